//! A history of loads: increment after increment, each from the state that the one before committed.
//!
//! Loads and right-hand sides go in straight lines from stage to stage. An increment whose Newton iteration fails is halved
//! and tried again from the last committed state, and so are its parts up to a number of halvings. Each part begins and
//! ends at the corners of its halving, so an increment that is reached is reached exactly.

use super::problem::TornProblem;
use super::{Outcome, Settings, Solution, Start, StepRecord, StepSolver, Watch, solve};
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
    /// Equal increments that lead there.
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Part {
    done: u64,
    level: u32,
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

/// Goes through the stages, first from `start` or from rest, until an increment cannot be reached. Collective.
///
/// `problem` is given with what is prescribed at the beginning, and left with what is at the last attempt.
///
/// # Panics
/// If there is no increment.
pub fn follow(
    problem: &mut TornProblem,
    solver: &mut StepSolver,
    settings: &Settings,
    mut start: Option<Start>,
    stages: Vec<Stage>,
    watch: &Watch,
    tell: &mut dyn FnMut(&TornProblem, Progress),
) -> Followed {
    let mut steps = Vec::new();
    let mut from = Conditions { loads: std::mem::take(&mut problem.loads), rhs: std::mem::take(&mut problem.rhs) };
    let (mut last, mut committed, mut number): (Option<Solution>, bool, usize) = (None, false, 0);
    for (stage, Stage { end, increments, halvings }) in stages.into_iter().enumerate() {
        for increment in 1..=increments {
            number += 1;
            let (mut part, mut halved) = (Some(Part::default()), 0);
            while let Some(tried) = part {
                if let Some(solution) = last.as_ref().filter(|_| !std::mem::replace(&mut committed, true)) {
                    problem.commit(&solution.u, &solution.lambda);
                }
                let begin = last.as_ref().map(|solution| beginning(problem, solution)).or_else(|| start.take());
                let fraction = (increment as f64 - 1.0 + tried.end()) / increments as f64;
                let at = At { stage, increment, number, fraction, halvings: halved };
                Conditions { loads: problem.loads, rhs: problem.rhs } = from.towards(&end, fraction);
                tell(problem, Progress::Attempt(at));
                let mut solution = solve(problem, solver, settings, begin, watch);
                steps.extend(std::mem::take(&mut solution.steps).into_iter().map(|step| (number, step)));
                if solution.outcome == Outcome::Converged {
                    tell(problem, Progress::Solution(at, &solution));
                    (last, committed) = (Some(solution), false);
                    part = tried.next();
                } else if let Some(half) = tried.halved(halvings) {
                    tell(problem, Progress::Halved(at, &solution.outcome));
                    solver.forget();
                    (part, halved) = (Some(half), halved + 1);
                } else {
                    let failure = Some((at, solution.outcome.clone()));
                    if last.is_none() {
                        tell(problem, Progress::Solution(at, &solution));
                    }
                    return Followed { solution: last.unwrap_or(solution), steps, failure };
                }
            }
        }
        from = end;
    }
    Followed { solution: last.expect("a history has an increment"), steps, failure: None }
}

/// The start that a committed solution is for the next increment.
fn beginning(problem: &TornProblem, solution: &Solution) -> Start {
    let rows = problem.constraints.rows.iter().zip(&solution.lambda);
    let held = rows.map(|(row, &lambda)| !row.is_inequality() || lambda > 0.0).collect();
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
