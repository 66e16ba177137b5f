//! The two errors of a solution: that of the solver, on its mesh, and that of the mesh. Both are of the stress, in the norm of
//! its complementary energy, relative to the stress.

use super::StepSolver;
use super::problem::{SIGNIFICANT, State, TornProblem};
use super::residuals::relative;
use crate::estimate::{self, Estimate};
use crate::feti::Torn;
use crate::monitor::timing::Timer;

/// How exact a solution is.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Bound on `J(u)` less its minimum on this mesh (energy).
    pub gap: f64,
    /// Distance from the solution on this mesh at most, see [`super::certificate`].
    pub algebraic: f64,
    /// Whether `algebraic` is a bound; else it is an estimate.
    pub is_bound: bool,
    /// Distance of the solution on this mesh from the exact one, estimated, see [`crate::estimate`].
    pub discretisation: f64,
    /// Part of each element of each own subdomain: the squares of all parts, over all ranks, add up to the square of
    /// `discretisation`.
    pub elements: Vec<Vec<f64>>,
}

impl StepSolver<'_> {
    /// The errors of an admissible displacement with the multipliers of the last step: that of the solver as sharply as it takes to
    /// see whether it is this `share` of the other one, if that is all that is asked. Collective.
    pub fn errors(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        lambda: &[f64],
        share: Option<f64>,
        timer: &Timer,
    ) -> Errors {
        let Estimate { mut errors, stresses } =
            timer.time("error estimate", || estimate::estimate(problem.sums, &problem.regions(), u));
        let partial: Vec<f64> =
            errors.iter().zip(stresses).flat_map(|(errors, stress)| [errors.iter().sum(), stress]).collect();
        let sum = problem.space.sum(&partial, 2);
        let size = sum[1].sqrt().max(SIGNIFICANT * state.terms.energy.sqrt());
        let wanted = share.map(|share| 0.5 * share * share * sum[0]);
        let certificate = self.certify(problem, (u, state), lambda, wanted, timer);
        errors.iter_mut().flatten().for_each(|square| *square = relative(square.sqrt(), size));
        Errors {
            gap: certificate.gap,
            algebraic: relative(certificate.stress_error(), size),
            is_bound: certificate.is_bound,
            discretisation: relative(sum[0].sqrt(), size),
            elements: errors,
        }
    }
}
