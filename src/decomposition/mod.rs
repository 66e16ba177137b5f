//! Tearing the bodies into subdomains, and who owns them.
//!
//! Subdomains belong to the scene, ranks do not: their number, shape and numbering are the same on any number of
//! ranks, and each rank owns a block of consecutive ones. A rank holds the meshes of its own subdomains only, and of
//! the others just which of them share its nodes ([`interface`]).

pub mod bricks;
pub mod connectivity;
pub mod interface;
pub mod metis;
pub mod shares;
pub mod subdomain;
pub mod twins;

pub use interface::InterfaceNode;
pub use subdomain::{Facet, Subdomain};

use crate::comm::{Comm, Shares};
use crate::mesh::brick::Brick;
use crate::mesh::face::Face;

/// A surface that a support, load or contact names: a face of a brick body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Surface {
    /// Index of the body.
    pub body: usize,
    /// Which of its faces.
    pub face: Face,
}

/// One body's mesh before tearing: a brick, numbered behind the bodies before it.
#[derive(Clone, Debug)]
pub struct BodyMesh {
    /// The generator of nodes and elements.
    pub brick: Brick,
    /// Number of nodes of all bodies before this one.
    pub first_node: u64,
    /// Number of elements of all bodies before this one.
    pub first_element: u64,
}

impl BodyMesh {
    /// Nodes of an element, both numbered within the body.
    pub fn element(&self, element: u64) -> [u64; 4] {
        self.brick.tets(self.brick.cell_position(element / 6))[(element % 6) as usize]
    }
}

/// How to cut the bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Boxes of so many cells; they divide the cells of every body.
    Bricks([usize; 3]),
    /// So many parts in all, by METIS, at least one a body.
    Metis(usize),
}

/// One rank's part of the torn bodies.
pub struct Decomposition {
    /// Subdomains owned by each rank.
    pub shares: Shares,
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
}

/// Lays bodies one behind the other in one numbering of nodes and elements.
pub fn number_bodies(bricks: Vec<Brick>) -> Vec<BodyMesh> {
    let (mut first_node, mut first_element) = (0, 0);
    bricks
        .into_iter()
        .map(|brick| {
            let body = BodyMesh { first_node, first_element, brick };
            first_node += body.brick.node_count();
            first_element += body.brick.element_count();
            body
        })
        .collect()
}

/// Tears the bodies; facets and interface nodes refer to `surfaces` by index. Boxes of [`Cut::Bricks`] are spread over the
/// ranks by their `costs` if given, otherwise every rank gets as many subdomains. Collective.
pub fn tear(
    bodies: &[BodyMesh],
    surfaces: &[Surface],
    cut: Cut,
    costs: Option<&[u64]>,
    comm: &dyn Comm,
) -> Decomposition {
    let (shares, lists) = match cut {
        Cut::Bricks(cells) => bricks::own_elements(bodies, cells, costs, comm),
        Cut::Metis(parts) => metis::own_elements(bodies, parts, comm),
    };
    let first = shares.begin(comm.rank());
    let subdomains: Vec<_> = lists
        .into_iter()
        .enumerate()
        .map(|(k, (body, elements))| Subdomain::new(first + k, body, &bodies[body], &elements, surfaces))
        .collect();
    let interface = interface::share(comm, &subdomains);
    Decomposition { shares, subdomains, interface }
}

/// Elements of one subdomain: its body, and the numbers of its elements within the body, ascending.
pub(crate) type ElementList = (usize, Vec<u64>);

#[cfg(test)]
mod tests;
