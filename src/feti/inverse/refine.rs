//! Iterative refinement of `x = K^+ r`, where the residual of the subdomains' problems `K x = r` is too large.
//!
//! Factors are in single precision where a probe lets them be, and matrices near incompressibility or collapse have large
//! condition numbers. The multipliers hide that, as they are found with the same factors; the forces that a step leaves out of
//! balance do not. Once a step the residual costs one product with `K`, some per cent of an application of `F`.

use std::rc::Rc;

use super::factor::Factors;
use crate::feti::Torn;

/// Turns of refinement at most: each gains as many digits as the factors have.
const TURNS: usize = 3;

/// Refines `x = K^+ r` until `|r - K x|` is below a `share` of `|r|`, or does not fall any more. `r` is in balance; `tangents` are
/// the lower values of `K`, from which the factors differ by rounding or a small change. Returns `|r - K x| / |r|` in the end, and
/// the number of applications of `K^+`. Collective, as `norm` is.
pub fn refine(
    factors: &mut Factors,
    tangents: &[Rc<Vec<f64>>],
    norm: &dyn Fn(&Torn) -> f64,
    (r, x): (&Torn, &mut Torn),
    share: f64,
) -> (f64, usize) {
    let size = norm(r);
    let mut rest = remainder(factors, tangents, r, x);
    let mut left = relative(norm(&rest), size);
    for turn in 0..TURNS {
        if left <= share || !left.is_finite() {
            return (left, turn);
        }
        factors.solve(&mut rest);
        let mut better = x.clone();
        better.iter_mut().flatten().zip(rest.iter().flatten()).for_each(|(x, c)| *x += c);
        rest = remainder(factors, tangents, r, &better);
        let now = relative(norm(&rest), size);
        if now.is_nan() || now >= left {
            return (left, turn + 1);
        }
        (*x, left) = (better, now);
    }
    (left, TURNS)
}

/// `r - K x`, zero at unknowns that are kept at zero: their supports carry what is left there.
fn remainder(factors: &Factors, tangents: &[Rc<Vec<f64>>], r: &Torn, x: &Torn) -> Torn {
    let of = |(own, x): (usize, &Vec<f64>)| {
        let mut product = vec![0.0; x.len()];
        factors.symbolic(own).pattern.multiply_add(&tangents[own], x, &mut product);
        let mut rest: Vec<f64> = r[own].iter().zip(product).map(|(r, kx)| r - kx).collect();
        factors.pinned(own).iter().for_each(|&dof| rest[dof as usize] = 0.0);
        rest
    };
    x.iter().enumerate().map(of).collect()
}

/// `a / b`, and zero where there is nothing to solve for.
fn relative(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use super::{refine, remainder};
    use crate::feti::Torn;
    use crate::fixture::{on_ranks, two_bricks};

    fn norm(x: &Torn) -> f64 {
        x.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Factors of a stiffness that is a hundredth off gain two digits a turn, of one that is off by more than itself none.
    #[test]
    fn refinement_gains_what_the_factors_know_and_never_spoils() {
        on_ranks(&two_bricks(&[]), 1, |setup| {
            let (mut factors, stiffnesses) = setup.factors();
            for (off, share, turns, left) in
                [(1.0, 1e-8, 0, 1e-12), (1.01, 2e-6, 2, 1.1e-6), (1.01, 1e-12, 3, 1.1e-8), (2.5, 1e-3, 1, 1.51)]
            {
                let scaled = |values: &Vec<f64>| Rc::new(values.iter().map(|v| off * v).collect::<Vec<f64>>());
                let tangents: Vec<_> = stiffnesses.iter().map(scaled).collect();
                let strained = setup.displacements(3);
                let r: Torn = remainder(&factors, &tangents, &setup.gather.zeros(), &strained);
                let mut x = r.clone();
                factors.solve(&mut x);
                let before = norm(&remainder(&factors, &tangents, &r, &x)) / norm(&r);
                assert!((before - (off - 1.0)).abs() < 1e-10, "{before:e}");
                let (found, solves) = refine(&mut factors, &tangents, &norm, (&r, &mut x), share);
                assert_eq!(solves, turns, "{off} {found:e}");
                assert!(found <= left && found <= before.max(1e-12), "{off} {found:e}");
                assert_eq!(found, norm(&remainder(&factors, &tangents, &r, &x)) / norm(&r));
            }
        });
    }
}
