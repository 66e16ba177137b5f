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

use std::collections::{BTreeMap, BTreeSet, HashSet};

use thiserror::Error;

use super::SolidMesh;
use super::boxes::{Box3, BoxTree, around};
use super::connectivity::split_into_pieces;
use super::faces::{Neighbours, OUTSIDE};
use super::near::{of_points, of_segments, pierces, to_triangle, volume};
use super::surface::{area, normal};
use crate::element::Kind;

/// What is nearer than this, in units of the height of elements, touches.
pub const NEAR: f64 = 1e-4;

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
        /// Faces that have points with others in common, but no node within them.
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

/// A triangle of a boundary face.
struct Facet {
    element: u32,
    /// Number of the face among those of the boundary.
    face: u32,
    /// Its corners; numbers beyond those of the nodes stand for centres of faces.
    ids: [u32; 3],
    corners: [[f64; 3]; 3],
    /// What is nearer touches.
    near: f64,
}

impl Facet {
    /// The box of all that may touch it.
    fn room(&self) -> Box3 {
        let [low, high] = around(&self.corners);
        [low.map(|x| x - self.near), high.map(|x| x + self.near)]
    }

    /// Corners that another facet does not have.
    fn own<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (u32, [f64; 3])> + 'a {
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
    fn is_aside(&self, other: &Self, near: f64) -> bool {
        let Some(normal) = normal(&self.corners) else { return false };
        let height = |x: [f64; 3]| (0..3).map(|i| normal[i] * (x[i] - self.corners[0][i])).sum::<f64>();
        let (low, high) = other.own(self).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| {
            let height = height(x);
            (low.min(height), high.max(height))
        });
        low > near || high < -near
    }

    /// Whether edges come near each other, or go through the other facet, beyond the corners that both have.
    fn crosses(&self, other: &Self, near: f64) -> bool {
        let through = |one: &Self, other: &Self| {
            let free = |ids: &[u32; 2]| !ids.iter().any(|id| other.ids.contains(id));
            one.edges().iter().any(|(ids, edge)| free(ids) && pierces(edge, &other.corners))
        };
        let touch = self.edges().iter().any(|(of_self, a)| {
            let apart = |ids: &[u32; 2]| !ids.iter().any(|id| of_self.contains(id));
            other.edges().iter().any(|(ids, b)| apart(ids) && of_segments(a, b) <= near * near)
        });
        touch || through(self, other) || through(other, self)
    }
}

/// The boundary in triangles.
fn facets(mesh: &SolidMesh, neighbours: &Neighbours) -> Vec<Facet> {
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
    const AT_CORNERS: [[usize; 4]; 8] = [
        [0, 1, 3, 4],
        [1, 2, 0, 5],
        [2, 3, 1, 6],
        [3, 0, 2, 7],
        [4, 7, 5, 0],
        [5, 4, 6, 1],
        [6, 5, 7, 2],
        [7, 6, 4, 3],
    ];
    let tetrahedra: &[[usize; 4]] = match mesh.elements.kind() {
        Kind::Tet4 | Kind::Tet10 => &[[0, 1, 2, 3]],
        Kind::Hex8 => &AT_CORNERS,
    };
    let of = |tet: &[usize; 4]| {
        let [a, b, c, d] = tet.map(|k| mesh.points[nodes[k] as usize]);
        let largest = [[a, b, c], [a, b, d], [b, c, d], [a, c, d]].iter().map(area).fold(0.0, f64::max);
        0.5 * volume(a, b, c, d).abs() / largest
    };
    tetrahedra.iter().map(of).fold(f64::INFINITY, f64::min)
}

/// Refuses elements that share corners of a face, but not its middles.
fn middles(mesh: &SolidMesh, neighbours: &Neighbours) -> Result<(), Found> {
    if mesh.elements.kind() != Kind::Tet10 {
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
    let boundary: HashSet<[u32; 3]> = match mesh.elements.kind() {
        Kind::Tet4 => facets.iter().map(|facet| sorted(facet.ids)).collect(),
        Kind::Tet10 | Kind::Hex8 => HashSet::new(),
    };
    let (mut coincident, mut hanging, mut crossing) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    let (mut holes, mut hole, mut first) = (BTreeSet::new(), None, None);
    for (own, facet) in (0..).zip(facets) {
        tree.meeting(&facet.room(), |other| {
            let other_facet = &facets[other as usize];
            let near = facet.near.min(other_facet.near);
            if other <= own || other_facet.face == facet.face {
                return;
            }
            let elements = [facet.element as usize, other_facet.element as usize];
            if !boundary.is_empty() && let Some(nodes) = hole_between(mesh, facet, other_facet, &boundary) {
                hole.get_or_insert((mesh.points[nodes[0] as usize], elements));
                holes.insert(nodes);
                return;
            }
            if facet.is_aside(other_facet, near) || other_facet.is_aside(facet, near) {
                return;
            }
            let (mut touches, mut place) = (false, None);
            for (one, two) in [(facet, other_facet), (other_facet, facet)] {
                let is_node = |id: &u32| (*id as usize) < mesh.points.len();
                for (node, x) in one.own(two).filter(|(node, _)| is_node(node)) {
                    if to_triangle(x, &two.corners) > near * near {
                        continue;
                    }
                    let met = two.own(one).find(|(id, y)| is_node(id) && of_points(x, *y) <= near * near);
                    if met.is_some() { coincident.insert(node) } else { hanging.insert(node) };
                    (touches, place) = (true, place.or(Some(x)));
                }
            }
            if !touches && facet.crosses(other_facet, near) {
                crossing.extend([facet.face, other_facet.face]);
                place = Some(facet.corners[0]);
            }
            if let Some(place) = place {
                first.get_or_insert((place, elements));
            }
        });
    }
    hanging.retain(|node| !coincident.contains(node));
    let (coincident, hanging, crossing) = (coincident.len(), hanging.len(), crossing.len());
    found(mesh, Flaw::Torn { coincident, hanging, crossing }, first)?;
    found(mesh, Flaw::Holes(holes.len()), hole)
}

/// The nodes of two facets with an edge in common, if the other two faces of their tetrahedron are there, too, but no element
/// is.
fn hole_between(mesh: &SolidMesh, one: &Facet, other: &Facet, boundary: &HashSet<[u32; 3]>) -> Option<[u32; 4]> {
    let [a, b] = [one.only(other)?, other.only(one)?];
    let closed = one.ids.iter().filter(|&&id| id != a).all(|&id| boundary.contains(&sorted([a, b, id])));
    let [i, j, k] = one.ids;
    (closed && !mesh.elements.get(one.element as usize).contains(&b)).then(|| sorted([i, j, k, b]))
}

fn sorted<const N: usize>(mut ids: [u32; N]) -> [u32; N] {
    ids.sort_unstable();
    ids
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
                let other = || pieces.iter().zip(&mesh.elements).position(|(p, nodes)| p == known && nodes.contains(&node));
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
            if pierces(&away, corners) {
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
