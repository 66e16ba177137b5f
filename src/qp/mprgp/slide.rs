//! Steps along circles: conjugate gradients on the tangents of discs that pairs slide in, then back onto the circles.
//!
//! On the tangents the function gets the curvature of the circles, so the model is exact to second order (a Newton-CG
//! method for the Lagrangian, truncated). x leaves the set meanwhile, by the square of the way; no product is spent on
//! that until the run ends: when the model's gradient is small enough, when another constraint is met, or when a pair has
//! gone as far as its radius. Then x is projected, which takes one product. What has not lowered the cost is
//! taken back by parts, and in the end replaced by a gradient step of fixed length, the step of Dostal and Kozubek (2012) that
//! cannot fail. All accepted steps lower the cost by a fixed part, at least, of what such a step is sure to do.

use super::{FIXED_STEP, Hessian, Line, Mprgp, Norms, Point, Squares};
use crate::qp::{Outcome, Statistics};

/// A run ends when the model's free gradient is this part of the first.
const RUN: f64 = 0.03;
/// The cost falls by this part of step |phi~||phi|, or the move is taken back: a step of fixed length below 2 / |H| does
/// more.
const LEAST: f64 = 0.01;
/// The parts of a move that are tried if the whole one fails.
const PARTS: [f64; 2] = [0.25, 0.05];

impl Mprgp<'_> {
    /// Moves from a feasible point with pairs that slide to another one of lower cost; `first` is its split gradient. An
    /// outcome if the solver has to end.
    pub(super) fn slide(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        first: Squares,
        statistics: &mut Statistics,
        stop: &mut dyn FnMut(Norms) -> bool,
    ) -> Option<Outcome> {
        self.old.copy_from_slice(&point.x);
        self.old_gradient.copy_from_slice(&point.gradient);
        let least = LEAST * FIXED_STEP / self.norm * first.reduced;
        let mut last = None;
        let end = loop {
            self.conjugate(hessian, point, last, statistics);
            let Some(line) = self.line(hessian, point, statistics) else {
                break Err(Outcome::NotFinite);
            };
            let step = line.step();
            if step.min(line.reach) == f64::INFINITY {
                break Err(Outcome::Unbounded);
            }
            if line.slope <= 0.0 {
                break Ok(None);
            }
            if step > line.reach {
                break Ok(Some(line));
            }
            self.walk(point, step);
            statistics.cg += 1;
            last = Some(line.curvature);
            self.set.split_on_tangents(&point.x, &point.gradient, FIXED_STEP / self.norm, &mut self.parts);
            let squares = self.squares(point);
            if !squares.is_finite() {
                break Err(Outcome::NotFinite);
            }
            let small = squares.free <= RUN * RUN * first.free || stop(squares.norms());
            if small || !squares.is_proportional() || statistics.hessian >= self.products {
                break Ok(None);
            }
        };
        match end {
            Ok(beyond) => {
                self.land(hessian, b, point, statistics, beyond, least);
                statistics.expansions += 1;
                None
            }
            Err(outcome) => {
                point.x.copy_from_slice(&self.old);
                point.gradient.copy_from_slice(&self.old_gradient);
                Some(outcome)
            }
        }
    }

    /// From the tangents, and `beyond` by a step along p that meets a constraint earlier, back to a point of the set
    /// that lowers the cost by `least`.
    fn land(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        beyond: Option<Line>,
        least: f64,
    ) {
        if let Some(line) = &beyond {
            self.way.copy_from_slice(&point.x);
            if self.cut(hessian, b, point, statistics, line, least) {
                return;
            }
            point.x.copy_from_slice(&self.way);
            self.set.advance_on_tangents(&self.parts.places, &mut point.x, line.reach, &self.p);
        }
        for ((p, x), old) in self.p.iter_mut().zip(&point.x).zip(&self.old) {
            *p = old - x;
        }
        self.way.copy_from_slice(&self.old);
        for part in std::iter::once(1.0).chain(PARTS) {
            if self.go(hessian, b, point, statistics, part, least) {
                return;
            }
        }
        self.descend(hessian, b, point, statistics);
    }
}
