//! What converged increments leave: the history of the material, and the largest sizes so far.

use serde::{Deserialize, Serialize};

use super::energies::Energies;
use crate::material::History;

/// The state that an increment starts from; by default that of rest.
#[derive(Clone, Default)]
pub struct Committed {
    /// History of each integration point of each own subdomain; none where nothing ever yielded.
    pub histories: Vec<Vec<History>>,
    /// What surfaces have slid, in friction rows; zero in other rows, empty without friction.
    pub slips: Vec<f64>,
    /// Least sizes that relative errors refer to.
    pub sizes: Sizes,
    /// Energies since the beginning.
    pub energies: Energies,
}

/// The largest values of the increments so far. After an unloading errors are of the size of the values before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sizes {
    /// `|u|_e` (root of energy).
    pub elastic_norm: f64,
    /// Squared norm of the nodal forces, applied or internal (force squared).
    pub force_square: f64,
    /// Largest nodal displacement (length).
    pub displacement: f64,
    /// Largest contact force (force).
    pub contact_force: f64,
}

impl Sizes {
    /// The larger of each.
    pub fn larger(self, other: Self) -> Self {
        Self {
            elastic_norm: self.elastic_norm.max(other.elastic_norm),
            force_square: self.force_square.max(other.force_square),
            displacement: self.displacement.max(other.displacement),
            contact_force: self.contact_force.max(other.contact_force),
        }
    }
}

impl Committed {
    /// History of the elements of an own subdomain; empty if nothing ever yielded there.
    pub fn history(&self, own: usize) -> &[History] {
        self.histories.get(own).map_or(&[], Vec::as_slice)
    }
}
