//! `G` of the equalities: what the rigid modes of subdomains make of them, level by level.
//!
//! A gluing row is of the lowest level on which one group has all its copies. It moves the members of that group against each
//! other, and no larger group. Gluing between clusters and supports are of a level above all.

use std::ops::RangeInclusive;

use super::halo::Halo;
use crate::constraint::{Constraints, Kind};
use crate::decomposition::{Clusters, Subdomain};
use crate::feti::dual::Interconnection;
use crate::feti::inverse::kernel::{MODES, RigidModes};
use crate::work;

/// `G` of one rank's equalities.
pub struct Gluing<'a> {
    /// For each level the rows of each component of the displacement.
    levels: Vec<[Rows; 3]>,
    /// Modes of own subdomains, in terms of their shapes.
    modes: &'a [RigidModes],
}

/// Rows that compare one component of copies.
#[derive(Default)]
struct Rows {
    rows: Vec<u32>,
    /// First slot of each row, and the end.
    begin: Vec<u32>,
    /// For each slot the place of its subdomain ([`Halo::place`]).
    subdomain: Vec<u32>,
    /// The slot's force along the component, and its moments about the two axes after it.
    lever: Vec<[f64; 3]>,
}

impl<'a> Gluing<'a> {
    /// Of the rows of this rank, given the level of each. One neighbour exchange.
    pub fn new(
        (connection, subdomains): (&'a Interconnection, &[Subdomain]),
        constraints: &Constraints,
        of_rows: &[Option<usize>],
    ) -> Self {
        let Interconnection { gather, halo, tree, motions, .. } = connection;
        let none = || [(); 3].map(|()| Rows { begin: vec![0], ..Rows::default() });
        let mut levels: Vec<[Rows; 3]> = (0..=tree.levels()).map(|_| none()).collect();
        let modes = &motions.shapes[..];
        let plain: Vec<RigidModes> = modes.iter().map(RigidModes::plain).collect();
        gather.moved(
            |own, node, axis| plain[own].along(axis, subdomains[own].shape[node]),
            |row, values| {
                let Some(level) = of_rows[row] else { return };
                let axis = constraints.rows[row].terms[0].axis;
                let of = &mut levels[level - 1][axis];
                of.rows.push(row as u32);
                of.subdomain.extend(constraints.slots(row).map(|slot| halo.place(constraints.slot_subdomain[slot])));
                of.lever.extend(values.iter().map(|six| places(axis).map(|k| six[k])));
                of.begin.push(of.subdomain.len() as u32);
            },
        );
        Self { levels, modes }
    }

    /// `sums += G rows` for own subdomains, by the rows of some levels.
    pub fn add_resultants(&self, levels: RangeInclusive<usize>, rows: &[f64], sums: &mut [f64]) {
        let mut forces = vec![[0.0; MODES]; self.modes.len()];
        for (axis, of) in self.of_levels(levels) {
            let [force, first, second] = places(axis);
            for (&row, slots) in of.rows.iter().zip(of.begin.windows(2)) {
                let x = rows[row as usize];
                for slot in slots[0] as usize..slots[1] as usize {
                    if let Some(sum) = forces.get_mut(of.subdomain[slot] as usize) {
                        let lever = of.lever[slot];
                        sum[force] += x * lever[0];
                        sum[first] += x * lever[1];
                        sum[second] += x * lever[2];
                    }
                }
            }
        }
        for ((sum, modes), force) in sums.as_chunks_mut::<MODES>().0.iter_mut().zip(self.modes).zip(forces) {
            sum.iter_mut().zip(modes.of_force(force)).for_each(|(sum, x)| *sum += x);
        }
    }

    /// `rows += factor G'a` in the rows of some levels, of six numbers an own subdomain. One neighbour exchange.
    pub fn add_moved(&self, halo: &Halo, levels: RangeInclusive<usize>, factor: f64, a: &[f64], rows: &mut [f64]) {
        let motions = a.as_chunks::<MODES>().0.iter().zip(self.modes);
        let mut motions: Vec<f64> = motions.flat_map(|(a, modes)| modes.to_motion(*a)).collect();
        halo.fill(&mut motions, MODES);
        let motions = motions.as_chunks::<MODES>().0;
        for (axis, of) in self.of_levels(levels) {
            let [way, first, second] = places(axis);
            for (&row, slots) in of.rows.iter().zip(of.begin.windows(2)) {
                let mut sum = 0.0;
                for slot in slots[0] as usize..slots[1] as usize {
                    let (lever, motion) = (of.lever[slot], &motions[of.subdomain[slot] as usize]);
                    sum += lever[0] * motion[way] + lever[1] * motion[first] + lever[2] * motion[second];
                }
                rows[row as usize] += factor * sum;
            }
        }
    }

    /// The rows of some levels and their components, for a product with `G` or `G'`.
    fn of_levels(&self, levels: RangeInclusive<usize>) -> impl Iterator<Item = (usize, &Rows)> {
        let of_levels = self.levels[levels.start() - 1..*levels.end()].iter();
        let of_axes = of_levels.flat_map(|of_axes| of_axes.iter().enumerate());
        of_axes.inspect(|(_, of)| work::each(of.lever.len(), 6, size_of::<[f64; 3]>() + size_of::<u32>()))
    }
}

/// Which of the six numbers of a force and its moment one along this axis has.
fn places(axis: usize) -> [usize; 3] {
    [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3]
}

/// The level of a row that always holds.
pub fn level(clusters: &Clusters, constraints: &Constraints, row: usize) -> Option<usize> {
    let slots = &constraints.slot_subdomain[constraints.slots(row)];
    let is_within = |level: &usize| {
        let group = |subdomain: u32| clusters.group(*level, subdomain as usize);
        slots.windows(2).all(|pair| group(pair[0]) == group(pair[1]))
    };
    let (row, above) = (&constraints.rows[row], clusters.levels() + 1);
    let gluing = (row.kind == Kind::Gluing).then(|| (1..above).find(is_within)).flatten();
    row.law().always_holds().then(|| gluing.unwrap_or(above))
}
