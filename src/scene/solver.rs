//! Methods, tolerances and limits of the solver. Every key has a default, so the section may be absent.

use serde::{Deserialize, Serialize};

use super::goal::ErrorOf;

/// Settings of Newton's method and of the quadratic programs inside it. All tolerances are relative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Solver {
    /// Newton stops when the step is this small in the elastic energy norm (the paper's criterion) ...
    pub newton_tolerance: f64,
    /// ... and the largest true residual of the nonlinear problem (equilibrium, gluing, gap, complementarity) is this small too.
    pub residual_tolerance: f64,
    /// Newton stops, whatever these say, when the algebraic error is at most this share of the discretisation error. Without it
    /// they decide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Meshes are refined until the error is at most this. Without it the mesh is that of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// What the error is of.
    #[serde(skip_serializing_if = "ErrorOf::is_default")]
    pub error_of: ErrorOf,
    /// Refined meshes have so many unknowns at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_unknowns: Option<u64>,
    /// Newton steps at most.
    pub newton_limit: usize,
    /// How exactly a quadratic program is solved.
    pub qp_tolerance: f64,
    /// Applications of the Hessian at most, for each quadratic program.
    pub qp_limit: usize,
    /// Which solver of quadratic programs.
    pub qp: Qp,
    /// Preconditioner of the dual problem.
    pub preconditioner: Preconditioner,
    /// What factors are stored in.
    pub precision: Precision,
}

impl Default for Solver {
    /// The paper's tolerances, and the fastest method.
    fn default() -> Self {
        Solver {
            newton_tolerance: 1e-4,
            residual_tolerance: 1e-6,
            accuracy: None,
            error: None,
            error_of: ErrorOf::default(),
            max_unknowns: None,
            newton_limit: 50,
            qp_tolerance: 1e-7,
            qp_limit: 5000,
            qp: Qp::ActiveSet,
            preconditioner: Preconditioner::Dirichlet,
            precision: Precision::Mixed,
        }
    }
}

/// Solvers of quadratic programs with bounds and equalities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Qp {
    /// Semimonotonic augmented Lagrangians: the paper's, with guaranteed convergence.
    SmalseM,
    /// Primal-dual active sets, each an equality-constrained problem.
    ActiveSet,
}

/// Preconditioners of the dual problem, cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preconditioner {
    /// No preconditioner.
    None,
    /// The stiffness of the interface nodes alone.
    Lumped,
    /// The Schur complement on the interface.
    Dirichlet,
}

/// What the factors of stiffness matrices are stored in. Residuals are always computed in double precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Single where that is exact enough for Newton's method to converge as fast, double elsewhere.
    Mixed,
    /// Double.
    Double,
}
