//! `G = R'B'`: six lines a cluster, one column for each row of `B`.
//!
//! Kept by columns, for `G'a`, and by clusters, for `G x`. Equalities and inequalities are kept apart: what equalities make of
//! the coarse problem never changes.

use std::ops::Range;

use super::sliding::Weight;
use crate::constraint::{Constraints, Kind, Row};
use crate::decomposition::{Clusters, Subdomain};
use crate::feti::dual::blocks::{Block, FewBlocks, Place, add_product};
use crate::feti::dual::gather::Gather;
use crate::feti::inverse::kernel::{MODES, RigidModes};
use crate::work;

/// Which rows of `B`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    /// Those that always hold.
    Equalities,
    /// Contacts, which may open.
    Inequalities,
}

impl Rows {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Equalities, Self::Inequalities];

    fn of(row: &Row) -> Self {
        if row.law().always_holds() { Self::Equalities } else { Self::Inequalities }
    }
}

/// `G` of one rank: all columns of its rows, and all that its own subdomains add to lines.
pub(super) struct Matrix {
    /// First slot of each row, and the end.
    begin: Vec<u32>,
    /// For each slot of each row the subdomain, its cluster, and the values of the cluster's six modes. Gluing within a cluster has no
    /// slot.
    subdomain: Vec<u32>,
    cluster: Vec<u32>,
    modes: Vec<[f64; MODES]>,
    /// Rows with slots: equalities, and inequalities.
    moving: [Vec<u32>; 2],
    /// Number of the first own subdomain.
    first: usize,
    /// Clusters of own subdomains.
    clusters: Vec<usize>,
    /// What acts on each own subdomain, in row order: equalities, and inequalities.
    acting: [Vec<Vec<Acting>>; 2],
}

/// A row that acts on a subdomain, with a copy of its slot's modes: what is summed lies side by side.
struct Acting {
    row: u32,
    modes: [f64; MODES],
}

impl Matrix {
    /// Of the rows of this rank. One neighbour exchange.
    pub fn new(
        clusters: &Clusters,
        subdomains: &[Subdomain],
        modes: &[RigidModes],
        constraints: &Constraints,
        gather: &Gather,
    ) -> Self {
        let mut result = Self {
            begin: vec![0],
            subdomain: Vec::new(),
            cluster: Vec::new(),
            modes: Vec::new(),
            moving: Default::default(),
            first: subdomains.first().map_or(0, |s| s.id),
            clusters: subdomains.iter().map(|s| clusters.of(s.id)).collect(),
            acting: Default::default(),
        };
        let of_dof = |own: usize, node: usize, axis| modes[own].along(axis, subdomains[own].points[node]);
        gather.moved(of_dof, |row, values| {
            let slots = constraints.slots(row).map(|slot| constraints.slot_subdomain[slot]);
            result.push(row, &constraints.rows[row], clusters, slots.zip(values));
        });
        result.act(subdomains.len());
        result
    }

    /// Adds the next row, with the subdomains and modes' values of its slots.
    fn push<'s>(
        &mut self,
        row: usize,
        of: &Row,
        clusters: &Clusters,
        slots: impl Iterator<Item = (u32, &'s [f64; MODES])>,
    ) {
        let begin = self.cluster.len();
        for (subdomain, six) in slots {
            // Several nodes of one subdomain, unless it is contact.
            let is_same = of.law().always_holds() && self.subdomain[begin..].last() == Some(&subdomain);
            if let Some(sum) = self.modes.last_mut().filter(|_| is_same) {
                sum.iter_mut().zip(six).for_each(|(s, x)| *s += x);
            } else {
                self.subdomain.push(subdomain);
                self.cluster.push(clusters.of(subdomain as usize) as u32);
                self.modes.push(*six);
            }
        }
        let is_within = self.cluster[begin..].windows(2).all(|pair| pair[0] == pair[1]);
        if of.kind == Kind::Gluing && is_within {
            self.subdomain.truncate(begin);
            self.cluster.truncate(begin);
            self.modes.truncate(begin);
        }
        if self.cluster.len() > begin {
            self.moving[Rows::of(of) as usize].push(row as u32);
        }
        self.begin.push(self.cluster.len() as u32);
    }

    /// Finds what acts on each of `count` own subdomains.
    fn act(&mut self, count: usize) {
        for rows in Rows::ALL {
            let mut acting: Vec<Vec<Acting>> = (0..count).map(|_| Vec::new()).collect();
            for &row in &self.moving[rows as usize] {
                for slot in self.slots(row as usize) {
                    let own = (self.subdomain[slot] as usize).checked_sub(self.first);
                    if let Some(acting) = own.and_then(|own| acting.get_mut(own)) {
                        acting.push(Acting { row, modes: self.modes[slot] });
                    }
                }
            }
            self.acting[rows as usize] = acting;
        }
    }

    /// Number of rows of `B` on this rank.
    pub fn rows(&self) -> usize {
        self.begin.len() - 1
    }

    /// Slots of a row of `B`.
    fn slots(&self, row: usize) -> Range<usize> {
        self.begin[row] as usize..self.begin[row + 1] as usize
    }

    /// The clusters that a row acts on, with its forces on their modes.
    pub fn forces(&self, row: usize) -> impl Iterator<Item = (usize, &[f64; MODES])> {
        self.slots(row).map(|slot| (self.cluster[slot] as usize, &self.modes[slot]))
    }

    /// What own subdomains add to `G x` by some rows of `x`, summed in the order of the rows.
    pub fn resultants(&self, rows: Rows, x: impl Fn(usize) -> f64) -> impl Iterator<Item = [f64; MODES]> {
        self.acting[rows as usize].iter().map(move |acting| {
            let mut sum = [0.0; MODES];
            work::each(acting.len(), 2 * MODES, size_of::<Acting>());
            for Acting { row, modes } in acting {
                let x = x(*row as usize);
                sum.iter_mut().zip(modes).for_each(|(s, g)| *s += g * x);
            }
            sum
        })
    }

    /// `x += factor G'a` in some rows, in those of them that are `wanted`.
    pub fn add_transpose(&self, rows: Rows, wanted: impl Fn(usize) -> bool, factor: f64, a: &[f64], x: &mut [f64]) {
        let (a, mut slots) = (a.as_chunks::<MODES>().0, 0);
        for &row in self.moving[rows as usize].iter().filter(|row| wanted(**row as usize)) {
            slots += self.slots(row as usize).len();
            let of_slot = |slot: usize| dot(&self.modes[slot], &a[self.cluster[slot] as usize]);
            x[row as usize] += factor * self.slots(row as usize).map(of_slot).sum::<f64>();
        }
        work::each(slots, 2 * MODES, size_of::<[f64; MODES]>() + size_of::<u32>());
    }

    /// Blocks of `G W G'` of some rows with these weights `W`: for each own subdomain its cluster, and what it adds to the lower blocks
    /// of that line, by column. Complete: every row that a subdomain takes part in is on its rank.
    pub fn products(&self, rows: Rows, weight: impl Fn(usize) -> Weight) -> Vec<(Place, Block)> {
        let mut result = Vec::new();
        for (&cluster, acting) in self.clusters.iter().zip(&self.acting[rows as usize]) {
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
