//! Projected preconditioned conjugate gradients: min 1/2 x'A x - x'b over x in x0 + Ker G, no bounds.
//!
//! Farhat, Lesoinne and Pierson, Numer. Linear Algebra Appl. 7 (2000). Every direction is P M P r, orthogonalised in the
//! A-inner product against *all* kept directions: at some dozens of iterations this costs little next to the products
//! and restores the convergence that round-off takes. Rows that are to stay zero are the projector's affair: if P maps
//! onto vectors that vanish there, so do all directions.
//!
//! The residual b - A x is carried *unprojected*, so that a caller who changes P or moves x goes on from it.

use super::quadratic::{Operator, Projection, Space};
use super::{Limits, Outcome, Statistics, axpy};

/// Directions kept (two vectors each); beyond that the oldest is replaced.
const KEPT: usize = 120;

/// How it ended.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// How it ended.
    pub outcome: Outcome,
    /// What it took; CG steps and products are as many as iterations.
    pub statistics: Statistics,
    /// Norm of P r at the start.
    pub first_norm: f64,
    /// Norm of P r at the end.
    pub norm: f64,
}

/// Solves from `x`, with `residual = b - A x` on entry and on return (at x = 0 it is b: no product needed). A direction
/// without curvature ends it as [`Outcome::Unbounded`].
pub fn solve(
    space: &dyn Space,
    operator: &mut dyn Operator,
    projection: &mut dyn Projection,
    mut preconditioner: Option<&mut dyn Operator>,
    x: &mut [f64],
    residual: &mut [f64],
    limits: &Limits,
) -> Report {
    let n = x.len();
    let mut kept: Vec<Direction> = Vec::new();
    let (mut inside, mut z) = (vec![0.0; n], vec![0.0; n]);
    let mut statistics = Statistics::default();
    let mut first_norm = None;
    loop {
        inside.copy_from_slice(residual);
        projection.project(&mut inside);
        let norm = space.norm(&inside);
        let first_norm = *first_norm.get_or_insert(norm);
        let report = |outcome, statistics| Report { outcome, statistics, first_norm, norm };
        if !norm.is_finite() {
            return report(Outcome::NotFinite, statistics);
        }
        if norm <= limits.target(first_norm) {
            return report(Outcome::Converged, statistics);
        }
        if statistics.hessian >= limits.products {
            return report(Outcome::LimitReached, statistics);
        }

        if let Some(m) = preconditioner.as_deref_mut() {
            m.apply(&inside, &mut z);
            projection.project(&mut z);
            statistics.preconditioner += 1;
        } else {
            z.copy_from_slice(&inside);
        }
        let pairs: Vec<_> = kept.iter().map(|d| (&z[..], &d.ap[..])).collect();
        let coefficients = space.dots(&pairs);
        for (d, c) in kept.iter().zip(coefficients) {
            axpy(-c / d.curvature, &d.p, &mut z);
        }

        let mut ap = vec![0.0; n];
        operator.apply(&z, &mut ap);
        statistics.hessian += 1;
        let d = space.dots(&[(&z, &ap), (&z, &inside)]);
        if !(d[0].is_finite() && d[1].is_finite()) {
            return report(Outcome::NotFinite, statistics);
        }
        if d[0] <= 0.0 {
            return report(Outcome::Unbounded, statistics);
        }
        let step = d[1] / d[0];
        axpy(step, &z, x);
        axpy(-step, &ap, residual);
        let direction = Direction { p: std::mem::replace(&mut z, vec![0.0; n]), ap, curvature: d[0] };
        if kept.len() < KEPT {
            kept.push(direction);
        } else {
            kept[statistics.cg % KEPT] = direction;
        }
        statistics.cg += 1;
    }
}

/// A search direction with its product.
struct Direction {
    p: Vec<f64>,
    ap: Vec<f64>,
    curvature: f64,
}

#[cfg(test)]
mod tests {
    use super::super::dense::{Matrix, Null, Plain, Random, distance, dot, enumerate};
    use super::*;

    const LIMITS: Limits = Limits { relative: 1e-10, reference: None, absolute: 0.0, products: 1000 };

    fn run(a: &mut Matrix, null: &mut Null, m: Option<&mut dyn Operator>, b: &[f64], x: &mut [f64]) -> Report {
        let mut residual: Vec<f64> = a.times(x).iter().zip(b).map(|(ax, b)| b - ax).collect();
        let report = solve(&Plain, a, null, m, x, &mut residual, &LIMITS);
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
        let again = solve(&Plain, &mut a, &mut null, None, &mut x, &mut residual, &limits);
        assert_eq!((again.outcome, again.statistics.hessian), (Outcome::Converged, 0));
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
    fn ill_conditioned() {
        let mut random = Random::new(6);
        let n = 60;
        let mut a = Matrix::with_condition(n, 1e9, &mut random);
        let b = random.vector(n);
        let mut x = vec![0.0; n];
        let mut residual = b.clone();
        let limits = Limits { relative: 1e-6, ..LIMITS };
        let report = solve(&Plain, &mut a, &mut Null::default(), None, &mut x, &mut residual, &limits);
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(report.statistics.hessian <= 2 * n, "{report:?}");
        assert!(distance(&a.times(&x), &b) < 1e-5 * dot(&b, &b).sqrt());
    }

    #[test]
    fn bad_matrices_end_as_outcomes() {
        let mut random = Random::new(7);
        let mut a = Matrix::with_condition(5, 10.0, &mut random);
        a.entries.iter_mut().for_each(|v| *v = -*v);
        let b = random.vector(5);
        assert_eq!(run(&mut a, &mut Null::default(), None, &b, &mut [0.0; 5]).outcome, Outcome::Unbounded);
        a.entries[7] = f64::NAN;
        let report = solve(&Plain, &mut a, &mut Null::default(), None, &mut [0.0; 5], &mut b.clone(), &LIMITS);
        assert_eq!(report.outcome, Outcome::NotFinite);
    }
}
