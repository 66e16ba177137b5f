//! How large a discrete problem is: counts in the paper's way, and the memory that solving would take.

use super::discrete::Discrete;
use crate::comm::{Comm, Shares, ordered_sum};
use crate::constraint::Kind;
use crate::feti::factor::analyse;
use crate::feti::hybrid;
use crate::feti::space::RowSpace;
use crate::results::summary::Sizes;
use crate::scene::{self, Scene};

/// Counts what a discrete problem consists of, in the paper's way. Collective.
pub fn sizes(discrete: &Discrete, comm: &dyn Comm) -> Sizes {
    let Discrete { decomposition, constraints, bodies, .. } = discrete;
    let space = RowSpace::new(comm, &decomposition.shares, constraints);
    let mut partial = Vec::new();
    for (rows, subdomain) in space.owned().iter().zip(&decomposition.subdomains) {
        let touches = subdomain.facets.iter().any(|facet| discrete.touching.contains(&facet.surface));
        let mut counts = [subdomain.dofs() as f64, 0.0, 0.0, 0.0, f64::from(touches)];
        for &row in rows {
            counts[match constraints.rows[row as usize].kind {
                Kind::Gluing => 1,
                Kind::Support { .. } => 2,
                Kind::Contact { .. } => 3,
            }] += 1.0;
        }
        partial.extend(counts);
    }
    let sum: Vec<u64> = space.sum(&partial, 5).into_iter().map(|n| n as u64).collect();
    Sizes {
        nodes: bodies.iter().map(|b| b.counts().nodes).sum(),
        cells: bodies.iter().map(|b| b.counts().cells).sum(),
        elements: bodies.iter().map(|b| b.counts().elements).sum(),
        subdomains: decomposition.shares.total() as u64,
        clusters: decomposition.clusters.total() as u64,
        contact_subdomains: sum[4],
        primal_dofs: sum[0],
        gluing_rows: sum[1],
        dirichlet_rows: sum[2],
        contact_rows: sum[3],
        dual_dofs: sum[1] + sum[2] + sum[3],
    }
}

/// Memory that solving would take on all ranks together, in MiB: factors, tangents, multipliers and coarse problem.
/// Factors that congruent elastic subdomains share are counted for each: a material that may yield shares none in the end.
/// Subdomains of equal connectivity are analysed once. Collective.
pub fn memory_estimate_mb(scene: &Scene, discrete: &Discrete, comm: &dyn Comm) -> f64 {
    let Discrete { decomposition, constraints, .. } = discrete;
    let analysed = analyse(&decomposition.subdomains);
    // The interior factor of the Dirichlet preconditioner is about a third of the whole one on cubes.
    let interior = if scene.solver.preconditioner == scene::Preconditioner::Dirichlet { 1.35 } else { 1.0 };
    let factors = if scene.solver.precision == scene::Precision::Mixed { 0.5 * interior } else { interior };
    let doubles: f64 = analysed
        .iter()
        .map(|s| {
            factors * s.analysis().factor_length() as f64
                + 1.5 * s.pattern.rows.len() as f64
                + 12.0 * s.pattern.dofs() as f64
        })
        .sum();
    let clusters = decomposition.clusters.of_rank(comm.rank()).filter(|members| members.len() > 1);
    let bonds: f64 = clusters.map(|members| hybrid::numbers(&decomposition.subdomains[members]) as f64).sum();
    // A row of G' and a row's terms; the coarse factor is small beside them.
    let slots = 12.0 * constraints.slot_subdomain.len() as f64;
    let mine = 8.0 * (doubles + bonds + slots) / f64::from(1 << 20);
    ordered_sum(comm, &Shares(vec![1; comm.size()]), &[mine], 1)[0] + PROCESS_MB * comm.size() as f64
}

/// What a process takes before it holds anything (MPI, HDF5), in MiB.
const PROCESS_MB: f64 = 30.0;
