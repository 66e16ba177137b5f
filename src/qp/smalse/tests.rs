use super::*;
use crate::qp::tests::dense::{Joined, Matrix, Null, OnFaces, Plain, Random, distance, dot, enumerate};

const LIMITS: Limits =
    Limits { relative: 1e-9, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 4000 };
const NONE: f64 = f64::NEG_INFINITY;

struct Case {
    a: Matrix,
    null: Null,
    b: Vec<f64>,
    set: FeasibleSet,
    settings: Settings,
}

impl Case {
    fn new(a: Matrix, null: Null, b: Vec<f64>, lower: Vec<f64>) -> Self {
        let settings = Settings { limits: LIMITS, norm: 1.0 };
        Self { a, null, b, set: FeasibleSet::above(lower), settings }
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
        enumerate(&self.a, &self.b, self.set.lower(), &self.null)
    }

    fn from(&mut self, start: Start, preconditioner: Option<&mut Matrix>) -> Solution {
        let before = self.a.products;
        let mut size = self.b.clone();
        self.null.project(&mut size);
        self.settings.limits.reference = Some(dot(&size, &size).sqrt());
        let problem = Problem {
            space: &Plain,
            function: &mut OnFaces::new(Joined(&mut self.a, &mut self.null, preconditioner), Vec::new()),
            b: &self.b,
            set: &self.set,
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
        for (i, lower) in self.set.lower().iter().enumerate() {
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
        let found = case.solve();
        case.check(&found, 1e-8);
        assert!(distance(&found.x, &exact) < 1e-6, "case {k} {:?}", found.statistics);
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
        case.set = FeasibleSet::above(lower);
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
    // A power of two changes no rounding.
    let unit = 0.5_f64.powi(20);
    case.a.entries.iter_mut().for_each(|v| *v *= unit);
    case.b.iter_mut().for_each(|v| *v *= unit);
    case.settings.norm = unit;
    let second = case.solve();
    assert_eq!(first.statistics.hessian, second.statistics.hessian);
    assert_eq!((first.active, first.x), (second.active, second.x));
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
