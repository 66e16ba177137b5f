//! The factor that the coarse problem of a set of rows is built on: `G_B G_B'` of the equalities and some contacts, which all are kept.
//!
//! These rows may leave rigid motions `N` of whole bodies free: `G_B'N = 0`. Then the first cluster of each body is tied: with `C` the
//! rows of `N` there, scaled by body, `G_B G_B' + C C'` is regular, and its inverse is a generalised inverse of `G_B G_B'`, exact
//! for all right-hand sides orthogonal to `N`, since `N'C C'a = 0` leaves `C'a = 0`.

use super::bodies::BodyMotions;
use super::factor::CoarseFactor;
use super::sliding::Sliding;
use super::{Coarse, Floating};
use crate::comm::Comm;
use crate::feti::dual::blocks::Blocks;
use crate::feti::inverse::kernel::MODES;

/// The factor of `G_B G_B' + C C'`.
pub(super) struct Base {
    /// For each row whether it is in the base, equalities being in each; empty if no contact is.
    contacts: Vec<bool>,
    /// What is kept of pairs of these rows.
    sliding: Sliding,
    factor: CoarseFactor,
    /// `N`, six numbers a cluster.
    free: Vec<Vec<f64>>,
}

impl Base {
    /// Of the equalities. Collective.
    ///
    /// # Errors
    /// As [`Base::new`].
    pub fn of_equalities(coarse: &Coarse) -> Result<Self, Floating> {
        Self::new(coarse, &[], &Sliding::default())
    }

    /// Of the equalities and the kept contacts. Collective.
    ///
    /// # Errors
    /// If these rows leave a motion free that is not one of whole bodies: on every rank.
    pub fn new(coarse: &Coarse, kept: &[bool], sliding: &Sliding) -> Result<Self, Floating> {
        let weight = |row: usize| match kept.get(row) {
            Some(true) => sliding.weight(row),
            _ => 0.0.into(),
        };
        let blocks = || coarse.blocks(weight);
        let unit = || coarse.unit_blocks(weight);
        let found = coarse.factor_of(&blocks(), unit).map(|factor| (factor, Vec::new())).or_else(|floating| {
            let motions = coarse.motions();
            let free: Vec<Vec<f64>> = motions.free(&unit()).iter().map(|motion| motions.amplitudes(motion)).collect();
            if free.is_empty() {
                return Err(floating);
            }
            let tied = |blocks| tied(motions, &free, blocks);
            let factor = coarse.factor_of(&tied(blocks()), || tied(unit()))?;
            Ok((factor, free))
        });
        found.map(|(factor, free)| Self { contacts: kept.to_vec(), sliding: sliding.clone(), factor, free })
    }

    /// Whether a contact is in the base.
    pub fn has_contact(&self, row: usize) -> bool {
        self.contacts.get(row).is_some_and(|has| *has)
    }

    /// Whether it has nothing that these rows lack.
    pub fn is_part_of(&self, kept: &[bool], sliding: &Sliding) -> bool {
        let fits =
            |(row, kept): (usize, &bool)| !self.has_contact(row) || *kept && self.sliding.of(row) == sliding.of(row);
        kept.iter().enumerate().all(fits)
    }

    /// Rigid motions of whole bodies that the base leaves free, six numbers a cluster.
    pub fn free(&self) -> &[Vec<f64>] {
        &self.free
    }

    /// Numbers in the factor.
    pub fn length(&self) -> usize {
        self.factor.length()
    }

    /// `a = (G_B G_B')^+ a`, for `a` orthogonal to the free motions, equal on all ranks. Collective.
    pub fn solve(&self, comm: &dyn Comm, a: &mut [f64]) {
        self.factor.solve(comm, a);
    }
}

/// Adds `C C'` to the blocks. The rows of `N` at a body are scaled by the root of the largest entry of its block, so that `C'N` stays
/// regular.
fn tied(motions: &BodyMotions, free: &[Vec<f64>], mut blocks: Blocks) -> Blocks {
    let first = motions.first_clusters();
    let largest = |x: &[f64]| x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let any = blocks.values().map(|block| largest(block)).fold(0.0, f64::max);
    // Nothing may hold a body.
    let own =
        |cluster: &usize| blocks.get(&(*cluster, *cluster)).map(|block| largest(block)).filter(|size| *size > 0.0);
    let root = |cluster: &usize| own(cluster).unwrap_or(if any > 0.0 { any } else { 1.0 }).sqrt();
    let roots: Vec<f64> = first.iter().map(root).collect();
    for motion in free {
        let of = |cluster: usize| &motion[MODES * cluster..][..MODES];
        let scale = 1.0 / first.iter().map(|&cluster| largest(of(cluster))).fold(0.0, f64::max);
        let parts = || first.iter().zip(&roots).filter(|(cluster, _)| of(**cluster).iter().any(|x| *x != 0.0));
        for (&row, of_row) in parts() {
            for (&column, of_column) in parts().filter(|(column, _)| **column <= row) {
                let block = blocks.entry((row, column)).or_insert([0.0; MODES * MODES]);
                for (i, a) in of(row).iter().enumerate() {
                    for (j, b) in of(column).iter().enumerate() {
                        block[MODES * i + j] += (of_row * scale * a) * (of_column * scale * b);
                    }
                }
            }
        }
    }
    blocks
}
