//! `G = R'B'` and the coarse problem `G G' a = r`: six unknowns a cluster of subdomains, which in plain Total FETI is one.
//!
//! `G x` is local to each cluster; one all-gather brings it to every rank, each of which holds the sparse Cholesky
//! factor of `G G'` and solves redundantly: ranks agree to the last bit, and `G'a` needs no further exchange.

pub mod factor;

use std::cell::OnceCell;
use std::ops::Range;
use std::rc::Rc;

use thiserror::Error;

use self::factor::{Blocks, CoarseFactor, Symbolic};
use super::bodies::BodyMotions;
use super::gather::Gather;
use super::kernel::RigidModes;
use super::space::RowSpace;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::{Constraints, Kind};
use crate::decomposition::{Clusters, Subdomain};

/// Rigid modes a cluster.
pub const MODES: usize = 6;

/// The constraints leave a rigid motion free.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "the supports and contacts do not hold all bodies: the coarse problem is singular near subdomain {subdomain}; \
     add a support, or bring the contact surfaces together"
)]
pub struct Floating {
    /// Where the factorisation of `G G'` broke down.
    pub subdomain: usize,
}

/// `G` and the factor of `G G'`.
pub struct Coarse<'a> {
    comm: &'a dyn Comm,
    clusters: Clusters,
    /// Own clusters, as ranges of own subdomains.
    members: Vec<Range<usize>>,
    /// Rows of `G'`: for each slot of each row, the cluster and its six modes' values. Gluing within a cluster has none.
    slot_begin: Vec<u32>,
    slot_cluster: Vec<u32>,
    slot_modes: Vec<[f64; MODES]>,
    /// Rows with slots.
    moving: Vec<u32>,
    /// For each own cluster, its (row, slot) in row order.
    own_slots: Vec<Vec<(u32, u32)>>,
    /// Whether an inequality acts on it.
    bounded: Vec<bool>,
    /// Block rows of the others.
    constant: OnceCell<Blocks>,
    motions: BodyMotions,
    /// For all rows, and so for any.
    symbolic: OnceCell<Rc<Symbolic>>,
    /// Of all rows; present once the coarse problem is set up.
    factor: Option<CoarseFactor>,
}

impl<'a> Coarse<'a> {
    /// Computes `G` of the clusters' `modes`, given for each own subdomain. Nothing is solved before [`Coarse::factorise`].
    /// Collective.
    pub fn new(
        comm: &'a dyn Comm,
        clusters: &Clusters,
        subdomains: &[Subdomain],
        modes: &[RigidModes],
        constraints: &Constraints,
        gather: &Gather,
    ) -> Self {
        let first = clusters.shares.begin(comm.rank());
        let members: Vec<Range<usize>> = clusters.of_rank(comm.rank()).collect();
        let (mut own_slots, mut bounded) = (vec![Vec::new(); members.len()], vec![false; members.len()]);
        let mut moving = Vec::new();
        let (mut slot_begin, mut slot_cluster, mut slot_modes) = (vec![0], Vec::new(), Vec::new());
        gather.exchange(
            MODES,
            |own, slots| {
                for entry in gather.entries(own) {
                    let (node, axis) = (entry.dof as usize / 3, entry.dof as usize % 3);
                    let row = modes[own].at(subdomains[own].points[node])[axis];
                    let at = MODES * entry.slot as usize;
                    slots[at..at + MODES].iter_mut().zip(row).for_each(|(s, r)| *s += entry.value * r);
                }
            },
            |row, values| {
                let begin = slot_cluster.len();
                for (slot, six) in constraints.slots(row).zip(values.as_chunks::<MODES>().0) {
                    let cluster = clusters.of(constraints.slot_subdomain[slot] as usize) as u32;
                    // Copies of one node, unless it is contact.
                    if !constraints.rows[row].is_inequality() && slot_cluster[begin..].last() == Some(&cluster) {
                        let sum: &mut [f64; MODES] = slot_modes.last_mut().expect("it has a cluster");
                        sum.iter_mut().zip(six).for_each(|(s, x)| *s += x);
                    } else {
                        slot_cluster.push(cluster);
                        slot_modes.push(*six);
                    }
                }
                if constraints.rows[row].kind == Kind::Gluing && slot_cluster.len() == begin + 1 {
                    slot_cluster.truncate(begin);
                    slot_modes.truncate(begin);
                }
                for (slot, &cluster) in (begin..).zip(&slot_cluster[begin..]) {
                    if let Some(own) = (cluster as usize).checked_sub(first).filter(|&own| own < own_slots.len()) {
                        own_slots[own].push((row as u32, slot as u32));
                        bounded[own] |= constraints.rows[row].is_inequality();
                    }
                }
                if slot_cluster.len() > begin {
                    moving.push(row as u32);
                }
                slot_begin.push(slot_cluster.len() as u32);
            },
        );
        Self {
            comm,
            motions: BodyMotions::new(comm, clusters, subdomains, modes),
            clusters: clusters.clone(),
            members,
            slot_begin,
            slot_cluster,
            slot_modes,
            moving,
            own_slots,
            bounded,
            constant: OnceCell::new(),
            symbolic: OnceCell::new(),
            factor: None,
        }
    }

    /// Factorises `G G'` of all rows. Collective.
    ///
    /// # Errors
    /// If it is singular: on every rank.
    pub fn factorise(&mut self) -> Result<(), Floating> {
        let blocks = self.blocks(|_| true);
        self.symbolic.get_or_init(|| Rc::new(Symbolic::new(&blocks, self.clusters.total())));
        self.factor = Some(self.factor_of(&blocks)?);
        Ok(())
    }

    /// The factor of `G G'` with only the kept rows of the constraints. Collective.
    ///
    /// # Errors
    /// If these rows leave a rigid motion free: on every rank.
    pub fn restricted(&self, kept: impl Fn(usize) -> bool) -> Result<CoarseFactor, Floating> {
        self.factor_of(&self.blocks(kept))
    }

    /// The factor of blocks, which need not be those of some rows. Collective.
    ///
    /// # Errors
    /// If they are singular: on every rank.
    pub fn factor_of(&self, blocks: &Blocks) -> Result<CoarseFactor, Floating> {
        let clusters = self.clusters.total();
        let symbolic = self.symbolic.get_or_init(|| Rc::new(Symbolic::new(&self.blocks(|_| true), clusters)));
        let fitting = if symbolic.holds(blocks) { symbolic } else { &Rc::new(Symbolic::new(blocks, clusters)) };
        CoarseFactor::new(fitting, blocks).map_err(|cluster| Floating { subdomain: self.clusters.first(cluster) })
    }

    /// The blocks of `G G'` of the kept rows, which are all equalities and some inequalities; lower triangle, on every rank.
    /// Collective.
    pub fn blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        share_blocks(self.comm, &self.own_blocks(kept))
    }

    /// `G' motion` of all rows, of six numbers a cluster. Local.
    pub fn moved(&self, motion: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.slot_begin.len() - 1];
        self.add_transpose(1.0, motion, &mut rows);
        rows
    }

    /// Rigid motions of whole bodies.
    pub fn motions(&self) -> &BodyMotions {
        &self.motions
    }

    /// Force of a row's unit multiplier on the bodies, six numbers each. Local.
    pub fn force_on_bodies(&self, row: usize) -> Vec<f64> {
        let mut forces = vec![0.0; MODES * self.motions.bodies()];
        for slot in self.slots(row) {
            self.motions.add_force(self.slot_cluster[slot] as usize, &self.slot_modes[slot], &mut forces);
        }
        forces
    }

    /// Block rows of `G G'` that belong to own clusters, lower triangle. Complete: every row that a subdomain takes
    /// part in is on its rank.
    fn own_blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        let constant = || self.block_rows(|own| !self.bounded[own], |_| true).collect();
        let mut blocks: Blocks = self.constant.get_or_init(constant).clone();
        blocks.extend(self.block_rows(|own| self.bounded[own], kept));
        blocks
    }

    /// Block rows of some own clusters.
    fn block_rows(
        &self,
        of: impl Fn(usize) -> bool,
        kept: impl Fn(usize) -> bool,
    ) -> impl Iterator<Item = ((usize, usize), [f64; MODES * MODES])> {
        let first = self.clusters.shares.begin(self.comm.rank());
        (0..self.members.len()).filter(move |&own| of(own)).flat_map(move |own| {
            // A cluster has few neighbours.
            let (mut columns, mut blocks): (Vec<u32>, Vec<[f64; MODES * MODES]>) = Default::default();
            for &(row, slot) in self.own_slots[own].iter().filter(|(row, _)| kept(*row as usize)) {
                for other in self.slots(row as usize) {
                    let column = self.slot_cluster[other];
                    if column as usize > first + own {
                        continue;
                    }
                    let at = columns.iter().position(|c| *c == column).unwrap_or_else(|| {
                        blocks.push([0.0; MODES * MODES]);
                        columns.push(column);
                        columns.len() - 1
                    });
                    for (a, products) in
                        self.slot_modes[slot as usize].iter().zip(blocks[at].as_chunks_mut::<MODES>().0)
                    {
                        products.iter_mut().zip(&self.slot_modes[other]).for_each(|(p, b)| *p += a * b);
                    }
                }
            }
            columns.into_iter().map(move |column| (first + own, column as usize)).zip(blocks)
        })
    }

    fn slots(&self, row: usize) -> std::ops::Range<usize> {
        self.slot_begin[row] as usize..self.slot_begin[row + 1] as usize
    }

    /// `G rows`, whole on every rank. One all-gather.
    pub fn apply(&self, rows: &[f64]) -> Vec<f64> {
        self.comm.all_gather(self.resultants(rows).as_flattened(), &self.clusters.shares.counts(MODES))
    }

    /// As [`Coarse::apply`], and in the same all-gather the square of `rows`, and its inner products with each of
    /// `against`, then those of `pairs`.
    pub fn apply_with_products(
        &self,
        space: &RowSpace,
        rows: &[f64],
        against: &[&[f64]],
        pairs: &[(&[f64], &[f64])],
    ) -> (Vec<f64>, f64, Vec<f64>) {
        let mut all = vec![(rows, rows)];
        all.extend(against.iter().map(|other| (rows, *other)));
        all.extend(pairs);
        let width = all.len();
        let partial = self.over_members(&space.partial(&all), width);
        let mut mine = Vec::with_capacity((MODES + width) * self.members.len());
        for (six, values) in self.resultants(rows).iter().zip(partial.chunks_exact(width)) {
            mine.extend_from_slice(six);
            mine.extend_from_slice(values);
        }
        let all = self.comm.all_gather(&mine, &self.clusters.shares.counts(MODES + width));
        let mut sums = vec![0.0; width];
        let mut result = Vec::with_capacity(MODES * self.clusters.total());
        for of_cluster in all.chunks_exact(MODES + width) {
            let (six, values) = of_cluster.split_at(MODES);
            result.extend_from_slice(six);
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        let square = sums.remove(0);
        (result, square, sums)
    }

    /// `G rows` of the own clusters, each summed in the order of the rows.
    fn resultants(&self, rows: &[f64]) -> Vec<[f64; MODES]> {
        let first = self.clusters.shares.begin(self.comm.rank());
        let mut sums = vec![[0.0; MODES]; self.members.len()];
        for &row in &self.moving {
            let x = rows[row as usize];
            for slot in self.slots(row as usize) {
                let own = (self.slot_cluster[slot] as usize).checked_sub(first);
                let Some(sum) = own.and_then(|own| sums.get_mut(own)) else { continue };
                sum.iter_mut().zip(&self.slot_modes[slot]).for_each(|(s, g)| *s += g * x);
            }
        }
        sums
    }

    /// Sums six numbers an own subdomain over each cluster and brings them to every rank.
    pub fn share(&self, mine: &[f64]) -> Vec<f64> {
        self.comm.all_gather(&self.over_members(mine, MODES), &self.clusters.shares.counts(MODES))
    }

    /// Sums of `width` numbers an own subdomain over each own cluster.
    fn over_members(&self, mine: &[f64], width: usize) -> Vec<f64> {
        let mut sums = Vec::with_capacity(width * self.members.len());
        for members in &self.members {
            let begin = sums.len();
            sums.extend_from_slice(&mine[width * members.start..][..width]);
            for of_member in mine[width * (members.start + 1)..width * members.end].chunks_exact(width) {
                sums[begin..].iter_mut().zip(of_member).for_each(|(s, x)| *s += x);
            }
        }
        sums
    }

    /// Of six numbers a cluster, those for a subdomain.
    pub fn of_subdomain<'b>(&self, subdomain: usize, amplitudes: &'b [f64]) -> &'b [f64] {
        &amplitudes[MODES * self.clusters.of(subdomain)..][..MODES]
    }

    /// `(G G')^-1 a`, in place. Local.
    pub fn solve(&self, a: &mut [f64]) {
        self.factor.as_ref().expect("factorised").solve(a);
    }

    /// `rows += factor G' a`. Local.
    pub fn add_transpose(&self, factor: f64, a: &[f64], rows: &mut [f64]) {
        for &row in &self.moving {
            let mut sum = 0.0;
            for slot in self.slots(row as usize) {
                let at = MODES * self.slot_cluster[slot] as usize;
                sum += self.slot_modes[slot].iter().zip(&a[at..at + MODES]).map(|(g, a)| g * a).sum::<f64>();
            }
            rows[row as usize] += factor * sum;
        }
    }
}

/// The blocks of all ranks, on every rank.
fn share_blocks(comm: &dyn Comm, blocks: &Blocks) -> Blocks {
    let mut message = Vec::new();
    for ((row, column), block) in blocks {
        message.extend([*row as u64, *column as u64]);
        message.extend(block.map(f64::to_bits));
    }
    all_gather_u64(comm, &message)
        .chunks_exact(2 + MODES * MODES)
        .map(|m| ((m[0] as usize, m[1] as usize), std::array::from_fn(|k| f64::from_bits(m[2 + k]))))
        .collect()
}

#[cfg(test)]
mod tests;
