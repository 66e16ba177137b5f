//! Contact on faces with quadratic shape functions.
//!
//! A constant pressure acts on the middles of edges alone: the shape functions of corners integrate to zero, and force by force
//! at the nodes, corners would be pulled as often as pressed. So displacements get another basis with positive integrals
//! (Popp, Wohlmuth, Gee and Wall, "Dual quadratic mortar finite element methods for 3D finite deformation contact", 2012;
//! Wohlmuth, Popp, Gee and Wall 2012): with `s` = [`SHARE`]
//!
//! `phi~_corner = phi_corner + s * sum of phi_middle over its edges,   phi~_middle = (1 - 2 s) phi_middle`
//!
//! Then the coefficient of a corner is its displacement, that of the middle `m` of the edge `a b` is
//! `(u_m - s (u_a + u_b)) / (1 - 2 s)`, whose weights add up to one, and with multipliers dual to that basis there is one condition a coefficient. All
//! multipliers are forces of the same sense, and a constant pressure passes exactly where meshes match. Nodes meet nodes
//! here; [`super::mortar`] is for meshes that do not match.

use std::collections::{BTreeMap, HashMap};

use super::ContactPair;
use super::surface::GatheredSurface;
use crate::vector::{difference, dot};

/// What a corner gets of the function of an edge's middle.
pub const SHARE: f64 = 0.2;

/// Area that belongs to the condition of each node, of the faces that count: of a corner the integral of its function, `2/3 s A`
/// of each face `A`, of a middle the integral of its own, `(1 - 2 s) A / 3`.
pub(super) fn areas(surface: &GatheredSurface, counts: impl Fn(&[usize; 6]) -> bool) -> Vec<f64> {
    areas_by([2.0 * SHARE, 1.0 - 2.0 * SHARE], surface, counts)
}

/// The same where corners alone have conditions: the integral of the linear function of each.
pub(super) fn areas_of_corners(surface: &GatheredSurface) -> Vec<f64> {
    areas_by([1.0, 0.0], surface, |_| true)
}

/// Areas where each corner and each middle of a face gets so many thirds of it.
fn areas_by(
    [of_corner, of_middle]: [f64; 2],
    surface: &GatheredSurface,
    counts: impl Fn(&[usize; 6]) -> bool,
) -> Vec<f64> {
    let mut areas = vec![0.0; surface.nodes.len()];
    let of_triangles: Vec<f64> = surface.corners().map(|corners| crate::mesh::surface::area(&corners)).collect();
    for (face, parts) in surface.quadratic.iter().zip(of_triangles.chunks_exact(4)).filter(|(face, _)| counts(face)) {
        let third = parts.iter().sum::<f64>() / 3.0;
        face[..3].iter().for_each(|&corner| areas[corner] += of_corner * third);
        face[3..].iter().for_each(|&middle| areas[middle] += of_middle * third);
    }
    areas
}

/// From conditions on nodes to those on coefficients. `gap` is the distance, along a direction, of a pair. Middles of which a
/// corner has no condition have none either.
pub fn conditions(
    slave: &GatheredSurface,
    pairs: Vec<ContactPair>,
    gap: impl Fn(&ContactPair, [f64; 3]) -> f64,
) -> Vec<ContactPair> {
    let mut ends: BTreeMap<(u64, u32), [(u64, u32); 2]> = BTreeMap::new();
    for face in &slave.quadratic {
        let nodes = face.map(|node| (slave.nodes[node], slave.parts[node]));
        (0..3).for_each(|k| {
            // In one order, whichever face comes last.
            let [a, b] = [nodes[k], nodes[(k + 1) % 3]];
            ends.insert(nodes[3 + k], [a.min(b), a.max(b)]);
        });
    }
    let of_node: HashMap<(u64, u32), &ContactPair> = pairs.iter().map(|pair| ((pair.slave, pair.part), pair)).collect();
    let condition = |pair: &ContactPair| {
        let Some(ends) = ends.get(&(pair.slave, pair.part)) else { return Some(pair.clone()) };
        let (own, share) = (1.0 / (1.0 - 2.0 * SHARE), -SHARE / (1.0 - 2.0 * SHARE));
        let mut result = ContactPair { gap: own * pair.gap, ..pair.clone() };
        result.slaves.iter_mut().chain(&mut result.masters).for_each(|(_, weight)| *weight *= own);
        for end in ends {
            let corner = of_node.get(end)?;
            result.slaves.push((end.0, share));
            result.masters.extend(corner.masters.iter().map(|(node, weight)| (*node, share * weight)));
            result.gap += share * gap(corner, pair.normal);
        }
        Some(result)
    };
    pairs.iter().filter_map(condition).collect()
}

/// Distance between a slave node and the master node opposite, along a direction.
pub fn distance(slave: &GatheredSurface, master: &GatheredSurface, pair: &ContactPair, direction: [f64; 3]) -> f64 {
    let place = |surface: &GatheredSurface, node: u64| {
        surface.points[surface.nodes.binary_search(&node).expect("it is on the surface")]
    };
    dot(direction, difference(place(master, pair.masters[0].0), place(slave, pair.slave)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::matching;
    use crate::mesh::surface::shares;

    /// A square of two quadratic faces at a height; looking down if `turned`.
    fn square(z: f64, first: u64, turned: bool) -> GatheredSurface {
        let at = |i: usize, j: usize| i + 3 * j;
        let up = [
            [at(0, 0), at(2, 0), at(2, 2), at(1, 0), at(2, 1), at(1, 1)],
            [at(0, 0), at(2, 2), at(0, 2), at(1, 1), at(1, 2), at(0, 1)],
        ];
        let down = |[a, b, c, ab, bc, ca]: [usize; 6]| [a, c, b, ca, bc, ab];
        let quadratic = if turned { up.map(down) } else { up }.to_vec();
        let cut = |&[a, b, c, ab, bc, ca]: &[usize; 6]| [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        GatheredSurface {
            nodes: (0..9).map(|k| first + k).collect(),
            parts: vec![0; 9],
            points: (0..9).map(|k| [(k % 3) as f64, (k / 3) as f64, z]).collect(),
            triangles: quadratic.iter().flat_map(cut).collect(),
            share: 1.0,
            quadratic,
            of: None,
        }
    }

    /// A constant pressure on all conditions acts on all nodes of both sides as on their faces, and has positive areas.
    #[test]
    fn a_constant_pressure_passes_exactly() {
        let (slave, master) = (square(0.3, 100, true), square(0.0, 0, false));
        let pairs = matching::pair(0, &slave, &master).expect("they match").pairs;
        let pairs = conditions(&slave, pairs, |pair, along| distance(&slave, &master, pair, along));
        assert_eq!(pairs.len(), 9);
        let mut forces = [[0.0; 9]; 2];
        for pair in &pairs {
            assert!(pair.area > 0.0);
            pair.slaves.iter().for_each(|(node, weight)| forces[0][(node - 100) as usize] += weight * pair.area);
            pair.masters.iter().for_each(|(node, weight)| forces[1][*node as usize] += weight * pair.area);
            for weights in [&pair.slaves, &pair.masters] {
                assert!((weights.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-15, "{pair:?}");
            }
            assert!((pair.gap - 0.3).abs() < 1e-15, "{pair:?}");
        }
        let mut expected = [0.0; 9];
        for face in &master.quadratic {
            let places = face.map(|node| master.points[node]);
            face.iter().zip(shares(&places)).for_each(|(&node, share)| expected[node] += share[2]);
        }
        for found in forces {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13), "{found:?} {expected:?}");
        }
    }

    #[test]
    fn middles_beside_a_corner_without_condition_have_none() {
        let (slave, master) = (square(0.3, 100, true), square(0.0, 0, false));
        let mut pairs = matching::pair(0, &slave, &master).expect("they match").pairs;
        pairs.retain(|pair| pair.slave != 100);
        let left = conditions(&slave, pairs, |pair, along| distance(&slave, &master, pair, along));
        assert_eq!(left.iter().map(|pair| pair.slave).collect::<Vec<_>>(), [102, 105, 106, 107, 108]);
    }
}
