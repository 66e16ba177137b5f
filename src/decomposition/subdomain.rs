//! One subdomain's mesh in local numbering.

use super::{Bodies, BodyMesh, Patch, Surface};
use crate::element::Kind;
use crate::mesh::Elements;
use crate::mesh::faces::{Neighbours, key};
use crate::mesh::marked::Marked;
use crate::vector::difference;

/// A face on a named surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Facet {
    /// Index into the list of named surfaces.
    pub surface: usize,
    /// Local nodes, corners first, counter-clockwise seen from outside.
    pub nodes: Vec<u32>,
}

/// A face-connected set of elements of one kind and material. Local nodes ascend in global numbering, elements likewise, so
/// that congruent boxes of one brick are numbered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdomain {
    /// Number among all subdomains.
    pub id: usize,
    /// Index of its body.
    pub body: usize,
    /// The face-connected piece of the body that it is part of, from 0.
    pub piece: usize,
    /// Number of its material.
    pub material: usize,
    /// Global number of each local node, ascending.
    pub nodes: Vec<u64>,
    /// Coordinates of the local nodes.
    pub points: Vec<[f64; 3]>,
    /// Coordinates relative to the first node: congruent boxes have the same bits here, and so has what is computed
    /// from them alone.
    pub shape: Vec<[f64; 3]>,
    /// Elements by their local nodes.
    pub elements: Elements,
    /// Faces on named surfaces.
    pub facets: Vec<Facet>,
    /// Local nodes on this subdomain's boundary, ascending.
    pub boundary: Vec<u32>,
}

impl Subdomain {
    /// From its elements (kind, and numbers of nodes within the body), the places of nodes and the ways between two, and
    /// the named surfaces that a face is on.
    fn new(
        (id, body, piece, material): (usize, usize, usize, usize),
        first_node: u64,
        (kind, of_elements): (Kind, &[u64]),
        point: impl Fn(u64) -> [f64; 3],
        way: impl Fn(u64, u64) -> [f64; 3],
        surfaces: impl Fn(&[u64]) -> Vec<usize>,
    ) -> Self {
        let mut nodes = of_elements.to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: u64| nodes.binary_search(&node).expect("every node is listed") as u32;
        let points = nodes.iter().map(|&node| point(node)).collect();
        let shape = nodes.iter().map(|&node| way(nodes[0], node)).collect();
        let elements = Elements::new(kind, of_elements.iter().map(|&node| local(node)).collect());

        let mut outer: Vec<Vec<u32>> = Neighbours::new(nodes.len(), &elements).outer(&elements).collect();
        outer.sort_unstable();
        let mut boundary: Vec<u32> = outer.iter().flatten().copied().collect();
        boundary.sort_unstable();
        boundary.dedup();
        let mut facets = Vec::new();
        for face in outer {
            let global: Vec<u64> = face.iter().map(|&n| nodes[n as usize]).collect();
            facets.extend(surfaces(&global).into_iter().map(|surface| Facet { surface, nodes: face.clone() }));
        }
        let nodes = nodes.iter().map(|node| first_node + node).collect();
        Self { id, body, piece, material, nodes, points, shape, elements, facets, boundary }
    }

    /// Of a brick, from the numbers of its elements within the body (ascending).
    ///
    /// # Panics
    /// If the body is no brick.
    pub fn of_brick(id: usize, bodies: &Bodies, body: usize, elements: &[u64]) -> Self {
        let BodyMesh { first_node, kind, ref materials, .. } = bodies.bodies[body];
        let of = (id, body, 0, materials[0]);
        let lattice = bodies.bodies[body].lattice().expect("the body is a brick");
        let on = |surface: &Surface, face: &[u64]| match surface.patch {
            Patch::Face(side) => face.iter().all(|&node| lattice.is_on(side, lattice.node_position(node))),
            Patch::Named(_) => false,
        };
        let surfaces = |face: &[u64]| {
            let of_body = bodies.surfaces.iter().enumerate().filter(|(_, s)| s.body == body);
            of_body.filter(|(_, s)| on(s, face)).map(|(index, _)| index).collect()
        };
        let nodes: Vec<u64> = elements.iter().flat_map(|&e| bodies.bodies[body].element(e)).collect();
        let point = |node| lattice.coordinates(lattice.node_position(node));
        Self::new(of, first_node, (kind, &nodes), point, |from, to| lattice.way(from, to), surfaces)
    }

    /// Of a mesh, from the nodes of its elements within the body (all in one region), where they are, and the named surfaces
    /// of its faces, by ascending nodes. `piece` and `region` say which of the body it is in.
    pub fn of_mesh(
        (id, body, piece, region): (usize, usize, usize, usize),
        &BodyMesh { first_node, ref materials, kind, .. }: &BodyMesh,
        nodes: &[u64],
        point: impl Fn(u64) -> [f64; 3],
        surfaces: &Marked,
    ) -> Self {
        let surfaces = |face: &[u64]| {
            let face: Vec<u32> = face.iter().map(|&n| n as u32).collect();
            surfaces.get(&key(&face)).cloned().unwrap_or_default()
        };
        let way = |from, to| difference(point(to), point(from));
        Self::new((id, body, piece, materials[region]), first_node, (kind, nodes), &point, way, surfaces)
    }

    /// Number of local unknowns.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Local number of a global node, if it is here.
    pub fn local_node(&self, node: u64) -> Option<usize> {
        self.nodes.binary_search(&node).ok()
    }
}
