//! Membranes torn into strips, beside SMALSE-M.

use super::super::power;
use super::super::tests::dense::{Plain, distance, dot};
use super::super::tests::torn::{Torn, homogenised};
use super::*;

const LIMITS: Limits =
    Limits { relative: 1e-8, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 2000 };

fn from(torn: &mut Torn, x: Vec<f64>, kept: Vec<bool>, limits: &Limits) -> Solution {
    from_with(torn, (x, kept), 0.0, limits)
}

fn from_with(torn: &mut Torn, (x, mut kept): (Vec<f64>, Vec<bool>), astray: f64, limits: &Limits) -> Solution {
    let bounded = torn.bounded.clone();
    assert!(torn.restrict(&mut kept, &Slides::default()));
    let residual = torn.f.times(&x).iter().zip(&torn.d).map(|(fx, d)| d - fx).collect();
    solve(
        &Plain,
        torn,
        &bounded,
        Guess {
            x,
            residual,
            kept,
            slides: Slides::default(),
            uneven: false,
            astray,
            directions: Directions::default(),
        },
        limits,
    )
}

#[test]
fn equals_smalse() {
    for (preconditioned, most) in [(false, 85), (true, 65)] {
        let mut torn = Torn::membrane(4, 6);
        torn.preconditioned = preconditioned;
        let n = torn.d.len();
        let slow = homogenised(&mut torn, 1e-8);
        let fast = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
        assert_eq!((slow.outcome, fast.outcome), (Outcome::Converged, Outcome::Converged));
        assert!(slow.statistics.hessian <= if preconditioned { 130 } else { 175 }, "{:?}", slow.statistics);
        assert!(distance(&slow.x, &fast.x) < 1e-5 * dot(&fast.x, &fast.x).sqrt());
        assert!(fast.statistics.hessian <= most, "{:?}", fast.statistics);
        let (rows, carrying) = (torn.bounded.iter().filter(|b| **b).count(), fast.kept.iter().filter(|k| !**k).count());
        assert!(carrying > 0 && carrying < rows, "{carrying} of {rows}");
        torn.restrict(&mut fast.kept.clone(), &Slides::default());
        let mut gaps = fast.residual.clone();
        torn.gaps(&mut gaps);
        for i in (0..n).filter(|i| torn.bounded[*i]) {
            assert!(fast.x[i] >= 0.0 && gaps[i] < 1e-6);
        }
    }
}

#[test]
fn any_start_gives_the_same_and_the_solution_costs_nothing() {
    let mut torn = Torn::membrane(3, 5);
    let n = torn.d.len();
    let first = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
    let none: Vec<bool> = torn.bounded.iter().map(|b| !b).collect();
    let other = from(&mut torn, vec![0.0; n], none, &LIMITS);
    assert_eq!((other.outcome, &other.kept), (Outcome::Converged, &first.kept));
    assert!(distance(&first.x, &other.x) < 1e-5 * dot(&first.x, &first.x).sqrt());
    let limits = Limits { reference: Some(dot(&torn.d, &torn.d).sqrt()), ..LIMITS };
    let again = from(&mut torn, first.x, first.kept, &limits);
    assert_eq!(again.outcome, Outcome::Converged);
    assert!(again.statistics.hessian <= 2, "{:?}", again.statistics);
}

#[test]
fn rounding_of_a_projection_is_no_direction() {
    let mut torn = Torn::membrane(3, 5);
    torn.preconditioned = true;
    let n = torn.d.len();
    let exact = Limits { relative: 1e-15, ..LIMITS };
    let first = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
    let near = from(&mut torn, first.x, first.kept, &exact);
    // Without a reference the tolerance is a share of what is rounding already.
    let again = from(&mut torn, near.x.clone(), near.kept, &exact);
    assert_eq!(again.outcome, Outcome::Converged);
    assert!(
        again.first_norm < 1e-12 * dot(&torn.d, &torn.d).sqrt() && again.statistics.hessian <= 2,
        "{:?}",
        again.statistics
    );
    assert!(distance(&near.x, &again.x) < 1e-12 * dot(&near.x, &near.x).sqrt());
}

#[test]
fn few_rows_may_be_astray_unless_the_tolerance_is_the_last() {
    let mut torn = Torn::membrane(4, 6);
    let n = torn.d.len();
    let rest = || (vec![0.0; n], vec![true; n]);
    let exact = from_with(&mut torn, rest(), 0.0, &LIMITS);
    let last = from_with(&mut torn, rest(), 0.5, &LIMITS);
    assert_eq!((&last.kept, last.statistics.hessian), (&exact.kept, exact.statistics.hessian));
    let loose = Limits { drop: 0.1, ..LIMITS };
    let [strict, astray] = [0.0, 0.5].map(|share| from_with(&mut torn, rest(), share, &loose));
    assert_eq!((strict.outcome, astray.outcome), (Outcome::Converged, Outcome::Converged));
    assert!(astray.statistics.hessian < strict.statistics.hessian, "{:?} {:?}", astray.statistics, strict.statistics);
    // The set is the next one already; forces are those of the one before.
    let wrong = (0..n).filter(|&i| torn.bounded[i] && !astray.kept[i] && astray.x[i] != 0.0).count();
    let bounds = torn.bounded.iter().filter(|b| **b).count();
    assert!(wrong > 0 && 2 * wrong <= bounds, "{wrong} of {bounds}");
    let off = distance(&strict.x, &astray.x) / dot(&strict.x, &strict.x).sqrt();
    assert!(off < 0.2, "{off}");
}

#[test]
fn a_wrong_row_of_many_waits_for_the_tolerance() {
    let mut torn = Torn::membrane(6, 18);
    let n = torn.d.len();
    let exact = from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS);
    let mut kept = exact.kept.clone();
    let wrong = (0..n).find(|&i| torn.bounded[i] && !kept[i]).unwrap();
    kept[wrong] = true;
    let loose = Limits { drop: 1e-3, ..LIMITS };
    let [none, few] = [1e-3, 0.5].map(|share| from_with(&mut torn, (vec![0.0; n], kept.clone()), share, &loose));
    assert_eq!((none.outcome, few.outcome), (Outcome::Converged, Outcome::Converged));
    assert!(few.statistics.hessian < none.statistics.hessian, "{:?} {:?}", few.statistics, none.statistics);
    // It is corrected in the end.
    assert_eq!((few.statistics.sets, few.kept[wrong]), (1, false));
}

#[test]
fn norm_of_a_dual_problem() {
    let mut torn = Torn::membrane(3, 5);
    let n = torn.d.len();
    torn.restrict(&mut vec![true; n], &Slides::default());
    let start = torn.d.clone();
    let found = power::norm(&Plain, &mut torn, &start).expect("an estimate");
    assert!(found.products <= 12);
}

#[test]
fn faults_end_as_outcomes() {
    let mut torn = Torn::membrane(3, 5);
    let n = torn.d.len();
    let limits = Limits { products: 5, ..LIMITS };
    assert_eq!(from(&mut torn, vec![0.0; n], vec![true; n], &limits).outcome, Outcome::LimitReached);
    assert!(!torn.restrict(&mut vec![false; n], &Slides::default()));
    torn.f.entries[3] = f64::NAN;
    assert_eq!(from(&mut torn, vec![0.0; n], vec![true; n], &LIMITS).outcome, Outcome::NotFinite);
}
