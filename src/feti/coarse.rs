//! `G = R'B'` and the coarse problem `G G' a = r`: six unknowns a subdomain.
//!
//! `G x` is local to each subdomain; one all-gather brings it to every rank, each of which holds the sparse Cholesky
//! factor of `G G'` and solves redundantly: ranks agree to the last bit, and `G'a` needs no further exchange.

use std::cell::RefCell;
use std::collections::BTreeMap;

use thiserror::Error;

use super::bodies::BodyMotions;
use super::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
use super::gather::Gather;
use super::kernel::RigidModes;
use super::ordering::nested_dissection;
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
            factor: None,
        }
    }

    /// Factorises `G G'` of all rows. Collective.
    ///
    /// # Errors
    /// If it is singular: on every rank.
    pub fn factorise(&mut self) -> Result<(), Floating> {
        self.factor = Some(self.restricted(|_| true)?);
        Ok(())
    }

    /// The factor of `G G'` with only the kept rows of the constraints. Collective.
    ///
    /// # Errors
    /// If these rows leave a rigid motion free: on every rank.
    pub fn restricted(&self, kept: impl Fn(usize) -> bool) -> Result<CoarseFactor, Floating> {
        CoarseFactor::new(&self.blocks(kept), self.shares.total())
    }

    /// The blocks of `G G'` of the kept rows, lower triangle, on every rank. Collective.
    pub fn blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        share_blocks(self.comm, &self.own_blocks(kept))
    }

    /// Subdomains of all ranks.
    pub fn subdomains(&self) -> usize {
        self.shares.total()
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

/// A 6x6 block of `G G'`, by `(row, column)` subdomain.
pub type Blocks = BTreeMap<(usize, usize), [f64; MODES * MODES]>;

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

/// The subdomains that each one has a block with, as METIS wants it: begins and neighbours.
fn adjacency(blocks: &Blocks, subdomains: usize) -> (Vec<i32>, Vec<i32>) {
    let mut pairs: Vec<(usize, usize)> =
        blocks.keys().filter(|(a, b)| a != b).flat_map(|&(a, b)| [(a, b), (b, a)]).collect();
    pairs.sort_unstable();
    let begins = (0..=subdomains).map(|s| pairs.partition_point(|pair| pair.0 < s) as i32).collect();
    (begins, pairs.into_iter().map(|pair| pair.1 as i32).collect())
}

/// Sparse Cholesky factor of `G G'`, whole on every rank.
pub struct CoarseFactor {
    cholesky: Analysis,
    factor: Factor,
    workspace: RefCell<Workspace>,
}

impl CoarseFactor {
    /// Of these blocks.
    ///
    /// # Errors
    /// If they are singular.
    pub fn new(blocks: &Blocks, subdomains: usize) -> Result<Self, Floating> {
        let n = MODES * subdomains;
        let mut columns: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        for (&(row, column), block) in blocks {
            for i in 0..MODES {
                for j in (0..MODES).filter(|&j| row != column || j <= i) {
                    columns[MODES * column + j].push(((MODES * row + i) as u32, block[MODES * i + j]));
                }
            }
        }
        let mut begins = vec![0];
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for mut column in columns {
            column.sort_unstable_by_key(|entry| entry.0);
            rows.extend(column.iter().map(|entry| entry.0));
            values.extend(column.iter().map(|entry| entry.1));
            begins.push(rows.len() as u32);
        }
        let lower = Lower { column_begin: &begins, rows: &rows };
        let order = nested_dissection(&adjacency(blocks, subdomains), MODES as u32);
        let cholesky = Analysis::ordered(lower, &order);
        let mut workspace = Workspace::new([&cholesky]);
        let mut factor = Factor::new(&cholesky, Precision::Double);
        workspace
            .factorise(&cholesky, lower, &values, &mut factor)
            .map_err(|breakdown| Floating { subdomain: breakdown.unknown / MODES })?;
        let result = Self { cholesky, factor, workspace: RefCell::new(workspace) };
        // Round-off can hide a free motion: the factor then answers far beyond the size of the matrix.
        let largest = values.iter().copied().fold(0.0, f64::max);
        result.check_rank(n, largest).map(|()| result)
    }

    /// Inverse iteration from a fixed vector without a pattern: a free motion shows as a huge response.
    fn check_rank(&self, n: usize, largest: f64) -> Result<(), Floating> {
        let sound = |response: f64| response.abs() * largest < (n as f64).sqrt() / SINGULAR;
        // Multiples of an irrational number: no motion of a few subdomains is orthogonal to them.
        let mut x: Vec<f64> = (1..=n).map(|k| (k as f64 * std::f64::consts::SQRT_2).fract() - 0.5).collect();
        self.solve(&mut x);
        let worst = x.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        match worst {
            Some((at, response)) if !sound(*response) => Err(Floating { subdomain: at / MODES }),
            _ => Ok(()),
        }
    }

    /// Numbers in the factor.
    pub fn length(&self) -> usize {
        self.cholesky.factor_length()
    }

    /// `a = (G G')^-1 a`, six numbers a subdomain. Local.
    pub fn solve(&self, a: &mut [f64]) {
        self.workspace.borrow_mut().solve(&self.cholesky, &self.factor, a);
    }
}

/// A coarse problem conditioned worse than the inverse of this leaves a motion free.
const SINGULAR: f64 = 1e-12;

#[cfg(test)]
mod tests;
