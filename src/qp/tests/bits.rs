//! The bits that SMALSE-M and MPRGP find where no set has discs. Frictionless results rest on them.
//!
//! Only sums, products, quotients and roots go into these problems, so every machine has the same bits. A change that is
//! meant to alter the algorithm for bounds has to alter the numbers here.

use super::dense::{Joined, Matrix, Null, Plain, Random};
use super::torn::{Torn, homogenised};
use crate::qp::feasible::FeasibleSet;
use crate::qp::smalse::{Problem, Settings, Solution, Start, solve};
use crate::qp::{Limits, Outcome};

/// Fowler, Noll and Vo's hash (FNV-1a) of the bits of a solution, and what it took.
fn fingerprint(found: &Solution) -> (u64, [usize; 5]) {
    assert_eq!(found.outcome, Outcome::Converged);
    let numbers = found.x.iter().chain(&found.gradient).chain(&found.multiplier);
    let bytes = numbers.flat_map(|v| v.to_bits().to_le_bytes());
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let s = found.statistics;
    (hash, [s.outer, s.cg, s.expansions, s.proportionings, s.hessian])
}

/// A membrane over an obstacle that starts pressed on it, with some equalities.
fn membrane(set: impl Fn(Vec<f64>) -> FeasibleSet) -> Solution {
    let mut a = Matrix::laplacian(17);
    let n = a.n;
    let norm = 8.0 * 18.0 * 18.0;
    let mut random = Random::new(5);
    let rows = (0..3).map(|k| (0..n).map(|i| if i % 7 == k { random.next() } else { 0.0 }).collect()).collect();
    let b: Vec<f64> = (0..n).map(|i| if i < n / 3 { 60.0 } else { -40.0 } + 30.0 * random.next()).collect();
    let set = set(vec![-0.4; n]);
    let limits = Limits { relative: 1e-7, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 3000 };
    let function = &mut Joined(&mut a, &mut Null::of(rows), None);
    let problem = Problem { space: &Plain, function, b: &b, set: &set };
    solve(problem, &Settings { limits, norm }, Start { x: vec![-0.4; n], multiplier: None })
}

#[test]
fn programs_without_discs_are_solved_as_ever() {
    let mut torn = Torn::membrane(4, 6);
    let plain = fingerprint(&homogenised(&mut torn, 1e-8));
    torn.preconditioned = true;
    let preconditioned = fingerprint(&homogenised(&mut torn, 1e-8));
    let pressed = fingerprint(&membrane(FeasibleSet::above));
    let expected = [
        (0x484b_dc36_6037_ccd0, [8, 92, 12, 1, 119]),
        (0x6ccc_3a90_1821_5990, [8, 21, 8, 2, 40]),
        (0x9edf_5316_5c43_36f3, [3, 106, 13, 8, 143]),
    ];
    assert_eq!([plain, preconditioned, pressed], expected);
}
