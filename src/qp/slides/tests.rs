//! Active sets of discs against projected gradients, which know no sets.

use super::super::active_set::{self, Face, Guess};
use super::super::pcpg::Directions;
use super::super::quadratic::Quadratic;
use super::super::tests::dense::{Matrix, Plain, Random, distance, dot};
use super::super::{Limits, Outcome};
use super::*;

const LIMITS: Limits =
    Limits { relative: 1e-10, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 5000 };

/// A dense matrix on what a set leaves free.
struct Dense {
    a: Matrix,
    kept: Vec<bool>,
    slides: Slides,
}

impl Dense {
    fn mask(&self, x: &mut [f64]) {
        x.iter_mut().zip(&self.kept).for_each(|(x, kept)| *x *= f64::from(*kept));
        for ([i, j], [a, b], _) in self.slides.across() {
            let y = a * x[i] + b * x[j];
            (x[i], x[j]) = (a * y, b * y);
        }
    }
}

impl Quadratic for Dense {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.a.apply(x, y);
        self.slides.add_compliance(1.0, x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.mask(x);
    }

    fn precondition(&mut self, _: &[f64], _: &mut [f64]) -> bool {
        false
    }
}

impl Face for Dense {
    fn restrict(&mut self, kept: &mut [bool], slides: &Slides) -> bool {
        (self.kept, self.slides) = (kept.to_vec(), slides.clone());
        true
    }

    fn restore(&mut self, _: &mut [f64]) {}

    fn gaps(&mut self, _: &mut [f64]) {}
}

/// Discs `(3k, 3k + 1)` whose radius is a constant and grows with the unknown `3k + 2`, which is not negative; the last one is an
/// interval.
fn discs(a: &Matrix, radius: impl Fn(usize) -> [f64; 2]) -> Vec<Disc> {
    let disc = |k: usize| {
        let flexibility = a.entries[3 * k * a.n + 3 * k];
        let second = 3 * k + usize::from(3 * k + 3 < a.n);
        Disc { normal: 3 * k + 2, entries: [3 * k, second], radius: radius(k), flexibility }
    };
    (0..a.n / 3).map(disc).collect()
}

/// By projected gradients, radii following.
fn projected(a: &Matrix, d: &[f64], discs: &[Disc]) -> Vec<f64> {
    let mut x = vec![0.0; a.n];
    for _ in 0..200_000 {
        let gradient: Vec<f64> = a.times(&x).iter().zip(d).map(|(ax, d)| ax - d).collect();
        let mut next: Vec<f64> = x.iter().zip(&gradient).map(|(x, g)| x - g).collect();
        for disc in discs {
            next[disc.normal] = next[disc.normal].max(0.0);
            let [radius, size] = [disc.radius(&next), disc.of(&next)[0].hypot(disc.of(&next)[1])];
            if size > radius {
                disc.put(disc.of(&next).map(|x| x * radius / size), &mut next);
            }
        }
        let moved = distance(&x, &next);
        x = next;
        if moved < 1e-14 {
            break;
        }
    }
    x
}

fn solved(a: Matrix, d: &[f64], discs: Vec<Disc>) -> active_set::Solution {
    let n = a.n;
    let bounded: Vec<bool> = (0..n).map(|i| i % 3 == 2).collect();
    let slides = Slides::open(discs);
    let mut kept = vec![true; n];
    slides.mark(&mut kept);
    let mut face = Dense { a, kept: kept.clone(), slides: slides.clone() };
    let guess = Guess {
        x: vec![0.0; n],
        residual: d.to_vec(),
        kept,
        slides,
        astray: 0.0,
        uneven: false,
        directions: Directions::default(),
    };
    active_set::solve(&Plain, &mut face, &bounded, guess, &LIMITS)
}

#[test]
fn sets_of_discs_end_where_projected_gradients_do() {
    let mut seen = [0; 3];
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let a = Matrix::with_condition(18, 20.0, &mut random);
        let d = random.vector(18);
        // Constant radii, small to large; then radii that follow an unknown.
        let constant = 10.0_f64.powf(f64::from(seed as u32 % 5) - 2.0);
        for radius in [[constant, 0.0], [0.0, 0.3], [0.0, 0.0]] {
            let discs = discs(&a, |_| radius);
            let expected = projected(&a, &d, &discs);
            let found = solved(Matrix::new(a.n, a.entries.clone()), &d, discs);
            assert_eq!(found.outcome, Outcome::Converged, "{seed} {radius:?}");
            let size = dot(&expected, &expected).sqrt();
            assert!(distance(&found.x, &expected) < 1e-7 * size.max(1e-3), "{seed} {radius:?}");
            for state in &found.slides.states {
                seen[usize::from(state.name()[0]) + usize::from(state.name()[1])] += 1;
            }
        }
    }
    assert!(seen.iter().all(|count| *count > 50), "open, stick and slip all occur: {seen:?}");
}

#[test]
fn a_disc_fixes_along_its_slip_and_springs_act_across() {
    let disc = Disc { normal: 2, entries: [0, 1], radius: [0.5, 0.0], flexibility: 2.0 };
    let mut slides = Slides::open(vec![disc]);
    // z = x + v / f = (0, 2): beyond the radius.
    slides.states = slides.next(&[0.0, 0.5, 0.0], &[0.0, 3.0, 0.0], [0.0; 2]);
    assert_eq!(slides.states, [Slide::Slip { direction: [0.0, 1.0], radius: 0.5, compliance: 6.0 }]);
    let (mut x, mut y) = (vec![0.25, 9.0, 1.0], vec![0.0; 3]);
    slides.fix(&mut x);
    assert_eq!(x, [0.25, 0.5, 1.0]);
    slides.add_compliance(2.0, &x, &mut y);
    assert_eq!(y, [3.0, 0.0, 0.0]);
    // The scaled inverse of 2 + 6 on a unit vector across.
    let (mut soft, mut z) = (vec![1.0, 0.0, 0.0], vec![0.0; 3]);
    slides.soften(&mut soft);
    slides.add_springs(&[1.0, 0.0, 0.0], &mut z);
    assert!((soft[0] * soft[0] / 2.0 + z[0] - 1.0 / 8.0).abs() < 1e-15);
    let mut kept = vec![false; 3];
    slides.mark(&mut kept);
    assert_eq!((&kept[..], &slides.held(&kept)[..]), (&[true, true, false][..], &[false; 3][..]));
    // z = (0, 0.25): inside.
    assert_eq!(slides.next(&[0.0, 0.5, 0.0], &[0.0, -0.5, 0.0], [1e-9; 2]), [Slide::Stick]);
}

#[test]
fn what_slides_against_its_friction_turns_round_once() {
    let disc = Disc { normal: 2, entries: [0, 1], radius: [0.5, 0.0], flexibility: 2.0 };
    let mut slides = Slides::open(vec![disc]);
    slides.take(slides.next(&[0.0, 0.5, 0.0], &[0.0, 3.0, 0.0], [0.0; 2]));
    // z = (0, -14.5): beyond the other side.
    let (far, mut x) = ([0.0, -30.0, 0.0], vec![0.25, 0.5, 1.0]);
    slides.take(slides.next(&[0.0, 0.5, 0.0], &far, [1e-9; 2]));
    assert!(matches!(slides.states[..], [Slide::Slip { direction: [0.0, -1.0], .. }]));
    slides.align(&mut x);
    assert_eq!(x, [0.0, -0.5, 1.0]);
    let back = [0.0, 30.0, 0.0];
    assert_eq!(slides.next(&x, &back, [1e-9; 2]), [Slide::Stick]);
    // By what a residual may be it may slide: it goes on slipping, where that takes it.
    assert!(matches!(slides.next(&x, &back, [1e-9, 31.0])[..], [Slide::Slip { .. }]));
}

#[test]
fn what_slips_a_little_goes_on_on_a_larger_circle() {
    let disc = Disc { normal: 2, entries: [0, 1], radius: [0.0, 0.5], flexibility: 2.0 };
    let mut slides = Slides::open(vec![disc]);
    slides.states = slides.next(&[0.0, 0.5, 1.0], &[0.0, 3.0, 0.0], [0.0; 2]);
    // The unknowns are on the circle of before, 0.01 inside of the next one; the slip is 0.001 of the radius.
    let next = slides.next(&[0.0, 0.5, 1.02], &[0.0, 0.001, 0.0], [1e-9; 2]);
    let [Slide::Slip { radius, compliance, .. }] = next[..] else { panic!("{next:?}") };
    assert_eq!(radius, 0.51);
    assert!((compliance - 0.002).abs() < 1e-15, "slip over radius: {compliance}");
    // Against its friction it sticks.
    assert_eq!(slides.next(&[0.0, 0.5, 1.02], &[0.0, -0.001, 0.0], [1e-9; 2]), [Slide::Stick]);
}

#[test]
fn what_swings_as_a_whole_sticks_on_the_way() {
    // All second unknowns of discs move together, far; friction alone holds them. Fixed friction would throw them to and fro.
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let mut a = Matrix::with_condition(18, 5.0, &mut random);
        for (k, l) in (0..6).flat_map(|k| (0..6).map(move |l| (k, l))) {
            a.entries[(3 * k + 1) * a.n + 3 * l + 1] += 500.0;
        }
        let mut d = random.vector(18);
        (0..6).for_each(|k| d[3 * k + 1] += 300.0);
        (0..6).for_each(|k| d[3 * k + 2] = 3.0 + d[3 * k + 2].abs());
        let found = solved(Matrix::new(a.n, a.entries.clone()), &d, discs(&a, |_| [0.0, 0.8]));
        assert_eq!(found.outcome, Outcome::Converged, "{seed}");
        assert!(found.statistics.sets < 40, "{seed}: {:?}", found.statistics);
        // The conditions themselves: bounds, and |v| x = r v in each disc.
        let v: Vec<f64> = a.times(&found.x).iter().zip(&d).map(|(ax, d)| d - ax).collect();
        let most = dot(&d, &d).sqrt();
        for disc in &found.slides.discs {
            let (x, pressure) = (disc.of(&found.x), found.x[disc.normal]);
            assert!(
                pressure >= 0.0 && v[disc.normal] <= 1e-7 * most && pressure * v[disc.normal].abs() < 1e-6 * most,
                "{seed}"
            );
            let (radius, slid) = (disc.radius(&found.x), disc.of(&v));
            let size = slid[0].hypot(slid[1]);
            assert!(x[0].hypot(x[1]) <= radius * (1.0 + 1e-6) + 1e-9 * most, "{seed}");
            assert!((0..2).all(|k| (size * x[k] - radius * slid[k]).abs() < 1e-6 * most), "{seed}: {slid:?}");
        }
    }
}

#[test]
fn soft_springs_are_told_and_turning_is_no_change_of_radius() {
    let disc = Disc { normal: 2, entries: [0, 1], radius: [0.5, 0.0], flexibility: 2.0 };
    let mut slides = Slides::open(vec![disc]);
    for (slides_by, is_soft) in [(3.0, false), (300.0, true)] {
        slides.states = slides.next(&[0.0, 0.5, 0.0], &[0.0, slides_by, 0.0], [0.0; 2]);
        assert_eq!(slides.across().collect::<Vec<_>>(), [([0, 1], [-1.0, 0.0], is_soft)]);
    }
    let next = slides.next(&[0.0, 0.5, 0.0], &[100.0, 300.0, 0.0], [0.0; 2]);
    let [mut changed, mut fixed, mut hung] = [(); 3].map(|()| vec![0.0; 3]);
    slides.compare(&next, &[0.0, 0.5, 0.0], [&mut changed, &mut fixed, &mut hung]);
    assert_eq!((changed[0], fixed[0]), (0.0, 0.0));
    assert!(hung[0] > 1.0, "{hung:?}");
}

#[test]
fn what_slips_follows_its_circle() {
    let disc = Disc { normal: 0, entries: [1, 2], radius: [0.0, 0.5], flexibility: 1.0 };
    let mut slides = Slides::open(vec![disc]);
    let (start, mut x) = ([9.0, 1.0, 1.0], [1.0, 2.0, 3.0]);
    slides.carry(&start, &mut x, &[10.0]);
    assert_eq!(x, [1.0, 2.0, 3.0]);
    slides.settle(&[10.0, 3.0, 4.0], &[5.0]);
    slides.carry(&start, &mut x, &[10.0]);
    assert_eq!(x, [1.0, 5.0, 7.0]);
}
