//! From elements to the torn vectors and matrices: sparsity (once), stiffness, internal forces, loads.
//!
//! Every function works on one [`Region`]; nothing here communicates. All of them go through the elements by [`visit`].

pub mod dissipation;
pub mod flow;
pub mod gradients;
pub mod internal;
pub mod loads;
pub mod stiffness;
pub mod stress;
pub mod visit;

use crate::decomposition::Subdomain;
use crate::material::{History, Material, Variables};

/// A subdomain with the law of its material and the committed history of its integration points, element by element; no histories
/// at all mean that nothing ever yielded.
#[derive(Clone, Copy)]
pub struct Region<'a> {
    /// Its mesh.
    pub subdomain: &'a Subdomain,
    /// Its material.
    pub material: &'a Material,
    /// What its points remember.
    pub history: &'a [History],
}

impl<'a> Region<'a> {
    /// A subdomain where nothing ever yielded.
    pub fn virgin(subdomain: &'a Subdomain, material: &'a Material) -> Self {
        Self { subdomain, material, history: &[] }
    }

    /// What an integration point remembers.
    #[inline]
    pub fn committed(&self, point: usize) -> &'a History {
        self.history.get(point).unwrap_or(&History::VIRGIN)
    }
}

#[cfg(test)]
pub(crate) mod orders;
#[cfg(test)]
mod tests;
