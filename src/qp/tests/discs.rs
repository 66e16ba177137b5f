//! Programs with discs beside bounds and equalities, through SMALSE-M and MPRGP. What they find is compared with closed
//! forms, with the method of multipliers on plain projected gradients, and with the conditions of optimality.

use super::dense::{Joined, Matrix, Null, OnFaces, Plain, Random, distance, dot};
use crate::qp::discs::Disc;
use crate::qp::feasible::FeasibleSet;
use crate::qp::smalse::{Problem, Settings, Solution, Start, solve};
use crate::qp::{Limits, Outcome};
use crate::vector::axpy;

const LIMITS: Limits =
    Limits { relative: 1e-9, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 5000 };
const NONE: f64 = f64::NEG_INFINITY;

struct Case {
    a: Matrix,
    null: Null,
    b: Vec<f64>,
    lower: Vec<f64>,
    discs: Vec<Disc>,
    x: Vec<f64>,
    limits: Limits,
}

impl Case {
    fn new(a: Matrix, b: Vec<f64>, discs: Vec<Disc>) -> Self {
        let n = a.n;
        Self { a, null: Null::default(), b, lower: vec![NONE; n], discs, x: vec![0.0; n], limits: LIMITS }
    }

    /// Groups of a bounded entry and a disc, as of contact with friction, then entries without either; `rows` equalities.
    fn random(groups: usize, rest: usize, rows: usize, cond: f64, radius: f64, random: &mut Random) -> Self {
        let n = 3 * groups + rest;
        let disc = |k: usize, random: &mut Random| Disc {
            entries: [3 * k + 1, 3 * k + 2],
            centre: [0.3 * random.next(), 0.3 * random.next()],
            radius: radius * random.next().abs(),
        };
        let discs = (0..groups).map(|k| disc(k, random)).collect();
        let mut case = Self::new(Matrix::with_condition(n, cond, random), random.vector(n), discs);
        case.null = Null::of((0..rows).map(|_| random.vector(n)).collect());
        (0..groups).for_each(|k| case.lower[3 * k] = -random.next().abs());
        case
    }

    fn set(&self) -> FeasibleSet {
        FeasibleSet::with_discs(self.lower.clone(), self.discs.clone())
    }

    fn solve(&mut self) -> Solution {
        self.solve_on(&self.set(), None, None)
    }

    fn solve_on(
        &mut self,
        set: &FeasibleSet,
        multiplier: Option<Vec<f64>>,
        preconditioner: Option<&mut Matrix>,
    ) -> Solution {
        let mut size = self.b.clone();
        self.null.project(&mut size);
        let limits = Limits { reference: Some(dot(&size, &size).sqrt()), ..self.limits };
        let discs = set.discs().iter().map(|disc| disc.entries).collect();
        let function = &mut OnFaces::new(Joined(&mut self.a, &mut self.null, preconditioner), discs);
        let problem = Problem { space: &Plain, function, b: &self.b, set };
        solve(problem, &Settings { limits, norm: 1.0 }, Start { x: self.x.clone(), multiplier })
    }

    /// Feasibility and optimality, from nothing but x and the equality multiplier. The tolerance is relative to b.
    fn check(&mut self, found: &Solution, tolerance: f64) {
        assert_eq!(found.outcome, Outcome::Converged, "{:?}", found.statistics);
        let scale = tolerance * dot(&self.b, &self.b).sqrt();
        let mut inside = found.x.clone();
        self.null.project(&mut inside);
        assert!(distance(&inside, &found.x) < scale);
        let mut g: Vec<f64> = self.a.times(&inside).iter().zip(&self.b).map(|(ax, b)| ax - b).collect();
        self.null.project(&mut g);
        axpy(1.0, &found.multiplier, &mut g);
        let mut in_disc = vec![false; self.a.n];
        for disc in &self.discs {
            let [i, j] = disc.entries;
            (in_disc[i], in_disc[j]) = (true, true);
            let y = [found.x[i] - disc.centre[0], found.x[j] - disc.centre[1]];
            let (length, size) = (y[0].hypot(y[1]), disc.centre[0].hypot(disc.centre[1]));
            assert!(length <= disc.radius + 2e-15 * (disc.radius + size));
            assert_eq!(found.active[i], found.active[j]);
            if disc.radius == 0.0 {
                assert!(found.active[i] && length == 0.0);
            } else if found.active[i] {
                assert!(length >= disc.radius - 2e-15 * (disc.radius + size));
                let n = y.map(|y| y / length);
                let (normal, tangential) = (n[0] * g[i] + n[1] * g[j], n[0] * g[j] - n[1] * g[i]);
                assert!(normal < scale && tangential.abs() < scale, "{normal} {tangential} {scale}");
            } else {
                assert!(g[i].hypot(g[j]) < scale);
            }
        }
        for (i, lower) in self.lower.iter().enumerate().filter(|(i, _)| !in_disc[*i]) {
            assert!(found.x[i] >= *lower);
            assert!(if found.active[i] { g[i] > -scale } else { g[i].abs() < scale });
        }
    }

    /// The method of multipliers, each step by projected gradients until they stand still.
    fn reference(&mut self) -> Vec<f64> {
        const PENALTY: f64 = 4.0;
        let mut x = self.x.clone();
        let mut multipliers = vec![0.0; self.null.rows.len()];
        loop {
            for _ in 0..100_000 {
                let mut g: Vec<f64> = self.a.times(&x).iter().zip(&self.b).map(|(ax, b)| ax - b).collect();
                for (row, m) in self.null.rows.iter().zip(&multipliers) {
                    axpy(m + PENALTY * dot(row, &x), row, &mut g);
                }
                let old = x.clone();
                axpy(-1.0 / (1.0 + PENALTY), &g, &mut x);
                x.iter_mut().zip(&self.lower).for_each(|(x, lower)| *x = x.max(*lower));
                for Disc { entries: [i, j], centre: [a, b], radius } in self.discs.iter().copied() {
                    let shrink = (radius / (x[i] - a).hypot(x[j] - b)).min(1.0);
                    (x[i], x[j]) = (a + shrink * (x[i] - a), b + shrink * (x[j] - b));
                }
                if distance(&x, &old) < 1e-14 {
                    break;
                }
            }
            let defects: Vec<f64> = self.null.rows.iter().map(|row| dot(row, &x)).collect();
            multipliers.iter_mut().zip(&defects).for_each(|(m, d)| *m += PENALTY * d);
            if dot(&defects, &defects).sqrt() < 1e-12 {
                return x;
            }
        }
    }

    /// How many discs are active.
    fn active(&self, found: &Solution) -> usize {
        self.discs.iter().filter(|disc| found.active[disc.entries[0]]).count()
    }
}

#[test]
fn random_programs() {
    let mut random = Random::new(41);
    let (mut active, mut all) = (0, 0);
    for k in 0..72 {
        let radius = [0.3, 3.0, 30.0][k / 4 % 3];
        let mut case = Case::random(1 + k % 6, 2 + k % 3, k % 4, 50.0, radius, &mut random);
        let exact = case.reference();
        let found = case.solve();
        case.check(&found, 1e-8);
        assert!(distance(&found.x, &exact) < 1e-6, "case {k}: {}", distance(&found.x, &exact));
        assert!(found.statistics.hessian <= 250, "case {k}: {:?}", found.statistics);
        (active, all) = (active + case.active(&found), all + case.discs.len());
    }
    assert!(all / 3 < active && active < 2 * all / 3 + all / 6, "{active} of {all}");
}

#[test]
fn one_disc_in_closed_form() {
    // (A + t I) x = b with the t >= 0 that makes |x| = r.
    for (b, radius) in [([3.0, -1.0], 0.5), ([1e3, 1e-3], 1.0), ([0.0, -2.0], 1e-4), ([5.0, 5.0], 2.0)] {
        let (p, q, s) = (1.0, 0.3, 0.2);
        let x = |t: f64| {
            let determinant = (p + t) * (s + t) - q * q;
            [((s + t) * b[0] - q * b[1]) / determinant, ((p + t) * b[1] - q * b[0]) / determinant]
        };
        let (mut low, mut high) = (0.0, 1e9);
        for _ in 0..200 {
            let t = 0.5 * (low + high);
            *if x(t)[0].hypot(x(t)[1]) > radius { &mut low } else { &mut high } = t;
        }
        let disc = Disc { entries: [1, 0], centre: [0.0; 2], radius };
        let mut case = Case::new(Matrix::new(2, vec![p, q, q, s]), b.to_vec(), vec![disc]);
        let found = case.solve();
        case.check(&found, 1e-8);
        assert!(distance(&found.x, &x(low)) < 1e-7 * radius, "{:?} {:?}", found.x, x(low));
        assert!(found.statistics.hessian <= 16, "{:?}", found.statistics);
    }
}

#[test]
fn the_nearest_point_is_found_at_once() {
    let mut random = Random::new(45);
    let n = 60;
    let identity = (0..n * n).map(|e| f64::from(u8::from(e / n == e % n))).collect();
    let disc = |k| Disc { entries: [2 * k, 2 * k + 1], centre: [2.0, 0.0], radius: 0.1 * k as f64 };
    let mut case = Case::new(Matrix::new(n, identity), random.vector(n), (0..n / 2).map(disc).collect());
    let mut nearest = case.b.clone();
    case.set().project(&mut nearest);
    let found = case.solve();
    case.check(&found, 1e-8);
    assert!(distance(&found.x, &nearest) < 1e-8);
    assert!(found.statistics.hessian <= 20, "{:?}", found.statistics);
}

/// With radii 0 the entries are fixed, which bounds from both sides would do: the others solve a smaller problem.
#[test]
fn radius_zero_fixes() {
    let mut random = Random::new(46);
    let mut case = Case::random(4, 6, 2, 50.0, 0.0, &mut random);
    let exact = case.reference();
    let found = case.solve();
    case.check(&found, 1e-8);
    assert_eq!(case.active(&found), 4);
    assert!(distance(&found.x, &exact) < 1e-7);
}

#[test]
fn far_circles_change_no_bit() {
    let mut random = Random::new(47);
    let mut case = Case::random(5, 5, 2, 50.0, 1.0, &mut random);
    let without = FeasibleSet::above(case.lower.clone());
    let without = case.solve_on(&without, None, None);
    assert_eq!(without.outcome, Outcome::Converged);
    for radius in [1e3, 1e9, 1e200, f64::INFINITY] {
        case.discs.iter_mut().for_each(|disc| disc.radius = radius);
        for set in [case.set(), FeasibleSet::with_discs(case.lower.clone(), Vec::new())] {
            let with = case.solve_on(&set, None, None);
            assert_eq!((&without.x, &without.gradient), (&with.x, &with.gradient));
            assert_eq!((without.statistics, &without.active), (with.statistics, &with.active));
        }
    }
}

/// All pairs start at one side of their circles and end as far as at the other one.
#[test]
fn slides_far_along_circles() {
    for angle in [0.1_f64, 1.0, 2.0, 3.0, std::f64::consts::PI - 1e-5] {
        for cond in [1.0, 1e2, 1e4] {
            let n = 20;
            let a = Matrix::with_condition(n, cond, &mut Random::new(44));
            let on =
                |angle: f64| (0..n).map(|i| if i % 2 == 0 { angle.cos() } else { angle.sin() }).collect::<Vec<_>>();
            let target = on(angle);
            let mut b = a.times(&target);
            axpy(0.1, &target, &mut b);
            let discs = (0..n / 2).map(|k| Disc { entries: [2 * k, 2 * k + 1], centre: [0.0; 2], radius: 1.0 });
            let mut case = Case::new(a, b, discs.collect());
            case.x = on(0.0);
            let found = case.solve();
            case.check(&found, 1e-8);
            assert_eq!(case.active(&found), n / 2);
            assert!(distance(&found.x, &target) < 1e-7);
            assert!(found.statistics.hessian <= 60, "{angle} {cond} {:?}", found.statistics);
        }
    }
}

#[test]
fn ill_conditioned() {
    for (cond, most) in [(1e2, 250), (1e4, 650), (1e6, 3500)] {
        for radius in [1e-3, 0.03, 1.0, 30.0] {
            let mut random = Random::new(43);
            let mut case = Case::random(15, 15, 3, cond, radius, &mut random);
            case.b = case.a.times(&random.vector(60));
            case.limits.relative = 1e-7;
            let found = case.solve();
            case.check(&found, 1e-6);
            assert!(found.statistics.hessian <= most, "{cond} {radius} {:?}", found.statistics);
        }
    }
}

/// A membrane of 23 x 23 points, with a bound and a disc in every eight entries: conditioned as a dual problem is.
fn membrane(radius: f64) -> Case {
    let mut random = Random::new(42);
    let mut a = Matrix::laplacian(23);
    let n = a.n;
    let norm = 8.0 * 24.0 * 24.0;
    a.entries.iter_mut().for_each(|v| *v /= norm);
    let b: Vec<f64> = (0..n).map(|_| 1e-2 * (random.next() + 0.3)).collect();
    let disc = |k: usize| Disc {
        entries: [8 * k + 1, 8 * k + 2],
        centre: [0.01 * random.next(), 0.01 * random.next()],
        radius: radius * (1.0 + random.next()),
    };
    let mut case = Case::new(a, b, (0..n / 8).map(disc).collect());
    (0..n / 8).for_each(|k| case.lower[8 * k] = -0.05);
    let rows = (0..8).map(|k| (0..n).map(|i| if 8 * i / n == k { random.next() } else { 0.0 }).collect()).collect();
    case.null = Null::of(rows);
    case
}

/// Whatever the radii, no more products than a few times those without discs, 150 to a tolerance of 1e-8. Gradient steps of
/// fixed length instead of conjugate gradients on the tangents take up to 20000.
#[test]
fn five_hundred_unknowns() {
    let mut slide = Vec::new();
    for radius in [1e-6, 1e-3, 0.03, 0.3, 1.0, 10.0] {
        for (relative, most) in [(1e-5, 190), (1e-8, 270), (1e-10, 330)] {
            let mut case = membrane(radius);
            case.limits.relative = relative;
            let found = case.solve();
            case.check(&found, 10.0 * relative);
            assert!(found.statistics.hessian <= most, "{radius} {relative} {:?}", found.statistics);
            slide.push(case.active(&found));
        }
    }
    assert_eq!((slide[0], slide[17]), (66, 1));
}

#[test]
fn preconditioner_saves_products() {
    let mut total = [0, 0];
    for (radius, most) in [(0.0, 90), (1e-6, 150), (1e-3, 180), (0.03, 250), (1.0, 110), (10.0, 65)] {
        let mut case = membrane(radius);
        let plain = case.solve();
        let mut shifted = Matrix::new(case.a.n, case.a.entries.clone());
        (0..case.a.n).for_each(|i| shifted.entries[i * case.a.n + i] += 0.01);
        let fast = case.solve_on(&case.set(), None, Some(&mut shifted.inverse()));
        case.check(&plain, 1e-8);
        case.check(&fast, 1e-8);
        assert!(distance(&plain.x, &fast.x) < 1e-4);
        assert!(fast.statistics.hessian <= most, "{radius} {:?}", fast.statistics);
        total = [total[0] + fast.statistics.hessian, total[1] + plain.statistics.hessian];
    }
    assert!(4 * total[0] < 3 * total[1], "{total:?}");
}

#[test]
fn warm_start_at_the_solution() {
    let mut case = Case::random(15, 15, 3, 1e3, 1.0, &mut Random::new(48));
    let first = case.solve();
    case.limits.relative = 2e-9;
    case.x.copy_from_slice(&first.x);
    let again = case.solve_on(&case.set(), Some(first.multiplier), None);
    case.check(&again, 1e-8);
    assert!(again.statistics.hessian <= 3, "{:?}", again.statistics);
}

#[test]
fn units_do_not_matter() {
    let mut case = Case::random(8, 6, 3, 1e2, 1.0, &mut Random::new(49));
    let first = case.solve();
    // Lengths 1024 times larger, forces as they are. A power of two changes no rounding.
    let unit = 1024.0;
    case.b.iter_mut().for_each(|v| *v *= unit);
    case.lower.iter_mut().for_each(|v| *v *= unit);
    for disc in &mut case.discs {
        disc.radius *= unit;
        disc.centre = disc.centre.map(|c| unit * c);
    }
    let second = case.solve();
    assert_eq!(first.active, second.active);
    assert_eq!(first.statistics.hessian, second.statistics.hessian);
    assert!(first.x.iter().zip(&second.x).all(|(x, y)| unit * x == *y));
}

#[test]
fn bad_matrices_end_as_outcomes() {
    let mut case = Case::random(4, 4, 2, 10.0, 1.0, &mut Random::new(50));
    case.a.entries[17] = f64::NAN;
    assert_eq!(case.solve().outcome, Outcome::NotFinite);
    let mut case = membrane(0.1);
    for products in 1..40 {
        case.limits.products = products;
        let found = case.solve();
        assert_eq!(found.outcome, Outcome::LimitReached);
        assert!(found.statistics.hessian <= products + 16);
        // What is handed out is in the set.
        let mut nearest = found.x.clone();
        case.set().project(&mut nearest);
        assert_eq!(nearest, found.x);
    }
}
