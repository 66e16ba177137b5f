//! `G` of the equalities: what the rigid modes of subdomains make of them, level by level.
//!
//! A gluing row is of the lowest level on which one group has all its copies. It moves the members of that group against each
//! other, and no larger group. Gluing between clusters and supports are of a level above all.

use std::ops::RangeInclusive;

use super::halo::Halo;
use super::levers::{Levers, Six};
use super::{Motions, Tree};
use crate::constraint::{Constraints, Kind, Row};
use crate::decomposition::{Clusters, Subdomain};
use crate::feti::dual::gather::Gather;
use crate::feti::inverse::kernel::{MODES, RigidModes};

/// `G` of one rank's equalities.
pub struct Gluing {
    /// For each level its rows, with forces and moments about the centres of subdomains.
    levels: Vec<Levers>,
    /// The level of each row, from 1; 0 for contacts.
    of_rows: Vec<u8>,
    /// Number of own subdomains.
    own: usize,
}

impl Gluing {
    /// Of the rows of this rank. A neighbour exchange for what is within groups, and one for what is above.
    pub fn new(
        (gather, halo, tree, motions): (&Gather, &Halo, &Tree, &Motions),
        (clusters, subdomains): (&Clusters, &[Subdomain]),
        constraints: &Constraints,
    ) -> Self {
        let level_of = |row| level(clusters, constraints, row).map_or(0, |level| level as u8);
        let of_rows: Vec<u8> = (0..constraints.rows.len()).map(level_of).collect();
        let mut levels: Vec<Levers> = (0..=tree.levels()).map(|_| Levers::default()).collect();
        let plain = |modes: &[RigidModes]| modes.iter().map(RigidModes::plain).collect::<Vec<_>>();
        let mut add = |of: RangeInclusive<u8>, of_dof: &dyn Fn(usize, usize, usize) -> Six| {
            let is_of = |row: usize| of.contains(&of_rows[row]);
            gather.moved(is_of, of_dof, |row, values| {
                let places = constraints.slots(row).map(|slot| halo.place(constraints.slot_subdomain[slot]));
                let (slots, levers) = (places.zip(values.iter().copied()), &mut levels[of_rows[row] as usize - 1]);
                let Row { kind, terms, .. } = &constraints.rows[row];
                match kind {
                    Kind::Gluing => levers.push_of_three(row, terms[0].axis, slots),
                    _ => levers.push(row, slots),
                }
            });
        };
        // Congruent members of groups have equal bits. Clusters are where they are, as loads and displacements are.
        let (groups, above) = (tree.levels() as u8, tree.levels() as u8 + 1);
        let (by_shape, by_place) = (plain(&motions.shapes), plain(&motions.levels[0]));
        if groups > 0 {
            add(1..=groups, &|own, node, axis| by_shape[own].along(axis, subdomains[own].shape[node]));
        }
        add(above..=above, &|own, node, axis| by_place[own].along(axis, subdomains[own].points[node]));
        Self { levels, of_rows, own: subdomains.len() }
    }

    /// The level of a row, if it always holds.
    pub fn level(&self, row: usize) -> Option<usize> {
        Some(self.of_rows[row] as usize).filter(|level| *level > 0)
    }

    /// Forces and moments of the rows of some levels on own subdomains, about the centres of these.
    pub fn forces(&self, levels: RangeInclusive<usize>, rows: &[f64]) -> Vec<Six> {
        let mut forces = vec![[0.0; MODES]; self.own];
        self.levels[levels.start() - 1..*levels.end()].iter().for_each(|of| of.add_forces(rows, &mut forces));
        forces
    }

    /// `rows += factor` times the jumps that motions make in the rows of some levels: translations, and rotations about the centres of
    /// subdomains, by place.
    pub fn add_jumps(&self, levels: RangeInclusive<usize>, factor: f64, motions: &[Six], rows: &mut [f64]) {
        self.levels[levels.start() - 1..*levels.end()].iter().for_each(|of| of.add_jumps(factor, motions, rows));
    }
}

/// The level of a row that always holds.
fn level(clusters: &Clusters, constraints: &Constraints, row: usize) -> Option<usize> {
    let slots = &constraints.slot_subdomain[constraints.slots(row)];
    let is_within = |level: &usize| {
        let group = |subdomain: u32| clusters.group(*level, subdomain as usize);
        slots.windows(2).all(|pair| group(pair[0]) == group(pair[1]))
    };
    let (row, above) = (&constraints.rows[row], clusters.levels() + 1);
    let gluing = (row.kind == Kind::Gluing).then(|| (1..above).find(is_within)).flatten();
    row.law().always_holds().then(|| gluing.unwrap_or(above))
}
