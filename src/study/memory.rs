//! What solving takes in memory: the model that counts and built problems share.
//!
//! A subdomain has the factor of its stiffness (in single precision where that is mixed), with the Dirichlet preconditioner
//! another of the interior, about a third as long on cubes; tangents and a tangent's copy on the boundary, half as many numbers
//! again as the matrix has; and some vectors, histories and results. Factors that congruent elastic subdomains share are counted
//! for each: a material that may yield shares none in the end. The coarse problem's factors, for all rows and for those of the
//! active set, are on every rank: [`COARSE`] `n^1.4` numbers each for `n` clusters, as `bench-results/kernels.md` has it
//! for 250 to 21,296.

use crate::scene::{Precision, Preconditioner, Solver};

/// Memory of a run, in MiB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// Of all subdomains together, wherever they are.
    pub subdomains_mb: f64,
    /// On every rank.
    pub rank_mb: f64,
    /// On rank 0 while meshes are cut, before anything else is there.
    pub cutting_mb: f64,
}

impl Memory {
    /// Of all ranks together.
    pub fn total_mb(&self, ranks: usize) -> f64 {
        let cutting = self.cutting_mb + PROCESS_MB * ranks as f64;
        (self.subdomains_mb + self.rank_mb * ranks as f64).max(cutting)
    }

    /// Of a rank with its part of the subdomains.
    pub fn of_rank_mb(&self, rank: usize, ranks: usize) -> f64 {
        let solving = self.subdomains_mb / ranks as f64 + self.rank_mb;
        if rank == 0 { solving.max(self.cutting_mb + PROCESS_MB) } else { solving }
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

/// Numbers that a subdomain takes, given the lengths of its factor and of its matrix' lower half, and its unknowns.
pub(super) fn of_subdomain(solver: &Solver, factor: f64, matrix: f64, unknowns: f64) -> f64 {
    let interior = if solver.preconditioner == Preconditioner::Dirichlet { 1.35 } else { 1.0 };
    let precision = if solver.precision == Precision::Mixed { 0.5 } else { 1.0 };
    precision * interior * factor + 1.5 * matrix + 12.0 * unknowns
}

/// Numbers that a slot of a row takes: that of `G'` and the row's term.
pub(super) const SLOT: f64 = 12.0;

/// What every rank takes.
pub(super) fn of_rank_mb(subdomains: f64, clusters: f64, conditions: f64) -> f64 {
    let coarse = 2.0 * 8.0 * COARSE * clusters.powf(1.4);
    PROCESS_MB + megabytes(coarse + KNOWN * subdomains + CONDITION * conditions)
}

pub(super) fn megabytes(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}
