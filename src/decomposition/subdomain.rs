//! One subdomain's mesh in local numbering.

use std::collections::HashMap;

use super::{Bodies, BodyMesh, Patch, Surface};
use crate::mesh::TetMesh;
use crate::mesh::faces::{Neighbours, key};

/// A triangle on a named surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet {
    /// Index into the list of named surfaces.
    pub surface: usize,
    /// Local nodes, counter-clockwise seen from outside.
    pub nodes: [u32; 3],
}

/// A face-connected set of tetrahedra. Local nodes ascend in global numbering, elements likewise, so that congruent
/// boxes of one brick are numbered alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdomain {
    /// Number among all subdomains.
    pub id: usize,
    /// Index of its body.
    pub body: usize,
    /// Global number of each local node, ascending.
    pub nodes: Vec<u64>,
    /// Coordinates of the local nodes.
    pub points: Vec<[f64; 3]>,
    /// Coordinates relative to the first node: congruent boxes have the same bits here, and so has what is computed
    /// from them alone.
    pub shape: Vec<[f64; 3]>,
    /// Local nodes of each element.
    pub elements: Vec<[u32; 4]>,
    /// Triangles on named surfaces.
    pub facets: Vec<Facet>,
    /// Local nodes on this subdomain's boundary, ascending.
    pub boundary: Vec<u32>,
}

impl Subdomain {
    /// From its elements (numbers of nodes within the body), the places of nodes and the ways between two, and the named
    /// surfaces that a triangle is on.
    fn new(
        (id, body): (usize, usize),
        first_node: u64,
        tets: &[[u64; 4]],
        point: impl Fn(u64) -> [f64; 3],
        way: impl Fn(u64, u64) -> [f64; 3],
        surfaces: impl Fn([u64; 3]) -> Vec<usize>,
    ) -> Self {
        let mut nodes: Vec<u64> = tets.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: u64| nodes.binary_search(&node).expect("every corner is listed") as u32;
        let points = nodes.iter().map(|&node| point(node)).collect();
        let shape = nodes.iter().map(|&node| way(nodes[0], node)).collect();
        let elements: Vec<[u32; 4]> = tets.iter().map(|tet| tet.map(local)).collect();

        let mut outer: Vec<[u32; 3]> = Neighbours::new(nodes.len(), &elements).outer(&elements).collect();
        outer.sort_unstable();
        let mut boundary: Vec<u32> = outer.iter().flatten().copied().collect();
        boundary.sort_unstable();
        boundary.dedup();
        let mut facets = Vec::new();
        for triangle in outer {
            let surfaces = surfaces(triangle.map(|n| nodes[n as usize]));
            facets.extend(surfaces.into_iter().map(|surface| Facet { surface, nodes: triangle }));
        }
        let nodes = nodes.iter().map(|node| first_node + node).collect();
        Self { id, body, nodes, points, shape, elements, facets, boundary }
    }

    /// Of a brick, from the numbers of its elements within the body (ascending).
    ///
    /// # Panics
    /// If the body is no brick.
    pub fn of_brick(id: usize, bodies: &Bodies, body: usize, elements: &[u64]) -> Self {
        let BodyMesh { first_node, .. } = bodies.bodies[body];
        let brick = bodies.bodies[body].brick().expect("the body is a brick");
        let on = |surface: &Surface, triangle: &[u64; 3]| match surface.patch {
            Patch::Face(face) => triangle.iter().all(|&node| brick.is_on(face, brick.node_position(node))),
            Patch::Named(_) => false,
        };
        let surfaces = |triangle| {
            let of_body = bodies.surfaces.iter().enumerate().filter(|(_, s)| s.body == body);
            of_body.filter(|(_, s)| on(s, &triangle)).map(|(index, _)| index).collect()
        };
        let tets: Vec<[u64; 4]> = elements.iter().map(|&e| brick.tet(e)).collect();
        let point = |node| brick.coordinates(brick.node_position(node));
        Self::new((id, body), first_node, &tets, point, |from, to| brick.way(from, to), surfaces)
    }

    /// Of a mesh, from the numbers of its elements within the body (ascending), and the named surfaces of its triangles,
    /// by ascending nodes.
    pub fn of_mesh(
        (id, body): (usize, usize),
        first_node: u64,
        mesh: &TetMesh,
        elements: &[u64],
        surfaces: &HashMap<[u32; 3], Vec<usize>>,
    ) -> Self {
        let tets: Vec<[u64; 4]> = elements.iter().map(|&e| mesh.tets[e as usize].map(u64::from)).collect();
        let surfaces = |triangle: [u64; 3]| surfaces.get(&key(triangle.map(|n| n as u32))).cloned().unwrap_or_default();
        let point = |node: u64| mesh.points[node as usize];
        Self::new((id, body), first_node, &tets, point, |from, to| relative(point(from), point(to)), surfaces)
    }

    /// Number of local unknowns.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Local number of a global node, if it is here.
    pub fn local_node(&self, node: u64) -> Option<usize> {
        self.nodes.binary_search(&node).ok()
    }

    /// As numbers, for sending; of subdomains of meshes only, whose shape follows from their points.
    pub fn pack(&self, message: &mut Vec<u64>) {
        let Self { id, body, nodes, points, elements, facets, boundary, .. } = self;
        message.extend([*id, *body, nodes.len(), elements.len(), facets.len(), boundary.len()].map(|n| n as u64));
        message.extend(nodes);
        message.extend(points.as_flattened().iter().map(|x| x.to_bits()));
        message.extend(elements.iter().flat_map(|tet| [pair(tet[0], tet[1]), pair(tet[2], tet[3])]));
        let nodes = |f: &Facet| [f.surface as u64, pair(f.nodes[0], f.nodes[1]), u64::from(f.nodes[2])];
        message.extend(facets.iter().flat_map(nodes));
        message.extend(boundary.iter().map(|&n| u64::from(n)));
    }

    /// What [`Subdomain::pack`] made; `None` at the end of the message.
    pub fn unpack(message: &mut impl Iterator<Item = u64>) -> Option<Self> {
        let id = message.next()? as usize;
        let mut next = || message.next().expect("a packed subdomain is whole");
        let [body, nodes, elements, facets, boundary] = [(); 5].map(|()| next() as usize);
        let of_nodes: Vec<u64> = (0..nodes).map(|_| next()).collect();
        let points: Vec<[f64; 3]> = (0..nodes).map(|_| [(); 3].map(|()| f64::from_bits(next()))).collect();
        Some(Self {
            id,
            body,
            nodes: of_nodes,
            shape: points.iter().map(|&point| relative(points[0], point)).collect(),
            points,
            elements: (0..elements)
                .map(|_| {
                    let ([a, b], [c, d]) = (unpair(next()), unpair(next()));
                    [a, b, c, d]
                })
                .collect(),
            facets: (0..facets)
                .map(|_| {
                    let (surface, [a, b], c) = (next() as usize, unpair(next()), next() as u32);
                    Facet { surface, nodes: [a, b, c] }
                })
                .collect(),
            boundary: (0..boundary).map(|_| next() as u32).collect(),
        })
    }
}

fn relative(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| to[a] - from[a])
}

fn pair(low: u32, high: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

fn unpair(pair: u64) -> [u32; 2] {
    [pair as u32, (pair >> 32) as u32]
}
