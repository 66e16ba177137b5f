//! `K_k`: the tangent of a subdomain; at rest it is the elastic stiffness `K_e`.

use super::Region;
use super::visit::{LAW, Visited, Visitor, for_each_element, strain_flops};
use crate::element::point::block;
use crate::material::Law;
use crate::sparse::pattern::Pattern;
use crate::tensor::{Tangent, Voigt};
use crate::work;

/// Overwrites `values` (on `pattern`) by the tangent at the displacement `u`, one step from the committed history, with
/// the directions of `flow` (`flow`); without them it is the consistent one. Returns the number of elements that yield.
pub fn assemble(region: &Region, (u, flow): (&[f64], &[Voigt]), pattern: &Pattern, values: &mut [f64]) -> usize {
    values.fill(0.0);
    let (elements, elastic) = (&region.subdomain.elements, region.material.hooke().tangent());
    let (nodes, points) = (elements.kind().nodes(), elements.kind().points());
    // At each point w D B has 6 rows of 3 numbers a node, and the blocks of two nodes 9 numbers, of 6 operations each; then the lower
    // blocks are added to the matrix, which is read and written.
    let of_point = strain_flops(nodes) + LAW + 6 * 6 * 3 * nodes + 6 * 9 * nodes * nodes;
    let blocks = 9 * nodes * (nodes + 1) / 2;
    work::each(elements.len(), points * of_point + blocks, 2 * size_of::<f64>() * blocks);
    let mut assembly = Assembly { region, u, flow, elastic, pattern, values, plastic: 0 };
    for_each_element(elements, &region.subdomain.shape, &mut assembly);
    assembly.plastic
}

struct Assembly<'a> {
    region: &'a Region<'a>,
    u: &'a [f64],
    flow: &'a [Voigt],
    elastic: Tangent,
    pattern: &'a Pattern,
    values: &'a mut [f64],
    /// Elements so far that yield.
    plastic: usize,
}

impl Visitor for Assembly<'_> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let material = self.region.material;
        let u = element.nodal(self.u);
        let mut k = [[[[0.0; N]; 3]; 3]; N];
        let mut yields = false;
        for (index, point) in element.points() {
            let committed = self.region.committed(index);
            let strain = point.strain(&u);
            if material.respond(&strain, committed).plastic {
                yields = true;
                point.add_stiffness(&material.stiffness(&strain, committed, self.flow.get(index)), &mut k);
            } else {
                point.add_stiffness(&self.elastic, &mut k);
            }
        }
        self.plastic += usize::from(yields);
        for (a, &row) in element.nodes.iter().enumerate() {
            for (b, &column) in element.nodes.iter().enumerate().filter(|&(_, &column)| column <= row) {
                self.pattern.add_block(self.values, row, column, &block(&k, a, b));
            }
        }
    }
}
