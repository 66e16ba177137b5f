//! Tearing the bodies into subdomains, and who owns them.
//!
//! Subdomains belong to the scene, ranks do not: their number, shape and numbering are the same on any number of
//! ranks, and each rank owns a block of consecutive ones. A rank holds the meshes of its own subdomains only, and of
//! the others just which of them share its nodes ([`interface`]). Where there are many, neighbouring ones form [`clusters`].

mod beside;
pub mod bricks;
pub mod clusters;
pub mod cost;
pub mod interface;
mod parts;
pub mod shares;
pub mod subdomain;
pub mod sums;
pub mod twins;

pub use crate::mesh::solid::Counts;
pub use clusters::Clusters;
pub use interface::InterfaceNode;
pub use subdomain::Subdomain;

use std::collections::BTreeMap;

use crate::comm::{Comm, Shares};
use crate::element::{Cell, Kind};
use crate::mesh::{Brick, Face, SolidMesh};

/// A surface that a support, load or contact names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Surface {
    /// Index of the body.
    pub body: usize,
    /// Where on the body.
    pub patch: Patch,
}

/// Part of the boundary of a body.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Patch {
    /// A face of a brick.
    Face(Face),
    /// A named surface of a mesh.
    Named(String),
}

/// What every rank knows of a body's mesh before tearing; its nodes are numbered behind those of the bodies before it.
#[derive(Clone, Debug)]
pub struct BodyMesh {
    /// Its elements.
    pub kind: Kind,
    /// Where nodes and elements come from.
    pub shape: Shape,
    /// Numbers of the materials of its regions, ascending.
    pub materials: Vec<usize>,
    /// Number of nodes of all bodies before this one.
    pub first_node: u64,
}

/// Where nodes and elements of a body come from.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Any rank can generate them.
    Brick(Brick),
    /// Each rank has some, as a [`SolidMesh`], until they are torn; all know how many there are.
    Mesh(Counts),
}

impl BodyMesh {
    /// The brick, if the body is one: its cells.
    pub fn brick(&self) -> Option<&Brick> {
        match &self.shape {
            Shape::Brick(brick) => Some(brick),
            Shape::Mesh(_) => None,
        }
    }

    /// The brick whose nodes are those of the body.
    pub fn lattice(&self) -> Option<Brick> {
        self.brick().map(|brick| brick.refined(self.kind.degree()))
    }

    /// Node numbers, within the body, of an element of a brick.
    ///
    /// # Panics
    /// If the body is no brick.
    pub fn element(&self, element: u64) -> Vec<u64> {
        let brick = self.brick().expect("the body is a brick");
        let corners = match self.kind.cell() {
            Cell::Tetrahedron => brick.tet(element).to_vec(),
            Cell::Hexahedron => brick.hexahedron(element).to_vec(),
        };
        if self.kind.middles().is_empty() {
            return corners;
        }
        // Nodes are on a finer lattice, which corners and middles of edges fill.
        let lattice = brick.refined(self.kind.degree());
        let corners: Vec<[usize; 3]> = corners.into_iter().map(|node| brick.node_position(node)).collect();
        let middle = |a: usize, b: usize| std::array::from_fn(|i| corners[a][i] + corners[b][i]);
        let of_corners = (0..corners.len()).map(|a| lattice.node(middle(a, a)));
        of_corners.chain(self.kind.middles().iter().map(|&(a, b)| lattice.node(middle(a, b)))).collect()
    }

    /// The element of a brick around a point inside it, given in cells from its origin: node numbers within the body, and
    /// the values there of their shape functions.
    ///
    /// # Panics
    /// If the body is no brick.
    pub fn around(&self, at: [f64; 3]) -> (Vec<u64>, Vec<f64>) {
        let brick = self.brick().expect("the body is a brick");
        match self.kind.cell() {
            Cell::Tetrahedron => {
                let (element, at) = brick.tet_around(at);
                (self.element(element), self.kind.values(&at))
            }
            Cell::Hexahedron => {
                let (cell, inside) = brick.around(at);
                (self.element(brick.cell(cell)), self.kind.values(&inside.map(|x| 2.0 * x - 1.0)))
            }
        }
    }

    /// Sizes of the mesh.
    pub fn counts(&self) -> Counts {
        match &self.shape {
            Shape::Brick(brick) => {
                let (cells, nodes) = (brick.cell_count(), self.lattice().map_or(0, |lattice| lattice.node_count()));
                Counts { nodes, cells, elements: self.kind.cell().per_hexahedron() * cells }
            }
            Shape::Mesh(counts) => *counts,
        }
    }
}

/// All bodies and what is done with their surfaces.
pub struct Bodies<'a> {
    /// In the order of their names.
    pub bodies: &'a [BodyMesh],
    /// Named surfaces; facets and interface nodes refer to them by index.
    pub surfaces: &'a [Surface],
}

/// How to cut the bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Boxes of so many cells; all bodies are bricks, and these divide their cells.
    Bricks([usize; 3]),
    /// So many compact parts in all, at least one for each region of each body.
    Parts(usize),
}

/// One rank's part of the torn bodies.
pub struct Decomposition {
    /// Subdomains owned by each rank.
    pub shares: Shares,
    /// Which of them share rigid motions.
    pub clusters: Clusters,
    /// Own subdomains, in the order of their numbers.
    pub subdomains: Vec<Subdomain>,
    /// Own nodes that other subdomains share or that lie on a named surface, ascending.
    pub interface: Vec<InterfaceNode>,
}

impl Decomposition {
    /// Position of a subdomain among this rank's own, if it is one.
    pub fn own_index(&self, subdomain: u32) -> Option<usize> {
        let first = self.subdomains.first()?.id;
        (subdomain as usize).checked_sub(first).filter(|&k| k < self.subdomains.len())
    }

    /// Whether this rank tells others of a node on the interface: it has the lowest copy.
    pub fn tells(&self, node: u64) -> bool {
        let at = self.interface.binary_search_by_key(&node, |known| known.node);
        at.is_ok_and(|at| self.own_index(self.interface[at].copies[0]).is_some())
    }
}

/// Lays bodies one behind the other in one numbering of nodes.
pub fn number_bodies(shapes: impl IntoIterator<Item = (Kind, Shape, Vec<usize>)>) -> Vec<BodyMesh> {
    let mut first_node = 0;
    shapes
        .into_iter()
        .map(|(kind, shape, materials)| {
            let body = BodyMesh { first_node, kind, shape, materials };
            first_node += body.counts().nodes;
            body
        })
        .collect()
}

/// Tears the bodies into subdomains, `meshes` being this rank's parts of those that are no bricks, by index, in groups of about so
/// many on each level, which `groups` tells of the number of subdomains.
/// `yielding` says which boxes of [`Cut::Bricks`] of each body, x fastest, are expected to yield: every rank gets its part of
/// them. Collective.
pub fn tear(
    bodies: &Bodies,
    meshes: BTreeMap<usize, SolidMesh>,
    cut: Cut,
    groups: &dyn Fn(usize) -> Vec<usize>,
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> Decomposition {
    let (clusters, shares, subdomains) = match cut {
        Cut::Bricks(cells) => {
            let groups = groups(bodies.bodies.iter().map(|body| bricks::count(body, cells)).sum());
            let (clusters, shares, lists) = bricks::own_elements(bodies.bodies, cells, &groups, yielding, comm);
            let ids = shares.begin(comm.rank())..;
            let of_brick = |(id, (body, list)): (usize, ElementList)| Subdomain::of_brick(id, bodies, body, &list);
            (clusters, shares, ids.zip(lists).map(of_brick).collect())
        }
        Cut::Parts(parts) => parts::own_subdomains(bodies, meshes, parts, &groups(parts), comm),
    };
    let interface = interface::share(comm, &subdomains);
    Decomposition { shares, clusters, subdomains, interface }
}

/// As many linear tetrahedra as would take the work of these bodies' elements.
pub fn tetrahedra(bodies: &[BodyMesh]) -> u64 {
    bodies.iter().map(|body| body.counts().elements * body.kind.tetrahedra()).sum()
}

/// Elements of one subdomain: its body, and the numbers of its elements within the body, ascending.
pub(crate) type ElementList = (usize, Vec<u64>);

#[cfg(test)]
mod tests;
