//! What a solver needs to know of a quadratic function: products with its Hessian, inner products, a projector.
//!
//! Vectors are slices of one rank's entries; several ranks may hold the same entry. Everything a solver branches on
//! must come out of [`Space`], whose results are the same bits on every rank.

use super::feasible::Face;

/// Inner products and reductions over a distributed vector.
pub trait Space {
    /// `x'y` of each pair, in one collective.
    fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64>;

    /// The smallest of all ranks' values; NaN if any is NaN.
    fn minimum(&self, mine: f64) -> f64;

    /// `x'y`.
    fn dot(&self, x: &[f64], y: &[f64]) -> f64 {
        self.dots(&[(x, y)])[0]
    }

    /// Euclidean norm.
    fn norm(&self, x: &[f64]) -> f64 {
        self.dot(x, x).sqrt()
    }
}

/// A quadratic function on the null space of the equality constraints `G x = 0`: its symmetric positive semidefinite matrix A, a
/// projector P onto that space, which is orthogonal unless [`Quadratic::reduce`] says otherwise, and, if there is one, a
/// preconditioner M.
pub trait Quadratic {
    /// `y = A x`.
    fn apply(&mut self, x: &[f64], y: &mut [f64]);

    /// `x = P x`, in place.
    fn project(&mut self, x: &mut [f64]);

    /// `r = P' r`, in place: what a gradient is on the null space.
    fn reduce(&mut self, r: &mut [f64]) {
        self.project(r);
    }

    /// Sets `x = P' x`. Returns `|P' x|^2`, `r'P' x` with an `r = P' r`, and inner products: of the unprojected `x` with each
    /// of `against`, then of `pairs`. To be overridden where one collective can do all.
    fn reduce_with_products(
        &mut self,
        space: &dyn Space,
        x: &mut [f64],
        r: &[f64],
        against: &[&[f64]],
        pairs: &[(&[f64], &[f64])],
    ) -> ([f64; 2], Vec<f64>) {
        let before = x.to_vec();
        self.reduce(x);
        let mut all: Vec<(&[f64], &[f64])> = vec![(x, x), (x, r)];
        all.extend(against.iter().map(|y| (&before[..], *y)));
        all.extend(pairs);
        let products = space.dots(&all);
        ([products[0], products[1]], products[2..].to_vec())
    }

    /// `z = M r` with M an approximate inverse of A, symmetric and positive on Ker G; returns false, and leaves `z`
    /// alone, if there is none.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool;

    /// From now on [`Quadratic::precondition_on_face`] and [`Quadratic::balance`] are about this face. Functions without faces need
    /// none of the three. Collective.
    fn enter(&mut self, _face: &Face) {}

    /// `z = M r` with M an approximate inverse, on the face, of P A P + penalty (I - P) and what circles add to it, with the `size` of
    /// P A P; `r` and `z` are zero where the face has no freedom. Returns false, and leaves `z` alone, if there is none.
    fn precondition_on_face(&mut self, [_size, _penalty]: [f64; 2], _r: &[f64], _z: &mut [f64]) -> bool {
        false
    }

    /// Changes `x` on the face so that `G x = G target`. A guess is enough.
    fn balance(&mut self, _target: &[f64], _x: &mut [f64]) {}
}
