//! One JSON object that sums up a run, for scripts, tables and tests.
//!
//! The keys are a contract (more may be added). Quantities that a run does not have (a check solves nothing, a scene
//! without contact has no gap) are null; so are values that are not finite. All other numbers read back to the same bits.

use std::collections::BTreeMap;

use serde::Serialize;

use super::counts::{CommunicationRow, ContactRow, Counted, Counters, Sizes, Work};
use super::forecast::{Forecast, HeldRow};
use super::rows::{CascadeRow, LimitLoad, NewtonRow, RefinementRow, StepRow};
use super::state::State;

/// What a run was about and what came out. Lengths, forces and energies are in the scene's units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the built-in scene, or the path of its file.
    pub scene: String,
    /// The scene's own title.
    pub title: String,
    /// Refinement level.
    pub level: usize,
    /// Whether Newton's method converged; null if nothing was solved.
    pub converged: Option<bool>,
    /// Number of ranks.
    pub ranks: usize,
    /// Sizes of the problem.
    #[serde(flatten)]
    pub sizes: Sizes,
    /// How contacts were paired.
    pub contacts: Vec<ContactRow>,
    /// Share of the elements with plastic flow, 0 to 1, in the increment with most of them.
    pub plastic_fraction: Option<f64>,
    /// Newton steps.
    pub newton_iterations: Option<u64>,
    /// QP solver: smalse-m or active-set; pcpg (conjugate gradients) without contact.
    pub qp: String,
    /// Work done by the QP solver.
    #[serde(flatten)]
    pub counters: Counters,
    /// The state at the end of the run; but plastic elements are those of the increment with most of them, as the last one may
    /// be an unloading.
    #[serde(flatten)]
    pub state: State,
    /// Bounds of the limit load factor, where that is sought.
    pub limit_load: Option<LimitLoad>,
    /// Wall time of the run in seconds.
    pub time_total: Option<f64>,
    /// Seconds outside messages, of the rank with most over that with least.
    pub imbalance: Option<f64>,
    /// Seconds of each phase on the slowest rank, without messages.
    pub time: BTreeMap<String, f64>,
    /// What phases do at least, all ranks together, where that is known.
    pub work: BTreeMap<String, Work>,
    /// What ranks did, free of noise.
    #[serde(flatten)]
    pub counted: Counted,
    /// Messages by kind.
    pub communication: BTreeMap<String, CommunicationRow>,
    /// Sum over the ranks of their largest resident memory, in MiB.
    pub peak_rss_mb: Option<f64>,
    /// The same without pages that processes of a host share.
    pub peak_private_mb: Option<f64>,
    /// Resident memory of the rank with the largest, in MiB.
    pub peak_rss_mb_max: Option<f64>,
    /// Largest resident memory of a rank until meshes that are no bricks were read or made, and cut, in MiB.
    pub mesh_reading_mb: Option<f64>,
    /// What a run would take, in MiB; from `check` only.
    pub memory_estimate_mb: Option<f64>,
    /// What the hosts of the run have left, in MiB; from `check` only.
    pub memory_available_mb: Option<f64>,
    /// What a rank would hold, item by item; from `check --ranks` only.
    pub memory_of_rank: Vec<HeldRow>,
    /// Ranks that this is for.
    pub memory_ranks: Option<usize>,
    /// How long it would take on as many; from `check --ranks` only.
    pub forecast: Option<Forecast>,
    /// Why the run failed.
    pub error: Option<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Where the run comes from: the texts of the result file's `/provenance`, but for the scene itself.
    pub provenance: BTreeMap<String, String>,
    /// One row an increment of the load.
    pub steps: Vec<StepRow>,
    /// One row a Newton step; those of attempts that failed included.
    pub newton: Vec<NewtonRow>,
    /// Coarser levels that were solved before for a start, coarsest first.
    pub cascade: Vec<CascadeRow>,
    /// Meshes of a run that refines them, coarsest first.
    pub refinements: Vec<RefinementRow>,
}
