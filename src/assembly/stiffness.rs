//! `K_k`: the consistent tangent of a subdomain; at rest it is the elastic stiffness `K_e`.

use super::pattern::Pattern;
use super::{committed, displacements, geometry};
use crate::decomposition::Subdomain;
use crate::material::{History, Material};

/// Overwrites `values` (on `pattern`) by the tangent at the displacement `u`, one step from the committed `history`.
/// Returns the number of elements that yield.
pub fn assemble(
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
    pattern: &Pattern,
    values: &mut [f64],
) -> usize {
    values.fill(0.0);
    let elastic = material.elastic_tangent();
    let mut plastic = 0;
    for (index, nodes) in subdomain.elements.iter().enumerate() {
        let committed = committed(history, index);
        let element = geometry(&subdomain.shape, nodes);
        let strain = element.strain(&displacements(u, nodes));
        let k = if material.respond(&strain, committed).plastic {
            plastic += 1;
            element.stiffness(&material.tangent(&strain, committed))
        } else {
            element.stiffness(&elastic)
        };
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate().filter(|&(_, &column)| column <= row) {
                let block = std::array::from_fn(|i| std::array::from_fn(|j| k[3 * a + i][3 * b + j]));
                pattern.add_block(values, row, column, &block);
            }
        }
    }
    plastic
}
