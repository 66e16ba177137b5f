//! One subdomain's mesh in local numbering.

use super::{BodyMesh, Surface};
use crate::mesh::face::Face;

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

/// Faces of a positively oriented tetrahedron, counter-clockwise from outside.
const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

impl Subdomain {
    /// From the numbers of its elements within the body (ascending).
    pub fn new(id: usize, body_index: usize, body: &BodyMesh, elements: &[u64], surfaces: &[Surface]) -> Self {
        let brick = &body.brick;
        let tets: Vec<[u64; 4]> = elements.iter().map(|&e| body.element(e)).collect();
        let mut nodes: Vec<u64> = tets.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: u64| nodes.binary_search(&node).expect("every corner is listed") as u32;
        let points = nodes.iter().map(|&node| brick.coordinates(brick.node_position(node))).collect();
        let shape = nodes.iter().map(|&node| brick.way(nodes[0], node)).collect();
        let elements: Vec<[u32; 4]> = tets.iter().map(|tet| tet.map(local)).collect();

        let mut outer = outer_faces(&elements);
        outer.sort_unstable();
        let mut boundary: Vec<u32> = outer.iter().flatten().copied().collect();
        boundary.sort_unstable();
        boundary.dedup();
        let facets = outer
            .into_iter()
            .filter_map(|triangle| {
                let on =
                    |face: Face| triangle.iter().all(|&n| brick.is_on(face, brick.node_position(nodes[n as usize])));
                let surface = surfaces.iter().position(|s| s.body == body_index && on(s.face))?;
                Some(Facet { surface, nodes: triangle })
            })
            .collect();
        let nodes = nodes.iter().map(|node| body.first_node + node).collect();
        Self { id, body: body_index, nodes, points, shape, elements, facets, boundary }
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

/// Faces that belong to one element only, oriented outwards.
fn outer_faces(elements: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = elements
        .iter()
        .flat_map(|tet| TET_FACES.map(|face| face.map(|corner| tet[corner])))
        .map(|face| {
            let mut key = face;
            key.sort_unstable();
            (key, face)
        })
        .collect();
    faces.sort_unstable();
    faces.chunk_by(|a, b| a.0 == b.0).filter(|twins| twins.len() == 1).map(|twins| twins[0].1).collect()
}
