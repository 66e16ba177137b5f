//! A history of loads as a value: Newton's method for each increment, one step at a time.
//!
//! [`Newton::step`] takes the iterate one step further. When [`Newton::outcome`] is known the increment has been reached, or
//! given up; [`Newton::advance`] goes on to the next one, or to half of the one that failed. Between any two calls
//! [`Newton::snapshot`] has all that the rest depends on.

use std::mem::{replace, take};
use std::ops::ControlFlow::{self, Break, Continue};

use super::control::{Control, LONGEST, firm};
use super::damping::{self, Damped};
use super::forcing::Forcing;
use super::iterate::{self, Iterate};
use super::outcome::{Next, Outcome, StepRecord};
use super::path::{At, Attempt, Path};
use super::problem::{State, TornProblem};
use super::snapshot::{Begin, Reached, Snapshot};
use super::step::{Step, StepSolver};
use crate::feti::Torn;
use crate::model::history::{Conditions, Stage};
use crate::monitor::timing::Timer;
use crate::qp;

/// How often a step that does not lower the energy is tried again, more exactly each time.
const TRIALS: usize = 3;

/// A body is not held if so many steps in a row leave forces on subdomains out of balance. Factors are in double precision from the
/// second on: that is no rounding.
const UNHELD: usize = 10;

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

/// What became of the trial of a step.
enum Trial {
    Accepted(Step, Damped),
    /// To be tried again, more exactly.
    Refused(Step),
    Ended(Outcome),
}

/// Newton's method on its way through a history of loads.
pub struct Newton<'a> {
    pub(super) problem: TornProblem<'a>,
    pub(super) solver: StepSolver<'a>,
    settings: Settings,
    pub(super) path: Path,
    pub(super) attempt: Attempt,
    pub(super) iterate: Iterate,
    /// Whether the iterate is admissible: only then `J` may not grow.
    pub(super) admissible: bool,
    pub(super) forcing: Forcing,
    pub(super) outcome: Option<Outcome>,
    pub(super) reached: Option<Reached>,
    /// The displacement of an earlier run that the history goes on from.
    pub(super) origin: Option<Torn>,
    pub(super) steps: Vec<(usize, StepRecord)>,
    /// Steps of attempts before this one.
    pub(super) before: usize,
    /// What the loads follow, if not the path.
    pub(super) control: Option<Control>,
}

impl<'a> Newton<'a> {
    /// A history through these stages, at least one; `problem` comes with what is prescribed at the beginning. Loads `along` follow
    /// the work they do. Collective.
    pub fn new(
        mut problem: TornProblem<'a>,
        mut solver: StepSolver<'a>,
        settings: Settings,
        (stages, along): (Vec<Stage>, Option<Torn>),
        begin: Begin,
        timer: &Timer,
    ) -> Self {
        let friction = take(&mut problem.friction);
        let path = Path {
            begin: Conditions { loads: take(&mut problem.loads), rhs: take(&mut problem.rhs), friction },
            stages,
        };
        let rest = |problem: &TornProblem| (problem.gather.zeros(), vec![0.0; problem.gather.rows()]);
        let (mut attempt, mut forcing) = (Attempt::FIRST, Forcing::first(settings.accuracy));
        let (mut reached, mut origin, mut steps, mut before, mut stood, mut reach) =
            (None, None, Vec::new(), 0, None, None);
        let ((u, lambda), kept) = match begin {
            Begin::Rest => (rest(&problem), None),
            Begin::Near(start) => {
                (reach, origin) = (start.reach, start.is_origin.then(|| start.u.clone()));
                ((start.u, rest(&problem).1), Some(start.kept))
            }
            Begin::At(snapshot) => {
                (attempt, forcing) = (snapshot.attempt, snapshot.forcing);
                (reached, origin) = (snapshot.reached, snapshot.origin);
                (steps, before, stood, reach) =
                    (snapshot.steps, snapshot.before, Some(snapshot.solver), snapshot.reach);
                problem.committed = snapshot.committed;
                ((snapshot.u, snapshot.lambda), snapshot.kept)
            }
        };
        Conditions { loads: problem.loads, rhs: problem.rhs, friction: problem.friction } = path.conditions(attempt);
        let is_made = reach.is_some_and(|reach| reach.work.is_some());
        let control = along.map(|along| Control::new(&problem.loads, along, reach));
        if let Some(control) = &control {
            (problem.loads, problem.firm) = (control.loads(), firm(&problem.materials));
        }
        let (iterate, outcome) = iterate::first(&problem, &mut solver, (u, lambda), kept, stood, timer);
        // Where the work is chosen, displacements are made admissible.
        let admissible = before < steps.len() || is_made || problem.is_admissible(&iterate.u);
        Self {
            problem,
            solver,
            settings,
            path,
            attempt,
            iterate,
            admissible,
            forcing,
            outcome,
            reached,
            origin,
            steps,
            before,
            control,
        }
    }

    /// All that the rest depends on.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            attempt: self.attempt,
            committed: self.problem.committed.clone(),
            reached: self.reached.clone(),
            origin: self.origin.clone(),
            steps: self.steps.clone(),
            before: self.before,
            u: self.iterate.u.clone(),
            lambda: self.iterate.lambda.clone(),
            kept: None,
            forcing: self.forcing,
            solver: self.solver.state(),
            reach: self.control.as_ref().map(|control| control.reach),
        }
    }

    /// The problem of the present attempt.
    pub fn problem(&self) -> &TornProblem<'a> {
        &self.problem
    }

    /// The present iterate.
    pub fn iterate(&self) -> &Iterate {
        &self.iterate
    }

    /// Where the present attempt leads.
    pub fn at(&self) -> At {
        self.control.as_ref().map_or(self.path.at(self.attempt), Control::at)
    }

    /// How the iteration of the present attempt ended; `None` while it goes on.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// The last increment that was reached.
    pub fn reached(&self) -> Option<&Reached> {
        self.reached.as_ref()
    }

    /// All steps so far, those of failed attempts included, with the number of the increment.
    pub fn steps(&self) -> &[(usize, StepRecord)] {
        &self.steps
    }

    /// One step of the present attempt, whose outcome is not known yet. `None` if none could be taken, as
    /// [`Newton::outcome`] explains then. `alive` is told the number of the step and the applications of F so far. Collective.
    pub fn step(&mut self, timer: &Timer, alive: &dyn Fn(usize, usize)) -> Option<&StepRecord> {
        let began = timer.total_seconds();
        let mut refused = Vec::new();
        let (step, damped) = loop {
            match self.trial(&refused, timer, alive) {
                Trial::Accepted(step, damped) => break (step, damped),
                Trial::Refused(step) => refused.push(step),
                Trial::Ended(outcome) => {
                    self.end(outcome, timer);
                    return None;
                }
            }
        };
        let (solved, length, mut statistics) = (step.outcome, damped.length, step.statistics);
        refused.iter().for_each(|trial: &Step| statistics += trial.statistics);
        let change = || self.problem.relative_change(&self.iterate.u, &damped.u, &damped.state.terms);
        let criterion = timer.time("residuals", change);
        let left = self.move_to(&step, damped, timer);
        let record = StepRecord {
            number: self.steps.len() - self.before + 1,
            criterion,
            residual: self.iterate.residuals.largest(),
            damping: length,
            energy: self.iterate.state.energy,
            plastic_elements: self.iterate.state.plastic,
            active_contacts: self.problem.active_contacts(&self.iterate.lambda),
            statistics,
            local_residual: step.local_residual,
            applications: step.applications + refused.iter().map(|trial| trial.applications).sum::<usize>(),
            factorisations: step.factorisations + refused.iter().map(|trial| trial.factorisations).sum::<usize>(),
            seconds: timer.total_seconds() - began,
        };
        self.steps.push((self.at().number, record));
        match self.verdict((criterion, step.is_exact), solved, timer) {
            Some(outcome) => self.end(outcome, timer),
            None => {
                let Self { solver, problem, iterate, .. } = self;
                timer.time("internal forces", || solver.follow(problem, (&left.0, &left.1), &iterate.u, length));
            }
        }
        self.steps.last().map(|(_, record)| record)
    }

    /// Tries a step: solves the quadratic program of the tangents at the iterate, and looks for a length that lowers `J`.
    fn trial(&mut self, refused: &[Step], timer: &Timer, alive: &dyn Fn(usize, usize)) -> Trial {
        let step = match self.program(refused, timer, alive) {
            Continue(step) => step,
            Break(trial) => return trial,
        };
        let Self { problem, solver, iterate, forcing, control, .. } = self;
        // Inadmissible starts (prescribed displacements, overlaps) have no energy to compare with.
        let radii = problem.radii(&step.lambda);
        let longest = if control.is_some() { LONGEST } else { 1.0 };
        let from = (&iterate.u, &iterate.state);
        match damping::search(problem, from, (&step.du, &radii, longest), self.admissible, timer) {
            Ok(damped) => Trial::Accepted(step, damped),
            Err(_) if !iterate.state.energy.is_finite() => Trial::Ended(Outcome::NotFinite),
            // With friction energies depend on radii, which are as exact as the program. Near the solution residuals tell more.
            Err(full)
                if problem.has_friction()
                    && problem.residuals(&full.u, &full.state, &step.lambda).largest()
                        < iterate.residuals.largest() =>
            {
                Trial::Accepted(step, *full)
            }
            Err(_) if refused.len() >= TRIALS => Trial::Ended(Outcome::Stalled),
            Err(_) => {
                // Perhaps the program was solved too loosely for a descent direction.
                forcing.tighten();
                solver.sharpen();
                Trial::Refused(step)
            }
        }
    }

    /// The step by the quadratic program of a trial, with loads that follow their work; or how the trial ended with it.
    fn program(&mut self, refused: &[Step], timer: &Timer, alive: &dyn Fn(usize, usize)) -> ControlFlow<Trial, Step> {
        let Self { problem, solver, iterate, forcing, steps, control, .. } = self;
        let own = &steps[self.before..];
        // Where rounding spoiled the last step factors have to be in double precision.
        if own.last().is_some_and(|(_, step)| step.is_spoiled()) {
            solver.sharpen();
        }
        let goes_on = self.settings.accuracy.is_none();
        if problem.is_linear() && goes_on {
            forcing.drop = solver.linear_drop();
        }
        let number = own.len() + 1;
        let at = (&iterate.u, &iterate.state);
        let last = refused.last().map_or(&iterate.lambda, |trial| &trial.lambda);
        let alive = |applications: usize| alive(number, applications);
        let mut step = match solver.solve(problem, at, last, (*forcing, goes_on), timer, &alive) {
            Ok(step) => step,
            Err(message) => return Break(Trial::Ended(Outcome::Singular(message))),
        };
        // Perhaps the factors were not exact enough.
        if step.outcome != qp::Outcome::Converged && solver.sharpen() {
            return Break(Trial::Refused(step));
        }
        if let Err(outcome) = Outcome::of_program(step.outcome) {
            return Break(Trial::Ended(outcome));
        }
        let Some(control) = control else { return Continue(step) };
        let (from, drop) = ((&iterate.u, &mut iterate.state), forcing.drop);
        match control.steer(problem, solver, from, (&mut step, drop), timer) {
            Ok(true) => Continue(step),
            Ok(false) => Break(Trial::Refused(step)),
            Err(outcome) => Break(Trial::Ended(outcome)),
        }
    }

    /// Takes the step; returns the displacement that it left, and the problem there.
    fn move_to(&mut self, step: &Step, next: Damped, timer: &Timer) -> (Torn, State) {
        let Self { problem, iterate, .. } = self;
        let left = (replace(&mut iterate.u, next.u), replace(&mut iterate.state, next.state));
        iterate.lambda.clone_from(&step.lambda);
        self.admissible = true;
        let before = iterate.residuals.largest();
        let residuals = || problem.residuals(&iterate.u, &iterate.state, &iterate.lambda);
        iterate.residuals = timer.time("residuals", residuals);
        let way = (before, iterate.residuals.largest());
        self.forcing.update(way, self.settings.residual, (step.at_floor, step.local_residual));
        left
    }

    /// Whether the iteration ends with the step just taken, whose quadratic program ended like this, and whose model was exact or not.
    fn verdict(&mut self, (criterion, was_exact): (f64, bool), program: qp::Outcome, timer: &Timer) -> Option<Outcome> {
        let Self { problem, solver, settings, iterate, .. } = self;
        if !(criterion.is_finite() && iterate.state.energy.is_finite()) {
            return Some(Outcome::NotFinite);
        }
        let is_close = criterion < settings.tolerance || was_exact;
        if is_close && iterate.residuals.largest() <= settings.residual {
            return Some(Outcome::Converged);
        }
        if let Some(accuracy) = settings.accuracy {
            let errors = solver.errors(problem, (&iterate.u, &iterate.state), &iterate.lambda, Some(accuracy), timer);
            if errors.algebraic <= accuracy * errors.discretisation {
                (iterate.errors, iterate.ended_by_accuracy) = (Some(errors), true);
                return Some(Outcome::Converged);
            }
        }
        if program == qp::Outcome::LimitReached {
            return Some(Outcome::Inner(program));
        }
        let own = &self.steps[self.before..];
        let spoiled = own.iter().rev().take_while(|(_, step)| step.is_spoiled()).count();
        if spoiled >= UNHELD {
            return Some(Outcome::Unheld);
        }
        (own.len() >= settings.limit).then_some(Outcome::LimitReached)
    }

    /// Ends the iteration, and finds out how exact the iterate is.
    fn end(&mut self, outcome: Outcome, timer: &Timer) {
        let Self { problem, solver, iterate, .. } = self;
        let has_moved = self.steps.len() > self.before;
        if iterate.errors.is_none() && has_moved && iterate.state.energy.is_finite() {
            iterate.errors = Some(solver.errors(problem, (&iterate.u, &iterate.state), &iterate.lambda, None, timer));
        }
        if outcome == Outcome::Converged {
            self.iterate.energies = Some(timer.time("residuals", || self.energies()));
        }
        self.outcome = Some(outcome);
    }

    /// Goes on from the end of an iteration: commits what was reached and begins with the next increment, or begins with half
    /// of what failed. Collective.
    ///
    /// # Panics
    /// If the iteration has not ended.
    pub fn advance(&mut self, timer: &Timer) -> Next {
        let outcome = self.outcome.clone().expect("the iteration has ended");
        let (attempt, next) = if outcome == Outcome::Converged {
            self.problem.commit(&self.iterate);
            self.reached = Some(Reached { u: self.iterate.u.clone(), lambda: self.iterate.lambda.clone() });
            let Some(attempt) = self.path.next(self.attempt) else { return Next::End };
            (attempt, Next::Increment)
        } else {
            let Some(attempt) = self.path.halved(self.attempt) else { return Next::End };
            self.solver.forget();
            (attempt, Next::Half(self.at(), outcome))
        };
        self.enter(attempt, timer);
        next
    }

    /// Begins with an attempt, near the last increment that was reached.
    fn enter(&mut self, attempt: Attempt, timer: &Timer) {
        let Self { problem, solver, path, .. } = self;
        Conditions { loads: problem.loads, rhs: problem.rhs, friction: problem.friction } = path.conditions(attempt);
        let lambda = vec![0.0; problem.gather.rows()];
        let (u, kept) = match &self.reached {
            Some(reached) => (reached.u.clone(), Some(problem.laws().kept(&reached.lambda, 0.0))),
            None => (problem.gather.zeros(), None),
        };
        let first = iterate::first(problem, solver, (u, lambda), kept, None, timer);
        let admissible = problem.is_admissible(&first.0.u);
        self.attempt = attempt;
        self.start_at(first, admissible);
    }

    /// Starts the iteration at its first iterate, which may have come to an end; no step so far belongs to it.
    pub(super) fn start_at(&mut self, (iterate, outcome): (Iterate, Option<Outcome>), admissible: bool) {
        (self.iterate, self.outcome, self.admissible) = (iterate, outcome, admissible);
        (self.forcing, self.before) = (Forcing::first(self.settings.accuracy), self.steps.len());
    }

    /// The problem, with all that is committed, and the displacement at the end of the last increment that was reached; that of
    /// the iterate if there is none.
    pub fn finish(self) -> (TornProblem<'a>, Torn) {
        (self.problem, self.reached.map_or(self.iterate.u, |reached| reached.u))
    }
}
