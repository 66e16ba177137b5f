//! The smooth parts of a surface around each of its nodes.
//!
//! A surface that runs round an edge has no normal there: a mean of both sides points out of neither, and a pressure along it
//! is no pressure on either. So a node has a normal, and a condition of contact, for each smooth part of the surface around
//! it. Faces around a node belong to one part if their normals there differ by at most [`SHARPEST`], or if a chain of such faces
//! leads from one to the other. Curved surfaces in facets stay whole, edges of parts and chamfers of 45 degrees do not.

use crate::mesh::surface::{SHARPEST, area_vector, quadratic_normal};
use crate::vector::dot;

/// Slack of the cosine of that angle, so that rounding does not cut a circle of nine facets.
const ROUNDING: f64 = 1e-9;

/// A node, a face around it, and which of the face's nodes it is.
type Slot = (u64, usize, usize);

/// For each node of each face the number of the smooth part of the surface around that node. Faces list their corners first
/// (three or four), then the middles of their edges; `place` is that of a node. Numbers do not depend on the order of faces.
pub fn parts(faces: &[Vec<u64>], place: impl Fn(u64) -> [f64; 3]) -> Vec<Vec<u32>> {
    let normals: Vec<Vec<Option<[f64; 3]>>> = faces.iter().map(|face| normals(face, &place)).collect();
    let cosine = SHARPEST.to_radians().cos() - ROUNDING;
    // Faces without area are smooth with all.
    let smooth = |a: &Slot, b: &Slot| match (normals[a.1][a.2], normals[b.1][b.2]) {
        (Some(a), Some(b)) => dot(a, b) >= cosine,
        _ => true,
    };
    let mut around: Vec<Slot> = Vec::new();
    for (f, face) in faces.iter().enumerate() {
        around.extend(face.iter().enumerate().map(|(k, &node)| (node, f, k)));
    }
    around.sort_unstable();
    let mut result: Vec<Vec<u32>> = faces.iter().map(|face| vec![0; face.len()]).collect();
    for slots in around.chunk_by(|a, b| a.0 == b.0) {
        if slots.iter().all(|slot| smooth(&slots[0], slot)) {
            continue;
        }
        let mut chains = chains(slots, smooth);
        chains.sort_by_key(|chain| chain.iter().map(|&(_, face, _)| sorted(&faces[face])).min());
        for (number, chain) in chains.into_iter().enumerate() {
            chain.into_iter().for_each(|(_, face, k)| result[face][k] = number as u32);
        }
    }
    result
}

/// Unit normals of a face at its nodes, which differ where it is quadratic; none without area.
fn normals(face: &[u64], place: impl Fn(u64) -> [f64; 3]) -> Vec<Option<[f64; 3]>> {
    let places: Vec<[f64; 3]> = face.iter().map(|&node| place(node)).collect();
    let unit = |vector: [f64; 3]| {
        let area = dot(vector, vector).sqrt();
        (area > 0.0).then(|| vector.map(|x| x / area))
    };
    if let Ok(quadratic) = <[_; 6]>::try_from(&places[..]) {
        return (0..6).map(|node| unit(quadratic_normal(&quadratic, NODES[node]))).collect();
    }
    let triangles = (2..places.len()).map(|k| area_vector(&[places[0], places[k - 1], places[k]]));
    vec![unit(triangles.fold([0.0; 3], |sum, part| std::array::from_fn(|a| sum[a] + part[a]))); face.len()]
}

/// The nodes of a quadratic face between its corners.
pub const NODES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];

/// Cuts the faces around a node into chains of smooth neighbours.
fn chains(slots: &[Slot], smooth: impl Fn(&Slot, &Slot) -> bool) -> Vec<Vec<Slot>> {
    let (mut left, mut found) = (slots.to_vec(), Vec::new());
    while let Some(first) = left.pop() {
        let (mut chain, mut next) = (vec![first], 0);
        while let Some(&link) = chain.get(next) {
            let near;
            (near, left) = left.into_iter().partition(|other| smooth(&link, other));
            chain.extend::<Vec<Slot>>(near);
            next += 1;
        }
        found.push(chain);
    }
    found
}

fn sorted(face: &[u64]) -> Vec<u64> {
    let mut nodes = face.to_vec();
    nodes.sort_unstable();
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of quadrilaterals along x between two rows of nodes, `heights` above the plane at x = 0, 1, 2, ...
    fn strip(heights: &[f64]) -> (Vec<Vec<u64>>, Vec<[f64; 3]>) {
        let points = heights.iter().enumerate();
        let points = points.flat_map(|(k, z)| [[k as f64, 0.0, *z], [k as f64, 1.0, *z]]).collect();
        let face = |k: u64| vec![2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
        ((0..heights.len() as u64 - 1).map(face).collect(), points)
    }

    fn of_strip(heights: &[f64]) -> Vec<Vec<u32>> {
        let (faces, points) = strip(heights);
        parts(&faces, |node| points[node as usize])
    }

    #[test]
    fn a_surface_is_cut_where_it_bends_by_more_than_the_limit() {
        let up = |degrees: f64| degrees.to_radians().tan();
        assert_eq!(of_strip(&[0.0, 0.0, up(39.0)]), [[0; 4], [0; 4]]);
        let cut = of_strip(&[0.0, 0.0, up(41.0)]);
        // The two nodes in common, second and third of the one, first and fourth of the other.
        assert_eq!(cut, [[0, 0, 0, 0], [1, 0, 0, 1]]);
        // A chain of small angles is smooth, however far it leads.
        let chain: Vec<f64> = (0..8)
            .scan(0.0, |z, k| {
                *z += up(10.0 * f64::from(k));
                Some(*z)
            })
            .collect();
        assert!(of_strip(&chain).iter().flatten().all(|part| *part == 0));
    }

    #[test]
    fn a_corner_has_three_parts_whatever_the_order_of_faces() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [vec![0, 2, 1], vec![0, 1, 3], vec![0, 3, 2]];
        let found = parts(&faces, |node| points[node as usize]);
        assert_eq!(found.iter().map(|face| face[0]).collect::<Vec<_>>(), [0, 1, 2]);
        // In other units too.
        assert_eq!(found, parts(&faces, |node| points[node as usize].map(|x| 1e-12 * x)));
        let turned: Vec<Vec<u64>> = faces.iter().rev().cloned().collect();
        let mut again = parts(&turned, |node| points[node as usize]);
        again.reverse();
        assert_eq!(found, again);
    }

    /// Eight quadratic faces around a circle bend by 45 degrees from corner to corner, but not at their nodes.
    #[test]
    fn curved_faces_are_smooth_where_their_tangents_are() {
        let at = |eighth: f64, z: f64| {
            let angle = eighth * std::f64::consts::FRAC_PI_4;
            [angle.cos(), angle.sin(), z]
        };
        // Corners (0, 0), (1, 0), (0, 1) and (2, 0), (2, 1), (1, 0) of the unrolled strip, in eighths and z, and middles.
        let strip = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)];
        let next = [(1.0, 0.0), (2.0, 0.0), (1.0, 1.0), (1.5, 0.0), (1.5, 0.5), (1.0, 0.5)];
        let points: Vec<[f64; 3]> = strip.iter().chain(&next).map(|&(s, z)| at(s, z)).collect();
        let faces = [vec![0, 1, 2, 3, 4, 5], vec![1, 7, 8, 9, 10, 11]];
        let curved = parts(&faces, |node| points[node as usize]);
        assert!(curved.iter().flatten().all(|part| *part == 0), "{curved:?}");
        // By their corners alone they are not.
        let flat = parts(&[vec![0, 1, 2], vec![1, 7, 8]], |node| points[node as usize]);
        assert!(flat.iter().flatten().any(|part| *part == 1), "{flat:?}");
    }

    #[test]
    fn faces_that_share_a_node_alone_but_a_direction_are_one_part() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        let found = parts(&[vec![0, 1, 2], vec![0, 3, 4]], |node| points[node as usize]);
        assert_eq!(found, [[0; 3]; 2]);
    }
}
