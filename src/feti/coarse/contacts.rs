//! `G` of the contacts: six lines a cluster, one column for each row.
//!
//! Kept by columns, for `G'a`, and by subdomains, for `G x`.

use std::ops::Range;

use super::sliding::Weight;
use crate::constraint::Constraints;
use crate::decomposition::{Clusters, Decomposition};
use crate::feti::dual::Interconnection;
use crate::feti::dual::blocks::{Block, FewBlocks, Place, add_product};
use crate::feti::inverse::kernel::MODES;
use crate::work;

/// `G` of one rank's contacts: all columns of its rows, and all that its own subdomains add to lines.
pub(super) struct Contacts {
    /// First slot of each row of `B`, and the end. Equalities have none.
    begin: Vec<u32>,
    /// For each slot the subdomain's cluster, and the values of the cluster's six modes.
    cluster: Vec<u32>,
    modes: Vec<[f64; MODES]>,
    /// Rows with slots.
    rows: Vec<u32>,
    /// Clusters of own subdomains.
    clusters: Vec<usize>,
    /// What acts on each own subdomain, in row order.
    acting: Vec<Vec<Acting>>,
}

/// A row that acts on a subdomain, with a copy of its slot's modes: what is summed lies side by side.
struct Acting {
    row: u32,
    modes: [f64; MODES],
}

impl Contacts {
    /// Of the rows of this rank. One neighbour exchange.
    pub fn new(
        Decomposition { clusters, subdomains, .. }: &Decomposition,
        constraints: &Constraints,
        connection: &Interconnection,
    ) -> Self {
        let mut result = Self {
            begin: Vec::new(),
            cluster: Vec::new(),
            modes: Vec::new(),
            rows: Vec::new(),
            clusters: subdomains.iter().map(|s| clusters.of(s.id)).collect(),
            acting: subdomains.iter().map(|_| Vec::new()).collect(),
        };
        let (modes, first) = (connection.modes(), subdomains.first().map_or(0, |s| s.id));
        let of_dof = |own: usize, node: usize, axis| modes[own].along(axis, subdomains[own].points[node]);
        let is_contact = |row: usize| connection.gluing.level(row).is_none();
        connection.gather.moved(is_contact, of_dof, |row, sixes| {
            result.begin.resize(row + 1, result.cluster.len() as u32);
            let slots = constraints.slots(row).map(|slot| constraints.slot_subdomain[slot] as usize);
            result.push(row, clusters, first, slots.zip(sixes));
        });
        result.begin.resize(constraints.rows.len() + 1, result.cluster.len() as u32);
        result
    }

    /// Adds a row, with the subdomains and modes' values of its slots.
    fn push<'s>(
        &mut self,
        row: usize,
        clusters: &Clusters,
        first: usize,
        slots: impl Iterator<Item = (usize, &'s [f64; MODES])>,
    ) {
        self.rows.push(row as u32);
        for (subdomain, six) in slots {
            self.cluster.push(clusters.of(subdomain) as u32);
            self.modes.push(*six);
            if let Some(acting) = subdomain.checked_sub(first).and_then(|own| self.acting.get_mut(own)) {
                acting.push(Acting { row: row as u32, modes: *six });
            }
        }
    }

    /// Slots of a row of `B`.
    fn slots(&self, row: usize) -> Range<usize> {
        self.begin[row] as usize..self.begin[row + 1] as usize
    }

    /// The clusters that a row acts on, with its forces on their modes.
    pub fn forces(&self, row: usize) -> impl Iterator<Item = (usize, &[f64; MODES])> {
        self.slots(row).map(|slot| (self.cluster[slot] as usize, &self.modes[slot]))
    }

    /// What own subdomains add to `G x`, summed in the order of the rows.
    pub fn resultants(&self, x: impl Fn(usize) -> f64) -> impl Iterator<Item = [f64; MODES]> {
        self.acting.iter().map(move |acting| {
            let mut sum = [0.0; MODES];
            work::each(acting.len(), 2 * MODES, size_of::<Acting>());
            for Acting { row, modes } in acting {
                let x = x(*row as usize);
                sum.iter_mut().zip(modes).for_each(|(s, g)| *s += g * x);
            }
            sum
        })
    }

    /// `x += factor G'a` in the rows that are `wanted`.
    pub fn add_transpose(&self, wanted: impl Fn(usize) -> bool, factor: f64, a: &[f64], x: &mut [f64]) {
        let (a, mut slots) = (a.as_chunks::<MODES>().0, 0);
        for &row in self.rows.iter().filter(|row| wanted(**row as usize)) {
            slots += self.slots(row as usize).len();
            let of_slot = |slot: usize| dot(&self.modes[slot], &a[self.cluster[slot] as usize]);
            x[row as usize] += factor * self.slots(row as usize).map(of_slot).sum::<f64>();
        }
        work::each(slots, 2 * MODES, size_of::<[f64; MODES]>() + size_of::<u32>());
    }

    /// Blocks of `G W G'` with these weights `W`: for each own subdomain its cluster, and what it adds to the lower blocks of that line, by
    /// column. Complete: every row that a subdomain takes part in is on its rank.
    pub fn products(&self, weight: impl Fn(usize) -> Weight) -> Vec<(Place, Block)> {
        let mut result = Vec::new();
        for (&cluster, acting) in self.clusters.iter().zip(&self.acting) {
            let mut blocks = FewBlocks::default();
            for Acting { row, modes } in acting {
                let Weight { own, other } = weight(*row as usize);
                let both = [(*row as usize, own)].into_iter().chain(other).filter(|(_, weight)| *weight != 0.0);
                for (other, weight) in both.flat_map(|(of, weight)| self.slots(of).map(move |slot| (slot, weight))) {
                    let modes = modes.map(|g| weight * g);
                    let column = self.cluster[other] as usize;
                    if column > cluster {
                        continue;
                    }
                    work::add(2 * MODES * MODES, size_of::<[f64; MODES]>());
                    add_product(blocks.at((cluster, column)), &modes, &self.modes[other]);
                }
            }
            result.extend(blocks.into_blocks());
        }
        result
    }
}

/// The sum of products, as three chains of additions.
fn dot(g: &[f64; MODES], a: &[f64; MODES]) -> f64 {
    (g[0] * a[0] + g[3] * a[3]) + (g[1] * a[1] + g[4] * a[4]) + (g[2] * a[2] + g[5] * a[5])
}
