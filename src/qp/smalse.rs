//! SMALSE-M: bounds and equalities by augmented Lagrangians, min 1/2 x'A x - x'b over { x >= l, G x = 0 }.
//! Pairs of entries may be in discs instead of above bounds: the set is whatever [`super::feasible`] says.
//!
//! Dostal, Optimal Quadratic Programming Algorithms (2009), algorithm 8.2 (semimonotonic augmented Lagrangians, fixed
//! penalty, M updated). The equality constraint is taken orthonormalised and is never formed: with P the projector onto
//! Ker G and Q = I - P, the inner problem is the minimisation of
//!
//!   L(x, m, rho) = 1/2 x'P A P x - x'P b + m'x + rho/2 |Q x|^2    over { x >= l }
//!
//! by [`super::mprgp`] to |g^P| <= min(M |Q x|, eta), then m = m + rho Q x. M shrinks when L has risen by less than
//! rho/2 |Q x|^2. The multiplier m = G'mu is kept as a vector in the space of x. Where the literature scales the problem
//! to norm(P A P) = 1, here all constants carry the norm: |Q x| enters tests as norm |Q x|, in the units of the gradient.
//!
//! L follows from the gradient, the Q-part of a direction is a by-product of its product: a step costs one product with
//! A and two projections. Convergence does not depend on the quality of the norm, a few per cent are plenty.

use super::feasible::FeasibleSet;
use super::mprgp::{Mprgp, Norms, Point};
use super::penalty::Penalised;
use super::quadratic::{Quadratic, Space};
use super::{Limits, Outcome, Statistics};
use crate::vector::axpy;

/// Penalty rho, times the norm. Adds one far cluster of eigenvalues, which does not slow CG (Dostal 2009, section 4.6).
const PENALTY: f64 = 100.0;
/// First M, times the norm.
const RATIO: f64 = 10.0;
/// Factor by which M shrinks.
const SHRINK: f64 = 10.0;
/// First bound eta of the inner tolerance, times the first projected gradient.
const LOOSE: f64 = 0.1;
/// Converged with a gradient updated more often than this: it is computed afresh before it is believed.
const AGE: usize = 50;

/// The problem.
pub struct Problem<'a> {
    /// Inner products.
    pub space: &'a dyn Space,
    /// A and P, perhaps with a preconditioner on faces.
    pub function: &'a mut dyn Quadratic,
    /// b; only P b matters.
    pub b: &'a [f64],
    /// { x >= l }, with discs perhaps.
    pub set: &'a FeasibleSet,
}

/// How to solve it.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Tolerances for |g^P| and norm |Q x|, both referred to the first |g^P| by default.
    pub limits: Limits,
    /// Estimate of the norm of P A P, see [`super::power`].
    pub norm: f64,
}

/// Where to start.
pub struct Start {
    /// Unknowns; made feasible.
    pub x: Vec<f64>,
    /// [`Solution::multiplier`] of a similar problem; projected to the present Im G'.
    pub multiplier: Option<Vec<f64>>,
}

/// What was found.
pub struct Solution {
    /// The unknowns: x >= l holds exactly, discs up to rounding, G x = 0 within `defect_norm`.
    pub x: Vec<f64>,
    /// `P (A P x - b) + m`: up to the tolerance zero on the free set, nonnegative on the active one;
    /// on circles it points at the centre.
    pub gradient: Vec<f64>,
    /// The equality multiplier m that belongs to the gradient.
    pub multiplier: Vec<f64>,
    /// Which entries are on their bound or their circle.
    pub active: Vec<bool>,
    /// How it ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
    /// Norm of the projected gradient at the start.
    pub first_norm: f64,
    /// Norm of the projected gradient at the end.
    pub gradient_norm: f64,
    /// Norm of Q x at the end.
    pub defect_norm: f64,
}

/// Solves the problem. Every rank calls this with its own entries.
pub fn solve(problem: Problem, settings: &Settings, start: Start) -> Solution {
    let Problem { space, function, b, set } = problem;
    let Prepared { mut right, mut multiplier, x, inside } = prepare(function, set, b, start);
    let norm = settings.norm;
    let penalty = PENALTY * norm;
    let mut hessian = Penalised { function, size: norm, penalty, inside };
    let mut inner = Mprgp::new(space, set, penalty, settings.limits.products).with_size(norm);
    let mut statistics = Statistics::default();
    let mut point = first_point(space, &mut hessian, &right, x, &mut statistics);
    // What a start violates is repaired at once, and says nothing of how far the solution is.
    let mut without_penalty = point.clone();
    axpy(-penalty, &point.defect, &mut without_penalty.gradient);
    let first = inner.norms(&without_penalty).gradient;

    let mut tests = Tests { limits: settings.limits, norm, ratio: RATIO * norm, first, now: UNKNOWN, done: false };
    let mut cost_before = f64::NEG_INFINITY;
    let outcome = loop {
        // x: minimise L(x, m, rho) until |g^P| <= min(M |Q x|, eta).
        tests.done = false;
        let stop = &mut |now| tests.stop(now);
        let outcome = inner.minimise(&mut hessian, &right, &mut point, &mut statistics, stop);
        if outcome == Outcome::Converged && tests.done && point.age > AGE {
            point.refresh(&mut hessian, &right, &mut statistics);
            continue;
        }
        // M: shrink it where L has risen by less than rho/2 |Q x|^2. L = (x'g - x'b) / 2, with b - m as b.
        hessian.clean(&mut point);
        let d = space.dots(&[(&point.x, &point.gradient), (&point.x, &right)]);
        let cost = 0.5 * (d[0] - d[1]);
        if cost < cost_before + 0.5 * penalty * tests.now.defect * tests.now.defect {
            tests.ratio /= SHRINK;
        }
        cost_before = cost;
        // m: m + rho Q x. The gradient contains this sum already.
        axpy(penalty, &point.defect, &mut multiplier);
        if outcome != Outcome::Converged || tests.done {
            break outcome;
        }
        axpy(-penalty, &point.defect, &mut right);
        axpy(penalty, &point.defect, &mut point.gradient);
        statistics.outer += 1;
    };
    Solution {
        active: set.active(&point.x),
        x: point.x,
        gradient: point.gradient,
        multiplier,
        outcome,
        statistics,
        first_norm: tests.first,
        gradient_norm: tests.now.gradient,
        defect_norm: tests.now.defect,
    }
}

/// What the loop starts with.
struct Prepared {
    /// P b - m.
    right: Vec<f64>,
    /// m in Im G': what is not would shift the solution.
    multiplier: Vec<f64>,
    /// A feasible x.
    x: Vec<f64>,
    /// Work space.
    inside: Vec<f64>,
}

/// Projects b, the multiplier and x to where they belong.
fn prepare(function: &mut dyn Quadratic, set: &FeasibleSet, b: &[f64], start: Start) -> Prepared {
    let mut b = b.to_vec();
    function.project(&mut b);
    let mut multiplier = start.multiplier.unwrap_or_else(|| vec![0.0; b.len()]);
    let mut inside = multiplier.clone();
    function.project(&mut inside);
    axpy(-1.0, &inside, &mut multiplier);
    let mut x = start.x;
    set.project(&mut x);
    let right = b.iter().zip(&multiplier).map(|(b, m)| b - m).collect();
    Prepared { right, multiplier, x, inside }
}

/// The start with its gradient, for which x = 0 needs no product.
fn first_point(
    space: &dyn Space,
    hessian: &mut Penalised,
    right: &[f64],
    x: Vec<f64>,
    statistics: &mut Statistics,
) -> Point {
    let zero = vec![0.0; x.len()];
    let starts_at_zero = space.dot(&x, &x) == 0.0;
    let mut point = Point { x, gradient: zero.clone(), defect: zero, age: 0 };
    if starts_at_zero {
        axpy(-1.0, right, &mut point.gradient);
    } else {
        point.refresh(hessian, right, statistics);
    }
    point
}

const UNKNOWN: Norms = Norms { gradient: f64::NAN, defect: f64::NAN };

/// When the inner loop stops.
struct Tests {
    limits: Limits,
    /// Norm of P A P.
    norm: f64,
    /// M.
    ratio: f64,
    /// |g^P| at the start, without the penalty.
    first: f64,
    /// The norms that were tested last.
    now: Norms,
    /// Whether the whole problem is solved to the tolerance.
    done: bool,
}

impl Tests {
    /// Whether |g^P| and norm |Q x| are within the tolerance, or |g^P| <= min(M |Q x|, eta).
    fn stop(&mut self, now: Norms) -> bool {
        self.now = now;
        let target = self.limits.target(self.first);
        let loose = (LOOSE * self.first).max(target);
        self.done = now.gradient <= target && self.norm * now.defect <= target;
        self.done || now.gradient <= loose.min(self.ratio * now.defect)
    }
}

#[cfg(test)]
mod tests;
