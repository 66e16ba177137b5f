//! The map from a reference element, of `N` nodes and as many shape functions.

use super::{Nodal, Point};
use crate::vector::cross;

/// Determinant of the map where the shape functions have these derivatives by the reference coordinates.
#[inline]
pub fn determinant<const N: usize>(nodes: &Nodal<N>, derivatives: &Nodal<N>) -> f64 {
    jacobian(nodes, derivatives).0
}

/// A point of unit weight in the reference element, without dilatation.
#[inline]
pub fn point<const N: usize>(nodes: &Nodal<N>, derivatives: &Nodal<N>) -> Point<N> {
    let (determinant, cofactors) = jacobian(nodes, derivatives);
    let [a, b, c] = cofactors.map(|row| row.map(|x| x / determinant));
    let gradient = |d: [f64; 3]| std::array::from_fn(|i| a[i] * d[0] + b[i] * d[1] + c[i] * d[2]);
    Point { weight: determinant, gradients: derivatives.map(gradient), dilatation: None }
}

/// The determinant, and the cofactors: `[k][i]` over it is the derivative of reference coordinate `k` by coordinate `i`.
#[inline]
fn jacobian<const N: usize>(nodes: &Nodal<N>, derivatives: &Nodal<N>) -> (f64, [[f64; 3]; 3]) {
    let mut edges = [[0.0; 3]; 3];
    for (node, d) in nodes.iter().zip(derivatives) {
        for (edge, d) in edges.iter_mut().zip(d) {
            // Relative to one node: round-off does not depend on where the element is.
            (0..3).for_each(|i| edge[i] += d * (node[i] - nodes[0][i]));
        }
    }
    let [a, b, c] = edges;
    let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
    ((0..3).map(|i| a[i] * cofactors[0][i]).sum(), cofactors)
}
