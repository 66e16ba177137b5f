//! Projected preconditioned conjugate gradients: min 1/2 x'A x - x'b over x in x0 + Ker G, no bounds.
//!
//! Farhat, Lesoinne and Pierson, Numer. Linear Algebra Appl. 7 (2000). Every direction is P M P'r, orthogonalised in the
//! A-inner product against *all* kept directions: at some dozens of iterations this costs little next to the products
//! and restores the convergence that round-off takes. To keep some rows zero, let P map onto vectors that are zero there:
//! then all directions are.
//!
//! The residual b - A x is carried *unprojected*, so that a caller can change P or move x and go on from it. The projected
//! residual and its norm are carried by recurrences. An iteration has three collectives: for P M P'r, for the kept
//! directions, and for P'A p with all other inner products.
//!
//! A product in single precision is symmetric to about 1e-8. So the residual keeps as much of itself along kept directions, which no
//! new direction takes away. Where that is all there is left, the next direction is rounding. It shows, as p'P'r is
//! r'P M P'r otherwise, and x goes to the minimum along the kept directions once more.

use super::inside::Inside;
use super::quadratic::{Quadratic, Space};
use super::{Limits, Outcome, Statistics};
use crate::vector::axpy;

/// Directions kept (two vectors each); beyond that the oldest is replaced.
const KEPT: usize = 240;

/// When the squared norm has dropped by this factor it is measured again.
const REFRESH: f64 = 1e-4;

/// How it ended.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// How it ended.
    pub outcome: Outcome,
    /// What it took; CG steps and products are as many as iterations.
    pub statistics: Statistics,
    /// Norm of P'r at the start.
    pub first_norm: f64,
    /// Norm of P'r at the end.
    pub norm: f64,
    /// A norm that is nothing but rounding.
    pub noise: f64,
}

/// Where p'P'r is below this share of r'P M P'r, the residual lies along kept directions.
const LOST: f64 = 0.5;

/// A search direction with its product.
struct Direction {
    p: Vec<f64>,
    ap: Vec<f64>,
    curvature: f64,
}

/// Directions that are A-orthogonal to each other, with their products.
#[derive(Default)]
pub struct Directions {
    kept: Vec<Direction>,
    oldest: usize,
}

/// The solver with the directions it keeps. As long as A and P stay the same it goes on from them: to solve loosely,
/// look, and solve on costs nothing.
pub struct Pcpg<'a> {
    space: &'a dyn Space,
    directions: Directions,
}

impl<'a> Pcpg<'a> {
    /// A solver that knows no direction yet.
    pub fn new(space: &'a dyn Space) -> Self {
        Self::with(space, Directions::default())
    }

    /// A solver that knows directions of the same A in the range of the same P.
    pub fn with(space: &'a dyn Space, directions: Directions) -> Self {
        Self { space, directions }
    }

    /// What it knows.
    pub fn into_directions(self) -> Directions {
        self.directions
    }

    /// Takes `x` to the minimum along the directions that it knows; see [`Directions::descend`].
    pub fn descend(&self, x: &mut [f64], residual: &mut [f64]) {
        self.directions.descend(self.space, x, residual);
    }

    /// Drops the directions; due when A or the range of P has changed.
    pub fn forget(&mut self) {
        self.directions = Directions::default();
    }

    /// Solves from `x`, with `residual = b - A x` on entry and on return (at x = 0 it is b: no product needed). A
    /// direction without curvature ends it as [`Outcome::Unbounded`].
    pub fn solve(
        &mut self,
        function: &mut dyn Quadratic,
        x: &mut [f64],
        residual: &mut [f64],
        limits: &Limits,
    ) -> Report {
        let mut statistics = Statistics::default();
        let mut inside = Inside::of(self.space, function, residual);
        let first_norm = inside.norm();
        let mut has_descended = false;
        loop {
            // Stopping tests by |P'r|, which is measured before it is believed.
            let (norm, noise) = (inside.norm(), inside.noise);
            let report = |outcome, statistics| Report { outcome, statistics, first_norm, norm, noise };
            if !norm.is_finite() {
                return report(Outcome::NotFinite, statistics);
            }
            let small = norm <= limits.target(first_norm).max(noise);
            if small && inside.is_measured() {
                return report(Outcome::Converged, statistics);
            }
            if small || inside.has_dropped(REFRESH) {
                inside = Inside::of(self.space, function, residual);
                continue;
            }
            if statistics.hessian >= limits.products {
                return report(Outcome::LimitReached, statistics);
            }

            // The direction p = P M P'r, A-orthogonal to all kept ones, and its product.
            let (p, expected) = self.direction(function, &inside.residual, &mut statistics);
            let mut ap = vec![0.0; p.len()];
            function.apply(&p, &mut ap);
            statistics.hessian += 1;

            // The step p'P'r / p'A p, with the products that the norm of the next P'r follows from.
            let mut projected = ap.clone();
            let (of_image, d) = function.reduce_with_products(
                self.space,
                &mut projected,
                &inside.residual,
                &[&p],
                &[(&p, &inside.residual)],
            );
            let [curvature, slope] = d[..] else { unreachable!("two products were asked for") };
            if !(curvature.is_finite() && slope.is_finite()) {
                return report(Outcome::NotFinite, statistics);
            }
            if slope < LOST * expected && !has_descended {
                self.directions.descend(self.space, x, residual);
                inside = Inside::of(self.space, function, residual);
                has_descended = true;
                continue;
            }
            has_descended = false;
            if curvature <= 0.0 {
                return report(Outcome::Unbounded, statistics);
            }
            let step = slope / curvature;
            axpy(step, &p, x);
            axpy(-step, &ap, residual);
            inside.advance(step, &projected, of_image);
            statistics.cg += 1;
            self.directions.keep(Direction { p, ap, curvature });
        }
    }

    /// The next direction: `P M r` of the projected residual, or `r` itself without a preconditioner, A-orthogonal to the
    /// kept ones; and what its product with `r` is but for rounding, or zero if there are no kept ones.
    fn direction(&self, function: &mut dyn Quadratic, r: &[f64], statistics: &mut Statistics) -> (Vec<f64>, f64) {
        let mut z = vec![0.0; r.len()];
        if function.precondition(r, &mut z) {
            statistics.preconditioner += 1;
        } else {
            z.copy_from_slice(r);
        }
        function.project(&mut z);
        if self.directions.kept.is_empty() {
            return (z, 0.0);
        }
        let of_kept = self.directions.kept.iter().map(|d| (&z[..], &d.ap[..]));
        let mut coefficients = self.space.dots(&of_kept.chain([(&z[..], r)]).collect::<Vec<_>>());
        let expected = coefficients.pop().unwrap_or(0.0);
        for (d, c) in self.directions.kept.iter().zip(coefficients) {
            axpy(-c / d.curvature, &d.p, &mut z);
        }
        (z, expected)
    }
}

impl Directions {
    /// Takes `x` to the minimum along all of them, where the residual is `b - A x`; no product is needed.
    pub fn descend(&self, space: &dyn Space, x: &mut [f64], residual: &mut [f64]) {
        if self.kept.is_empty() {
            return;
        }
        let pairs: Vec<(&[f64], &[f64])> = self.kept.iter().map(|d| (&d.p[..], &*residual)).collect();
        for (d, slope) in self.kept.iter().zip(space.dots(&pairs)) {
            axpy(slope / d.curvature, &d.p, x);
            axpy(-slope / d.curvature, &d.ap, residual);
        }
    }

    fn keep(&mut self, direction: Direction) {
        if self.kept.len() < KEPT {
            self.kept.push(direction);
        } else {
            self.kept[self.oldest] = direction;
            self.oldest = (self.oldest + 1) % KEPT;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::dense::{Joined, Matrix, Null, Plain, Random, distance, dot, enumerate};
    use super::*;

    const LIMITS: Limits =
        Limits { relative: 1e-10, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 1000 };

    fn run(a: &mut Matrix, null: &mut Null, m: Option<&mut Matrix>, b: &[f64], x: &mut [f64]) -> Report {
        let mut residual: Vec<f64> = a.times(x).iter().zip(b).map(|(ax, b)| b - ax).collect();
        let report = Pcpg::new(&Plain).solve(&mut Joined(a, null, m), x, &mut residual, &LIMITS);
        let ax = a.times(x);
        let recomputed: Vec<f64> = b.iter().zip(&ax).map(|(b, ax)| b - ax).collect();
        assert!(report.outcome != Outcome::Converged || distance(&recomputed, &residual) < 1e-10);
        report
    }

    #[test]
    fn equals_the_dense_solution_with_redundant_equalities() {
        let mut random = Random::new(3);
        let n = 30;
        let mut a = Matrix::with_condition(n, 1e3, &mut random);
        let (g, h, b) = (random.vector(n), random.vector(n), random.vector(n));
        let sum = g.iter().zip(&h).map(|(g, h)| g + h).collect();
        let mut null = Null::of(vec![g, h, sum]);
        let mut x = vec![0.0; n];
        let report = run(&mut a, &mut null, None, &b, &mut x);
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(report.statistics.hessian <= n, "{report:?}");
        assert!(distance(&x, &enumerate(&a, &b, &vec![f64::NEG_INFINITY; n], &null)) < 1e-6);
    }

    #[test]
    fn stays_in_the_space_it_starts_in_and_costs_nothing_at_the_solution() {
        let mut random = Random::new(4);
        let n = 20;
        let mut a = Matrix::with_condition(n, 1e2, &mut random);
        let mut null = Null::of(vec![random.vector(n)]);
        let (b, mut x) = (random.vector(n), random.vector(n));
        let before = dot(&null.rows[0], &x);
        let first = run(&mut a, &mut null, None, &b, &mut x);
        assert!((dot(&null.rows[0], &x) - before).abs() < 1e-12);
        let mut residual: Vec<f64> = a.times(&x).iter().zip(&b).map(|(ax, b)| b - ax).collect();
        let limits = Limits { reference: Some(first.first_norm), relative: 1e-9, ..LIMITS };
        let again = Pcpg::new(&Plain).solve(&mut Joined(&mut a, &mut null, None), &mut x, &mut residual, &limits);
        assert_eq!((again.outcome, again.statistics.hessian), (Outcome::Converged, 0));
    }

    #[test]
    fn directions_lead_to_other_solutions_without_products() {
        let mut random = Random::new(9);
        let n = 30;
        let mut a = Matrix::with_condition(n, 1e3, &mut random);
        let mut null = Null::of(vec![random.vector(n)]);
        let (b, other) = (random.vector(n), random.vector(n));
        let mut solver = Pcpg::new(&Plain);
        let (mut x, mut residual) = (vec![0.0; n], b);
        solver.solve(&mut Joined(&mut a, &mut null, None), &mut x, &mut residual, &LIMITS);
        let known = solver.into_directions();
        let (mut x, mut residual) = (vec![0.0; n], other.clone());
        known.descend(&Plain, &mut x, &mut residual);
        let ax = a.times(&x);
        assert!(distance(&residual, &other.iter().zip(&ax).map(|(b, ax)| b - ax).collect::<Vec<_>>()) < 1e-9);
        // All directions of a space of dimension n - 1 are known.
        assert!(distance(&x, &enumerate(&a, &other, &vec![f64::NEG_INFINITY; n], &null)) < 1e-6);
    }

    #[test]
    fn good_preconditioner_saves_products() {
        let mut random = Random::new(5);
        let n = 80;
        let mut a = Matrix::with_condition(n, 1e4, &mut random);
        let mut near = Matrix::new(n, a.inverse().entries);
        (0..n).for_each(|i| near.entries[i * n + i] *= 1.1);
        let mut null = Null::of(vec![random.vector(n)]);
        let b = random.vector(n);
        let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
        let plain = run(&mut a, &mut null, None, &b, &mut x);
        let fast = run(&mut a, &mut null, Some(&mut near), &b, &mut y);
        assert!(3 * fast.statistics.hessian < 2 * plain.statistics.hessian, "{fast:?} {plain:?}");
        assert!(distance(&x, &y) < 1e-5 * dot(&x, &x).sqrt());
    }

    #[test]
    fn going_on_from_a_loose_solution_costs_no_more() {
        let mut random = Random::new(8);
        let n = 80;
        let mut a = Matrix::with_condition(n, 1e3, &mut random);
        let (b, mut null) = (random.vector(n), Null::of(vec![random.vector(n)]));
        let mut solver = Pcpg::new(&Plain);
        let (mut x, mut residual, mut products) = (vec![0.0; n], b.clone(), 0);
        for relative in [1e-1, 1e-3, 1e-10] {
            let limits = Limits { relative, reference: Some(5.0), ..LIMITS };
            let report = solver.solve(&mut Joined(&mut a, &mut null, None), &mut x, &mut residual, &limits);
            products += report.statistics.hessian;
        }
        let mut y = vec![0.0; n];
        let at_once = run(&mut a, &mut null, None, &b, &mut y);
        assert!(products <= at_once.statistics.hessian + 1, "{products} {at_once:?}");
        assert!(distance(&x, &y) < 1e-6);
    }

    #[test]
    fn ill_conditioned() {
        let mut random = Random::new(6);
        let n = 60;
        let mut a = Matrix::with_condition(n, 1e9, &mut random);
        let b = random.vector(n);
        let mut x = vec![0.0; n];
        let mut residual = b.clone();
        let limits = Limits { relative: 1e-6, ..LIMITS };
        let mut null = Null::default();
        let report = Pcpg::new(&Plain).solve(&mut Joined(&mut a, &mut null, None), &mut x, &mut residual, &limits);
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(report.statistics.hessian <= 2 * n, "{report:?}");
        assert!(distance(&a.times(&x), &b) < 1e-5 * dot(&b, &b).sqrt());
    }

    /// As products in single precision are: then all the directions that there are leave some residual.
    #[test]
    fn a_matrix_that_is_hardly_symmetric_takes_few_products_more_than_it_has_rows() {
        let mut random = Random::new(8);
        for n in [2, 3, 5, 12] {
            let mut a = Matrix::with_condition(n, 10.0, &mut random);
            let errors = random.vector(n * n);
            a.entries.iter_mut().zip(errors).for_each(|(v, error)| *v *= 1.0 + 1e-7 * error);
            let (b, mut x) = (random.vector(n), vec![0.0; n]);
            let mut residual = b.clone();
            let (limits, mut null) = (Limits { relative: 1e-14, ..LIMITS }, Null::default());
            let mut function = Joined(&mut a, &mut null, None);
            let report = Pcpg::new(&Plain).solve(&mut function, &mut x, &mut residual, &limits);
            assert_eq!(report.outcome, Outcome::Converged, "{n} rows: {report:?}");
            assert!(report.statistics.hessian <= n + 4, "{n} rows: {report:?}");
            assert!(distance(&a.times(&x), &b) < 1e-13 * dot(&b, &b).sqrt());
        }
    }

    #[test]
    fn bad_matrices_end_as_outcomes() {
        let mut random = Random::new(7);
        let mut a = Matrix::with_condition(5, 10.0, &mut random);
        a.entries.iter_mut().for_each(|v| *v = -*v);
        let b = random.vector(5);
        assert_eq!(run(&mut a, &mut Null::default(), None, &b, &mut [0.0; 5]).outcome, Outcome::Unbounded);
        a.entries[7] = f64::NAN;
        let (mut x, mut residual) = (vec![0.0; 5], b.clone());
        let mut null = Null::default();
        let report = Pcpg::new(&Plain).solve(&mut Joined(&mut a, &mut null, None), &mut x, &mut residual, &LIMITS);
        assert_eq!(report.outcome, Outcome::NotFinite);
    }
}
