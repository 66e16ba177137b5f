//! Contact geometry: which points of two surfaces face each other, normals and gaps. No unknowns, no multipliers.
//!
//! Every condition is one on a slave node: against a weighted mean of master nodes ([`matching`]: of one), or against a rigid
//! obstacle ([`rigid`]). Surfaces are two-dimensional, so every rank sees both sides of each contact whole,
//! for the time of the pairing only; what is kept of it are the pairs.

pub mod matching;
pub mod rigid;
pub mod surface;

use thiserror::Error;

/// A node of the slave surface and what it meets: linearised frictionless contact
/// `normal . (u_slave - sum of weight u_master) <= gap`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPair {
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Global node on the slave surface.
    pub slave: u64,
    /// Global nodes on the master surface with their weights, which add up to one; none on a rigid obstacle.
    pub masters: Vec<(u64, f64)>,
    /// Unit vector towards the other side. Between surfaces: the outward normal of the slave surface at the node, mean of
    /// the adjacent triangles' area vectors. At a rigid obstacle: straight into it.
    pub normal: [f64; 3],
    /// Initial distance along the normal (length); negative where the bodies overlap.
    pub gap: f64,
    /// Share of the slave surface that belongs to the node: a third of the adjacent triangles (area).
    pub area: f64,
}

/// Why two surfaces cannot be paired.
#[derive(Debug, Error, PartialEq)]
pub enum ContactError {
    /// The slave surface meets the master surface at places that are not its nodes.
    #[error(
        "contact.{name}: {unmatched} of {slaves} nodes of the slave surface meet the master surface between its nodes; \
         make the two meshes match there (same node positions on both sides)"
    )]
    NotMatching {
        /// Name of the contact in the scene.
        name: String,
        /// Slave nodes over the master surface without a master node opposite.
        unmatched: usize,
        /// All slave nodes.
        slaves: usize,
    },
    /// The surfaces do not face each other anywhere.
    #[error(
        "contact.{name}: no node of the slave surface has the master surface opposite along its normal; \
             check the names of the surfaces and the positions of the bodies"
    )]
    Apart {
        /// Name of the contact in the scene.
        name: String,
    },
    /// All of a slave surface is turned away from a rigid obstacle, or beside it.
    #[error(
        "contact.{name}: none of the {slaves} nodes of the slave surface faces the obstacle; check its place and which side \
         is free (normal, inside, above), and the name of the surface"
    )]
    LooksAway {
        /// Name of the contact in the scene.
        name: String,
        /// All slave nodes.
        slaves: usize,
    },
    /// Supports hold a slave node where it overlaps with the other side.
    #[error(
        "contact.{name}: supports hold {nodes} of its nodes inside the other side, up to {depth:.2e} deep; move the bodies apart, \
         or leave the direction towards the other side free where they meet"
    )]
    Held {
        /// Name of the contact in the scene.
        name: String,
        /// Slave nodes that are held so.
        nodes: usize,
        /// Deepest of them (length).
        depth: f64,
    },
}
