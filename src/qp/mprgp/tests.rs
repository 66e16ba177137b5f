use super::*;
use crate::qp::tests::dense::{Matrix, Null, Plain, Random, distance, dot, enumerate};

/// No equality constraints.
struct Alone<'a>(&'a mut Matrix, Option<&'a mut Matrix>, Vec<bool>);

impl Hessian for Alone<'_> {
    fn apply(&mut self, p: &[f64], hp: &mut [f64], defect: &mut [f64]) {
        self.0.apply(p, hp);
        defect.fill(0.0);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        let Some(m) = &mut self.1 else { return false };
        m.apply(r, z);
        z.iter_mut().zip(&self.2).for_each(|(z, free)| *z *= f64::from(*free));
        true
    }

    fn enter(&mut self, face: &Face) {
        self.2.clone_from(&face.free);
    }

    fn balance(&mut self, _: &[f64], _: &mut [f64]) {}
}

struct Run {
    x: Vec<f64>,
    outcome: Outcome,
    statistics: Statistics,
}

fn run(a: &mut Matrix, m: Option<&mut Matrix>, b: &[f64], set: &FeasibleSet, norm: f64, tolerance: f64) -> Run {
    let cost = Matrix::new(a.n, a.entries.clone());
    let n = b.len();
    let mut hessian = Alone(a, m, Vec::new());
    let mut statistics = Statistics::default();
    let mut point = Point { x: vec![0.0; n], gradient: vec![0.0; n], defect: vec![0.0; n], age: 0 };
    set.project(&mut point.x);
    point.refresh(&mut hessian, b, &mut statistics);
    let mut solver = Mprgp::new(&Plain, set, norm, 3000);
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
        let set = FeasibleSet::above(lower);
        // A norm four times too small must not break it.
        for norm in [1.0, 0.25] {
            let found = run(&mut a, None, &b, &set, norm, 1e-9);
            assert_eq!(found.outcome, Outcome::Converged);
            assert!(distance(&found.x, &exact) < 1e-6, "case {case} {:?}", found.statistics);
        }
    }
}

/// Membrane under load above a flat obstacle, 23 x 23 points.
fn membrane() -> (Matrix, Vec<f64>, FeasibleSet) {
    let a = Matrix::laplacian(23);
    let n = a.n;
    (a, vec![-10.0; n], FeasibleSet::above(vec![-0.3; n]))
}

#[test]
fn membrane_over_an_obstacle() {
    let (mut a, b, set) = membrane();
    let norm = 8.0 * 24.0 * 24.0;
    let found = run(&mut a, None, &b, &set, norm, 1e-7 * dot(&b, &b).sqrt());
    assert_eq!(found.outcome, Outcome::Converged);
    assert!(found.statistics.hessian <= 90, "{:?}", found.statistics);
    let ax = a.times(&found.x);
    let active = set.active(&found.x);
    for i in 0..a.n {
        let force = ax[i] - b[i];
        assert!(if active[i] { force >= -1e-4 } else { force.abs() < 1e-4 && found.x[i] > -0.3 });
    }
}

/// What takes the place of a projected step that is no number, or would raise the cost, even if the norm is too small.
#[test]
fn the_safe_expansion_lowers_the_cost() {
    let mut random = Random::new(13);
    for case in 0..40 {
        let n = 3 + case % 10;
        let mut a = Matrix::with_condition(n, 100.0, &mut random);
        let cost = Matrix::new(n, a.entries.clone());
        let b = random.vector(n);
        let set = FeasibleSet::above((0..n).map(|_| -random.next().abs()).collect());
        let mut hessian = Alone(&mut a, None, Vec::new());
        let (mut point, mut statistics) =
            (Point { x: vec![0.0; n], gradient: vec![0.0; n], defect: vec![0.0; n], age: 0 }, Statistics::default());
        point.refresh(&mut hessian, &b, &mut statistics);
        let before = cost.cost(&point.x, &b);
        let mut solver = Mprgp::new(&Plain, &set, 0.25, 3000);
        solver.p.copy_from_slice(&point.gradient);
        let (p, mut defect) = (solver.p.clone(), vec![0.0; n]);
        hessian.apply(&p, &mut solver.hp, &mut defect);
        let reach = set.reach(&[], &point.x, &p).min(0.1);
        let line = Line { curvature: 0.0, slope: 1.0, reach };
        solver.expand(&mut hessian, &b, &mut point, &mut statistics, &line);
        let after = cost.cost(&point.x, &b);
        assert!(after < before, "case {case}: {after} after {before}");
        assert!(point.x.iter().zip(set.lower()).all(|(x, lower)| x >= lower));
    }
}

#[test]
fn preconditioned_in_the_face() {
    let (mut a, b, set) = membrane();
    let tolerance = 1e-7 * dot(&b, &b).sqrt();
    let plain = run(&mut a, None, &b, &set, 4608.0, tolerance);
    let mut shifted = Matrix::new(a.n, a.entries.clone());
    (0..a.n).for_each(|i| shifted.entries[i * a.n + i] += 20.0);
    let mut m = shifted.inverse();
    let fast = run(&mut a, Some(&mut m), &b, &set, 4608.0, tolerance);
    assert!(distance(&plain.x, &fast.x) < 1e-6);
    assert!(fast.statistics.hessian < plain.statistics.hessian, "{:?} {:?}", fast.statistics, plain.statistics);
}

#[test]
fn unbounded_and_not_finite() {
    let mut random = Random::new(12);
    let mut a = Matrix::with_eigenvalues(&[1.0, 0.0, 0.0], &mut random);
    a.entries.iter_mut().for_each(|v| *v = -*v);
    let b = random.vector(3);
    let free = FeasibleSet::above(vec![f64::NEG_INFINITY; 3]);
    assert_eq!(run(&mut a, None, &b, &free, 1.0, 1e-9).outcome, Outcome::Unbounded);
    a.entries[4] = f64::NAN;
    assert_eq!(run(&mut a, None, &b, &free, 1.0, 1e-9).outcome, Outcome::NotFinite);
}
