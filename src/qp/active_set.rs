//! Active set of bounds around PCPG: min 1/2 x'A x - x'd over { x_i >= 0 for bounded i, |x_T| <= r for discs T, G x = e }.
//!
//! The fast path of contact: guess the rows that carry a force, solve the equality problem on them, correct the guess
//! (the primal-dual active set strategy, Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002), applied to the dual).
//! Kept rows with x_i < 0 are let go; other rows with a violated gap, (d - A x - G'a)_i > 0, are taken in.
//!
//! The equality problems are solved loosely. Each time the residual has dropped by a factor the set is checked, and PCPG
//! goes on with its directions if the set stands. How loosely depends on how the sets go (`exactness`). Where the tolerance is not the
//! caller's last, it can do with a set on which few rows are still wrong; the last correction is made, and not solved for. Before that
//! very few wrong bounds wait: their correction would cost the directions.
//!
//! Discs ([`super::slides`]) are corrected along with the bounds. Where none of them changes its set, radii and directions of slips
//! follow once they are further off than the residual. Then the caller's `A` includes the springs across slips. Where radii grow with
//! bounded unknowns a solution is a fixed point, and minimises the function over the discs that it has itself.
//!
//! No proof of convergence goes with it: sets that come back end as [`Outcome::Cycled`], and the caller turns to
//! [`super::smalse`]. Unlike there x is not homogenised: bounds are zero and the equalities have a right-hand side,
//! both the caller's affair, since the projector changes with the set.

mod exactness;

use std::ops::ControlFlow;

use self::exactness::{Exactness, LEAST, LOOSE};
use super::inside::Inside;
use super::pcpg::{Directions, Pcpg};
use super::quadratic::{Quadratic, Space};
use super::slides::Slides;
use super::{Limits, Outcome, Statistics};
use crate::vector::axpy;

/// Sets that are tried at most.
const SETS: usize = 60;
/// How often directions and radii of discs are followed at most.
const FOLLOWS: usize = 100;
/// The gap of one row may be violated by so much of the tolerance, which is for the norm of all rows.
const OF_ONE: f64 = 0.1;
/// What slides by less than this share of the residual may slide the other way.
const DOUBT: f64 = 0.2;
/// Of the rows that may be on the wrong set in the end this share waits there before it is corrected.
const WAITING: f64 = 0.03;
/// A move of x smaller than this, relative to x, is rounding.
const ROUNDING: f64 = 1e-13;

/// The problem on the rows of a set. All answers must be the same on all ranks.
pub trait Face: Quadratic {
    /// From now on x, P and M are restricted to the kept rows, in discs to what slides leave free; elsewhere x is what they fix, or
    /// zero. Adds rows if G x = e has no solution on the kept ones (a body that nothing holds). False if it has none then.
    fn restrict(&mut self, kept: &mut [bool], slides: &Slides) -> bool;

    /// Moves x, which is what it has to be off the kept rows, to the nearest point with G x = e.
    fn restore(&mut self, x: &mut [f64]);

    /// Replaces `residual` = d - A x by residual - G'a, with an a that makes this vanish on the kept rows if x is the solution there.
    /// Positive entries are violated gaps.
    fn gaps(&mut self, residual: &mut [f64]);
}

/// What was found.
pub struct Solution {
    /// The unknowns. If converged they are zero off the kept rows and not negative where bounded, but for the rows that are astray.
    pub x: Vec<f64>,
    /// `d - A x`.
    pub residual: Vec<f64>,
    /// Rows where x need not be zero.
    pub kept: Vec<bool>,
    /// What is known of discs.
    pub slides: Slides,
    /// How it ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
    /// Norm of the projected residual at the start, on the first set.
    pub first_norm: f64,
    /// Directions on the last set.
    pub directions: Directions,
}

/// Where to start, with a guess of the set.
pub struct Guess {
    /// The unknowns.
    pub x: Vec<f64>,
    /// `d - A x`.
    pub residual: Vec<f64>,
    /// The first set, to which the face is restricted already; true for all rows without a bound.
    pub kept: Vec<bool>,
    /// The discs with a guess of what they do, to which the face is restricted already.
    pub slides: Slides,
    /// Whether rows with a bound or in discs are of unequal length, as where some are stiff and some soft.
    pub uneven: bool,
    /// Where the tolerance is that of `drop`: the share of bounds that may be on the wrong set in the end.
    pub astray: f64,
    /// Directions on the first set.
    pub directions: Directions,
}

/// Solves the problem. Give `limits` a reference at a warm start: the default is the first residual, which is too small
/// there.
pub fn solve(space: &dyn Space, face: &mut dyn Face, bounded: &[bool], start: Guess, limits: &Limits) -> Solution {
    let Guess { x, residual, kept, slides, uneven, astray, directions } = start;
    let n = x.len();
    let mut run = Run {
        space,
        bounded,
        uneven,
        few: 0.0,
        waiting: 0.0,
        follows: 0,
        x: x.clone(),
        residual,
        kept,
        slides,
        work: vec![0.0; n],
        image: vec![0.0; n],
        statistics: Statistics::default(),
        first_norm: f64::NAN,
    };
    let mut solver = Pcpg::with(space, directions);
    if astray > 0.0 {
        let bounds: Vec<f64> = bounded.iter().map(|&b| f64::from(b)).collect();
        run.few = astray * space.dot(&bounds, &bounds);
    }
    run.slides.add_compliance(-1.0, &x, &mut run.residual);
    let outcome = run.iterate(face, &mut solver, x, limits);
    run.slides.add_compliance(1.0, &run.x, &mut run.residual);
    let directions = solver.into_directions();
    let Run { x, residual, kept, slides, statistics, first_norm, .. } = run;
    Solution { x, residual, kept, slides, outcome, statistics, first_norm, directions }
}

struct Run<'a> {
    space: &'a dyn Space,
    bounded: &'a [bool],
    uneven: bool,
    /// So many bounds and discs may be on the wrong set where the tolerance is not the last.
    few: f64,
    /// So many bounds wait for their correction above the tolerance.
    waiting: f64,
    /// How often directions and radii of discs have been followed.
    follows: usize,
    x: Vec<f64>,
    residual: Vec<f64>,
    kept: Vec<bool>,
    slides: Slides,
    work: Vec<f64>,
    image: Vec<f64>,
    statistics: Statistics,
    first_norm: f64,
}

impl Run<'_> {
    /// Alternates between solving and correcting the set. x starts on each set as near to `wish` as the set allows.
    fn iterate(&mut self, face: &mut dyn Face, solver: &mut Pcpg, mut wish: Vec<f64>, limits: &Limits) -> Outcome {
        let (mut target, mut floor) = (None, 0.0);
        let mut exactness = Exactness::new(self.names(), if self.uneven { LEAST } else { LOOSE });
        while exactness.history.len() <= SETS && self.follows < FOLLOWS {
            self.move_to(face, &mut wish);
            self.statistics.sets += 1;
            let goal = *target.get_or_insert_with(|| {
                let inside = Inside::of(self.space, face, &self.residual);
                self.first_norm = inside.norm();
                floor = Limits { drop: 0.0, ..*limits }.target(self.first_norm).max(inside.noise);
                limits.target(self.first_norm).max(inside.noise)
            });
            self.waiting = if goal > floor { WAITING * self.few } else { 0.0 };
            let relative = exactness.take_relative();
            let of_set = Limits { relative, reference: None, absolute: goal, rounding: 0.0, drop: 0.0, ..*limits };
            let change = match self.solve_on_set(face, solver, &mut wish, exactness.turns_for_ever(), &of_set) {
                ControlFlow::Continue(change) => change,
                ControlFlow::Break(outcome) => return outcome,
            };
            solver.forget();
            let complete = face.restrict(&mut self.kept, &self.slides);
            self.slides.adopt(&self.kept);
            self.slides.add_compliance(-1.0, &self.x, &mut self.residual);
            if !complete {
                return Outcome::Cycled;
            }
            if change.norm <= goal && goal > floor && change.rows <= self.few {
                return Outcome::Converged;
            }
            wish.copy_from_slice(&self.x);
            self.slides.align(&mut wish);
            if change.rows == 0.0 {
                exactness.note_springs(change.springs);
                self.follows += 1;
                continue;
            }
            exactness.note(change.rows);
            if exactness.is_stuck() {
                return Outcome::Cycled;
            }
            if self.seen(&exactness.history) {
                if exactness.loose == 0.0 && goal <= floor {
                    return Outcome::Cycled;
                }
                exactness.tighten();
                target = Some(floor.max(exactness::TIGHTER * goal));
            }
            exactness.history.push(self.names());
        }
        Outcome::Cycled
    }

    /// Solves on the present set until it is corrected, or to an end. Discs fix their unknowns elsewhere on the way. Where slips turn
    /// `for_ever` nothing turns once more. `limits` count the products of all sets.
    fn solve_on_set(
        &mut self,
        face: &mut dyn Face,
        solver: &mut Pcpg,
        wish: &mut [f64],
        for_ever: bool,
        limits: &Limits,
    ) -> ControlFlow<Outcome, Change> {
        loop {
            let limits = Limits { products: limits.products.saturating_sub(self.statistics.hessian), ..*limits };
            let report = solver.solve(face, &mut self.x, &mut self.residual, &limits);
            self.statistics += report.statistics;
            if report.outcome != Outcome::Converged {
                return ControlFlow::Break(report.outcome);
            }
            let goal = limits.absolute.max(report.noise);
            match self.correct(face, goal, report.norm, for_ever) {
                Correction::None if report.norm <= goal => return ControlFlow::Break(Outcome::Converged),
                Correction::None => {}
                Correction::Shift if self.follows < FOLLOWS => {
                    self.follows += 1;
                    self.statistics.sets += 1;
                    wish.copy_from_slice(&self.x);
                    self.move_to(face, wish);
                    solver.descend(&mut self.x, &mut self.residual);
                }
                Correction::Shift => return ControlFlow::Break(Outcome::Cycled),
                Correction::Set(change) => return ControlFlow::Continue(change),
            }
        }
    }

    /// Moves x as near to `wish` as the set allows. Costs one product, none if x is there already.
    fn move_to(&mut self, face: &mut dyn Face, wish: &mut [f64]) {
        for (w, kept) in wish.iter_mut().zip(&self.kept) {
            *w *= f64::from(*kept);
        }
        self.slides.fix(wish);
        face.restore(wish);
        for ((move_, w), x) in self.work.iter_mut().zip(&*wish).zip(&self.x) {
            *move_ = w - x;
        }
        let d = self.space.dots(&[(&self.work, &self.work), (wish, wish)]);
        if d[0] <= ROUNDING * ROUNDING * d[1] {
            return;
        }
        face.apply(&self.work, &mut self.image);
        self.statistics.hessian += 1;
        axpy(-1.0, &self.image, &mut self.residual);
        self.x.copy_from_slice(wish);
    }

    /// Lets rows of negative force go and takes rows of violated gap in, and corrects discs. Very few rows, and no disc besides, wait until
    /// the `goal` of all rows is met. A part of it, a tolerance of gaps, keeps rows that have neither force nor gap from coming and going;
    /// what slides against its friction does not either, up to what is in doubt, which is nothing where slips turn `for_ever`. Where the set
    /// is another one `residual` is without springs afterwards.
    fn correct(&mut self, face: &mut dyn Face, goal: f64, norm: f64, for_ever: bool) -> Correction {
        let tolerance = OF_ONE * goal;
        let doubt = if for_ever { 0.0 } else { tolerance.max(DOUBT * norm) };
        self.work.copy_from_slice(&self.residual);
        face.gaps(&mut self.work);
        let mut moved = Vec::new();
        if !self.slides.is_empty() {
            moved.clone_from(&self.work);
            self.slides.add_compliance(1.0, &self.x, &mut moved);
        }
        for i in 0..self.x.len() {
            let wanted = if self.kept[i] { self.x[i] >= 0.0 } else { self.work[i] > tolerance };
            self.work[i] = f64::from(self.bounded[i] && wanted != self.kept[i]);
        }
        let next = self.slides.next(&self.x, &moved, [tolerance, doubt]);
        let [mut turned, mut fixed, mut hung] = [(); 3].map(|()| vec![0.0; self.x.len()]);
        self.slides.compare(&next, &self.x, [&mut turned, &mut fixed, &mut hung]);
        let d = self.space.dots(&[&self.work, &turned, &fixed, &hung].map(|v| (&**v, &**v)));
        let (bounds, discs, fixed, springs, enough) = (d[0], d[1], d[2].sqrt(), d[3].sqrt(), norm.max(goal));
        let may_wait = norm > goal && bounds <= self.waiting && discs == 0.0;
        if springs > enough || bounds + discs > 0.0 && !may_wait {
            self.kept.iter_mut().zip(&self.work).for_each(|(kept, changes)| *kept ^= *changes != 0.0);
            self.slides.add_compliance(1.0, &self.x, &mut self.residual);
            self.slides.take(next);
            self.slides.mark(&mut self.kept);
            return Correction::Set(Change { rows: bounds + discs, springs, norm });
        }
        if fixed > enough {
            self.slides.shift(&next);
            return Correction::Shift;
        }
        Correction::None
    }

    /// What tells the present set from others.
    fn names(&self) -> Vec<bool> {
        self.kept.iter().copied().chain(self.slides.names()).collect()
    }

    /// Whether the present set has been there before, on all ranks.
    fn seen(&self, history: &[Vec<bool>]) -> bool {
        let names = self.names();
        history.iter().any(|old| self.space.minimum(f64::from(*old == names)) == 1.0)
    }
}

/// What a correction did, on all ranks.
enum Correction {
    /// Nothing: the set stands.
    None,
    /// Discs fix their unknowns elsewhere; matrix and set stay as they are.
    Shift,
    /// The set is another one, or springs are.
    Set(Change),
}

/// How a set became another one, on all ranks.
struct Change {
    /// How many bounds and discs changed theirs; zero if springs alone are others.
    rows: f64,
    /// What springs across slips moved the residual by.
    springs: f64,
    /// Norm of the projected residual before.
    norm: f64,
}

#[cfg(test)]
mod tests;
