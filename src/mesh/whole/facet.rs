//! Boundary faces in triangles: which of them touch.

use std::collections::HashSet;

use crate::mesh::SolidMesh;
use crate::mesh::boxes::{Box3, around};
use crate::mesh::faces::{Neighbours, OUTSIDE};
use crate::mesh::near::{of_segments, pierces, volume};
use crate::mesh::surface::{area, normal};

/// What is nearer than this, in units of the height of elements, touches.
pub const NEAR: f64 = 1e-4;

/// A triangle of a boundary face.
pub(super) struct Facet {
    pub element: u32,
    /// Number of the face among those of the boundary.
    pub face: u32,
    /// Its corners; numbers beyond those of the nodes stand for centres of faces.
    pub ids: [u32; 3],
    pub corners: [[f64; 3]; 3],
    /// What is nearer touches.
    pub near: f64,
}

impl Facet {
    /// The box of all that may touch it.
    pub fn room(&self) -> Box3 {
        let [low, high] = around(&self.corners);
        [low.map(|x| x - self.near), high.map(|x| x + self.near)]
    }

    /// Corners that another facet does not have.
    pub fn own<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (u32, [f64; 3])> + 'a {
        self.ids.into_iter().zip(self.corners).filter(|(id, _)| !other.ids.contains(id))
    }

    /// The corner that another facet does not have, if there is one only.
    fn only(&self, other: &Self) -> Option<u32> {
        let mut own = self.own(other);
        let (id, _) = own.next()?;
        own.next().is_none().then_some(id)
    }

    /// Sides by the numbers of their ends, and their ends.
    fn edges(&self) -> [([u32; 2], [[f64; 3]; 2]); 3] {
        [[0, 1], [1, 2], [2, 0]].map(|edge| (edge.map(|k| self.ids[k]), edge.map(|k| self.corners[k])))
    }

    /// Whether the corners that another facet has for itself are clearly on one side of this one.
    pub fn is_aside(&self, other: &Self, near: f64) -> bool {
        let Some(normal) = normal(&self.corners) else { return false };
        let height = |x: [f64; 3]| (0..3).map(|i| normal[i] * (x[i] - self.corners[0][i])).sum::<f64>();
        let (low, high) = other.own(self).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| {
            let height = height(x);
            (low.min(height), high.max(height))
        });
        low > near || high < -near
    }

    /// Whether edges come near each other, or go through the other facet, beyond the corners that both have.
    pub fn crosses(&self, other: &Self, near: f64) -> bool {
        let through = |one: &Self, other: &Self| {
            let free = |ids: &[u32; 2]| !ids.iter().any(|id| other.ids.contains(id));
            one.edges().iter().any(|(ids, edge)| free(ids) && pierces(edge, &other.corners, near))
        };
        let touch = self.edges().iter().any(|(of_self, a)| {
            let apart = |ids: &[u32; 2]| !ids.iter().any(|id| of_self.contains(id));
            other.edges().iter().any(|(ids, b)| apart(ids) && of_segments(a, b) <= near * near)
        });
        touch || through(self, other) || through(other, self)
    }
}

/// The boundary in triangles.
pub(super) fn facets(mesh: &SolidMesh, neighbours: &Neighbours) -> Vec<Facet> {
    let outer = || {
        (0..mesh.elements.len()).flat_map(|element| {
            let sides = neighbours.behind(element).iter().enumerate().filter(|(_, behind)| **behind == OUTSIDE);
            sides.map(move |(side, _)| (element, mesh.elements.face(element, side)))
        })
    };
    let mut heights = vec![f64::NAN; mesh.points.len()];
    outer().flat_map(|(_, face)| face).for_each(|n| heights[n as usize] = f64::INFINITY);
    for nodes in &mesh.elements {
        if nodes.iter().any(|&n| !heights[n as usize].is_nan()) {
            let height = height(mesh, nodes);
            for &node in nodes {
                // What is not a number stays so.
                if heights[node as usize] > height {
                    heights[node as usize] = height;
                }
            }
        }
    }
    let mut facets = Vec::new();
    for (number, (element, face)) in outer().enumerate() {
        let near = NEAR * face.iter().map(|&n| heights[n as usize]).fold(f64::INFINITY, f64::min);
        let mut add = |ids: [u32; 3], corners| {
            facets.push(Facet { element: element as u32, face: number as u32, ids, corners, near });
        };
        let at = |k: u32| mesh.points[k as usize];
        match face[..] {
            [a, b, c, ab, bc, ca] => {
                for ids in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                    add(ids, ids.map(at));
                }
            }
            [a, b, c, d] => {
                let centre = std::array::from_fn(|i| 0.25 * face.iter().map(|&n| at(n)[i]).sum::<f64>());
                for [m, n] in [[a, b], [b, c], [c, d], [d, a]] {
                    add([m, n, (mesh.points.len() + number) as u32], [at(m), at(n), centre]);
                }
            }
            _ => {
                let ids = [face[0], face[1], face[2]];
                add(ids, ids.map(at));
            }
        }
    }
    facets
}

/// The least height of a tetrahedron, or of those that the edges at the corners of a hexahedron span.
fn height(mesh: &SolidMesh, nodes: &[u32]) -> f64 {
    let of = |tet: &[usize; 4]| {
        let [a, b, c, d] = tet.map(|k| mesh.points[nodes[k] as usize]);
        let largest = [[a, b, c], [a, b, d], [b, c, d], [a, c, d]].iter().map(area).fold(0.0, f64::max);
        0.5 * volume(a, b, c, d).abs() / largest
    };
    mesh.elements.kind().cell().spanned().iter().map(of).fold(f64::INFINITY, f64::min)
}

/// The nodes of two facets with an edge in common, if the other two faces of their tetrahedron are there, too, but no element
/// is. The boundary is empty where cells are not cut.
pub(super) fn hole_between(
    mesh: &SolidMesh,
    one: &Facet,
    other: &Facet,
    boundary: &HashSet<[u32; 3]>,
) -> Option<[u32; 4]> {
    if boundary.is_empty() {
        return None;
    }
    let [a, b] = [one.only(other)?, other.only(one)?];
    let closed = one.ids.iter().filter(|&&id| id != a).all(|&id| boundary.contains(&sorted([a, b, id])));
    let [i, j, k] = one.ids;
    (closed && !mesh.elements.get(one.element as usize).contains(&b)).then(|| sorted([i, j, k, b]))
}

pub(super) fn sorted<const N: usize>(mut ids: [u32; N]) -> [u32; N] {
    ids.sort_unstable();
    ids
}
