//! `G = R'B'` and the coarse problem `G G' a = r`: six unknowns a subdomain.
//!
//! `G x` is local to each subdomain; one all-gather brings it to every rank, each of which holds the sparse Cholesky
//! factor of `G G'` and solves redundantly: ranks agree to the last bit, and `G'a` needs no further exchange.

pub mod factor;

use std::cell::OnceCell;
use std::rc::Rc;

use thiserror::Error;

use self::factor::{Blocks, CoarseFactor, Symbolic};
use super::bodies::BodyMotions;
use super::gather::Gather;
use super::kernel::RigidModes;
use super::space::RowSpace;
use crate::comm::{Comm, Shares, all_gather_u64};
use crate::constraint::Constraints;
use crate::decomposition::Subdomain;

/// Rigid modes a subdomain.
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
    shares: Shares,
    /// Rows of `G'`: for each slot of each row, the subdomain and its six modes' values.
    slot_begin: Vec<u32>,
    slot_subdomain: Vec<u32>,
    slot_modes: Vec<[f64; MODES]>,
    /// For each own subdomain, its (row, slot) in row order.
    own_slots: Vec<Vec<(u32, u32)>>,
    motions: BodyMotions,
    /// For all rows, and so for any.
    symbolic: OnceCell<Rc<Symbolic>>,
    /// Of all rows; present once the coarse problem is set up.
    factor: Option<CoarseFactor>,
}

impl<'a> Coarse<'a> {
    /// Computes `G`. Nothing is solved before [`Coarse::factorise`]. Collective.
    pub fn new(
        comm: &'a dyn Comm,
        shares: &Shares,
        subdomains: &[Subdomain],
        modes: &[RigidModes],
        constraints: &Constraints,
        gather: &Gather,
    ) -> Self {
        let slots = constraints.slot_subdomain.len();
        let mut slot_modes = vec![[0.0; MODES]; slots];
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
                for (slot, six) in constraints.slots(row).zip(values.chunks_exact(MODES)) {
                    slot_modes[slot].copy_from_slice(six);
                }
            },
        );
        let own_slots = gather_own_slots(constraints, gather, subdomains.len());
        Self {
            comm,
            shares: shares.clone(),
            slot_begin: constraints.slot_begin.clone(),
            slot_subdomain: constraints.slot_subdomain.clone(),
            slot_modes,
            own_slots,
            motions: BodyMotions::new(comm, shares, subdomains, modes),
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
        self.symbolic.get_or_init(|| Rc::new(Symbolic::new(&blocks, self.shares.total())));
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
        let subdomains = self.shares.total();
        let symbolic = self.symbolic.get_or_init(|| Rc::new(Symbolic::new(&self.blocks(|_| true), subdomains)));
        if symbolic.holds(blocks) {
            return CoarseFactor::new(symbolic, blocks);
        }
        CoarseFactor::new(&Rc::new(Symbolic::new(blocks, subdomains)), blocks)
    }

    /// The blocks of `G G'` of the kept rows, lower triangle, on every rank. Collective.
    pub fn blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        share_blocks(self.comm, &self.own_blocks(kept))
    }

    /// `G' motion` of all rows, of six numbers a subdomain. Local.
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
            self.motions.add_force(self.slot_subdomain[slot] as usize, &self.slot_modes[slot], &mut forces);
        }
        forces
    }

    /// Block rows of `G G'` that belong to own subdomains, lower triangle. Complete: every row that a subdomain takes
    /// part in is on its rank.
    fn own_blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        let first = self.shares.begin(self.comm.rank());
        let mut blocks = Blocks::new();
        for (own, slots) in self.own_slots.iter().enumerate() {
            for &(row, slot) in slots.iter().filter(|(row, _)| kept(*row as usize)) {
                for other in self.slots(row as usize) {
                    let column = self.slot_subdomain[other] as usize;
                    if column > first + own {
                        continue;
                    }
                    let block = blocks.entry((first + own, column)).or_insert([0.0; MODES * MODES]);
                    for (i, a) in self.slot_modes[slot as usize].iter().enumerate() {
                        for (j, b) in self.slot_modes[other].iter().enumerate() {
                            block[MODES * i + j] += a * b;
                        }
                    }
                }
            }
        }
        blocks
    }

    fn slots(&self, row: usize) -> std::ops::Range<usize> {
        self.slot_begin[row] as usize..self.slot_begin[row + 1] as usize
    }

    /// `G rows`, whole on every rank. One all-gather.
    pub fn apply(&self, rows: &[f64]) -> Vec<f64> {
        self.share(self.resultants(rows).as_flattened())
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
        let (width, partial) = (all.len(), space.partial(&all));
        let mut mine = Vec::with_capacity((MODES + width) * self.own_slots.len());
        for (six, values) in self.resultants(rows).iter().zip(partial.chunks_exact(width)) {
            mine.extend_from_slice(six);
            mine.extend_from_slice(values);
        }
        let all = self.comm.all_gather(&mine, &self.shares.counts(MODES + width));
        let mut sums = vec![0.0; width];
        let mut result = Vec::with_capacity(MODES * self.shares.total());
        for of_subdomain in all.chunks_exact(MODES + width) {
            let (six, values) = of_subdomain.split_at(MODES);
            result.extend_from_slice(six);
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        let square = sums.remove(0);
        (result, square, sums)
    }

    /// `G rows` of the own subdomains.
    fn resultants(&self, rows: &[f64]) -> Vec<[f64; MODES]> {
        let of_subdomain = |slots: &Vec<(u32, u32)>| {
            let mut sum = [0.0; MODES];
            for &(row, slot) in slots {
                let x = rows[row as usize];
                sum.iter_mut().zip(&self.slot_modes[slot as usize]).for_each(|(s, g)| *s += g * x);
            }
            sum
        };
        self.own_slots.iter().map(of_subdomain).collect()
    }

    /// Brings six numbers an own subdomain to every rank.
    pub fn share(&self, mine: &[f64]) -> Vec<f64> {
        self.comm.all_gather(mine, &self.shares.counts(MODES))
    }

    /// `(G G')^-1 a`, in place. Local.
    pub fn solve(&self, a: &mut [f64]) {
        self.factor.as_ref().expect("factorised").solve(a);
    }

    /// `rows += factor G' a`. Local.
    pub fn add_transpose(&self, factor: f64, a: &[f64], rows: &mut [f64]) {
        for (row, x) in rows.iter_mut().enumerate() {
            let mut sum = 0.0;
            for slot in self.slots(row) {
                let at = MODES * self.slot_subdomain[slot] as usize;
                sum += self.slot_modes[slot].iter().zip(&a[at..at + MODES]).map(|(g, a)| g * a).sum::<f64>();
            }
            *x += factor * sum;
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

/// For each own subdomain, the rows it takes part in and its slots there.
fn gather_own_slots(constraints: &Constraints, gather: &Gather, own: usize) -> Vec<Vec<(u32, u32)>> {
    (0..own)
        .map(|own| {
            let mut slots: Vec<(u32, u32)> = gather.entries(own).iter().map(|e| (e.row, e.slot)).collect();
            slots.dedup();
            debug_assert!(slots.iter().all(|&(row, slot)| constraints.slots(row as usize).contains(&(slot as usize))));
            slots
        })
        .collect()
}

#[cfg(test)]
mod tests;
