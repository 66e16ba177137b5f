//! A displacement with its multipliers, from the first one of an increment on.

use super::energies::Energies;
use super::errors::Errors;
use super::outcome::Outcome;
use super::problem::{State, TornProblem};
use super::residuals::Residuals;
use super::step::{SolverState, StepSolver};
use crate::feti::Torn;
use crate::monitor::timing::Timer;

/// A displacement with its multipliers, and what is known of both.
pub struct Iterate {
    /// Torn displacement; after a step copies agree and the bodies do not overlap, to round-off.
    pub u: Torn,
    /// Multipliers of this rank's rows.
    pub lambda: Vec<f64>,
    /// Internal forces and energies at `u`.
    pub state: State,
    /// Residuals of the glued problem.
    pub residuals: Residuals,
    /// How exact it is. Known at the end of an iteration, unless no step was taken or numbers are not finite.
    pub errors: Option<Errors>,
    /// Energies up to here. Known where an increment is reached.
    pub energies: Option<Energies>,
    /// Whether the accuracy ended the iteration, before the criteria were met.
    pub ended_by_accuracy: bool,
}

/// The first iterate of an attempt, and how the iteration ended if it cannot even begin. With a state of the solver, goes on
/// from there; if rows are known to hold, with the multipliers that follow from them. Collective.
pub(super) fn first(
    problem: &TornProblem,
    solver: &mut StepSolver,
    (u, mut lambda): (Torn, Vec<f64>),
    kept: Option<Vec<bool>>,
    stood: Option<SolverState>,
    timer: &Timer,
) -> (Iterate, Option<Outcome>) {
    let state = timer.time("internal forces", || problem.evaluate(&u));
    let refusal = match stood {
        Some(stood) => solver.resume(problem, stood, timer).err(),
        None => {
            solver.begin();
            None
        }
    };
    if let Some(kept) = kept {
        lambda = timer.time("coarse set-up", || solver.expect(problem, &state, kept));
    }
    let residuals = timer.time("residuals", || problem.residuals(&u, &state, &lambda));
    let iterate = Iterate { u, lambda, state, residuals, errors: None, energies: None, ended_by_accuracy: false };
    (iterate, refusal.map(Outcome::Singular))
}
