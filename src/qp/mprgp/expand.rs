//! Steps that run into constraints: back onto the set, where another face begins.
//!
//! A preconditioned step runs into many constraints at once. What the set cuts off it may have been needed for balance, and the penalty
//! of equality constraints would forbid such a step: entries that are free at the new point make up for it. A step that does not lower
//! the cost then is tried at a quarter of its length, and so on, and in the end replaced by a gradient step of fixed length, the step
//! of Dostal and Schoberl (2005) that cannot fail.

use super::{FIXED_STEP, Hessian, Line, Mprgp, Point};
use crate::qp::Statistics;
use crate::vector::axpy;

/// A step that did not lower the cost is tried at this share of its length ...
const SHORTER: f64 = 0.25;
/// ... so many times. The next expansion begins one time longer than this one ended.
const TRIALS: usize = 5;
/// How often an underestimated norm of H is doubled before a gradient step is accepted as it is.
const DOUBLINGS: usize = 4;

impl Mprgp<'_> {
    /// The step to the minimum along p runs into bounds.
    pub(super) fn expand(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        line: &Line,
    ) {
        for start in [&mut self.old, &mut self.way] {
            start.copy_from_slice(&point.x);
        }
        self.old_gradient.copy_from_slice(&point.gradient);
        if self.cut(hessian, b, point, statistics, line, 0.0) {
            return;
        }
        // To the bound, where the gradient costs nothing; from there a gradient step.
        self.set.advance(&mut self.old, line.reach, &self.p);
        axpy(-line.reach, &self.hp, &mut self.old_gradient);
        self.descend(hessian, b, point, statistics);
    }

    /// Tries steps along p from `way`, cut to the set, of the length to the minimum and shorter ones. Whether one of them lowers the cost
    /// by `least`.
    pub(super) fn cut(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        line: &Line,
        least: f64,
    ) -> bool {
        if !line.step().is_finite() {
            return false;
        }
        self.share = (self.share / SHORTER).min(1.0);
        for _ in 0..TRIALS {
            if self.go(hessian, b, point, statistics, self.share * line.step(), least) {
                return true;
            }
            self.share *= SHORTER;
            if self.share * line.step() <= line.reach {
                break;
            }
        }
        false
    }

    /// Goes a step of this length along p from `way`, and makes up for what the set cuts off. Whether the cost is lower by `least` then.
    pub(super) fn go(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        step: f64,
        least: f64,
    ) -> bool {
        point.x.copy_from_slice(&self.way);
        self.set.advance(&mut point.x, step, &self.p);
        self.target.copy_from_slice(&self.way);
        axpy(-step, &self.p, &mut self.target);
        hessian.enter(&self.set.face(&point.x, &self.old_gradient));
        hessian.balance(&self.target, &mut point.x);
        self.set.project(&mut point.x);
        point.refresh(hessian, b, statistics);
        self.lowered(point, least)
    }

    /// A gradient step of fixed length from `old`, which lowers the cost if it is short enough. Pairs on circles take part: the
    /// projection makes a step along the circle of theirs.
    pub(super) fn descend(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
    ) {
        self.parts.free.copy_from_slice(&self.old_gradient);
        self.set.mask_bounds(&self.old, &mut self.parts.free);
        let norm = self.norm;
        for _ in 0..=DOUBLINGS {
            point.x.copy_from_slice(&self.old);
            self.set.advance(&mut point.x, FIXED_STEP / self.norm, &self.parts.free);
            point.refresh(hessian, b, statistics);
            if self.lowered(point, 0.0) {
                return;
            }
            self.norm *= 2.0;
        }
        if self.set.has_discs() {
            // Not the norm was wrong: rounding is felt on circles, and hides whether the cost falls.
            self.norm = norm;
        }
    }

    /// Whether the cost has fallen by this at least from `old` to the point: the difference is (x - old)'(g + old g) / 2, free of
    /// the cancellation that the difference of two costs would suffer.
    fn lowered(&mut self, point: &Point, least: f64) -> bool {
        self.set.difference(&point.x, &self.old, &mut self.z);
        let d = self.space.dots(&[(&self.z, &point.gradient), (&self.z, &self.old_gradient)]);
        // NaN ends the loop at the next test.
        d[0] + d[1] <= -2.0 * least || d[0].is_nan()
    }
}
