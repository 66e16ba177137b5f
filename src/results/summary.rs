//! One JSON object that sums up a run, for scripts, tables and tests.
//!
//! The keys are a contract (more may be added). Quantities that a run does not have (a check solves nothing, a scene
//! without contact has no gap) are null; so are values that are not finite. All other numbers read back to the same bits.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::OutputError;
use crate::comm::Comm;

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
    /// QP solver: smalse-m or active-set.
    pub qp: String,
    /// Work done by the QP solver.
    #[serde(flatten)]
    pub counters: Counters,
    /// The state at the end of the run; but plastic elements are those of the increment with most of them, as the last one may
    /// be an unloading.
    #[serde(flatten)]
    pub state: State,
    /// Wall time of the run in seconds.
    pub time_total: Option<f64>,
    /// Seconds outside messages, of the rank with most over that with least.
    pub imbalance: Option<f64>,
    /// Seconds of each phase on the slowest rank, without messages.
    pub time: BTreeMap<String, f64>,
    /// What phases do at least, all ranks together, where that is known.
    pub work: BTreeMap<String, Work>,
    /// Messages by kind.
    pub communication: BTreeMap<String, CommunicationRow>,
    /// Sum over the ranks of their largest resident memory, in MiB.
    pub peak_rss_mb: Option<f64>,
    /// That of the rank with the largest, in MiB.
    pub peak_rss_mb_max: Option<f64>,
    /// Largest resident memory of rank 0 until meshes from files were read and sent out, in MiB.
    pub mesh_reading_mb: Option<f64>,
    /// What a run would take, in MiB; from `check` only.
    pub memory_estimate_mb: Option<f64>,
    /// What the hosts of the run have left, in MiB; from `check` only.
    pub memory_available_mb: Option<f64>,
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
}

/// What a phase does at least, where that is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Work {
    /// Additions and multiplications.
    pub flops: f64,
    /// Bytes of matrices read.
    pub bytes: f64,
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

/// What a solution is like. Energies are those of the last increment: what is stored elastically, and what this increment
/// dissipates or stores by hardening.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Elements with plastic flow in the increment.
    pub plastic_elements: Option<u64>,
    /// Contact pairs that transmit pressure.
    pub active_contacts: Option<u64>,
    /// Sum of `contact_forces`.
    pub contact_force: Option<[f64; 3]>,
    /// Force of each contact on the body that the scene names first, whichever surface is the slave.
    pub contact_forces: BTreeMap<String, [f64; 3]>,
    /// Force of each support on the bodies.
    pub reactions: BTreeMap<String, [f64; 3]>,
    /// What acts on each body.
    pub balance: BTreeMap<String, Acting>,
    /// Work of the loads, `f'u`.
    pub external_work: Option<f64>,
    /// `Psi(u)`.
    pub internal_energy: Option<f64>,
    /// `J(u) = Psi(u) - f'u`.
    pub energy: Option<f64>,
    /// Largest length of a nodal displacement.
    pub max_displacement: Option<f64>,
    /// Largest von Mises stress of an element.
    pub max_von_mises: Option<f64>,
    /// How well the equations hold.
    #[serde(flatten)]
    pub residuals: Residuals,
    /// How far the stress is from what it should be.
    #[serde(flatten)]
    pub errors: Errors,
    /// How near it is to the limits of small strains and displacements.
    #[serde(flatten)]
    pub measures: Measures,
}

/// The largest value of a measure, and where it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// The value.
    pub value: f64,
    /// Name of the body or contact.
    pub of: String,
    /// Coordinates of an element's centre or of a node.
    pub at: [f64; 3],
}

/// Measures of how near a solution is to the limits of the theory (`study/limits`); null where there is nothing to measure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Norm of the strain.
    pub max_strain: Option<Extreme>,
    /// Angle in radians.
    pub max_rotation: Option<Extreme>,
    /// Displacement of a node over the diagonal of its body's bounding box.
    pub max_relative_displacement: Option<Extreme>,
    /// Way that a closed slave node slides, in edges of its facets.
    pub max_sliding: Option<Extreme>,
    /// Gap that closed over the diagonal of the slave's body.
    pub max_closed_gap: Option<Extreme>,
    /// Rounding of coordinates over what bodies are strained by (strain times the diagonal); null without contact.
    pub max_rounding: Option<Extreme>,
}

/// Forces and moments on a body, these about the mean of its nodes. What supports hold of a contact's condition passes from one
/// to the other and is in neither.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// Of loads.
    pub loads: Resultant,
    /// Of supports.
    pub supports: Resultant,
    /// Of contacts.
    pub contacts: Resultant,
    /// Their sum, zero in equilibrium.
    pub unbalanced: Resultant,
}

/// A force and its moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Resultant {
    /// The force.
    pub force: [f64; 3],
    /// The moment (force times length).
    pub moment: [f64; 3],
}

/// Errors of the stress in the norm of its complementary energy, relative to the stress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Bound on `J(u)` less its minimum on this mesh.
    pub duality_gap: Option<f64>,
    /// Bound on the distance from the solution on this mesh.
    #[serde(rename = "error_algebraic")]
    pub algebraic: Option<f64>,
    /// Whether it is a bound; with perfect plasticity it is an estimate.
    #[serde(rename = "error_algebraic_is_bound")]
    pub algebraic_is_bound: Option<bool>,
    /// Estimated distance of the solution on this mesh from the exact one.
    #[serde(rename = "error_discretisation")]
    pub discretisation: Option<f64>,
    /// Whether the solver stopped because the first was small beside the second.
    pub ended_by_accuracy: Option<bool>,
}

/// The end of an increment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepRow {
    /// Number of the load step, from 1.
    pub step: u64,
    /// Its name.
    pub name: String,
    /// Number of the increment in the step, from 1.
    pub increment: u64,
    /// Load steps done, that of the present one as a fraction: the time in the result file.
    pub time: f64,
    /// How often parts of the increment were halved because Newton's method failed.
    pub halvings: u64,
    /// Whether the increment was reached.
    pub converged: bool,
    /// The state there.
    #[serde(flatten)]
    pub state: State,
}

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
    /// Clusters of them that have six rigid motions in the coarse problem: as many where each has its own.
    pub clusters: u64,
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

/// Relative residuals of the glued, undecomposed problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// Forces out of balance.
    #[serde(rename = "residual_equilibrium")]
    pub equilibrium: Option<f64>,
    /// Jumps between the copies of a node.
    #[serde(rename = "residual_gluing")]
    pub gluing: Option<f64>,
    /// Penetration.
    #[serde(rename = "residual_gap")]
    pub gap: Option<f64>,
    /// Pressure across open gaps.
    #[serde(rename = "residual_complementarity")]
    pub complementarity: Option<f64>,
    /// Unbalanced force or moment of a body.
    #[serde(rename = "residual_balance")]
    pub balance: Option<f64>,
}

/// What the solution on a coarser level took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CascadeRow {
    /// Refinement level.
    pub level: usize,
    /// Subdomains.
    pub subdomains: u64,
    /// Newton steps.
    pub newton_iterations: Option<u64>,
    /// Every application of F.
    pub hessian_multiplications: Option<u64>,
    /// Subdomains that got a new factor; congruent ones that share it count each.
    pub factorisations: Option<u64>,
    /// Wall time in seconds.
    pub seconds: f64,
}

/// One Newton step.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NewtonRow {
    /// Number of the increment of the load, from 1.
    pub increment: u64,
    /// Number, from 1.
    pub step: u64,
    /// The paper's stopping criterion in the energy norm.
    pub criterion: f64,
    /// Relative residual of the equilibrium.
    pub residual: f64,
    /// Length of the step taken, 1 is Newton's own.
    pub damping: f64,
    /// Elements with plastic flow.
    pub plastic_elements: u64,
    /// Contact pairs that transmit pressure.
    pub active_contacts: u64,
    /// `J` after the step.
    pub energy: f64,
    /// Residual of the subdomains' stiffness problems, relative to their forces: what rounding costs.
    pub local_residual: f64,
    /// Outer iterations of the QP solver: multiplier updates of SMALSE-M, sets of the active-set method.
    pub qp_iterations: u64,
    /// Applications of F.
    pub hessian_multiplications: u64,
    /// Subdomains that got a new factor.
    pub factorisations: u64,
    /// Wall time.
    pub seconds: f64,
}

impl Summary {
    /// Rank 0 writes the summary as JSON. Collective.
    ///
    /// # Errors
    /// [`OutputError::Write`] on every rank; an earlier file of that name is untouched then.
    pub fn write(&self, comm: &dyn Comm, path: &Path) -> Result<(), OutputError> {
        super::write_json(comm, path, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use serde_json::Value;

    #[test]
    fn numbers_read_back_bitwise_and_absent_ones_are_null() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/summary.json");
        let summary = Summary {
            converged: Some(true),
            state: State {
                energy: Some(-1245323411.382042),
                max_displacement: Some(0.1 + 0.2),
                residuals: Residuals { equilibrium: Some(f64::NAN), gluing: Some(5e-324), ..Residuals::default() },
                reactions: BTreeMap::from([("left".into(), [1.0 / 3.0, -0.0, 1e300])]),
                ..State::default()
            },
            ..Summary::default()
        };
        threads::run(3, |comm| summary.write(comm, &path).unwrap());
        let read: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(read["energy"].as_f64(), summary.state.energy);
        assert_eq!(read["max_displacement"].as_f64(), Some(0.1 + 0.2));
        assert_eq!(read["residual_gluing"].as_f64(), Some(5e-324));
        assert_eq!(read["reactions"]["left"][0].as_f64(), Some(1.0 / 3.0));
        for key in ["residual_equilibrium", "residual_gap", "smalse_iterations", "error", "contact_force"] {
            assert_eq!(read.get(key), Some(&Value::Null), "{key}");
        }
        assert_eq!(read["dual_dofs"], 0);
    }

    #[test]
    fn an_impossible_place_is_everybodys_error() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("file");
        std::fs::write(&file, "kept").unwrap();
        let outcomes = threads::run(3, |comm| Summary::default().write(comm, &file.join("summary.json")));
        assert!(matches!(&outcomes[0], Err(OutputError::Write { reason, .. }) if reason.contains("rank 0")));
        assert!(outcomes.iter().all(|o| *o == outcomes[0]));
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
    }
}
