//! Contact geometry: which points of two surfaces face each other, normals and gaps. No unknowns, no multipliers.
//!
//! Surfaces are two-dimensional, so every rank sees both sides of each contact whole, for the time of the pairing
//! only; what is kept of it are the pairs.

pub mod matching;
pub mod surface;

use thiserror::Error;

/// A node of the slave surface and the point of the master surface that it meets: linearised frictionless contact
/// `normal . (u_slave - u_master) <= gap`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPair {
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Global node on the slave surface.
    pub slave: u64,
    /// Global node on the master surface.
    pub master: u64,
    /// Unit outward normal of the slave surface at the node: mean of the adjacent triangles' area vectors.
    pub normal: [f64; 3],
    /// Initial distance along the normal (length); negative where the bodies overlap.
    pub gap: f64,
    /// Share of the slave surface that belongs to the node: a third of the adjacent triangles (area).
    pub area: f64,
}

/// Why two surfaces cannot be paired.
#[derive(Debug, Error, PartialEq, Eq)]
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
}
