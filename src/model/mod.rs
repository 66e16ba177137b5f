//! From a scene to its discrete problem: meshes, subdomains, contact conditions, rows of B and loads.
//!
//! [`meshes`] reads and makes the meshes, [`contacts`] pairs the surfaces, [`conditions`] makes the rows and their right-hand
//! sides, [`extent`] measures bodies and places, [`discrete`] joins all to the problem of one rank. [`history`] has loads and
//! right-hand sides of each load step, [`held`] tells whether anything moves freely.

pub mod conditions;
pub mod contacts;
pub mod discrete;
pub mod extent;
pub mod held;
pub mod history;
pub mod meshes;

pub use discrete::{Discrete, discretise, discretise_expecting, discretise_meshes};

use thiserror::Error;

use self::meshes::MeshError;
use crate::contact::ContactError;
use crate::feti::coarse::Floating;
use crate::feti::dual::hybrid::Loose;

/// Why a scene has no discrete problem; the same on every rank.
#[derive(Debug, Error)]
pub enum ModelError {
    /// A mesh file is missing or bad.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A contact has no conditions, or impossible ones.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Supports contradict each other.
    #[error("{0}")]
    Supports(String),
    /// Supports, contacts and loads together do not hold a body.
    #[error("{0}")]
    Unheld(String),
    /// Some body can move freely.
    #[error(transparent)]
    Floating(#[from] Floating),
    /// The members of a cluster are not held by each other.
    #[error(transparent)]
    Loose(#[from] Loose),
}
