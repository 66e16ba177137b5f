//! MPRGP: minimisation of 1/2 x'H x - x'b over { x >= l }, modified proportioning with reduced gradient projections.
//!
//! Dostal and Schoberl, Comput. Optim. Appl. 30 (2005); Dostal and Kozubek, Math. Program. 135 (2012). While the chopped
//! gradient is small against the free one (|beta|^2 <= Gamma^2 phi~'phi) it takes conjugate gradient steps on the free
//! set; a step that would leave the set becomes an *expansion* of the active set; otherwise a *proportioning* step along
//! the chopped gradient releases entries. Optionally conjugate gradients are preconditioned *in the face*,
//! z = mask(M mask(g)) with one M for all faces.
//!
//! The cost never rises: an expansion that failed to lower it is replaced by one that cannot fail. The gradient is
//! updated along CG steps and is computed afresh after expansions. Beside x goes its *defect*, the part that violates
//! equality constraints: SMALSE-M penalises it and stops by it.

use super::feasible::{FeasibleSet, Parts};
use super::quadratic::Space;
use super::{Outcome, Statistics, axpy};

/// Gamma of the proportioning test; 1 makes proportioning rare and CG long.
const PROPORTION: f64 = 1.0;
/// Length of gradient steps times the norm of H: below the largest admissible 2 (Dostal and Kozubek 2012).
const FIXED_STEP: f64 = 1.9;
/// How often an underestimated norm of H is doubled before an expansion is accepted as it is.
const DOUBLINGS: usize = 4;

/// The quadratic function's matrix, seen with the equality constraints that it penalises.
pub trait Hessian {
    /// `hp = H p`, and `defect` the part of `p` that violates equality constraints (zero if there are none).
    fn apply(&mut self, p: &[f64], hp: &mut [f64], defect: &mut [f64]);

    /// `z = M r` with M an approximate inverse of H; returns false, and leaves `z` alone, if there is none.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool;
}

/// The iterate with what belongs to it.
pub struct Point {
    /// The unknowns.
    pub x: Vec<f64>,
    /// `H x - b`.
    pub gradient: Vec<f64>,
    /// The part of x that violates equality constraints.
    pub defect: Vec<f64>,
    /// Updates of the gradient since it was computed afresh.
    pub age: usize,
}

impl Point {
    /// Computes gradient and defect by one product.
    pub fn refresh(&mut self, hessian: &mut dyn Hessian, b: &[f64], statistics: &mut Statistics) {
        hessian.apply(&self.x, &mut self.gradient, &mut self.defect);
        statistics.hessian += 1;
        axpy(-1.0, b, &mut self.gradient);
        self.age = 0;
    }
}

/// Norms that a stopping test sees.
#[derive(Clone, Copy, Debug)]
pub struct Norms {
    /// Norm of the projected gradient, phi + beta.
    pub gradient: f64,
    /// Norm of the defect.
    pub defect: f64,
}

/// The cost along a direction p: p'H p, p'g, and the longest step in the set.
struct Line {
    curvature: f64,
    slope: f64,
    reach: f64,
}

/// The solver: its problem apart from H and b, and its work space.
pub struct Mprgp<'a> {
    space: &'a dyn Space,
    set: &'a FeasibleSet,
    norm: f64,
    products: usize,
    parts: Parts,
    p: Vec<f64>,
    hp: Vec<f64>,
    defect: Vec<f64>,
    z: Vec<f64>,
    old: Vec<f64>,
    old_gradient: Vec<f64>,
}

impl<'a> Mprgp<'a> {
    /// `norm` is an estimate of the norm of H, `products` the number of products after which to give up.
    pub fn new(space: &'a dyn Space, set: &'a FeasibleSet, norm: f64, products: usize) -> Self {
        let zero = || vec![0.0; set.dimension()];
        Self {
            space,
            set,
            norm,
            products,
            parts: Parts::new(set.dimension()),
            p: zero(),
            hp: zero(),
            defect: zero(),
            z: zero(),
            old: zero(),
            old_gradient: zero(),
        }
    }

    /// Iterates from a feasible point with a valid gradient until `stop` says so.
    pub fn minimise(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        stop: &mut dyn FnMut(Norms) -> bool,
    ) -> Outcome {
        // Curvature of the last direction while CG may continue from it.
        let mut last: Option<f64> = None;
        loop {
            // Stopping tests, by the projected gradient phi + beta.
            let squares = self.measure(point);
            if !squares.iter().all(|v| v.is_finite()) {
                return Outcome::NotFinite;
            }
            let [free, chopped, reduced_free, defect, free_hp] = squares;
            if stop(Norms { gradient: (free + chopped).sqrt(), defect: defect.sqrt() }) {
                return Outcome::Converged;
            }
            if statistics.hessian >= self.products {
                return Outcome::LimitReached;
            }

            // Proportioning test |beta|^2 <= Gamma^2 phi~'phi: a CG direction in the face, or one that leaves it along beta.
            let proportional = chopped <= PROPORTION * PROPORTION * reduced_free;
            if proportional {
                self.conjugate(hessian, &point.x, (free, free_hp), last, statistics);
            } else {
                self.p.copy_from_slice(&self.parts.chopped);
            }

            // The step to the minimum along p, and the one to the boundary of the set.
            let Some(Line { curvature, slope, reach }) = self.line(hessian, point, statistics) else {
                return Outcome::NotFinite;
            };
            if slope <= 0.0 && last.is_some() {
                // Conjugacy is lost in rounding: CG starts anew.
                last = None;
                continue;
            }
            let step = if curvature > 0.0 { slope / curvature } else { f64::INFINITY };
            if step.min(reach) == f64::INFINITY {
                return Outcome::Unbounded;
            }

            // CG or proportioning step inside the set; else expansion.
            if step <= reach {
                self.walk(point, step);
                last = proportional.then_some(curvature);
                *if proportional { &mut statistics.cg } else { &mut statistics.proportionings } += 1;
            } else {
                self.expand(hessian, b, point, statistics, step, reach);
                last = None;
                statistics.expansions += 1;
            }
        }
    }

    /// Splits the gradient at the point; returns phi'phi, beta'beta, phi~'phi, the square of the defect, and phi'H p with the last
    /// `H p`. One collective.
    fn measure(&mut self, point: &Point) -> [f64; 5] {
        self.set.split(&point.x, &point.gradient, FIXED_STEP / self.norm, &mut self.parts);
        let Parts { free, chopped, reduced } = &self.parts;
        let defect = &point.defect;
        let d =
            self.space.dots(&[(free, free), (chopped, chopped), (reduced, free), (defect, defect), (free, &self.hp)]);
        [d[0], d[1], d[2], d[3], d[4]]
    }

    /// The cost along the direction p, by one product with H; `None` if something is not finite.
    fn line(&mut self, hessian: &mut dyn Hessian, point: &Point, statistics: &mut Statistics) -> Option<Line> {
        let reach = self.space.minimum(self.set.reach(&point.x, &self.p));
        hessian.apply(&self.p, &mut self.hp, &mut self.defect);
        statistics.hessian += 1;
        let d = self.space.dots(&[(&self.p, &self.hp), (&self.p, &point.gradient)]);
        let (curvature, slope) = (d[0], d[1]);
        (curvature.is_finite() && slope.is_finite() && !reach.is_nan()).then_some(Line { curvature, slope, reach })
    }

    /// A step of this length along p that stays in the set; gradient and defect follow without a product.
    fn walk(&mut self, point: &mut Point, step: f64) {
        self.set.advance(&mut point.x, step, &self.p);
        axpy(-step, &self.hp, &mut point.gradient);
        axpy(-step, &self.defect, &mut point.defect);
        point.age += 1;
    }

    /// The next CG direction: the (preconditioned) free gradient, H-conjugate to the last direction if there is one. Given
    /// are phi'phi and phi'H p.
    fn conjugate(
        &mut self,
        hessian: &mut dyn Hessian,
        x: &[f64],
        (free_free, free_hp): (f64, f64),
        last: Option<f64>,
        statistics: &mut Statistics,
    ) {
        let mut z_hp = free_hp;
        let mut z = &self.parts.free;
        if free_free > 0.0 && hessian.precondition(&self.parts.free, &mut self.z) {
            statistics.preconditioner += 1;
            self.set.mask(x, &mut self.z);
            let d = self.space.dots(&[(&self.z, &self.hp), (&self.z, &self.parts.free)]);
            // A preconditioner that is not positive in this face is not used.
            if d[1] > 0.0 {
                (z_hp, z) = (d[0], &self.z);
            }
        }
        let beta = last.map_or(0.0, |curvature| z_hp / curvature);
        for (p, z) in self.p.iter_mut().zip(z) {
            *p = z - beta * *p;
        }
    }

    /// A step along p of length `step` runs into bounds at `reach`.
    fn expand(
        &mut self,
        hessian: &mut dyn Hessian,
        b: &[f64],
        point: &mut Point,
        statistics: &mut Statistics,
        step: f64,
        reach: f64,
    ) {
        self.old.copy_from_slice(&point.x);
        self.old_gradient.copy_from_slice(&point.gradient);
        if step.is_finite() {
            self.set.advance(&mut point.x, step, &self.p);
            point.refresh(hessian, b, statistics);
            if self.lowered(point) {
                return;
            }
        }

        // To the bound, where the gradient costs nothing; from there a gradient step.
        self.set.advance(&mut self.old, reach, &self.p);
        axpy(-reach, &self.hp, &mut self.old_gradient);
        self.parts.free.copy_from_slice(&self.old_gradient);
        self.set.mask(&self.old, &mut self.parts.free);
        for _ in 0..=DOUBLINGS {
            point.x.copy_from_slice(&self.old);
            self.set.advance(&mut point.x, FIXED_STEP / self.norm, &self.parts.free);
            point.refresh(hessian, b, statistics);
            if self.lowered(point) {
                return;
            }
            self.norm *= 2.0;
        }
    }

    /// Whether the cost has not risen from `old` to the point: the difference is (x - old)'(g + old g) / 2, free of the
    /// cancellation that the difference of two costs would suffer.
    fn lowered(&mut self, point: &Point) -> bool {
        for ((z, x), old) in self.z.iter_mut().zip(&point.x).zip(&self.old) {
            *z = x - old;
        }
        let d = self.space.dots(&[(&self.z, &point.gradient), (&self.z, &self.old_gradient)]);
        // NaN ends the loop at the next test.
        d[0] + d[1] <= 0.0 || d[0].is_nan()
    }
}

#[cfg(test)]
mod tests;
