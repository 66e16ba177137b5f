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
//! here, each along its own normal: that of a middle is the coefficient `(n_m . u_m - s (n_a . u_a + n_b . u_b)) / (1 - 2 s)` of the
//! displacements along the normals. So a constant pressure acts along the normals of a curved surface, and all nodes meet a distance that is
//! prescribed along these; [`super::mortar`] is for meshes that do not match.
//!
//! Where distances are bent, as under a ball, `s` should be small ([`SHARE_WHERE_BENT`]): a middle that would touch while both corners
//! are `d` away is held `2 s d` away. Where it is very small so are the areas of corners, and their pressures are noisy. Under a rigid ball
//! energies were 11.0, 6.1 and 4.0 % off on the first mesh with 0.2, 0.1 and 0.05, pressures at nodes 5.6, 3.5 and 5.6 % in the mean on a
//! finer one. On a plane all are as exact, and friction takes fewer iterations with 0.2.

use std::collections::{BTreeMap, HashMap};

use super::surface::GatheredSurface;
use super::{ContactPair, ROUNDING};
use crate::vector::{difference, length};

/// What a corner gets of the function of an edge's middle.
pub const SHARE: f64 = 0.2;

/// The same where distances are bent.
pub const SHARE_WHERE_BENT: f64 = 0.1;

/// Area that belongs to the condition of each node, of the faces that count: of a corner the integral of its function, `2/3 s A`
/// of each face `A`, of a middle the integral of its own, `(1 - 2 s) A / 3`.
pub(super) fn areas(surface: &GatheredSurface, share: f64, counts: impl Fn(&[usize; 6]) -> bool) -> Vec<f64> {
    let [of_corner, of_middle] = [2.0 * share, 1.0 - 2.0 * share];
    let mut areas = vec![0.0; surface.nodes.len()];
    let of_triangles: Vec<f64> = surface.corners().map(|corners| crate::mesh::surface::area(&corners)).collect();
    for (face, parts) in surface.quadratic.iter().zip(of_triangles.chunks_exact(4)).filter(|(face, _)| counts(face)) {
        let third = parts.iter().sum::<f64>() / 3.0;
        face[..3].iter().for_each(|&corner| areas[corner] += of_corner * third);
        face[3..].iter().for_each(|&middle| areas[middle] += of_middle * third);
    }
    areas
}

/// From conditions on nodes to those on coefficients. Middles of which a corner has no condition have none either.
pub fn conditions(slave: &GatheredSurface, share: f64, pairs: Vec<ContactPair>) -> Vec<ContactPair> {
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
        let Some([a, b]) = ends.get(&(pair.slave, pair.part)) else { return Some(pair.clone()) };
        let (own, other) = (1.0 / (1.0 - 2.0 * share), -share / (1.0 - 2.0 * share));
        let parts = [(pair, own), (*of_node.get(a)?, other), (*of_node.get(b)?, other)];
        let weighted = |nodes: fn(&ContactPair) -> &Vec<(u64, f64)>| {
            parts.iter().flat_map(|(of, factor)| nodes(of).iter().map(move |(node, w)| (*node, factor * w))).collect()
        };
        let (slaves, masters): (Vec<_>, Vec<_>) = (weighted(|of| &of.slaves), weighted(|of| &of.masters));
        let is_curved = parts.iter().any(|(of, _)| length(difference(of.normal, pair.normal)) > ROUNDING);
        let sides = if is_curved { 1 + usize::from(!masters.is_empty()) } else { 0 };
        let vectors = parts.map(|(of, factor)| of.normal.map(|n| factor * n)).repeat(sides);
        let gap = parts.iter().map(|(of, factor)| factor * of.gap).sum();
        Some(ContactPair { slaves, masters, vectors, gap, ..pair.clone() })
    };
    pairs.iter().filter_map(condition).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::matching;
    use crate::mesh::surface::shares;
    use crate::vector::dot;

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
        let pairs = conditions(&slave, SHARE, pairs);
        assert_eq!(pairs.len(), 9);
        let mut forces = [[0.0; 9]; 2];
        for pair in &pairs {
            assert!(pair.area > 0.0 && pair.vectors.is_empty());
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

    /// The forces of a constant pressure on a bent surface are along its normals, and a motion along these meets all conditions alike.
    #[test]
    fn on_a_curved_surface_pressures_and_motions_are_along_the_normals() {
        let round = |z: f64, first: u64, turned: bool| {
            let mut surface = square(0.0, first, turned);
            for [x, y, height] in &mut surface.points {
                (*x, *y) = (*x - 1.0, *y - 1.0);
                *height = z - (4.0 - *x * *x - *y * *y).sqrt();
            }
            surface
        };
        let (slave, master) = (round(0.0, 100, true), round(0.0, 0, false));
        let pairs = matching::pair(0, &slave, &master).expect("they match").pairs;
        let normals: BTreeMap<u64, [f64; 3]> = pairs.iter().map(|pair| (pair.slave, pair.normal)).collect();
        let found = conditions(&slave, SHARE, pairs);
        assert_eq!(found.iter().filter(|pair| !pair.vectors.is_empty()).count(), 5, "middles");
        let mut forces: BTreeMap<u64, [f64; 3]> = BTreeMap::new();
        for pair in &found {
            let factors: Vec<_> = pair.factors().collect();
            let motion = |(node, factor): &(u64, [f64; 3])| normals.get(node).map_or(0.0, |n| dot(*factor, *n));
            assert!((factors.iter().map(motion).sum::<f64>() - 1.0).abs() < 1e-14);
            let still = (0..3).map(|a| factors.iter().map(|(_, factor)| factor[a]).sum::<f64>());
            assert!(still.into_iter().all(|sum| sum.abs() < 1e-14), "a translation of all meets all");
            for (node, factor) in factors {
                let force = forces.entry(node).or_default();
                (0..3).for_each(|a| force[a] += pair.area * factor[a]);
            }
        }
        for (node, normal) in normals {
            let across = crate::vector::cross(forces[&node], normal);
            assert!(length(across) < 1e-14, "{node}: {across:?}");
            assert!((0..3).all(|a| (forces[&node][a] + forces[&(node - 100)][a]).abs() < 1e-14));
        }
    }

    #[test]
    fn middles_beside_a_corner_without_condition_have_none() {
        let (slave, master) = (square(0.3, 100, true), square(0.0, 0, false));
        let mut pairs = matching::pair(0, &slave, &master).expect("they match").pairs;
        pairs.retain(|pair| pair.slave != 100);
        let left = conditions(&slave, SHARE, pairs);
        assert_eq!(left.iter().map(|pair| pair.slave).collect::<Vec<_>>(), [102, 105, 106, 107, 108]);
    }
}
