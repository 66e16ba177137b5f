//! The projected residual of conjugate gradients, and what of it is rounding.
//!
//! ```text
//! P'r,   |P'r|,   |P'P'r - P'r|
//! ```
//!
//! The norm is measured now and then, and carried on by recurrences between. `P'` takes away the rigid motions that `r` tells, which may be
//! larger than the rest by many orders. What it leaves of them by rounding is no gradient, and directions from that grow beyond all
//! numbers. Where the norm is a small share of that of `r`, another `P'` tells how much there is.

use super::quadratic::{Quadratic, Space};
use crate::vector::axpy;

/// Below this share of r, P'r may be rounding.
const DOUBTFUL: f64 = 1e-12;
/// A norm of so many times what another P' takes away is rounding.
const NOISE: f64 = 10.0;

/// The projected residual.
pub struct Inside {
    /// P'r.
    pub residual: Vec<f64>,
    /// A norm that is nothing but rounding; zero where there is no doubt.
    pub noise: f64,
    /// Its squared norm; the recurrence rounds relative to where it began.
    square: f64,
    /// The squared norm when it was measured last.
    measured: f64,
}

impl Inside {
    /// Projects and measures a residual. Collective.
    pub fn of(space: &dyn Space, function: &mut dyn Quadratic, whole: &[f64]) -> Self {
        let mut residual = whole.to_vec();
        function.reduce(&mut residual);
        let [square, of_whole] = space.dots(&[(&residual, &residual), (whole, whole)])[..] else {
            unreachable!("two products were asked for")
        };
        let mut noise = 0.0;
        if square < DOUBTFUL * DOUBTFUL * of_whole {
            let mut again = residual.clone();
            function.reduce(&mut again);
            axpy(-1.0, &residual, &mut again);
            noise = NOISE * space.norm(&again);
        }
        Self { residual, noise, square, measured: square }
    }

    /// Its norm.
    pub fn norm(&self) -> f64 {
        self.square.sqrt()
    }

    /// Whether the norm is measured, not carried on.
    pub fn is_measured(&self) -> bool {
        self.square == self.measured
    }

    /// Whether the squared norm is below this share of what was measured.
    pub fn has_dropped(&self, share: f64) -> bool {
        self.square < share * self.measured
    }

    /// Takes `step` times `P'A p` away, given its squared norm and its product with the residual.
    pub fn advance(&mut self, step: f64, projected: &[f64], [square_ap, change]: [f64; 2]) {
        axpy(-step, projected, &mut self.residual);
        self.square += step * (step * square_ap - 2.0 * change);
        if self.square < 0.0 {
            self.square = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::dense::{Joined, Matrix, Null, Plain, Random, dot};
    use super::*;

    #[test]
    fn noise_is_what_a_projection_leaves_by_rounding() {
        let mut random = Random::new(5);
        let n = 20;
        let mut a = Matrix::with_condition(n, 1e2, &mut random);
        let (g, r) = (random.vector(n), random.vector(n));
        let mut null = Null::of(vec![g.clone()]);
        let inside = Inside::of(&Plain, &mut Joined(&mut a, &mut null, None), &r);
        assert!(inside.noise == 0.0 && inside.is_measured());
        assert!(dot(&inside.residual, &g).abs() < 1e-12);
        // Nothing but what the projection takes away: all that is left is rounding.
        let far: Vec<f64> = g.iter().map(|g| 1e3 * g).collect();
        let nothing = Inside::of(&Plain, &mut Joined(&mut a, &mut null, None), &far);
        assert!(nothing.norm() <= nothing.noise && nothing.noise < 1e-9, "{} {}", nothing.norm(), nothing.noise);
    }
}
