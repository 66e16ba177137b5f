//! Gradients of the displacement at the integration points.

use super::{displacements, integrated};
use crate::decomposition::Subdomain;
use crate::element::{Nodal, Point, by_kind};

/// Hands each element's number and the gradient at each of its points, `[i][j]` the derivative of component `i` by
/// coordinate `j`.
pub fn each(subdomain: &Subdomain, u: &[f64], hand: impl FnMut(usize, [[f64; 3]; 3])) {
    by_kind!(subdomain.elements.kind(), each_of(subdomain, u, hand));
}

fn each_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    u: &[f64],
    mut hand: impl FnMut(usize, [[f64; 3]; 3]),
) {
    for (index, (nodes, points)) in integrated(points, &subdomain.elements, &subdomain.points).enumerate() {
        let u = displacements(u, nodes);
        for point in &points {
            let slope = |i: usize, j: usize| point.gradients.iter().zip(&u).map(|(g, u)| u[i] * g[j]).sum();
            hand(index, std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j))));
        }
    }
}
