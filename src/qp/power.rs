//! Estimate of the norm of P A P, by a few steps of the Lanczos method.
//!
//! The Krylov space of the power method is used in full: the largest Ritz value is far closer to the norm than the
//! Rayleigh quotient of the last power (Golub and Van Loan, Matrix Computations, section 10.1). It is a *lower* bound,
//! good to a few per cent: never use it as if it were exact. No reorthogonalisation; the lost orthogonality does not
//! spoil the largest value.

use super::quadratic::{Quadratic, Space};
use crate::vector::axpy;

/// Products at most.
const STEPS: usize = 12;
/// Ends when a step raises the estimate by less than this.
const GROWTH: f64 = 0.02;

/// What [`norm`] found, and what it cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Lower bound of the norm of P A P.
    pub norm: f64,
    /// Products with A.
    pub products: usize,
}

/// Estimates the norm of P A P from a start vector. `None` if there is nothing to estimate from: P `start` is zero, or
/// something is not finite, or P A P vanishes on the start vector.
pub fn norm(space: &dyn Space, function: &mut dyn Quadratic, start: &[f64]) -> Option<Estimate> {
    let mut v = start.to_vec();
    let (mut last, mut w) = (vec![0.0; v.len()], vec![0.0; v.len()]);
    let (mut diagonal, mut coupling) = (Vec::new(), Vec::new());
    let mut found = 0.0;

    function.project(&mut v);
    let mut length = space.norm(&v);
    while length > 0.0 && length.is_finite() && diagonal.len() < STEPS {
        v.iter_mut().for_each(|v| *v /= length);
        function.apply(&v, &mut w);
        function.project(&mut w);
        let quotient = space.dot(&v, &w);
        if !quotient.is_finite() {
            return None;
        }
        diagonal.push(quotient);
        let before = std::mem::replace(&mut found, largest(&diagonal, &coupling));
        if diagonal.len() > 3 && found <= (1.0 + GROWTH) * before {
            break;
        }
        axpy(-quotient, &v, &mut w);
        if let Some(c) = coupling.last() {
            axpy(-c, &last, &mut w);
        }
        length = space.norm(&w);
        if length <= f64::EPSILON.sqrt() * found {
            break;
        }
        coupling.push(length);
        std::mem::swap(&mut last, &mut v);
        std::mem::swap(&mut v, &mut w);
    }
    (found > 0.0).then_some(Estimate { norm: found, products: diagonal.len() })
}

/// Largest eigenvalue of a symmetric tridiagonal matrix by bisection: T - s is negative definite above it.
fn largest(diagonal: &[f64], coupling: &[f64]) -> f64 {
    let at = |i: usize| coupling.get(i).copied().unwrap_or(0.0);
    let row = |i: usize| diagonal[i] + at(i) + if i > 0 { at(i - 1) } else { 0.0 };
    let mut low = diagonal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut high = (0..diagonal.len()).map(row).fold(low, f64::max);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let mut pivot = diagonal[0] - middle;
        let mut above = pivot < 0.0;
        for (d, c) in diagonal[1..].iter().zip(coupling) {
            pivot = d - middle - c * c / pivot;
            above &= pivot < 0.0;
        }
        *if above { &mut high } else { &mut low } = middle;
    }
    high
}

#[cfg(test)]
mod tests {
    use super::super::tests::dense::{Joined, Matrix, Null, Plain, Random};
    use super::*;

    #[test]
    fn tridiagonal_of_the_laplacian() {
        let n = 9;
        let exact = 2.0 + 2.0 * (std::f64::consts::PI / (n as f64 + 1.0)).cos();
        assert!((largest(&vec![2.0; n], &vec![1.0; n - 1]) - exact).abs() < 1e-12);
    }

    #[test]
    fn within_ten_per_cent_and_never_above() {
        let mut random = Random::new(1);
        for cond in [1e0, 1e2, 1e5] {
            let n = 60;
            let (mut a, norm_exact) = (Matrix::with_condition(n, cond, &mut random), 1.0);
            let start = random.vector(n);
            let found = norm(&Plain, &mut Joined(&mut a, &mut Null::default(), None), &start).expect("an estimate");
            assert!(found.norm > 0.9 * norm_exact && found.norm < norm_exact * (1.0 + 1e-10), "{found:?}");
            assert_eq!(found.products, a.products);
            assert!(found.products <= STEPS);
        }
    }

    #[test]
    fn nothing_to_estimate_from() {
        let mut random = Random::new(2);
        let mut a = Matrix::with_condition(4, 10.0, &mut random);
        assert_eq!(norm(&Plain, &mut Joined(&mut a, &mut Null::default(), None), &[0.0; 4]), None);
        a.entries[5] = f64::NAN;
        assert_eq!(norm(&Plain, &mut Joined(&mut a, &mut Null::default(), None), &[1.0; 4]), None);
    }
}
