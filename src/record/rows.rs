//! Rows of tables: one an increment, a Newton step, or a level of a cascade.

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};

use super::state::State;

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
    /// What it tells of the limit load, where that is sought.
    #[serde(default)]
    pub limit_load: Option<LimitLoad>,
    /// The number whose error is asked for.
    #[serde(default)]
    pub goal: Option<GoalRow>,
    /// What conditions of contact add to the distance of the energy, where meshes are refined (energy).
    #[serde(default)]
    pub consistency: Option<f64>,
    /// The state there.
    #[serde(flatten)]
    pub state: State,
}

/// Bounds of the limit load factor of a mesh: what multiplies the loads that grow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitLoad {
    /// From an equilibrium: bodies bear so much.
    pub lower: f64,
    /// From a mechanism: they do not bear more.
    pub upper: f64,
    /// The factor at the last equilibrium: the best estimate, as it comes near the limit before mechanisms do.
    pub factor: f64,
    /// What loads of factor one do on the displacement there (energy).
    pub work: f64,
    /// The same where they are not there, about: what loads that stay, overlaps and prescribed displacements make of it (energy).
    pub rest: f64,
}

impl LimitLoad {
    /// How far the bounds are apart, relative. Residuals may leave the lower one above what the mechanism takes.
    pub fn width(self) -> f64 {
        (self.upper - self.lower).abs() / self.upper.abs()
    }

    /// With the higher lower bound of both, and the upper one of the later, if the equilibrium before does not refute it: if it is not
    /// below by more than this share.
    pub fn then(self, later: Self, share: f64) -> Self {
        let is_refuted = later.upper < self.lower - share * self.lower.abs();
        let upper = if is_refuted { self.upper } else { later.upper };
        Self { lower: self.lower.max(later.lower), upper, ..later }
    }

    /// With bounds that do not overlap.
    pub fn in_order(self) -> Self {
        Self { lower: self.lower.min(self.upper), ..self }
    }
}

/// Both bounds with seven digits, of loads of any size.
impl Display for LimitLoad {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let [lower, upper] = [self.lower, self.upper].map(|bound| format!("{bound:.6e}").parse().unwrap_or(bound));
        write!(f, "{lower} and {upper}")
    }
}

/// A number that is of interest, and what is known of its error; all in the unit of the number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GoalRow {
    /// The number, on this mesh.
    pub value: f64,
    /// What recovered strains add to it.
    pub correction: f64,
    /// The same with the sizes of elements, which do not cancel.
    pub distance: f64,
    /// What the solver left of it in the solution; `value` has it no more.
    pub gap: f64,
    /// Sum of the sizes of the terms that it is a sum of.
    pub terms: f64,
    /// Applications of F for its dual solution.
    pub hessian_multiplications: u64,
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
    /// The largest relative residual: of equilibrium, gluing, gap and complementarity.
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

/// A mesh of a run that refines it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RefinementRow {
    /// Elements.
    pub elements: u64,
    /// Unknowns: three a node.
    pub unknowns: u64,
    /// Increments of the load that it took.
    pub increments: u64,
    /// Estimated error of what the scene asks for, relative.
    pub error: f64,
    /// `J(u)`, of the last increment.
    pub energy: f64,
    /// What errors of the energy are relative to: the largest `|J(u)|` of an increment.
    pub size: f64,
    /// Sum of the Bregman distances and of what conditions of contact add (energy), which the error of the energy is estimated from.
    pub distance: f64,
    /// What conditions of contact have of it; the largest of an increment.
    #[serde(default)]
    pub consistency: f64,
    /// `J(u)` is at most so much above its least value on this mesh.
    pub gap: f64,
    /// Estimated error of the stress, relative.
    pub stress: f64,
    /// The limit load, where that is sought; the energy is then `J(u)` without the work of the loads that grow.
    #[serde(default)]
    pub limit_load: Option<LimitLoad>,
    /// The number whose error is asked for; that of the last increment.
    #[serde(default)]
    pub goal: Option<GoalRow>,
    /// Newton steps.
    pub newton_iterations: Option<u64>,
    /// Every application of F.
    pub hessian_multiplications: Option<u64>,
    /// Wall time in seconds, from mesh to estimate.
    pub seconds: f64,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equilibria_refute_mechanisms_that_end_below_them() {
        let of = |lower: f64, upper: f64| LimitLoad { lower, upper, factor: lower, work: 1.0, rest: 0.0 };
        let bounds = |limit: LimitLoad| [limit.lower, limit.upper];
        let before = of(1.2, 1.5);
        assert_eq!(bounds(before.then(of(1.25, 1.3), 0.01)), [1.25, 1.3]);
        // Less work, and a mechanism that takes more.
        assert_eq!(bounds(before.then(of(1.1, 1.6), 0.01)), [1.2, 1.6]);
        assert_eq!(bounds(before.then(of(1.1, 1.15), 0.01)), [1.2, 1.5]);
        // Residuals leave a little.
        let near = before.then(of(1.1, 1.195), 0.01);
        assert_eq!(bounds(near), [1.2, 1.195]);
        assert!(near.width() < 0.005 && bounds(near.in_order()) == [1.195, 1.195]);
        // Loads that stay may bear more than all by themselves.
        let negative = of(-1.2, -0.9);
        assert_eq!(bounds(negative.then(of(-1.1, -1.3), 0.01)), [-1.1, -0.9]);
        assert!(of(-1.3, -1.0).width() > 0.2);
    }

    #[test]
    fn bounds_of_any_size_are_told_with_seven_digits() {
        let told =
            LimitLoad { lower: 1.234567891e-6, upper: 123456.7891, factor: 1.0, work: 1.0, rest: 0.0 }.to_string();
        assert_eq!(told, "0.000001234568 and 123456.8");
    }
}
