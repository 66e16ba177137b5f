//! `K_k`: the consistent tangent of a subdomain; at rest it is the elastic stiffness `K_e`.

use super::pattern::Pattern;
use super::{displacements, geometry};
use crate::decomposition::Subdomain;
use crate::material::{History, Material};

/// Overwrites `values` (on `pattern`) by the tangent at the displacement `u`, one step from rest. Returns the number of
/// elements that yield.
pub fn assemble(subdomain: &Subdomain, material: &Material, u: &[f64], pattern: &Pattern, values: &mut [f64]) -> usize {
    values.fill(0.0);
    let elastic = material.elastic_tangent();
    let rest = History::default();
    let mut plastic = 0;
    for nodes in &subdomain.elements {
        let element = geometry(&subdomain.shape, nodes);
        let strain = element.strain(&displacements(u, nodes));
        let k = if material.respond(&strain, &rest).plastic {
            plastic += 1;
            element.stiffness(&material.tangent(&strain, &rest))
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
