//! Pairs of coinciding meshes: every slave node that has a master node opposite along its normal.
//!
//! Surfaces face each other only where their normals do: what looks away from the slave, or stands at a right angle to it, is
//! not opposite. Slave nodes beyond the edge of the master surface carry no contact, and of those at its edge only the faces
//! that are covered count.

use std::collections::HashSet;

use super::patch::Line;
use super::surface::{FACING, GatheredSurface, Layer};
use super::tree::BallTree;
use super::{Conditions, ContactPair, MasterNode};
use crate::mesh::surface;
use crate::vector::{difference, dot};

/// How far, in edge lengths of the master surface, a master node may lie beside the slave node's normal.
const TOLERANCE: f64 = 1e-6;

/// For each node of a surface the node of the other that is opposite, and its distance along the normal.
pub type Facing = Vec<Option<(usize, f64)>>;

/// The lines through the nodes of a surface that [`facing`] looks along, as far as all faces around them are here. `spacing` is
/// that of the other surface.
pub fn lines(surface: &GatheredSurface, spacing: f64) -> Vec<Line> {
    let nodes = surface.points.iter().zip(surface.normals_and_areas()).enumerate();
    let here = nodes.filter(|(node, _)| surface.layer(*node) != Layer::Rim);
    here.map(|(_, (&point, (direction, _)))| Line { point, direction, distance: spacing }).collect()
}

/// What the nodes of one surface face on the other, of which all is here that is near [`lines`]; nothing where some faces around a
/// node are missing. `None` if the surfaces do not match: if a node has the other side opposite but none of its nodes, or if nodes
/// match but triangles do not.
pub fn facing(one: &GatheredSurface, other: &GatheredSurface) -> Option<Facing> {
    opposite_nodes(one, other).filter(|opposite| !differ(one, other, opposite))
}

/// Conditions of contact number `contact` on the nodes of own faces.
pub fn conditions(contact: usize, slave: &GatheredSurface, master: &GatheredSurface, facing: Facing) -> Conditions {
    let (normals, shares): (Vec<[f64; 3]>, Vec<f64>) = slave.normals_and_areas().into_iter().unzip();
    let areas = slave.covered_areas(&normals, |node| facing[node].is_some());
    let mut found = Conditions::default();
    for (k, (opposite, area)) in facing.into_iter().zip(areas).enumerate() {
        let Some((node, gap)) = opposite.filter(|_| area > 0.0 && slave.layer(k) == Layer::Own) else { continue };
        if slave.tells(k) {
            let (node, part, pairs) = (master.nodes[node], master.parts[node], vec![(found.pairs.len(), 1.0)]);
            found.masters.push(MasterNode { contact, node, part, distance: gap, matches: true, pairs });
        }
        found.pairs.push(ContactPair {
            contact,
            slave: slave.nodes[k],
            part: slave.parts[k],
            slaves: vec![(slave.nodes[k], 1.0)],
            masters: vec![(master.nodes[node], 1.0)],
            vectors: Vec::new(),
            normal: normals[k],
            gap,
            area,
            limit_area: shares[k],
            covered: true,
        });
    }
    found
}

/// Conditions of surfaces that are here as a whole; `None` if they do not match.
#[cfg(test)]
pub fn pair(contact: usize, slave: &GatheredSurface, master: &GatheredSurface) -> Option<Conditions> {
    facing(master, slave)?;
    Some(conditions(contact, slave, master, facing(slave, master)?))
}

/// Whether one surface has a triangle whose corners have opposite nodes that are no triangle of the other.
fn differ(one: &GatheredSurface, other: &GatheredSurface, opposite: &[Option<(usize, f64)>]) -> bool {
    let sorted = |mut triangle: [usize; 3]| {
        triangle.sort_unstable();
        triangle
    };
    let triangles: HashSet<[usize; 3]> = other.triangles.iter().copied().map(sorted).collect();
    let partner = |node: usize| opposite[node].map(|(partner, _)| partner);
    one.triangles.iter().any(|&[a, b, c]| match (partner(a), partner(b), partner(c)) {
        (Some(a), Some(b), Some(c)) => !triangles.contains(&sorted([a, b, c])),
        _ => false,
    })
}

/// For each node of one surface the node of the other that is opposite, and its distance. `None` if only the surface is.
fn opposite_nodes(one: &GatheredSurface, other: &GatheredSurface) -> Option<Facing> {
    let spacing = other.spacing();
    let corners: Vec<_> = other.corners().collect();
    let tree = BallTree::new(&corners);
    let facing = |triangle: &usize, normal| {
        surface::normal(&corners[*triangle]).is_some_and(|other| dot(normal, other) < -FACING)
    };
    let nodes = one.points.iter().zip(one.normals_and_areas()).enumerate();
    nodes
        .map(|(node, (&point, (normal, _)))| {
            if one.layer(node) == Layer::Rim {
                return Some(None);
            }
            let mut triangles = tree.along(point, normal, spacing);
            triangles.retain(|triangle| facing(triangle, normal));
            match opposite(other, &triangles, point, normal, spacing) {
                None if hits(other, &triangles, point, normal, spacing) => None,
                found => Some(found),
            }
        })
        .collect()
}

/// The nearest corner of these triangles of a surface on the line through `point` along `normal`, and its signed distance.
fn opposite(
    surface: &GatheredSurface,
    triangles: &[usize],
    point: [f64; 3],
    normal: [f64; 3],
    spacing: f64,
) -> Option<(usize, f64)> {
    let corners = triangles.iter().flat_map(|&triangle| surface.triangles[triangle]);
    let found = corners.filter_map(|index| {
        let arm = difference(surface.points[index], point);
        let gap = dot(arm, normal);
        let beside: [f64; 3] = std::array::from_fn(|a| arm[a] - gap * normal[a]);
        (dot(beside, beside).sqrt() <= TOLERANCE * spacing).then_some((index, gap))
    });
    found.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(a.0.cmp(&b.0)))
}

/// Whether the line through `point` along `normal` meets one of these triangles of a surface: inside or, to a thousandth
/// of an edge, on its rim.
fn hits(surface: &GatheredSurface, triangles: &[usize], point: [f64; 3], normal: [f64; 3], spacing: f64) -> bool {
    triangles.iter().any(|&triangle| {
        let [a, b, c] = surface.triangles[triangle].map(|corner| {
            let arm = difference(surface.points[corner], point);
            let along = dot(arm, normal);
            std::array::from_fn::<f64, 3, _>(|i| arm[i] - along * normal[i])
        });
        // Twice the signed areas, seen along the normal, of the triangles that the line makes with each edge.
        let side = |p: [f64; 3], q: [f64; 3]| {
            dot(normal, [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]])
        };
        let rim = 1e-3 * spacing * spacing;
        let areas = [side(a, b), side(b, c), side(c, a)];
        let whole: f64 = areas.iter().sum();
        whole.abs() > rim && areas.iter().all(|&s| s * whole.signum() > -rim)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat square of `n` x `n` cells at height `z`, normals along `up`.
    fn square(n: usize, size: f64, z: f64, up: bool, first: u64) -> GatheredSurface {
        let node = |i: usize, j: usize| i + (n + 1) * j;
        let mut triangles = Vec::new();
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let quad = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            for t in [[0, 1, 2], [0, 2, 3]] {
                let [a, b, c] = t.map(|k| quad[k]);
                triangles.push(if up { [a, b, c] } else { [a, c, b] });
            }
        }
        let h = size / n as f64;
        let points = (0..(n + 1) * (n + 1)).map(|k| [(k % (n + 1)) as f64 * h, (k / (n + 1)) as f64 * h, z]).collect();
        let nodes: Vec<u64> = (0..((n + 1) * (n + 1)) as u64).map(|k| first + k).collect();
        GatheredSurface {
            parts: vec![0; nodes.len()],
            nodes,
            points,
            triangles,
            share: 1.0,
            quadratic: Vec::new(),
            of: None,
        }
    }

    #[test]
    fn matching_squares_pair_with_gap_normal_and_area() {
        for gap in [0.0, 0.3, 7.0, -0.2] {
            let pairs =
                pair(0, &square(4, 1.0, gap, false, 100), &square(4, 1.0, 0.0, true, 0)).expect("they match").pairs;
            assert_eq!(pairs.len(), 25);
            for p in &pairs {
                assert_eq!(p.masters, [(p.slave - 100, 1.0)]);
                assert_eq!(p.normal, [0.0, 0.0, -1.0]);
                assert!((p.gap - gap).abs() < 1e-14);
            }
            assert!((pairs.iter().map(|p| p.area).sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    /// Quadrilaterals, which are cut in both ways, match each other but not triangles.
    #[test]
    fn quadrilaterals_match_quadrilaterals_only() {
        let cut_twice = |mut surface: GatheredSurface| {
            let others: Vec<_> = surface
                .triangles
                .chunks_exact(2)
                .flat_map(|pair| {
                    // [a, b, c] and [a, c, d], turned around if it looks down.
                    let [a, b, c] = pair[0];
                    let d = pair[1].into_iter().find(|n| !pair[0].contains(n)).expect("it has a fourth corner");
                    if b == a + 1 { [[a, b, d], [b, c, d]] } else { [[a, d, c], [c, d, b]] }
                })
                .collect();
            surface.triangles.extend(others);
            GatheredSurface { share: 0.5, ..surface }
        };
        let (up, down) = (square(4, 1.0, 0.0, true, 0), || square(4, 1.0, 0.3, false, 100));
        assert_eq!(pair(0, &cut_twice(down()), &up), None);
        assert_eq!(pair(0, &down(), &cut_twice(up)), None);
        let found = pair(0, &cut_twice(down()), &cut_twice(square(4, 1.0, 0.0, true, 0)));
        let pairs = found.expect("they match").pairs;
        assert!((pairs.iter().map(|p| p.area).sum::<f64>() - 1.0).abs() < 1e-14);
        let corner = pairs.iter().find(|p| p.slave == 100).expect("all nodes are paired");
        assert!((corner.area - 1.0 / 64.0).abs() < 1e-15);
    }

    #[test]
    fn nodes_beyond_the_master_carry_no_contact() {
        let found = pair(0, &square(4, 2.0, 0.0, false, 100), &square(2, 1.0, 0.0, true, 0)).expect("they match");
        assert_eq!(found.pairs.len(), 9);
        // What they carry acts on the covered part alone.
        assert!((found.pairs.iter().map(|p| p.area).sum::<f64>() - 1.0).abs() < 1e-15);
        let at = |node: u64| found.pairs.iter().find(|p| p.slave == node).expect("it is covered").area;
        assert!((at(100) + at(102) + at(110) + at(112) - 0.25).abs() < 1e-15);
        // Squares that have only an edge in common, or a corner, have no area to press on.
        let mut beside = square(2, 1.0, 0.0, true, 0);
        beside.points.iter_mut().for_each(|p| p[0] += 1.0);
        assert_eq!(pair(0, &square(2, 1.0, 0.0, false, 100), &beside), Some(Conditions::default()));
    }

    #[test]
    fn surfaces_that_look_away_or_stand_at_a_right_angle_are_not_opposite() {
        let slave = square(3, 1.0, 0.0, false, 100);
        assert_eq!(pair(0, &slave, &square(3, 1.0, 0.0, false, 0)), Some(Conditions::default()));
        let mut upright = square(3, 1.0, 0.0, true, 0);
        upright.points.iter_mut().for_each(|p| *p = [p[0], 0.0, p[1]]);
        assert_eq!(pair(0, &slave, &upright), Some(Conditions::default()));
    }

    #[test]
    fn other_meshes_do_not_match() {
        assert_eq!(pair(0, &square(3, 1.0, 0.0, false, 100), &square(2, 1.0, 0.0, true, 0)), None);
        // All nodes of one mesh have a partner, those of the other do not.
        assert_eq!(pair(0, &square(4, 1.0, 0.0, false, 100), &square(2, 1.0, 0.0, true, 0)), None);
        assert_eq!(pair(0, &square(2, 1.0, 0.0, false, 100), &square(4, 1.0, 0.0, true, 0)), None);
        let mut far = square(2, 1.0, 0.0, true, 0);
        far.points.iter_mut().for_each(|p| p[0] += 10.0);
        assert_eq!(pair(0, &square(2, 1.0, 0.0, false, 100), &far), Some(Conditions::default()));
    }
}
