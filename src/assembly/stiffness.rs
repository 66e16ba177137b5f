//! `K_k`: the tangent of a subdomain; at rest it is the elastic stiffness `K_e`.

use super::{committed, displacements, integrated};
use crate::decomposition::Subdomain;
use crate::element::point::block;
use crate::element::{Nodal, Point, by_kind};
use crate::material::{History, Material};
use crate::sparse::pattern::Pattern;
use crate::tensor::Voigt;

/// Overwrites `values` (on `pattern`) by the tangent at the displacement `u`, one step from the committed `history`, with
/// the directions of [`super::flow`]; without them it is the consistent one. Returns the number of elements that yield.
pub fn assemble(
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    (u, flow): (&[f64], &[Voigt]),
    pattern: &Pattern,
    values: &mut [f64],
) -> usize {
    by_kind!(subdomain.elements.kind(), assemble_of(subdomain, material, history, (u, flow), pattern, values))
}

fn assemble_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    (u, flow): (&[f64], &[Voigt]),
    pattern: &Pattern,
    values: &mut [f64],
) -> usize {
    values.fill(0.0);
    let elastic = material.elastic_tangent();
    let mut plastic = 0;
    for (index, (nodes, points)) in integrated(points, &subdomain.elements, &subdomain.shape).enumerate() {
        let u = displacements(u, nodes);
        let mut k = [[[[0.0; N]; 3]; 3]; N];
        let mut yields = false;
        for (at, point) in points.iter().enumerate() {
            let committed = committed(history, P * index + at);
            let strain = point.strain(&u);
            if material.respond(&strain, committed).plastic {
                yields = true;
                point.add_stiffness(&material.stiffness(&strain, committed, flow.get(P * index + at)), &mut k);
            } else {
                point.add_stiffness(&elastic, &mut k);
            }
        }
        plastic += usize::from(yields);
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate().filter(|&(_, &column)| column <= row) {
                pattern.add_block(values, row, column, &block(&k, a, b));
            }
        }
    }
    plastic
}
