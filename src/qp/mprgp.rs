//! MPRGP: minimisation of 1/2 x'H x - x'b over { x >= l, |(x_i, x_j) - c| <= r }, modified proportioning with reduced gradient
//! projections.
//!
//! Dostal and Schoberl, Comput. Optim. Appl. 30 (2005); Dostal and Kozubek, Math. Program. 135 (2012). While the chopped
//! gradient is small against the free one (|beta|^2 <= Gamma^2 phi~'phi) it takes conjugate gradient steps on the free
//! set; a step that would leave the set becomes an *expansion* of the active set (`expand.rs`); otherwise a *proportioning* step along
//! the chopped gradient releases entries. Optionally conjugate gradients are preconditioned *in the face*: the function is told of
//! each face that they begin in (chapter 5.10 of Dostal's book of 2009 has one preconditioner for all faces).
//!
//! The cost never rises. The gradient is updated along CG steps and is computed afresh after expansions. Pairs of entries on the
//! circle of their disc slide along it by the steps of `slide.rs`; without discs nothing of that is done. Beside x goes its *defect*,
//! the part that violates equality constraints: SMALSE-M penalises it and stops by it.

use super::feasible::{Face, FeasibleSet, Parts};
use super::quadratic::Space;
use super::{Outcome, Statistics};
use crate::vector::axpy;

/// Gamma of the proportioning test; 1 makes proportioning rare and CG long.
const PROPORTION: f64 = 1.0;
/// Length of gradient steps times the norm of H: below the largest admissible 2 (Dostal and Kozubek 2012).
const FIXED_STEP: f64 = 1.9;

/// The quadratic function's matrix, seen with the equality constraints that it penalises.
pub trait Hessian {
    /// `hp = H p`, and `defect` the part of `p` that violates equality constraints (zero if there are none).
    fn apply(&mut self, p: &[f64], hp: &mut [f64], defect: &mut [f64]);

    /// From now on preconditioner and balance are about this face.
    fn enter(&mut self, face: &Face);

    /// `z = M r` with M an approximate inverse, on the face, of H and what circles add to it; returns false, and leaves `z` alone, if
    /// there is none.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool;

    /// Changes `x` on the face so that it violates equality constraints as `target` does. A guess is enough.
    fn balance(&mut self, target: &[f64], x: &mut [f64]);
}

/// The iterate with what belongs to it.
#[derive(Clone)]
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

/// Squares and products of the parts of a gradient.
#[derive(Clone, Copy)]
struct Squares {
    /// phi'phi.
    free: f64,
    /// beta'beta.
    chopped: f64,
    /// phi~'phi.
    reduced: f64,
    /// Of the defect.
    defect: f64,
    /// Of the part of phi that pairs can slide by.
    tangent: f64,
}

impl Squares {
    fn is_finite(&self) -> bool {
        let Self { free, chopped, reduced, defect, tangent } = self;
        [free, chopped, reduced, defect, tangent].iter().all(|v| v.is_finite())
    }

    /// By the projected gradient phi + beta.
    fn norms(&self) -> Norms {
        Norms { gradient: (self.free + self.chopped).sqrt(), defect: self.defect.sqrt() }
    }

    /// The proportioning test |beta|^2 <= Gamma^2 phi~'phi.
    fn is_proportional(&self) -> bool {
        self.chopped <= PROPORTION * PROPORTION * self.reduced
    }
}

/// The cost along a direction p: p'H p, p'g, and the longest step in the set.
struct Line {
    curvature: f64,
    slope: f64,
    reach: f64,
}

impl Line {
    /// The step to the minimum.
    fn step(&self) -> f64 {
        if self.curvature > 0.0 { self.slope / self.curvature } else { f64::INFINITY }
    }
}

/// The solver: its problem apart from H and b, and its work space.
pub struct Mprgp<'a> {
    space: &'a dyn Space,
    set: &'a FeasibleSet,
    norm: f64,
    products: usize,
    parts: Parts,
    /// Size of the Hessian without its penalty.
    size: f64,
    p: Vec<f64>,
    hp: Vec<f64>,
    defect: Vec<f64>,
    z: Vec<f64>,
    old: Vec<f64>,
    old_gradient: Vec<f64>,
    way: Vec<f64>,
    target: Vec<f64>,
    /// The share of its step that the last expansion went.
    share: f64,
}

impl<'a> Mprgp<'a> {
    /// `norm` is an estimate of the norm of H, `products` the number of products after which to give up.
    pub fn new(space: &'a dyn Space, set: &'a FeasibleSet, norm: f64, products: usize) -> Self {
        let zero = || vec![0.0; set.dimension()];
        Self {
            space,
            set,
            norm,
            size: norm,
            products,
            parts: Parts::new(set.dimension()),
            p: zero(),
            hp: zero(),
            defect: zero(),
            z: zero(),
            old: zero(),
            old_gradient: zero(),
            way: zero(),
            target: zero(),
            share: 1.0,
        }
    }

    /// Tells the size of the Hessian without its penalty, if it has one: what the curvature of circles is compared with.
    pub fn with_size(mut self, size: f64) -> Self {
        self.size = size;
        self
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
            if !squares.is_finite() {
                return Outcome::NotFinite;
            }
            if stop(squares.norms()) {
                return Outcome::Converged;
            }
            if statistics.hessian >= self.products {
                return Outcome::LimitReached;
            }

            // A CG direction in the face, or one that leaves it along beta.
            let proportional = squares.is_proportional();
            if proportional && squares.tangent > 0.0 {
                if let Some(outcome) = self.slide(hessian, b, point, squares, statistics, stop) {
                    return outcome;
                }
                last = None;
                continue;
            }
            if proportional {
                self.conjugate(hessian, point, last, statistics);
            } else {
                self.p.copy_from_slice(&self.parts.chopped);
            }

            // The step to the minimum along p, and the one to the boundary of the set.
            let Some(line) = self.line(hessian, point, statistics) else {
                return Outcome::NotFinite;
            };
            let Line { curvature, slope, reach } = line;
            if slope <= 0.0 && last.is_some() {
                // Conjugacy is lost in rounding: CG starts anew.
                last = None;
                continue;
            }
            let step = line.step();
            if step.min(reach) == f64::INFINITY {
                return Outcome::Unbounded;
            }

            // CG or proportioning step inside the set; else expansion.
            if step <= reach {
                self.walk(point, step);
                last = proportional.then_some(curvature);
                *if proportional { &mut statistics.cg } else { &mut statistics.proportionings } += 1;
            } else {
                self.expand(hessian, b, point, statistics, &line);
                last = None;
                statistics.expansions += 1;
            }
        }
    }

    /// What a stopping test sees at the point. One collective.
    pub fn norms(&mut self, point: &Point) -> Norms {
        self.measure(point).norms()
    }

    /// Splits the gradient at the point. One collective.
    fn measure(&mut self, point: &Point) -> Squares {
        self.set.split(&point.x, &point.gradient, FIXED_STEP / self.norm, &mut self.parts);
        self.squares(point)
    }

    /// Squares and products of the split gradient. One collective.
    fn squares(&self, point: &Point) -> Squares {
        let Parts { free, chopped, reduced, tangent, .. } = &self.parts;
        let defect = &point.defect;
        let mut pairs: Vec<(&[f64], &[f64])> =
            vec![(free, free), (chopped, chopped), (reduced, free), (defect, defect)];
        if self.set.has_discs() {
            pairs.push((tangent, tangent));
        }
        let d = self.space.dots(&pairs);
        let tangent = d.get(4).copied().unwrap_or(0.0);
        Squares { free: d[0], chopped: d[1], reduced: d[2], defect: d[3], tangent }
    }

    /// The cost along the direction p, by one product with H; `None` if something is not finite.
    fn line(&mut self, hessian: &mut dyn Hessian, point: &Point, statistics: &mut Statistics) -> Option<Line> {
        let reach = self.space.minimum(self.set.reach(&self.parts.places, &point.x, &self.p));
        hessian.apply(&self.p, &mut self.hp, &mut self.defect);
        statistics.hessian += 1;
        self.set.bend(&self.parts.places, &self.p, &mut self.hp);
        let d = self.space.dots(&[(&self.p, &self.hp), (&self.p, &point.gradient)]);
        let (curvature, slope) = (d[0], d[1]);
        (curvature.is_finite() && slope.is_finite() && !reach.is_nan()).then_some(Line { curvature, slope, reach })
    }

    /// A step of this length along p that stays in the set, or on tangents; gradient and defect follow without a product.
    fn walk(&mut self, point: &mut Point, step: f64) {
        self.set.advance_on_tangents(&self.parts.places, &mut point.x, step, &self.p);
        axpy(-step, &self.hp, &mut point.gradient);
        axpy(-step, &self.defect, &mut point.defect);
        point.age += 1;
    }

    /// The next CG direction: the (preconditioned) free gradient, H-conjugate to the last direction if there is one. Where there is
    /// none the face may be a new one.
    fn conjugate(&mut self, hessian: &mut dyn Hessian, point: &Point, last: Option<f64>, statistics: &mut Statistics) {
        if last.is_none() {
            hessian.enter(&self.set.face(&point.x, &point.gradient));
        }
        let mut products = [0.0; 2];
        if hessian.precondition(&self.parts.free, &mut self.z) {
            statistics.preconditioner += 1;
            products = self.products();
        }
        if products[1] <= 0.0 {
            // There is no M, or it is not positive in this face.
            self.z.copy_from_slice(&self.parts.free);
            self.set.relax(&self.parts.places, self.size, &mut self.z);
            products = self.products();
        }
        let beta = last.map_or(0.0, |curvature| products[0] / curvature);
        for (p, z) in self.p.iter_mut().zip(&self.z) {
            *p = z - beta * *p;
        }
    }

    /// z'H p with the last H p, and z'phi.
    fn products(&self) -> [f64; 2] {
        let d = self.space.dots(&[(&self.z, &self.hp), (&self.z, &self.parts.free)]);
        [d[0], d[1]]
    }
}

mod expand;
mod slide;

#[cfg(test)]
mod tests;
