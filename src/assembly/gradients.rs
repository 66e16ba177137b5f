//! Gradients of the displacement at the integration points.

use super::visit::{Visited, Visitor, for_each_element, strain_flops};
use crate::decomposition::Subdomain;
use crate::work;

/// Hands each element's number and the gradient at each of its points, `[i][j]` the derivative of component `i` by
/// coordinate `j`.
pub fn each(subdomain: &Subdomain, u: &[f64], hand: impl FnMut(usize, [[f64; 3]; 3])) {
    let elements = &subdomain.elements;
    let (nodes, points) = (elements.kind().nodes(), elements.kind().points());
    work::each(elements.len(), points * strain_flops(nodes), nodes * size_of::<[f64; 3]>());
    for_each_element(elements, &subdomain.points, &mut Gradients { u, hand });
}

struct Gradients<'a, F> {
    u: &'a [f64],
    hand: F,
}

impl<F: FnMut(usize, [[f64; 3]; 3])> Visitor for Gradients<'_, F> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let u = element.nodal(self.u);
        for point in element.points {
            let slope = |i: usize, j: usize| point.gradients.iter().zip(&u).map(|(g, u)| u[i] * g[j]).sum();
            (self.hand)(element.index, std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j))));
        }
    }
}
