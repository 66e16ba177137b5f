//! `F(u) = D Psi(u)`: internal forces and energy of a subdomain, and energies in the elastic norm.

use super::{displacements, geometry};
use crate::decomposition::Subdomain;
use crate::material::{History, Material};
use crate::tensor::{Voigt, apply, contract};

/// What one pass over the elements finds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Internal {
    /// `Psi(u)` (energy).
    pub energy: f64,
    /// Elements that yield.
    pub plastic: usize,
}

/// Adds the internal forces at `u`, one step from rest, to `forces`.
pub fn add_forces(subdomain: &Subdomain, material: &Material, u: &[f64], forces: &mut [f64]) -> Internal {
    let rest = History::default();
    let mut sum = Internal::default();
    for nodes in &subdomain.elements {
        let element = geometry(subdomain, nodes);
        let response = material.respond(&element.strain(&displacements(u, nodes)), &rest);
        sum.energy += element.volume * response.energy;
        sum.plastic += usize::from(response.plastic);
        let mut local = [0.0; 12];
        element.add_internal(&response.stress, &mut local);
        for (k, force) in local.iter().enumerate() {
            forces[3 * nodes[k / 3] as usize + k % 3] += force;
        }
    }
    sum
}

/// `v'K_e v` of each vector (energy).
pub fn elastic_squares<const N: usize>(subdomain: &Subdomain, material: &Material, vectors: [&[f64]; N]) -> [f64; N] {
    let tangent = material.elastic_tangent();
    let mut squares = [0.0; N];
    for nodes in &subdomain.elements {
        let element = geometry(subdomain, nodes);
        for (square, v) in squares.iter_mut().zip(vectors) {
            let strain: Voigt = element.strain(&displacements(v, nodes));
            *square += element.volume * contract(&apply(&tangent, &strain), &strain);
        }
    }
    squares
}
