//! `G` of the equalities: what the rigid modes of subdomains make of them, level by level.
//!
//! A gluing row is of the lowest level on which one group has all its copies. It moves the members of that group against each
//! other, and no larger group. Gluing between clusters and supports are of a level above all.

use super::halo::Halo;
use crate::constraint::{Constraints, Kind};
use crate::decomposition::{Clusters, Subdomain};
use crate::feti::dual::gather::Gather;
use crate::feti::inverse::kernel::{MODES, RigidModes};
use crate::work;

/// `G` of one rank's equalities.
pub struct Gluing {
    levels: Vec<Rows>,
}

/// The rows of one level.
#[derive(Default)]
struct Rows {
    rows: Vec<u32>,
    /// First slot of each row, and the end.
    begin: Vec<u32>,
    /// For each slot the place of its subdomain ([`Halo::place`]) and the values of its six modes.
    subdomain: Vec<u32>,
    modes: Vec<[f64; MODES]>,
}

impl Gluing {
    /// Of the rows of this rank. One neighbour exchange.
    pub fn new(
        clusters: &Clusters,
        subdomains: &[Subdomain],
        constraints: &Constraints,
        gather: &Gather,
        halo: &Halo,
    ) -> Self {
        let mut levels: Vec<Rows> =
            (0..=clusters.levels()).map(|_| Rows { begin: vec![0], ..Rows::default() }).collect();
        let modes: Vec<RigidModes> = subdomains.iter().map(|s| RigidModes::new(&s.shape)).collect();
        gather.moved(
            |own, node| modes[own].at(subdomains[own].shape[node]),
            |row, values| {
                let Some(level) = level(clusters, constraints, row) else { return };
                let of = &mut levels[level - 1];
                let slots = constraints.slots(row);
                of.rows.push(row as u32);
                of.subdomain.extend(slots.map(|slot| halo.place(constraints.slot_subdomain[slot])));
                of.modes.extend_from_slice(values);
                of.begin.push(of.subdomain.len() as u32);
            },
        );
        Self { levels }
    }

    /// `sums += G rows` for own subdomains, by the rows of one level.
    pub fn add_resultants(&self, level: usize, rows: &[f64], sums: &mut [f64]) {
        let of = &self.levels[level - 1];
        of.book();
        let sums = sums.as_chunks_mut::<MODES>().0;
        for (&row, slots) in of.rows.iter().zip(of.begin.windows(2)) {
            let x = rows[row as usize];
            for slot in slots[0] as usize..slots[1] as usize {
                if let Some(sum) = sums.get_mut(of.subdomain[slot] as usize) {
                    sum.iter_mut().zip(&of.modes[slot]).for_each(|(sum, g)| *sum += x * g);
                }
            }
        }
    }

    /// `rows += factor G'a` in the rows of one level, of six numbers an own subdomain and one of the halo.
    pub fn add_moved(&self, level: usize, factor: f64, a: &[f64], rows: &mut [f64]) {
        let of = &self.levels[level - 1];
        of.book();
        let a = a.as_chunks::<MODES>().0;
        for (&row, slots) in of.rows.iter().zip(of.begin.windows(2)) {
            let dot = |slot: usize| -> f64 {
                of.modes[slot].iter().zip(&a[of.subdomain[slot] as usize]).map(|(g, a)| g * a).sum()
            };
            rows[row as usize] += factor * (slots[0] as usize..slots[1] as usize).map(dot).sum::<f64>();
        }
    }
}

impl Rows {
    /// Books a product with `G` or `G'`.
    fn book(&self) {
        work::each(self.modes.len(), 2 * MODES, size_of::<[f64; MODES]>() + size_of::<u32>());
    }
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
