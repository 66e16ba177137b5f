//! Contact geometry: which points of two surfaces face each other, normals and gaps. No unknowns, no multipliers.
//!
//! Every condition is one on a slave node: against the master node opposite where meshes match ([`matching`]), against
//! weighted means of master nodes where they do not ([`mortar`]), or against a rigid obstacle ([`rigid`]). On quadratic
//! faces conditions of nodes are combined ([`quadratic`]). [`pairing`] finds out which, and which surface is the slave.
//! Surfaces are two-dimensional, so every rank sees both sides of each contact whole, for the time of the pairing only; what
//! is kept of it are the pairs.

pub mod clip;
pub mod corner;
pub mod dual;
pub mod matching;
pub mod mortar;
pub mod pairing;
pub mod quadratic;
pub mod rigid;
pub mod sagitta;
pub mod surface;
pub mod tree;

use thiserror::Error;

/// A node of the slave surface and what it meets: linearised frictionless contact
/// `normal . (u_slave + sum of weight u_other - sum of weight u_master) <= gap`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPair {
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Global node on the slave surface.
    pub slave: u64,
    /// Other nodes of the slave surface in the condition: some that supports hold, corners of a quadratic face; usually
    /// none.
    pub others: Vec<(u64, f64)>,
    /// Global nodes on the master surface with their weights, which add up to those of the slave side; none on a rigid
    /// obstacle.
    pub masters: Vec<(u64, f64)>,
    /// Unit vector towards the other side. Between surfaces: the outward normal of the slave surface at the node, mean of
    /// the adjacent triangles' area vectors. At a rigid obstacle: straight into it.
    pub normal: [f64; 3],
    /// Initial distance along the normal (length), times the sum of the slave side's weights; negative where the bodies
    /// overlap.
    pub gap: f64,
    /// Share of the slave surface that belongs to the node, seen along its outward normal: pressure is force on the condition
    /// over this area. A third of the adjacent triangles; of their part that faces the master surface where meshes do not
    /// match.
    pub area: f64,
}

impl ContactPair {
    /// Puts the other side at this distance along the normal (length).
    pub fn set_distance(&mut self, distance: f64) {
        self.gap = 0.0;
        self.widen(distance);
    }

    /// Moves the other side away along the normal (length).
    pub fn widen(&mut self, distance: f64) {
        self.gap += self.factor() * distance;
    }

    /// What the factors of the slave side's nodes add up to: the condition is met at this many times the distance.
    pub fn factor(&self) -> f64 {
        1.0 + self.others.iter().map(|(_, weight)| weight).sum::<f64>()
    }

    /// Force on the slave surface where the condition is met with this force: the master's nodes take all of it.
    pub fn force(&self, force: f64) -> [f64; 3] {
        let factor = self.factor();
        self.normal.map(|n| -factor * force * n)
    }
}

/// Why two surfaces cannot be paired.
#[derive(Debug, Error, PartialEq)]
pub enum ContactError {
    /// Supports hold every slave node that faces the master.
    #[error(
        "contact.{name}: supports hold all nodes of the slave surface in the direction of the contact; swap slave and master, \
         or leave that direction free"
    )]
    AllHeld {
        /// Name of the contact in the scene.
        name: String,
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
    /// Obstacles meet at a node in more directions than it has components.
    #[error(
        "contact.{names}: {nodes} nodes meet these obstacles in more directions than are independent there, so the contact \
         forces would not be unique; give each obstacle the part of the surface that it can touch"
    )]
    Crowded {
        /// Names of the contacts at the first such node.
        names: String,
        /// How many such nodes there are.
        nodes: usize,
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
