//! How large a problem is, and what solving it took.

use std::collections::BTreeMap;

use serde::Serialize;

pub use crate::work::Work;

/// Sizes of the problem, in the paper's way of counting rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Sizes {
    /// Nodes of the meshes.
    pub nodes: u64,
    /// Hexahedral cells of bricks before they are split into elements; elements of other meshes.
    pub cells: u64,
    /// Finite elements.
    pub elements: u64,
    /// Subdomains.
    pub subdomains: u64,
    /// Clusters of subdomains: as many where each is one.
    pub clusters: u64,
    /// Groups on the highest level, with six rigid motions each in the coarse problem.
    pub coarse_blocks: u64,
    /// Those with a triangle on a contact surface.
    pub contact_subdomains: u64,
    /// Displacements of the torn problem.
    pub primal_dofs: u64,
    /// All rows.
    pub dual_dofs: u64,
    /// Rows that glue subdomains.
    pub gluing_rows: u64,
    /// Rows of the supports.
    pub dirichlet_rows: u64,
    /// Rows of contact.
    pub contact_rows: u64,
    /// Rows of B along the surfaces of contacts with friction.
    pub friction_rows: u64,
    /// Keys of those above that are estimated; from `check` of large scenes only.
    pub estimated: Vec<String>,
}

/// How a contact was paired.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactRow {
    /// Its name in the scene.
    pub name: String,
    /// The surface whose nodes carry the conditions.
    pub slave: String,
    /// The other surface; none at a rigid obstacle.
    pub master: Option<String>,
    /// `node to node`, `mortar` or `rigid`.
    pub rule: String,
    /// Slave nodes with a condition.
    pub conditions: u64,
}

/// Work done by the QP solver in all Newton steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Counters {
    /// Outer iterations of SMALSE-M.
    pub smalse_iterations: Option<u64>,
    /// Outer iterations of the active-set method.
    pub active_set_iterations: Option<u64>,
    /// Inner iterations of either.
    pub dual_iterations: Option<u64>,
    /// Every application of F, the ones for norms and residuals included.
    pub hessian_multiplications: Option<u64>,
    /// Applications of the preconditioner.
    pub preconditioner_applications: Option<u64>,
    /// Subdomains that got a new factor; congruent ones that share it count each.
    pub factorisations: Option<u64>,
}

/// Messages of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CommunicationRow {
    /// On the rank with most of them.
    pub calls: u64,
    /// On the slowest rank, waiting for others included.
    pub seconds: f64,
    /// Handed in by all ranks together.
    pub megabytes: f64,
}

/// A number of each rank, over all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Load {
    /// Of the rank that has most.
    pub busiest: f64,
    /// Mean of all ranks.
    pub mean: f64,
}

/// What a rank does and says in a phase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Additions and multiplications, see [`Work`].
    pub flops: Load,
    /// Bytes read, see [`Work`].
    pub bytes: Load,
    /// Messages sent to single ranks: one for each partner of an exchange, one for each other rank that an all-to-all has
    /// something for.
    pub messages: Load,
    /// Calls that all ranks take part in: gathers, broadcasts, all-to-alls.
    pub collectives: Load,
    /// Bytes handed in for other ranks.
    pub bytes_sent: Load,
    /// Bytes that came from other ranks.
    pub bytes_received: Load,
    /// Bytes of the longest single message, or of the longest result of a collective call.
    pub largest_message: Load,
}

/// What ranks did, free of noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Counted {
    /// By phase; what is in none is under `outside phases`.
    pub counts: BTreeMap<String, Counts>,
    /// Of the whole run. The busiest rank is that of the whole, which need not be the busiest in any phase.
    pub counts_total: Option<Counts>,
    /// Other ranks that a rank exchanges with.
    pub partners: Option<Load>,
}
