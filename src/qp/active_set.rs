//! Active set of bounds around PCPG: min 1/2 x'A x - x'd over { x_i >= 0 for bounded i, G x = e }.
//!
//! The fast path of contact: guess the rows that carry a force, solve the equality problem on them, correct the guess
//! (the primal-dual active set strategy, Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002), applied to the dual).
//! Kept rows with x_i < 0 are let go; other rows with a violated gap, (d - A x - G'a)_i > 0, are taken in.
//!
//! The equality problems are solved loosely. Each time the residual has dropped by a factor the set is checked, and PCPG
//! goes on with its directions if the set stands. This can be too loose. Where stiffness jumps, the norm of the residual is
//! that of the soft parts; the forces and gaps of stiff rows may still be wrong, and the sets may wander. So the equality
//! problems are solved to the tolerance where stiffness jumps, more exactly after a correction that is much larger than an earlier one,
//! and more exactly for good each time that a set comes back, to the tolerance in the end.
//!
//! No proof of convergence goes with it: sets that come back end as [`Outcome::Cycled`], and the caller turns to
//! [`super::smalse`]. Unlike there x is not homogenised: bounds are zero and the equalities have a right-hand side,
//! both the caller's affair, since the projector changes with the set.

use super::pcpg::{Directions, Pcpg};
use super::quadratic::{Quadratic, Space};
use super::{Limits, Outcome, Statistics, axpy};

/// Factor by which the residual drops between two looks at the set.
const LOOSE: f64 = 0.1;
/// What it is multiplied by for a set after a large correction, and for good each time that a set comes back, ...
const TIGHTER: f64 = 0.1;
/// ... and the last before the tolerance.
const LEAST: f64 = 1e-3;
/// A correction that changes this many times more rows than the smallest so far: sets are corrected too early.
const GROWTH: f64 = 2.0;
/// Sets that are tried at most.
const SETS: usize = 60;
/// A move of x smaller than this, relative to x, is rounding.
const ROUNDING: f64 = 1e-13;

/// The problem on the rows of a set. All answers must be the same on all ranks.
pub trait Face: Quadratic {
    /// From now on x, P and M are restricted to the kept rows; x is zero elsewhere. Adds rows if G x = e has no solution on
    /// the kept ones (a body that nothing holds). False if it has none then.
    fn restrict(&mut self, kept: &mut [bool]) -> bool;

    /// Moves x to the nearest point of { G x = e, x = 0 off the kept rows }.
    fn restore(&mut self, x: &mut [f64]);

    /// Replaces `residual` = d - A x by residual - G'a, with an a that makes this vanish on the kept rows if x is the solution there.
    /// Positive entries are violated gaps.
    fn gaps(&mut self, residual: &mut [f64]);
}

/// What was found.
pub struct Solution {
    /// The unknowns, zero off the kept rows; not negative where bounded if converged.
    pub x: Vec<f64>,
    /// `d - A x`.
    pub residual: Vec<f64>,
    /// Rows where x need not be zero.
    pub kept: Vec<bool>,
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
    /// Whether rows are of unequal length, as where stiffness jumps.
    pub uneven: bool,
    /// Directions on the first set.
    pub directions: Directions,
}

/// Solves the problem. Give `limits` a reference at a warm start: the default is the first residual, which is too small
/// there.
pub fn solve(space: &dyn Space, face: &mut dyn Face, bounded: &[bool], start: Guess, limits: &Limits) -> Solution {
    let Guess { x, residual, kept, uneven, directions } = start;
    let n = x.len();
    let mut run = Run {
        space,
        bounded,
        uneven,
        x: x.clone(),
        residual,
        kept,
        work: vec![0.0; n],
        image: vec![0.0; n],
        statistics: Statistics::default(),
        first_norm: f64::NAN,
    };
    let mut solver = Pcpg::with(space, directions);
    let outcome = run.iterate(face, &mut solver, x, limits);
    let directions = solver.into_directions();
    let Run { x, residual, kept, statistics, first_norm, .. } = run;
    Solution { x, residual, kept, outcome, statistics, first_norm, directions }
}

struct Run<'a> {
    space: &'a dyn Space,
    bounded: &'a [bool],
    uneven: bool,
    x: Vec<f64>,
    residual: Vec<f64>,
    kept: Vec<bool>,
    work: Vec<f64>,
    image: Vec<f64>,
    statistics: Statistics,
    first_norm: f64,
}

impl Run<'_> {
    /// Alternates between solving and correcting the set. x starts on each set as near to `wish` as the set allows.
    fn iterate(&mut self, face: &mut dyn Face, solver: &mut Pcpg, mut wish: Vec<f64>, limits: &Limits) -> Outcome {
        let mut target = None;
        // The sets so far, and how far the residual of each drops before it is corrected.
        let (mut history, mut loose) = (Vec::new(), if self.uneven { 0.0 } else { LOOSE });
        let (mut smallest, mut wanders) = (f64::INFINITY, false);
        while history.len() < SETS {
            history.push(self.kept.clone());
            self.move_to(face, &mut wish);
            self.statistics.sets += 1;
            if target.is_none() {
                self.first_norm = self.projected_norm(face);
            }
            let target = *target.get_or_insert(limits.target(self.first_norm));
            let wary = std::mem::replace(&mut wanders, false);
            let relative = if wary { loose * TIGHTER } else { loose };
            let changes = loop {
                let products = limits.products.saturating_sub(self.statistics.hessian);
                let limits = Limits { relative, reference: None, absolute: target, drop: 0.0, products };
                let report = solver.solve(face, &mut self.x, &mut self.residual, &limits);
                self.statistics += report.statistics;
                if report.outcome != Outcome::Converged {
                    return report.outcome;
                }
                let changes = self.correct(face, target);
                if changes > 0.0 {
                    break changes;
                }
                if report.norm <= target {
                    return Outcome::Converged;
                }
            };
            solver.forget();
            if !face.restrict(&mut self.kept) {
                return Outcome::Cycled;
            }
            wanders = changes > GROWTH * smallest;
            smallest = smallest.min(changes);
            if self.seen(&history) {
                if loose == 0.0 {
                    return Outcome::Cycled;
                }
                loose = if loose > LEAST { loose * TIGHTER } else { 0.0 };
                history.clear();
            }
            wish.copy_from_slice(&self.x);
        }
        Outcome::Cycled
    }

    /// Moves x as near to `wish` as the set allows. Costs one product, none if x is there already.
    fn move_to(&mut self, face: &mut dyn Face, wish: &mut [f64]) {
        for (w, kept) in wish.iter_mut().zip(&self.kept) {
            *w *= f64::from(*kept);
        }
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

    fn projected_norm(&mut self, face: &mut dyn Face) -> f64 {
        self.work.copy_from_slice(&self.residual);
        face.reduce(&mut self.work);
        self.space.norm(&self.work)
    }

    /// Lets rows of negative force go and takes rows of violated gap in; returns how many, over all ranks. The tolerance of
    /// gaps keeps rows that have neither force nor gap from coming and going.
    fn correct(&mut self, face: &mut dyn Face, tolerance: f64) -> f64 {
        self.work.copy_from_slice(&self.residual);
        face.gaps(&mut self.work);
        for i in 0..self.x.len() {
            let wanted = if self.kept[i] { self.x[i] >= 0.0 } else { self.work[i] > tolerance };
            let changes = self.bounded[i] && wanted != self.kept[i];
            self.kept[i] ^= changes;
            self.work[i] = f64::from(changes);
        }
        self.space.dot(&self.work, &self.work)
    }

    /// Whether the present set has been there before, on all ranks.
    fn seen(&self, history: &[Vec<bool>]) -> bool {
        history.iter().any(|old| self.space.minimum(f64::from(*old == self.kept)) == 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::power;
    use super::super::tests::dense::{Plain, distance, dot};
    use super::super::tests::torn::{Torn, homogenised};
    use super::*;

    const LIMITS: Limits = Limits { relative: 1e-8, reference: None, absolute: 0.0, drop: 0.0, products: 2000 };

    fn from(torn: &mut Torn, x: Vec<f64>, mut kept: Vec<bool>, limits: &Limits) -> Solution {
        let bounded = torn.bounded.clone();
        assert!(torn.restrict(&mut kept));
        let residual = torn.f.times(&x).iter().zip(&torn.d).map(|(fx, d)| d - fx).collect();
        solve(
            &Plain,
            torn,
            &bounded,
            Guess { x, residual, kept, uneven: false, directions: Directions::default() },
            limits,
        )
    }

    #[test]
    fn equals_smalse() {
        for (preconditioned, most) in [(false, 85), (true, 65)] {
            let mut torn = Torn::membrane(4, 6);
            torn.preconditioned = preconditioned;
            let n = torn.d.len();
            let slow = homogenised(&mut torn, 1e-8);
            let fast = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
            assert_eq!((slow.outcome, fast.outcome), (Outcome::Converged, Outcome::Converged));
            assert!(slow.statistics.hessian <= if preconditioned { 130 } else { 175 }, "{:?}", slow.statistics);
            assert!(distance(&slow.x, &fast.x) < 1e-5 * dot(&fast.x, &fast.x).sqrt());
            assert!(fast.statistics.hessian <= most, "{:?}", fast.statistics);
            let (rows, carrying) =
                (torn.bounded.iter().filter(|b| **b).count(), fast.kept.iter().filter(|k| !**k).count());
            assert!(carrying > 0 && carrying < rows, "{carrying} of {rows}");
            torn.restrict(&mut fast.kept.clone());
            let mut gaps = fast.residual.clone();
            torn.gaps(&mut gaps);
            for i in (0..n).filter(|i| torn.bounded[*i]) {
                assert!(fast.x[i] >= 0.0 && gaps[i] < 1e-6);
            }
        }
    }

    #[test]
    fn any_start_gives_the_same_and_the_solution_costs_nothing() {
        let mut torn = Torn::membrane(3, 5);
        let n = torn.d.len();
        let first = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
        let none: Vec<bool> = torn.bounded.iter().map(|b| !b).collect();
        let other = from(&mut torn, vec![0.0; n], none, &LIMITS);
        assert_eq!((other.outcome, &other.kept), (Outcome::Converged, &first.kept));
        assert!(distance(&first.x, &other.x) < 1e-5 * dot(&first.x, &first.x).sqrt());
        let limits = Limits { reference: Some(dot(&torn.d, &torn.d).sqrt()), ..LIMITS };
        let again = from(&mut torn, first.x, first.kept, &limits);
        assert_eq!(again.outcome, Outcome::Converged);
        assert!(again.statistics.hessian <= 2, "{:?}", again.statistics);
    }

    #[test]
    fn norm_of_a_dual_problem() {
        let mut torn = Torn::membrane(3, 5);
        let n = torn.d.len();
        torn.restrict(&mut vec![true; n]);
        let start = torn.d.clone();
        let found = power::norm(&Plain, &mut torn, &start).expect("an estimate");
        assert!(found.products <= 12);
    }

    #[test]
    fn faults_end_as_outcomes() {
        let mut torn = Torn::membrane(3, 5);
        let n = torn.d.len();
        let limits = Limits { products: 5, ..LIMITS };
        assert_eq!(from(&mut torn, vec![0.0; n], vec![true; n], &limits).outcome, Outcome::LimitReached);
        assert!(!torn.restrict(&mut vec![false; n]));
        torn.f.entries[3] = f64::NAN;
        assert_eq!(from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS).outcome, Outcome::NotFinite);
    }
}
