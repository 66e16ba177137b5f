//! A history of loads: increment after increment, each from the state that the one before committed.
//!
//! Loads and right-hand sides go in straight lines from stage to stage. An increment whose Newton iteration fails is halved
//! and tried again from the last committed state, and so are its parts up to a number of halvings. Each part begins and
//! ends at the corners of its halving, so an increment that is reached is reached exactly.

use super::committed::Committed;
use super::problem::TornProblem;
use super::{Begin, Outcome, Settings, Solution, Standing, Start, StepRecord, StepSolver, Watch, solve};
use serde::{Deserialize, Serialize};

use crate::feti::Torn;

/// What is prescribed at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// `f`: nodal forces.
    pub loads: Torn,
    /// `c`: right-hand sides of the rows.
    pub rhs: Vec<f64>,
}

/// A straight part of the history.
pub struct Stage {
    /// What is prescribed at its end.
    pub end: Conditions,
    /// Equal increments that lead there, at least one.
    pub increments: usize,
    /// How often an increment may be halved.
    pub halvings: u32,
}

/// What happens on the way.
pub enum Progress<'a> {
    /// An increment, or a part of one, is tried.
    Attempt(At),
    /// It failed, and half of it is tried next.
    Halved(At, &'a Outcome),
    /// It converged, or nothing ever did and this is the first attempt. Not committed yet.
    Solution(At, &'a Solution),
}

/// Where in the history an attempt leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Stage, from 0.
    pub stage: usize,
    /// Increment in it, from 1.
    pub increment: usize,
    /// Increment since the beginning, from 1.
    pub number: usize,
    /// How much of the stage is done then, in (0, 1].
    pub fraction: f64,
    /// How often parts of this increment were halved before.
    pub halvings: usize,
}

impl At {
    /// The number of stages done, the fraction of the present one included.
    pub fn time(self) -> f64 {
        self.stage as f64 + self.fraction
    }
}

/// What the whole history took, and where it ended.
pub struct Followed {
    /// The last solution that converged; the last attempt where none did.
    pub solution: Solution,
    /// All Newton steps, those of failed attempts included, with the number of the increment.
    pub steps: Vec<(usize, StepRecord)>,
    /// Where and how the history was given up.
    pub failure: Option<(At, Outcome)>,
}

impl Conditions {
    /// A fraction of the way from here to `end`; exactly `end` at 1.
    fn towards(&self, end: &Self, fraction: f64) -> Self {
        if fraction == 1.0 {
            return end.clone();
        }
        let between = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + fraction * (b - a)).collect();
        Self {
            loads: self.loads.iter().zip(&end.loads).map(|(a, b)| between(a, b)).collect(),
            rhs: between(&self.rhs, &end.rhs),
        }
    }
}

/// A part of an increment, of size `2^-level`, after `done` parts of that size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Part {
    done: u64,
    level: u32,
}

/// An attempt: which stage, which increment of it, which part of that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// From 0.
    pub stage: usize,
    /// From 1.
    pub increment: usize,
    /// The part of the increment.
    pub part: Part,
    /// How often parts of the increment were halved before.
    pub halvings: usize,
}

impl Attempt {
    fn at(self, stages: &[Stage]) -> At {
        let Self { stage, increment, part, halvings } = self;
        let number = stages[..stage].iter().map(|stage| stage.increments).sum::<usize>() + increment;
        let fraction = (increment as f64 - 1.0 + part.end()) / stages[stage].increments as f64;
        At { stage, increment, number, fraction, halvings }
    }

    /// What follows on a success; `None` at the end of the history.
    fn next(self, stages: &[Stage]) -> Option<Self> {
        if let Some(part) = self.part.next() {
            return Some(Self { part, ..self });
        }
        let whole = Self { part: Part::default(), halvings: 0, ..self };
        if self.increment < stages[self.stage].increments {
            return Some(Self { increment: self.increment + 1, ..whole });
        }
        let stage = self.stage + 1;
        (stage < stages.len()).then_some(Self { stage, increment: 1, ..whole })
    }
}

/// Where a history stands between two Newton steps: all that the rest of it depends on.
pub struct Halt {
    /// The attempt it is in.
    pub attempt: Attempt,
    /// What is committed.
    pub committed: Committed,
    /// The last solution, which is committed.
    pub last: Option<Solution>,
    /// Newton steps of the attempts before, with the number of the increment.
    pub steps: Vec<(usize, StepRecord)>,
    /// Where the attempt stands.
    pub standing: Standing,
}

/// How a history begins.
pub enum Entry {
    /// From rest.
    Rest,
    /// Near the solution of the first increment.
    Near(Start),
    /// Where another one stood, whose conditions it shares.
    At(Box<Halt>),
}

/// Who follows a history.
pub struct Observer<'a> {
    /// Told what happens on the way.
    pub tell: &'a mut dyn FnMut(&TornProblem, Progress),
    /// Asked between two Newton steps whether to stop there, and handed what it takes to go on. Collective.
    pub pause: &'a dyn Fn(&dyn Fn() -> Halt) -> bool,
}

impl Part {
    /// Where it ends, as a fraction of the increment.
    fn end(self) -> f64 {
        (self.done + 1) as f64 / (1_u64 << self.level) as f64
    }

    /// The next part, as large as fits; `None` at the end of the increment.
    fn next(mut self) -> Option<Self> {
        self.done += 1;
        while self.level > 0 && self.done.is_multiple_of(2) {
            self = Self { done: self.done / 2, level: self.level - 1 };
        }
        (self.level > 0).then_some(self)
    }

    /// Its first half, if the limit allows.
    fn halved(self, limit: u32) -> Option<Self> {
        (self.level < limit).then_some(Self { done: 2 * self.done, level: self.level + 1 })
    }
}

/// Goes through the stages until an increment cannot be reached, or it is stopped. Collective.
///
/// `problem` is given with what is prescribed at the beginning, and left with what is at the last attempt.
///
/// # Panics
/// If there is no stage.
pub fn follow(
    problem: &mut TornProblem,
    solver: &mut StepSolver,
    settings: &Settings,
    entry: Entry,
    stages: &[Stage],
    watch: &Watch,
    Observer { tell, pause }: Observer,
) -> Followed {
    let (mut last, mut committed, mut steps): (Option<Solution>, bool, _) = (None, true, Vec::new());
    let mut attempt = Attempt { stage: 0, increment: 1, part: Part::default(), halvings: 0 };
    let mut begin = match entry {
        Entry::Rest => Some(Begin::Rest),
        Entry::Near(start) => Some(Begin::Near(start)),
        Entry::At(halt) => {
            (attempt, problem.committed, last, steps) = (halt.attempt, halt.committed, halt.last, halt.steps);
            Some(Begin::At(Box::new(halt.standing)))
        }
    };
    let start = Conditions { loads: std::mem::take(&mut problem.loads), rhs: std::mem::take(&mut problem.rhs) };
    loop {
        if let Some(solution) = last.as_ref().filter(|_| !std::mem::replace(&mut committed, true)) {
            problem.commit(&solution.u, &solution.lambda);
        }
        let near = |solution: &Solution| Begin::Near(beginning(problem, solution));
        let begin = begin.take().or_else(|| last.as_ref().map(near)).unwrap_or(Begin::Rest);
        let at = attempt.at(stages);
        let stage = &stages[attempt.stage];
        let from = attempt.stage.checked_sub(1).map_or(&start, |before| &stages[before].end);
        Conditions { loads: problem.loads, rhs: problem.rhs } = from.towards(&stage.end, at.fraction);
        tell(problem, Progress::Attempt(at));
        let halt = |standing: &dyn Fn() -> Standing| {
            pause(&|| {
                let (committed, last, steps) = (problem.committed.clone(), last.clone(), steps.clone());
                Halt { attempt, committed, last, steps, standing: standing() }
            })
        };
        let mut solution = solve(problem, solver, settings, begin, watch, &halt);
        steps.extend(std::mem::take(&mut solution.steps).into_iter().map(|step| (at.number, step)));
        if solution.outcome == Outcome::Converged {
            tell(problem, Progress::Solution(at, &solution));
            (last, committed) = (Some(solution), false);
            match attempt.next(stages) {
                Some(next) => attempt = next,
                None => break,
            }
        } else if solution.outcome != Outcome::Stopped
            && let Some(half) = attempt.part.halved(stage.halvings)
        {
            tell(problem, Progress::Halved(at, &solution.outcome));
            solver.forget();
            (attempt.part, attempt.halvings) = (half, attempt.halvings + 1);
        } else {
            let failure = Some((at, solution.outcome.clone()));
            if last.is_none() && solution.outcome != Outcome::Stopped {
                tell(problem, Progress::Solution(at, &solution));
            }
            return Followed { solution: last.unwrap_or(solution), steps, failure };
        }
    }
    Followed { solution: last.expect("a history has an increment"), steps, failure: None }
}

/// The start that a committed solution is for the next increment.
fn beginning(problem: &TornProblem, solution: &Solution) -> Start {
    let held = problem.constraints.laws().kept(&solution.lambda, 0.0);
    Start { u: solution.u.clone(), held }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_an_increment_once_and_grow_again() {
        let mut ends = Vec::new();
        let mut parts = Part::default().halved(3).and_then(|p| p.halved(3)).expect("two halvings are allowed");
        loop {
            ends.push(parts.end());
            match parts.next() {
                // The third part is halved once.
                Some(next) if next == (Part { done: 1, level: 1 }) && ends.len() == 2 => {
                    parts = next.halved(3).expect("one more halving");
                }
                Some(next) => parts = next,
                None => break,
            }
        }
        assert_eq!(ends, [0.25, 0.5, 0.75, 1.0]);
        let alone = Part::default();
        assert_eq!((alone.end(), alone.next(), alone.halved(0)), (1.0, None, None));
        let half = alone.halved(1).expect("one halving is allowed");
        assert_eq!((half.end(), half.next(), half.halved(1)), (0.5, Some(Part { done: 1, level: 1 }), None));
        assert_eq!(half.next().and_then(Part::next), None);
    }

    #[test]
    fn conditions_move_in_straight_lines_and_arrive_exactly() {
        let at = |x: f64| Conditions { loads: vec![vec![x, 0.1], vec![3.0 * x]], rhs: vec![-x] };
        let end = at(0.3);
        assert_eq!(at(0.1).towards(&end, 1.0), end);
        let middle = at(0.1).towards(&end, 0.5);
        assert!((middle.loads[0][0] - 0.2).abs() < 1e-16 && middle.loads[0][1] == 0.1);
        assert!((middle.loads[1][0] - 0.6).abs() < 1e-16 && (middle.rhs[0] + 0.2).abs() < 1e-16);
    }
}
