//! SMALSE-M: bounds and equalities by augmented Lagrangians, min 1/2 x'A x - x'b over { x >= l, G x = 0 }.
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

use super::bounds::Bounds;
use super::mprgp::{Expansion, Mprgp, Norms, Point};
use super::penalty::Penalised;
use super::quadratic::{Quadratic, Space};
use super::{Limits, Outcome, Statistics, axpy};

/// Penalty rho, times the norm. Adds one far cluster of eigenvalues, which does not slow CG (Dostal 2009, section 4.6).
const PENALTY: f64 = 100.0;
/// First M, times the norm.
const BALANCE: f64 = 10.0;
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
    /// A and P; a preconditioner M is used as P M P + Q / rho in faces.
    pub function: &'a mut dyn Quadratic,
    /// b; only P b matters.
    pub b: &'a [f64],
    /// l.
    pub bounds: &'a Bounds,
}

/// How to solve it.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Tolerances for |g^P| and norm |Q x|, both referred to the first |g^P| by default.
    pub limits: Limits,
    /// Estimate of the norm of P A P, see [`super::power`].
    pub norm: f64,
    /// Step into bounds.
    pub expansion: Expansion,
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
    /// The unknowns: x >= l holds exactly, G x = 0 within `defect_norm`.
    pub x: Vec<f64>,
    /// `P (A P x - b) + m`: up to the tolerance zero on the free set, nonnegative on the active one.
    pub gradient: Vec<f64>,
    /// The equality multiplier m that belongs to the gradient.
    pub multiplier: Vec<f64>,
    /// Which entries are on their bound.
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
    let Problem { space, function, b, bounds } = problem;
    let n = b.len();
    let mut b = b.to_vec();
    function.project(&mut b);
    let mut inside = vec![0.0; n];
    let mut multiplier = start.multiplier.unwrap_or_else(|| vec![0.0; n]);
    // What is not in Im G' would shift the solution.
    inside.copy_from_slice(&multiplier);
    function.project(&mut inside);
    axpy(-1.0, &inside, &mut multiplier);
    let mut x = start.x;
    bounds.project(&mut x);

    let starts_at_zero = space.dot(&x, &x) == 0.0;
    let (mut target, mut loose, mut first) = (0.0, 0.0, None);
    let norm = settings.norm;
    let penalty = PENALTY * norm;
    let mut balance = BALANCE * norm;

    let mut hessian = Penalised { function, penalty, inside };
    let mut inner = Mprgp::new(space, bounds, settings.expansion, penalty, settings.limits.products);
    let mut statistics = Statistics::default();
    let mut point = Point { x, gradient: vec![0.0; n], defect: vec![0.0; n], age: 0 };
    let mut right: Vec<f64> = b.iter().zip(&multiplier).map(|(b, m)| b - m).collect();
    if starts_at_zero {
        axpy(-1.0, &right, &mut point.gradient);
    } else {
        point.refresh(&mut hessian, &right, &mut statistics);
    }

    let mut norms = Norms { gradient: f64::NAN, defect: f64::NAN };
    let mut cost_before = f64::NEG_INFINITY;
    let outcome = loop {
        let mut done = false;
        let outcome = inner.minimise(&mut hessian, &right, &mut point, &mut statistics, &mut |now| {
            norms = now;
            let first_norm = *first.get_or_insert(now.gradient);
            target = settings.limits.target(first_norm);
            loose = (LOOSE * first_norm).max(target);
            done = now.gradient <= target && norm * now.defect <= target;
            done || now.gradient <= loose.min(balance * now.defect)
        });
        if outcome == Outcome::Converged && done && point.age > AGE {
            point.refresh(&mut hessian, &right, &mut statistics);
            continue;
        }
        hessian.clean(&mut point);
        let d = space.dots(&[(&point.x, &point.gradient), (&point.x, &right)]);
        let cost = 0.5 * (d[0] - d[1]);
        if cost < cost_before + 0.5 * penalty * norms.defect * norms.defect {
            balance /= SHRINK;
        }
        cost_before = cost;
        // The gradient contains m + rho Q x already.
        axpy(penalty, &point.defect, &mut multiplier);
        if outcome != Outcome::Converged || done {
            break outcome;
        }
        axpy(-penalty, &point.defect, &mut right);
        axpy(penalty, &point.defect, &mut point.gradient);
        statistics.outer += 1;
    };
    let active = bounds.active(&point.x);
    Solution {
        active,
        x: point.x,
        gradient: point.gradient,
        multiplier,
        outcome,
        statistics,
        first_norm: first.unwrap_or(f64::NAN),
        gradient_norm: norms.gradient,
        defect_norm: norms.defect,
    }
}

#[cfg(test)]
mod tests {
    use super::super::dense::{Matrix, Null, Plain, Random, distance, dot, enumerate};
    use super::super::quadratic::{Joined, Operator, Projection};
    use super::*;

    const LIMITS: Limits = Limits { relative: 1e-9, reference: None, absolute: 0.0, drop: 0.0, products: 4000 };
    const NONE: f64 = f64::NEG_INFINITY;

    struct Case {
        a: Matrix,
        null: Null,
        b: Vec<f64>,
        bounds: Bounds,
        settings: Settings,
    }

    impl Case {
        fn new(a: Matrix, null: Null, b: Vec<f64>, lower: Vec<f64>) -> Self {
            let settings = Settings { limits: LIMITS, norm: 1.0, expansion: Expansion::ProjectedCg };
            Self { a, null, b, bounds: Bounds::new(lower), settings }
        }

        /// Random, `rows` equalities of which one is redundant, every third entry bounded.
        fn random(n: usize, rows: usize, cond: f64, random: &mut Random) -> Self {
            let a = Matrix::with_condition(n, cond, random);
            let mut g: Vec<_> = (0..rows).map(|_| random.vector(n)).collect();
            g.extend(g.first().cloned());
            let lower = (0..n).map(|i| if i % 3 == 0 { -random.next().abs() } else { NONE }).collect();
            Self::new(a, Null::of(g), random.vector(n), lower)
        }

        fn exact(&self) -> Vec<f64> {
            enumerate(&self.a, &self.b, self.bounds.lower(), &self.null)
        }

        fn from(&mut self, start: Start, preconditioner: Option<&mut Matrix>) -> Solution {
            let before = self.a.products;
            let mut size = self.b.clone();
            self.null.project(&mut size);
            self.settings.limits.reference = Some(dot(&size, &size).sqrt());
            let problem = Problem {
                space: &Plain,
                function: &mut Joined {
                    operator: &mut self.a,
                    projection: &mut self.null,
                    preconditioner: preconditioner.map(|m| m as &mut dyn Operator),
                },
                b: &self.b,
                bounds: &self.bounds,
            };
            let found = solve(problem, &self.settings, start);
            assert_eq!(self.a.products - before, found.statistics.hessian);
            found
        }

        fn solve(&mut self) -> Solution {
            self.from(Start { x: vec![0.0; self.b.len()], multiplier: None }, None)
        }

        /// Optimality recomputed: stationarity on the free set, signs on the active one, equalities, P-free multiplier.
        fn check(&mut self, found: &Solution, tolerance: f64) {
            assert_eq!(found.outcome, Outcome::Converged);
            let mut inside = found.x.clone();
            self.null.project(&mut inside);
            let mut g: Vec<f64> = self.a.times(&inside).iter().zip(&self.b).map(|(ax, b)| ax - b).collect();
            self.null.project(&mut g);
            axpy(1.0, &found.multiplier, &mut g);
            let scale = tolerance * dot(&self.b, &self.b).sqrt();
            assert!(distance(&g, &found.gradient) < scale, "{} {scale}", distance(&g, &found.gradient));
            assert!(distance(&inside, &found.x) < scale);
            let mut multiplier = found.multiplier.clone();
            self.null.project(&mut multiplier);
            assert!(
                dot(&multiplier, &multiplier).sqrt() < 1e-14 * (1.0 + dot(&found.multiplier, &found.multiplier).sqrt())
            );
            for (i, lower) in self.bounds.lower().iter().enumerate() {
                assert_eq!(found.active[i], found.x[i] == *lower);
                assert!(found.x[i] >= *lower);
                assert!(if found.active[i] { g[i] > -scale } else { g[i].abs() < scale });
            }
        }
    }

    #[test]
    fn equals_enumeration() {
        let mut random = Random::new(21);
        for k in 0..60 {
            let (n, rows) = (9 + k % 12, k % 4);
            let mut case = Case::random(n, rows, 50.0, &mut random);
            let exact = case.exact();
            for expansion in [Expansion::ProjectedCg, Expansion::Fixed] {
                case.settings.expansion = expansion;
                let found = case.solve();
                case.check(&found, 1e-8);
                assert!(distance(&found.x, &exact) < 1e-6, "case {k} {expansion:?} {:?}", found.statistics);
            }
        }
    }

    #[test]
    fn zero_forces_at_the_bounds() {
        let mut random = Random::new(22);
        for _ in 0..20 {
            // The unconstrained solution lies exactly on some bounds.
            let mut case = Case::random(15, 2, 30.0, &mut random);
            let free = enumerate(&case.a, &case.b, &[NONE; 15], &case.null);
            let lower = (0..15).map(|i| if i % 3 == 0 { free[i] - (i % 2) as f64 } else { NONE }).collect();
            case.bounds = Bounds::new(lower);
            let found = case.solve();
            case.check(&found, 1e-8);
            assert!(distance(&found.x, &free) < 1e-6);
        }
    }

    #[test]
    fn definite_on_the_null_space_only() {
        let mut random = Random::new(23);
        for _ in 0..10 {
            let mut values = vec![0.0; 3];
            values.extend((0..15).map(|k| 1.0 / (1.0 + f64::from(k))));
            let mut case = Case::random(18, 4, 10.0, &mut random);
            case.a = Matrix::with_eigenvalues(&values, &mut random);
            let exact = case.exact();
            let found = case.solve();
            case.check(&found, 1e-8);
            assert!(distance(&found.x, &exact) < 1e-5);
        }
    }

    #[test]
    fn ill_conditioned() {
        let mut random = Random::new(24);
        for cond in [1e8, 1e10] {
            let mut case = Case::random(60, 3, cond, &mut random);
            case.b = case.a.times(&random.vector(60));
            case.settings.limits.relative = 1e-6;
            let found = case.solve();
            case.check(&found, 2e-6);
        }
    }

    #[test]
    fn warm_start_at_the_solution() {
        let mut random = Random::new(25);
        let mut case = Case::random(60, 4, 1e3, &mut random);
        let first = case.solve();
        case.check(&first, 1e-8);
        case.settings.limits.relative = 2e-9;
        let again = case.from(Start { x: first.x.clone(), multiplier: Some(first.multiplier) }, None);
        case.check(&again, 1e-8);
        assert!(again.statistics.hessian <= 3, "{:?}", again.statistics);
        assert!(distance(&again.x, &first.x) < 1e-6);
    }

    /// A dual problem's like: F = B K^-1 B' of floating membranes would be of this kind; 23 x 23 unknowns.
    fn large(random: &mut Random) -> Case {
        let mut a = Matrix::laplacian(23);
        let n = a.n;
        let norm = 8.0 * 24.0 * 24.0;
        a.entries.iter_mut().for_each(|v| *v /= norm);
        let g = (0..8).map(|k| (0..n).map(|i| if i % 8 == k { random.next() } else { 0.0 }).collect()).collect();
        let lower = (0..n).map(|i| if i % 4 == 0 { -0.5 } else { NONE }).collect();
        let b = (0..n).map(|_| 1e-2 * (random.next() - 0.3)).collect();
        Case::new(a, Null::of(g), b, lower)
    }

    #[test]
    fn five_hundred_unknowns() {
        let mut case = large(&mut Random::new(26));
        case.settings.limits.relative = 1e-7;
        let found = case.solve();
        case.check(&found, 1e-6);
        assert!(found.statistics.hessian <= 200, "{:?}", found.statistics);
        let active = found.active.iter().filter(|a| **a).count();
        assert!((5..130).contains(&active), "{active}");
    }

    #[test]
    fn preconditioner_saves_products() {
        let mut case = large(&mut Random::new(27));
        let plain = case.solve();
        let mut shifted = Matrix::new(case.a.n, case.a.entries.clone());
        (0..case.a.n).for_each(|i| shifted.entries[i * case.a.n + i] += 0.01);
        let n = case.a.n;
        let fast = case.from(Start { x: vec![0.0; n], multiplier: None }, Some(&mut shifted.inverse()));
        case.check(&plain, 1e-8);
        case.check(&fast, 1e-8);
        assert!(distance(&plain.x, &fast.x) < 1e-4);
        assert!(fast.statistics.preconditioner > 0);
        assert!(fast.statistics.hessian < plain.statistics.hessian, "{:?} {:?}", fast.statistics, plain.statistics);
    }

    #[test]
    fn units_do_not_matter() {
        let mut case = Case::random(30, 3, 1e2, &mut Random::new(28));
        let first = case.solve();
        case.a.entries.iter_mut().for_each(|v| *v *= 1e-6);
        case.b.iter_mut().for_each(|v| *v *= 1e-6);
        case.settings.norm = 1e-6;
        let second = case.solve();
        assert_eq!(first.active, second.active);
        assert!(first.statistics.hessian.abs_diff(second.statistics.hessian) < 5);
        assert!(distance(&first.x, &second.x) < 1e-6);
    }

    #[test]
    fn bad_matrices_end_as_outcomes() {
        let mut random = Random::new(29);
        let mut case = Case::random(12, 2, 10.0, &mut random);
        case.a.entries[17] = f64::NAN;
        assert_eq!(case.solve().outcome, Outcome::NotFinite);
        let mut case = Case::random(60, 2, 1e6, &mut random);
        case.settings.limits.products = 10;
        let found = case.solve();
        assert_eq!(found.outcome, Outcome::LimitReached);
        assert!(found.statistics.hessian <= 13);
    }
}
