//! MPRGP: minimisation of 1/2 x'H x - x'b over { x >= l }, modified proportioning with reduced gradient projections.
//!
//! Dostal and Schoberl, Comput. Optim. Appl. 30 (2005); Dostal and Kozubek, Math. Program. 135 (2012). While the chopped
//! gradient is small against the free one (|beta|^2 <= Gamma^2 phi~'phi) it takes conjugate gradient steps on the free
//! set; a step that would leave the set becomes an *expansion* of the active set; otherwise a *proportioning* step along
//! the chopped gradient releases entries. Optionally conjugate gradients are preconditioned *in the face*,
//! z = mask(M mask(g)) with one M for all faces.
//!
//! The cost never rises: an expansion that failed to lower it is replaced by one that cannot fail. The gradient is
//! updated along CG steps and is computed afresh after expansions. Beside x, the part of x that violates equality
//! constraints (if any) is carried along, since who penalises it wants to stop by it.

use super::bounds::{Bounds, Parts};
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

/// What a step does that runs into bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expansion {
    /// The whole CG step, projected. Never worse in practice, and needs no norm.
    ProjectedCg,
    /// To the bound, then a projected gradient step of a fixed length.
    Fixed,
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

/// The solver: its problem apart from H and b, and its work space.
pub struct Mprgp<'a> {
    space: &'a dyn Space,
    bounds: &'a Bounds,
    expansion: Expansion,
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
    pub fn new(space: &'a dyn Space, bounds: &'a Bounds, expansion: Expansion, norm: f64, products: usize) -> Self {
        let zero = || vec![0.0; bounds.lower().len()];
        Self {
            space,
            bounds,
            expansion,
            norm,
            products,
            parts: Parts::new(bounds.lower().len()),
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
            self.bounds.split(&point.x, &point.gradient, FIXED_STEP / self.norm, &mut self.parts);
            let Parts { free, chopped, reduced } = &self.parts;
            let defect = &point.defect;
            let d = self.space.dots(&[
                (free, free),
                (chopped, chopped),
                (reduced, free),
                (defect, defect),
                (free, &self.hp),
            ]);
            if d.iter().any(|v| !v.is_finite()) {
                return Outcome::NotFinite;
            }
            if stop(Norms { gradient: (d[0] + d[1]).sqrt(), defect: d[3].sqrt() }) {
                return Outcome::Converged;
            }
            if statistics.hessian >= self.products {
                return Outcome::LimitReached;
            }

            let proportional = d[1] <= PROPORTION * PROPORTION * d[2];
            if proportional {
                self.conjugate(hessian, &point.x, d[0], d[4], last, statistics);
            } else {
                self.p.copy_from_slice(chopped);
            }
            let reach = self.space.minimum(self.bounds.reach(&point.x, &self.p));
            hessian.apply(&self.p, &mut self.hp, &mut self.defect);
            statistics.hessian += 1;
            let d = self.space.dots(&[(&self.p, &self.hp), (&self.p, &point.gradient)]);
            let (curvature, slope) = (d[0], d[1]);
            if !(curvature.is_finite() && slope.is_finite() && !reach.is_nan()) {
                return Outcome::NotFinite;
            }
            if slope <= 0.0 && last.is_some() {
                // Conjugacy is lost in rounding.
                last = None;
                continue;
            }
            let step = if curvature > 0.0 { slope / curvature } else { f64::INFINITY };
            if step.min(reach) == f64::INFINITY {
                return Outcome::Unbounded;
            }
            if step <= reach {
                self.bounds.advance(&mut point.x, step, &self.p);
                axpy(-step, &self.hp, &mut point.gradient);
                axpy(-step, &self.defect, &mut point.defect);
                point.age += 1;
                last = proportional.then_some(curvature);
                *if proportional { &mut statistics.cg } else { &mut statistics.proportionings } += 1;
            } else {
                self.expand(hessian, b, point, statistics, step, reach);
                last = None;
                statistics.expansions += 1;
            }
        }
    }

    /// The next CG direction: the (preconditioned) free gradient, H-conjugate to the last direction if there is one.
    fn conjugate(
        &mut self,
        hessian: &mut dyn Hessian,
        x: &[f64],
        free_free: f64,
        free_hp: f64,
        last: Option<f64>,
        statistics: &mut Statistics,
    ) {
        let mut z_hp = free_hp;
        let mut z = &self.parts.free;
        if free_free > 0.0 && hessian.precondition(&self.parts.free, &mut self.z) {
            statistics.preconditioner += 1;
            self.bounds.mask(x, &mut self.z);
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
        if self.expansion == Expansion::ProjectedCg && step.is_finite() {
            self.bounds.advance(&mut point.x, step, &self.p);
            point.refresh(hessian, b, statistics);
            if self.lowered(point) {
                return;
            }
        }

        // To the bound, where the gradient costs nothing; from there a gradient step.
        self.bounds.advance(&mut self.old, reach, &self.p);
        axpy(-reach, &self.hp, &mut self.old_gradient);
        self.parts.free.copy_from_slice(&self.old_gradient);
        self.bounds.mask(&self.old, &mut self.parts.free);
        for _ in 0..=DOUBLINGS {
            point.x.copy_from_slice(&self.old);
            self.bounds.advance(&mut point.x, FIXED_STEP / self.norm, &self.parts.free);
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
mod tests {
    use super::super::dense::{Matrix, Null, Plain, Random, distance, dot, enumerate};
    use super::super::quadratic::Operator;
    use super::*;

    /// No equality constraints.
    struct Alone<'a>(&'a mut Matrix, Option<&'a mut Matrix>);

    impl Hessian for Alone<'_> {
        fn apply(&mut self, p: &[f64], hp: &mut [f64], defect: &mut [f64]) {
            self.0.apply(p, hp);
            defect.fill(0.0);
        }

        fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
            let Some(m) = &mut self.1 else { return false };
            m.apply(r, z);
            true
        }
    }

    struct Run {
        x: Vec<f64>,
        outcome: Outcome,
        statistics: Statistics,
    }

    fn run(
        a: &mut Matrix,
        m: Option<&mut Matrix>,
        b: &[f64],
        bounds: &Bounds,
        expansion: Expansion,
        norm: f64,
        tolerance: f64,
    ) -> Run {
        let cost = Matrix::new(a.n, a.entries.clone());
        let n = b.len();
        let mut hessian = Alone(a, m);
        let mut statistics = Statistics::default();
        let mut point = Point { x: vec![0.0; n], gradient: vec![0.0; n], defect: vec![0.0; n], age: 0 };
        bounds.project(&mut point.x);
        point.refresh(&mut hessian, b, &mut statistics);
        let mut solver = Mprgp::new(&Plain, bounds, expansion, norm, 3000);
        let mut last = f64::INFINITY;
        let mut outcome = Outcome::Converged;
        let mut done = false;
        // One step at a time, to see that the cost never rises.
        while !done && outcome == Outcome::Converged {
            let mut calls = 0;
            outcome = solver.minimise(&mut hessian, b, &mut point, &mut statistics, &mut |norms| {
                done = norms.gradient <= tolerance;
                calls += 1;
                done || calls > 7
            });
            let now = cost.cost(&point.x, b);
            assert!(outcome != Outcome::Converged || now <= last + 1e-12 * last.abs(), "{now} after {last}");
            last = now;
        }
        Run { x: point.x, outcome, statistics }
    }

    #[test]
    fn equals_enumeration() {
        let mut random = Random::new(11);
        for case in 0..60 {
            let n = 3 + case % 10;
            let mut a = Matrix::with_condition(n, 100.0, &mut random);
            let b = random.vector(n);
            let lower: Vec<f64> = (0..n).map(|i| if i < 7 { 2.0 * random.next() } else { f64::NEG_INFINITY }).collect();
            let exact = enumerate(&a, &b, &lower, &Null::default());
            let bounds = Bounds::new(lower);
            for expansion in [Expansion::ProjectedCg, Expansion::Fixed] {
                // A norm four times too small must not break it.
                for norm in [1.0, 0.25] {
                    let found = run(&mut a, None, &b, &bounds, expansion, norm, 1e-9);
                    assert_eq!(found.outcome, Outcome::Converged);
                    assert!(distance(&found.x, &exact) < 1e-6, "case {case} {expansion:?} {:?}", found.statistics);
                }
            }
        }
    }

    /// Membrane under load above a flat obstacle, 23 x 23 points.
    fn membrane() -> (Matrix, Vec<f64>, Bounds) {
        let a = Matrix::laplacian(23);
        let n = a.n;
        (a, vec![-10.0; n], Bounds::new(vec![-0.3; n]))
    }

    #[test]
    fn membrane_over_an_obstacle() {
        let (mut a, b, bounds) = membrane();
        let norm = 8.0 * 24.0 * 24.0;
        let mut solutions = Vec::new();
        for (expansion, limit) in [(Expansion::ProjectedCg, 90), (Expansion::Fixed, 300)] {
            let found = run(&mut a, None, &b, &bounds, expansion, norm, 1e-7 * dot(&b, &b).sqrt());
            assert_eq!(found.outcome, Outcome::Converged);
            assert!(found.statistics.hessian <= limit, "{expansion:?} {:?}", found.statistics);
            let ax = a.times(&found.x);
            let active = bounds.active(&found.x);
            for i in 0..a.n {
                let force = ax[i] - b[i];
                assert!(if active[i] { force >= -1e-4 } else { force.abs() < 1e-4 && found.x[i] > -0.3 });
            }
            solutions.push(found.x);
        }
        assert!(distance(&solutions[0], &solutions[1]) < 1e-6);
    }

    #[test]
    fn preconditioned_in_the_face() {
        let (mut a, b, bounds) = membrane();
        let tolerance = 1e-7 * dot(&b, &b).sqrt();
        let plain = run(&mut a, None, &b, &bounds, Expansion::ProjectedCg, 4608.0, tolerance);
        let mut shifted = Matrix::new(a.n, a.entries.clone());
        (0..a.n).for_each(|i| shifted.entries[i * a.n + i] += 20.0);
        let mut m = shifted.inverse();
        let fast = run(&mut a, Some(&mut m), &b, &bounds, Expansion::ProjectedCg, 4608.0, tolerance);
        assert!(distance(&plain.x, &fast.x) < 1e-6);
        assert!(fast.statistics.hessian < plain.statistics.hessian, "{:?} {:?}", fast.statistics, plain.statistics);
    }

    #[test]
    fn unbounded_and_not_finite() {
        let mut random = Random::new(12);
        let mut a = Matrix::with_eigenvalues(&[1.0, 0.0, 0.0], &mut random);
        a.entries.iter_mut().for_each(|v| *v = -*v);
        let b = random.vector(3);
        let free = Bounds::new(vec![f64::NEG_INFINITY; 3]);
        assert_eq!(run(&mut a, None, &b, &free, Expansion::ProjectedCg, 1.0, 1e-9).outcome, Outcome::Unbounded);
        a.entries[4] = f64::NAN;
        assert_eq!(run(&mut a, None, &b, &free, Expansion::ProjectedCg, 1.0, 1e-9).outcome, Outcome::NotFinite);
    }
}
