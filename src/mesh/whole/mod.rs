//! Whether a mesh is as whole as it looks: what touches must share nodes and faces.
//!
//! Elements hang together by their faces, so all that can be wrong lies between faces that have one element only. Two such
//! faces may have nodes in common; beyond these they must be apart, by more than [`NEAR`] times the least height of the
//! elements there. Through an element two faces are at least as far apart as it is high, so that flat elements, layers and
//! wedges raise no alarm, nor do slits that are wider than that. Nodes that coincide and nodes that hang are told from faces
//! that cross. Quadratic faces count as the four triangles between their nodes, quadrilaterals as the four around their
//! centre, so where they are curved the sides of a slit must be farther apart than these triangles are from the faces.
//!
//! Other flaws are found without geometry: cells on both sides of quadrilaterals that are cut along different diagonals leave
//! holes of the shape of a tetrahedron, quadratic elements can share corners but not middles, and pieces can hang together by
//! nodes without a face. Several pieces that do not touch are sound, unless one is inside of another.

mod facet;

use std::collections::{BTreeMap, BTreeSet, HashSet};

use thiserror::Error;

use super::SolidMesh;
use super::boxes::{Box3, BoxTree, around};
use super::connectivity::split_into_pieces;
use super::faces::{Neighbours, OUTSIDE};
use super::near::{of_points, pierces, to_triangle, volume};

pub use facet::NEAR;
use facet::{Facet, facets, hole_between, sorted};

/// Why a mesh only looks whole, with what to do about it in Gmsh.
#[derive(Debug, Error, PartialEq)]
pub enum Flaw {
    /// Boundary faces that touch without being joined.
    #[error(
        "the mesh is torn where it looks whole: {}; mesh both sides alike, with `Coherence;` or `BooleanFragments` before `Mesh 3;` \
         (`Coherence Mesh;` joins nodes that coincide); what only touches is a body of its own, with a contact; a slit must be wider \
         than {NEAR:e} of its elements, and than the facets of its sides are deep",
        torn(*coincident, *hanging, *crossing)
    )]
    Torn {
        /// Nodes that lie where other nodes do.
        coincident: usize,
        /// Nodes that lie elsewhere in faces without them.
        hanging: usize,
        /// Faces that have points with others in common, but no nodes near them.
        crossing: usize,
    },
    /// Faces around four nodes without an element between them.
    #[error(
        "there are {0} holes of one tetrahedron: an element is missing, or hexahedra, prisms or pyramids meet other cells that cut \
         their quadrilaterals along the other diagonal; let pyramids go between, or mesh both sides with `Recombine`"
    )]
    Holes(usize),
    /// Faces that share corners, but not the middles of their edges.
    #[error(
        "{0} faces between elements share their corners, but not the nodes in the middle of their edges: save the mesh again after \
         `Coherence Mesh;` or `SetOrder 1; SetOrder 2;`"
    )]
    Middles(usize),
    /// Pieces with nodes in common but no face.
    #[error(
        "{0} nodes alone join parts that have no face in common, so that these turn about a corner or an edge; join them by faces, \
         or take them apart"
    )]
    Hinge(usize),
    /// Pieces inside of others.
    #[error(
        "{0} pieces lie inside of others and have no node in common with them: cut them out (`BooleanFragments` joins, \
         `BooleanDifference` leaves room)"
    )]
    Inside(usize),
}

fn torn(coincident: usize, hanging: usize, crossing: usize) -> String {
    let parts = [
        (coincident, "nodes coincide with others"),
        (hanging, "nodes hang in faces or on edges of elements that do not have them"),
        (crossing, "faces cross others"),
    ];
    let parts = parts.into_iter().filter(|(count, _)| *count > 0);
    parts.map(|(count, what)| format!("{count} {what}")).collect::<Vec<_>>().join(", ")
}

/// A flaw and where it shows first.
#[derive(Debug, PartialEq)]
pub struct Found {
    /// What is wrong.
    pub flaw: Flaw,
    /// Where.
    pub near: [f64; 3],
    /// Regions of the elements there.
    pub regions: [usize; 2],
}

/// The face-connected piece of each element, numbered by their first elements; nothing if there is only one.
///
/// # Errors
/// If the mesh only looks whole.
pub fn pieces(mesh: &SolidMesh, neighbours: &Neighbours) -> Result<Vec<u32>, Found> {
    middles(mesh, neighbours)?;
    let mut pieces = vec![0; mesh.elements.len()];
    let count = split_into_pieces(&mut pieces, |element| neighbours.of(element));
    let pieces = if count > 1 { pieces.into_iter().map(|piece| piece as u32).collect() } else { Vec::new() };
    let facets = facets(mesh, neighbours);
    let boxes: Vec<Box3> = facets.iter().map(Facet::room).collect();
    let tree = BoxTree::new(&boxes);
    apart(mesh, &facets, &tree)?;
    hinges(mesh, &pieces)?;
    inside(mesh, &facets, &tree, &pieces, count)?;
    Ok(pieces)
}

/// Refuses elements that share corners of a face, but not its middles.
fn middles(mesh: &SolidMesh, neighbours: &Neighbours) -> Result<(), Found> {
    if mesh.elements.kind().middles().is_empty() {
        return Ok(());
    }
    let (mut count, mut first) = (0, None);
    for element in 0..mesh.elements.len() {
        for (side, &other) in neighbours.behind(element).iter().enumerate() {
            if other == OUTSIDE || (other as usize) < element {
                continue;
            }
            let (face, nodes) = (mesh.elements.face(element, side), mesh.elements.get(other as usize));
            if let Some(lost) = face.iter().find(|n| !nodes.contains(n)) {
                count += 1;
                first.get_or_insert((mesh.points[*lost as usize], [element, other as usize]));
            }
        }
    }
    found(mesh, Flaw::Middles(count), first)
}

/// Refuses boundary faces that touch beyond the nodes that they share.
fn apart(mesh: &SolidMesh, facets: &[Facet], tree: &BoxTree) -> Result<(), Found> {
    let boundary: HashSet<[u32; 3]> = match mesh.elements.kind().gmsh().is_split() {
        true => facets.iter().map(|facet| sorted(facet.ids)).collect(),
        false => HashSet::new(),
    };
    let (mut tears, mut holes, mut hole) = (Tears::default(), BTreeSet::new(), None);
    tree.pairs(|one, other| {
        let [one, other] = [one, other].map(|k| &facets[k as usize]);
        if one.face == other.face {
            return;
        }
        let elements = [one, other].map(|facet| facet.element as usize);
        match hole_between(mesh, one, other, &boundary) {
            Some(nodes) => {
                hole.get_or_insert((mesh.points[nodes[0] as usize], elements));
                holes.insert(nodes);
            }
            None => tears.add(mesh.points.len(), one, other),
        }
    });
    found(mesh, tears.flaw(), tears.first)?;
    found(mesh, Flaw::Holes(holes.len()), hole)
}

/// Where boundary faces touch that should not.
#[derive(Default)]
struct Tears {
    coincident: BTreeSet<u32>,
    hanging: BTreeSet<u32>,
    crossing: BTreeSet<u32>,
    /// Faces with nodes near them.
    touching: BTreeSet<u32>,
    first: Option<([f64; 3], [usize; 2])>,
}

impl Tears {
    /// Looks at two facets of a mesh with so many nodes.
    fn add(&mut self, nodes: usize, a: &Facet, b: &Facet) {
        let near = a.near.min(b.near);
        if a.is_aside(b, near) || b.is_aside(a, near) {
            return;
        }
        let is_node = |id: &u32| (*id as usize) < nodes;
        let mut place = None;
        for (one, two) in [(a, b), (b, a)] {
            for (node, x) in one.own(two).filter(|(node, _)| is_node(node)) {
                if to_triangle(x, &two.corners) <= near * near {
                    let met = two.own(one).any(|(id, y)| is_node(&id) && of_points(x, y) <= near * near);
                    if met { &mut self.coincident } else { &mut self.hanging }.insert(node);
                    place.get_or_insert(x);
                }
            }
        }
        if place.is_some() {
            self.touching.extend([a.face, b.face]);
        } else if a.crosses(b, near) {
            self.crossing.extend([a.face, b.face]);
            place = Some(a.corners[0]);
        }
        self.first = self.first.or(place.map(|place| (place, [a.element as usize, b.element as usize])));
    }

    fn flaw(&self) -> Flaw {
        Flaw::Torn {
            coincident: self.coincident.len(),
            hanging: self.hanging.difference(&self.coincident).count(),
            crossing: self.crossing.difference(&self.touching).count(),
        }
    }
}

/// Refuses pieces that share nodes.
fn hinges(mesh: &SolidMesh, pieces: &[u32]) -> Result<(), Found> {
    let mut of_node = vec![u32::MAX; mesh.points.len()];
    let (mut nodes, mut first) = (BTreeSet::new(), None);
    for (element, &piece) in pieces.iter().enumerate() {
        for &node in mesh.elements.get(element) {
            let known = &mut of_node[node as usize];
            if *known == u32::MAX {
                *known = piece;
            } else if *known != piece {
                let other =
                    || pieces.iter().zip(&mesh.elements).position(|(p, nodes)| p == known && nodes.contains(&node));
                first.get_or_insert_with(|| (mesh.points[node as usize], [other().unwrap_or(element), element]));
                nodes.insert(node);
            }
        }
    }
    found(mesh, Flaw::Hinge(nodes.len()), first)
}

/// Refuses pieces inside of others: a ray from there leaves another piece once more than it enters it.
fn inside(mesh: &SolidMesh, facets: &[Facet], tree: &BoxTree, pieces: &[u32], count: usize) -> Result<(), Found> {
    let (mut inner, mut first) = (0, None);
    let mut seen = vec![false; count];
    for (element, &piece) in pieces.iter().enumerate() {
        if std::mem::replace(&mut seen[piece as usize], true) {
            continue;
        }
        // A place within the element that lines through nodes hardly meet.
        let corners = mesh.elements.get(element)[..4].iter().map(|&n| mesh.points[n as usize]);
        let weighted: Vec<_> = corners.zip([0.2137, 0.3391, 0.1873, 0.2599]).collect();
        let x: [f64; 3] = std::array::from_fn(|i| weighted.iter().map(|(corner, weight)| weight * corner[i]).sum());
        let mut leaves = BTreeMap::new();
        tree.meeting(&[x, [f64::INFINITY, x[1], x[2]]], |k| {
            let Facet { corners, element, .. } = &facets[k as usize];
            let away = [x, [2.0 * around(corners)[1][0] - x[0], x[1], x[2]]];
            if pierces(&away, corners, 0.0) {
                let [a, b, c] = *corners;
                let (sum, _) = leaves.entry(pieces[*element as usize]).or_insert((0, *element));
                *sum += if volume(a, b, c, x) < 0.0 { 1 } else { -1 };
            }
        });
        if let Some((_, (_, other))) = leaves.iter().find(|(other, (sum, _))| **other != piece && *sum > 0) {
            inner += 1;
            first.get_or_insert((x, [element, *other as usize]));
        }
    }
    found(mesh, Flaw::Inside(inner), first)
}

/// The flaw, if it was found somewhere: at a place of two elements.
fn found(mesh: &SolidMesh, flaw: Flaw, first: Option<([f64; 3], [usize; 2])>) -> Result<(), Found> {
    match first {
        Some((near, elements)) => Err(Found { flaw, near, regions: elements.map(|element| mesh.region(element)) }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
