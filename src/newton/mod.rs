//! Semismooth Newton for `min J(v) = Psi(v) - f'v` over the admissible displacements (paper, section 3).
//!
//! `J` is convex and every iterate is made feasible, so the step of the quadratic model is a descent direction and the
//! method, damped by `J`, converges from anywhere; the direction of plastic flow is an unknown of its own
//! ([`crate::assembly::flow`]), that steps are seldom damped. [`step`] is the only place where
//! FETI and the QP solvers meet.

pub mod balance;
pub mod certificate;
pub mod committed;
pub mod damping;
pub mod dual;
pub mod errors;
pub mod forcing;
pub mod loading;
pub mod problem;
pub mod program;
pub mod residuals;
pub mod step;

pub use certificate::Certificate;
pub use committed::Committed;
pub use errors::Errors;
pub use problem::TornProblem;
pub use program::{Method, ProgramSettings};
pub use residuals::Residuals;
pub use step::{SolverState, StepSolver};

use serde::{Deserialize, Serialize};

use crate::feti::Torn;
use crate::monitor::timing::Timer;
use crate::qp;
use forcing::Forcing;

/// How often a step that does not lower the energy is tried again, more exactly each time.
const ATTEMPTS: usize = 3;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Bound on `|u+ - u|_e / (|u+|_e + |u|_e)` (paper, section 5).
    pub tolerance: f64,
    /// Bound on every one of the true residuals.
    pub residual: f64,
    /// Steps at most.
    pub limit: usize,
    /// An algebraic error of this share of the discretisation error is small enough, whatever the other two say.
    pub accuracy: Option<f64>,
}

/// How the iteration ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Both criteria are met, or the accuracy is.
    Converged,
    /// The allowed steps are used up.
    LimitReached,
    /// No step length along the Newton direction lowers the energy: round-off, or a quadratic program solved too loosely.
    Stalled,
    /// A quantity is NaN or infinite.
    NotFinite,
    /// The quadratic program of a step could not be solved.
    Inner(qp::Outcome),
    /// A tangent stiffness is singular beyond its rigid motions.
    Singular(String),
    /// Somebody asked to stop, and has what is needed to go on.
    Stopped,
}

impl Outcome {
    /// What to tell the user, `None` if all is well.
    pub fn message(&self) -> Option<String> {
        Some(match self {
            Self::Converged => return None,
            Self::LimitReached => "Newton's method reached solver.newton_limit without convergence".into(),
            Self::Stalled => {
                "Newton's method stalled: no step lowers the energy; tighten solver.qp_tolerance, or accept the residuals"
                    .into()
            }
            Self::NotFinite => "the solution is not finite (NaN or infinite): check loads, sizes and moduli".into(),
            Self::Inner(qp::Outcome::LimitReached) => {
                "a quadratic program reached solver.qp_limit without convergence".into()
            }
            Self::Inner(outcome) => format!("a quadratic program could not be solved ({outcome:?})"),
            Self::Singular(message) => message.clone(),
            Self::Stopped => "stopped on request".into(),
        })
    }
}

/// What one step did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Number, from 1.
    pub number: usize,
    /// The paper's criterion.
    pub criterion: f64,
    /// Largest of the true residuals.
    pub residual: f64,
    /// Step length, 1 for a full step.
    pub damping: f64,
    /// `J` after the step.
    pub energy: f64,
    /// Elements that yield.
    pub plastic_elements: usize,
    /// Contact pairs with a force.
    pub active_contacts: usize,
    /// What the QP solver did.
    pub statistics: qp::Statistics,
    /// Residual of the subdomains' problems that rounding leaves, relative to their forces.
    pub local_residual: f64,
    /// Applications of F, those around the quadratic program included.
    pub applications: usize,
    /// Subdomains with a new factor, over all ranks.
    pub factorisations: usize,
    /// Wall time.
    pub seconds: f64,
}

/// Where to start from.
pub struct Start {
    /// Torn displacement.
    pub u: Torn,
    /// Rows that hold there: all equalities and the closed contacts.
    pub held: Vec<bool>,
}

/// Where a solve stands between two steps: all that later steps depend on, beside the problem and what is committed.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Torn displacement.
    pub u: Torn,
    /// Multipliers of this rank's rows.
    pub lambda: Vec<f64>,
    /// Where multipliers and factors are lost, for they were of other subdomains: the rows that hold, from which and from the
    /// displacement multipliers follow.
    pub held: Option<Vec<bool>>,
    /// How exactly the next quadratic program is solved.
    pub forcing: Forcing,
    /// What is kept from step to step.
    pub solver: SolverState,
    /// The steps so far.
    pub steps: Vec<StepRecord>,
}

/// How a solve begins.
pub enum Begin {
    /// From rest.
    Rest,
    /// Near a solution.
    Near(Start),
    /// Where another one stood.
    At(Box<Standing>),
}

/// The solution and what it took.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Torn displacement; copies agree and the bodies do not overlap, to round-off.
    pub u: Torn,
    /// Multipliers of this rank's rows.
    pub lambda: Vec<f64>,
    /// How the iteration ended.
    pub outcome: Outcome,
    /// One record a step.
    pub steps: Vec<StepRecord>,
    /// Residuals of the glued problem at `u`.
    pub residuals: Residuals,
    /// How exact it is; `None` without a step, or where numbers are not finite.
    pub errors: Option<Errors>,
    /// Whether the accuracy ended the iteration, before the criteria were met.
    pub ended_by_accuracy: bool,
    /// `J(u)`.
    pub energy: f64,
    /// `Psi(u)`.
    pub internal_energy: f64,
    /// `f'u`.
    pub external_work: f64,
    /// Elements that yield.
    pub plastic_elements: usize,
}

/// Who watches.
pub struct Watch<'a> {
    /// Where the time goes.
    pub timer: &'a Timer,
    /// Told the number of the step and the applications of F in it so far.
    pub alive: &'a dyn Fn(usize, usize),
    /// Told of every step that is done.
    pub step: &'a dyn Fn(&StepRecord),
}

/// Solves one increment beyond what is committed. Between two steps `pause` is asked whether to stop there, and handed what
/// it takes to go on. Collective, and so is `pause`.
pub fn solve(
    problem: &TornProblem,
    solver: &mut StepSolver,
    settings: &Settings,
    begin: Begin,
    &Watch { timer, alive, step: report }: &Watch,
    pause: &dyn Fn(&dyn Fn() -> Standing) -> bool,
) -> Solution {
    let (mut u, mut lambda) = (problem.gather.zeros(), vec![0.0; problem.gather.rows()]);
    let (mut steps, mut forcing, mut held, mut stood) = (Vec::new(), Forcing::default(), None, None);
    match begin {
        Begin::Rest => {}
        Begin::Near(start) => (u, held) = (start.u, Some(start.held)),
        Begin::At(at) => {
            (u, lambda, forcing, steps) = (at.u, at.lambda, at.forcing, at.steps);
            (stood, held) = (Some(at.solver), at.held);
        }
    }
    let mut state = problem.evaluate(&u);
    let mut refused = None;
    if let Some(stood) = stood {
        refused = solver.resume(problem, stood, timer).err();
    } else {
        solver.begin();
    }
    if let Some(held) = held {
        lambda = solver.expect(problem, &state, held);
    }
    let mut residuals = problem.residuals(&u, &state, &lambda);
    let mut admissible = !steps.is_empty() || problem.is_admissible(&u);
    let mut attempts: Vec<step::Step> = Vec::new();
    let (mut errors, mut ended_by_accuracy) = (None, false);
    let outcome = loop {
        if let Some(message) = refused {
            break Outcome::Singular(message);
        }
        let standing = || {
            let (u, lambda, steps) = (u.clone(), lambda.clone(), steps.clone());
            Standing { u, lambda, held: None, forcing, solver: solver.state(), steps }
        };
        if attempts.is_empty() && pause(&standing) {
            break Outcome::Stopped;
        }
        if steps.last().is_some_and(|step| step.local_residual > forcing::LOOSEST) {
            solver.sharpen();
        }
        let watch = timer.total_seconds();
        if problem.is_linear() && settings.accuracy.is_none() {
            forcing.drop = solver.linear_drop();
        }
        let last = attempts.last().map_or(&lambda, |attempt| &attempt.lambda);
        let step = match solver.solve(problem, (&u, &state), last, forcing, timer, &|n| alive(steps.len() + 1, n)) {
            Ok(step) => step,
            Err(message) => break Outcome::Singular(message),
        };
        // Perhaps the factors were not exact enough.
        if step.outcome != qp::Outcome::Converged && solver.sharpen() {
            attempts.push(step);
            continue;
        }
        if !matches!(step.outcome, qp::Outcome::Converged | qp::Outcome::LimitReached) {
            break if step.outcome == qp::Outcome::NotFinite {
                Outcome::NotFinite
            } else {
                Outcome::Inner(step.outcome)
            };
        }
        // Inadmissible starts (prescribed displacements, overlaps) have no energy to compare with.
        let Some(damped) = damping::search(problem, &u, &state, &step.du, admissible, timer) else {
            if !state.energy.is_finite() || attempts.len() >= ATTEMPTS {
                break if state.energy.is_finite() { Outcome::Stalled } else { Outcome::NotFinite };
            }
            // Perhaps the program was solved too loosely for a descent direction.
            forcing.tighten();
            solver.sharpen();
            attempts.push(step);
            continue;
        };
        let criterion = timer.time("residuals", || problem.relative_change(&u, &damped.u, &damped.state.terms));
        let left = (std::mem::replace(&mut u, damped.u), std::mem::replace(&mut state, damped.state));
        lambda = step.lambda;
        admissible = true;
        let before = residuals.largest();
        residuals = timer.time("residuals", || problem.residuals(&u, &state, &lambda));
        forcing.update(before, residuals.largest(), settings.residual, step.at_floor);
        let record = StepRecord {
            number: steps.len() + 1,
            criterion,
            residual: residuals.largest(),
            damping: damped.length,
            energy: state.energy,
            plastic_elements: state.plastic,
            active_contacts: problem.active_contacts(&lambda),
            statistics: attempts.iter().fold(step.statistics, |sum, attempt| sum + attempt.statistics),
            local_residual: step.local_residual,
            applications: step.applications + attempts.iter().map(|a| a.applications).sum::<usize>(),
            factorisations: step.factorisations + attempts.iter().map(|a| a.factorisations).sum::<usize>(),
            seconds: timer.total_seconds() - watch,
        };
        attempts.clear();
        report(&record);
        steps.push(record);
        if !(criterion.is_finite() && state.energy.is_finite()) {
            break Outcome::NotFinite;
        }
        let close = criterion < settings.tolerance || problem.is_linear();
        if close && residuals.largest() <= settings.residual {
            break Outcome::Converged;
        }
        if let Some(accuracy) = settings.accuracy {
            let found = solver.errors(problem, (&u, &state), &lambda, timer);
            ended_by_accuracy = found.algebraic <= accuracy * found.discretisation;
            if ended_by_accuracy {
                errors = Some(found);
                break Outcome::Converged;
            }
        }
        if step.outcome == qp::Outcome::LimitReached {
            break Outcome::Inner(step.outcome);
        }
        if steps.len() >= settings.limit {
            break Outcome::LimitReached;
        }
        timer.time("internal forces", || solver.follow(problem, (&left.0, &left.1), &u, damped.length));
    };
    if errors.is_none() && !steps.is_empty() && state.energy.is_finite() && outcome != Outcome::Stopped {
        errors = Some(solver.errors(problem, (&u, &state), &lambda, timer));
    }
    Solution {
        u,
        lambda,
        outcome,
        steps,
        residuals,
        errors,
        ended_by_accuracy,
        energy: state.energy,
        internal_energy: state.internal_energy,
        external_work: state.external_work,
        plastic_elements: state.plastic,
    }
}

#[cfg(test)]
mod tests;
