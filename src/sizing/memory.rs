//! What solving takes in memory: the model that counts and built problems share.
//!
//! A subdomain has
//! - the factor of its stiffness, in single precision where that is mixed and the subdomain is small enough for a factor in
//!   single precision to pass its probe, and with the Dirichlet preconditioner that of its interior and the blocks beside it, half
//!   as long;
//! - its matrix and a copy of the blocks on the boundary; where no other subdomain is like it also what is known of them
//!   before they are factorised;
//! - vectors, tangents, histories and results, in proportion to its unknowns.
//!
//! Congruent boxes share factors as long as they are elastic; how many remain so nobody knows before, `SHARED` is taken where
//! a material may yield. Every rank has the coarse problem's factors, for all rows and for those of the active set:
//! `COARSE` `n^1.4` numbers each for `n` clusters, as `bench-results/kernels.md` has it for 250 to 21,296.
//!
//! Constants are from runs of the benchmark on one rank, with each element, in boxes and in parts: at level 2 the estimate is 0.75
//! to 1.3 times what runs took. The paper's boxes at levels 1 to 4 on two ranks take 0.94 to 1.19 of it.

use crate::material::Law;
use crate::scene::{Precision, Preconditioner, Scene};

/// Memory of a run, in MiB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// Of all subdomains together, wherever they are.
    pub subdomains_mb: f64,
    /// On every rank.
    pub rank_mb: f64,
    /// On each rank, at most, while meshes are read and cut, before anything else is there.
    pub cutting_mb: f64,
}

impl Memory {
    /// Of all ranks together.
    pub fn total_mb(&self, ranks: usize) -> f64 {
        (self.subdomains_mb + self.rank_mb * ranks as f64).max((self.cutting_mb + PROCESS_MB) * ranks as f64)
    }

    /// Of a rank with its part of the subdomains.
    pub fn of_rank_mb(&self, ranks: usize) -> f64 {
        (self.subdomains_mb / ranks as f64 + self.rank_mb).max(self.cutting_mb + PROCESS_MB)
    }
}

/// What a process takes before it holds anything (MPI, HDF5), in MiB.
pub(super) const PROCESS_MB: f64 = 45.0;
/// Numbers in the factor of the coarse problem, for one cluster.
const COARSE: f64 = 190.0;
/// What every rank knows of each subdomain (its body, place, owner and stiffness), in bytes.
const KNOWN: f64 = 100.0;
/// What every rank knows of each contact condition, in bytes.
const CONDITION: f64 = 400.0;
/// Part of the factors of congruent boxes that is held, if a material may yield, and if none may.
const SHARED: [f64; 2] = [0.5, 0.125];
/// Numbers for each unknown, if a material may yield, and if none may.
const VECTORS: [f64; 2] = [110.0, 45.0];
/// Unknowns from which a factor in single precision does not pass its probe.
const IN_DOUBLE: f64 = 7500.0;
/// Numbers that a slot of a row takes: that of `G'` and the row's term.
pub(super) const SLOT: f64 = 12.0;

/// Lengths of a subdomain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    /// Of the factor of its stiffness.
    pub factor: f64,
    /// Of the lower half of its matrix.
    pub matrix: f64,
    /// Of its vectors.
    pub unknowns: f64,
}

/// Numbers that a subdomain takes, which may be one of congruent boxes.
pub(super) fn of_subdomain(scene: &Scene, Lengths { factor, matrix, unknowns }: Lengths, is_box: bool) -> f64 {
    let is_elastic = usize::from(!scene.material.values().any(Law::yields));
    let (held, index) = if is_box { (SHARED[is_elastic], 1.5) } else { (1.0, 2.8) };
    let precision = if scene.solver.precision == Precision::Mixed { 0.5 } else { 1.0 };
    let whole = if unknowns > IN_DOUBLE { 1.0 } else { precision };
    let interior = if scene.solver.preconditioner == Preconditioner::Dirichlet { 0.5 * precision } else { 0.0 };
    held * (whole + interior) * factor + index * matrix + VECTORS[is_elastic] * unknowns
}

/// What every rank takes; the largest factor in its subdomains is worked on in double precision, beside the interior's.
pub(super) fn of_rank_mb(subdomains: f64, clusters: f64, conditions: f64, largest: f64) -> f64 {
    let coarse = 2.0 * 8.0 * COARSE * clusters.powf(1.4);
    PROCESS_MB + megabytes(coarse + 12.0 * largest + KNOWN * subdomains + CONDITION * conditions)
}

pub(super) fn megabytes(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}
