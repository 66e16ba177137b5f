//! `F(u) = D Psi(u)`: internal forces and energy of a subdomain, and energies in the elastic norm.

use super::{committed, displacements, geometry};
use crate::decomposition::Subdomain;
use crate::element::tet4::Tet4;
use crate::material::{History, Material, Response};
use crate::tensor::{Voigt, apply, contract};

/// What one pass over the elements finds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Internal {
    /// `Psi(u)` (energy).
    pub energy: f64,
    /// Elements that yield.
    pub plastic: usize,
    /// What could cancel.
    pub terms: Terms,
}

/// Size of the terms that add up to strains and internal forces. A body that moves as a whole has large terms that
/// cancel to round-off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Sum over the elements of `V (lambda + 2 mu) (sum_a |g_a| |u_a|)^2` (energy).
    pub energy: f64,
    /// Sum over the elements and their nodes of `(V (lambda + 2 mu) |g_a| sum_b |g_b| |u_b|)^2` (force squared).
    pub force_squares: f64,
}

impl Terms {
    fn add(&mut self, element: &Tet4, modulus: f64, u: &[f64; 12]) {
        let steepness = element.gradients.map(|g| g.iter().map(|x| x * x).sum::<f64>());
        let lengths = steepness
            .iter()
            .zip(u.as_chunks::<3>().0)
            .map(|(s, u)| (s * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])).sqrt());
        let strain: f64 = lengths.sum();
        let stress = element.volume * modulus * strain;
        self.energy += stress * strain;
        self.force_squares += stress * stress * steepness.iter().sum::<f64>();
    }
}

/// Adds the internal forces at `u`, one step from the committed `history`, to `forces`.
pub fn add_forces(
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
    forces: &mut [f64],
) -> Internal {
    let modulus = material.lambda() + 2.0 * material.shear_modulus();
    let mut sum = Internal::default();
    for (index, nodes) in subdomain.elements.iter().enumerate() {
        let element = geometry(&subdomain.points, nodes);
        let u = displacements(u, nodes);
        sum.terms.add(&element, modulus, &u);
        let response = material.respond(&element.strain(&u), committed(history, index));
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

/// What the elements answer to `u`, one step from the committed `history`.
pub fn responses<'a>(
    subdomain: &'a Subdomain,
    material: &'a Material,
    history: &'a [History],
    u: &'a [f64],
) -> impl Iterator<Item = Response> + 'a {
    subdomain.elements.iter().enumerate().map(move |(index, nodes)| {
        let strain = geometry(&subdomain.points, nodes).strain(&displacements(u, nodes));
        material.respond(&strain, committed(history, index))
    })
}

/// Commits the step that ends at `u`.
pub fn commit(subdomain: &Subdomain, material: &Material, u: &[f64], history: &mut Vec<History>) {
    history.resize(subdomain.elements.len(), History::default());
    for (nodes, history) in subdomain.elements.iter().zip(history) {
        let strain = geometry(&subdomain.points, nodes).strain(&displacements(u, nodes));
        *history = material.commit(&strain, history);
    }
}

/// The elements that yield at `u`, one step from the committed `history`, by their nodes.
pub fn yielding<'a>(
    subdomain: &'a Subdomain,
    material: &'a Material,
    history: &'a [History],
    u: &'a [f64],
) -> impl Iterator<Item = &'a [u32; 4]> {
    let responses = responses(subdomain, material, history, u);
    subdomain.elements.iter().zip(responses).filter(|(_, response)| response.plastic).map(|(nodes, _)| nodes)
}

/// `v'K_e v` of each vector (energy).
pub fn elastic_squares<const N: usize>(subdomain: &Subdomain, material: &Material, vectors: [&[f64]; N]) -> [f64; N] {
    let tangent = material.elastic_tangent();
    let mut squares = [0.0; N];
    for nodes in &subdomain.elements {
        let element = geometry(&subdomain.points, nodes);
        for (square, v) in squares.iter_mut().zip(vectors) {
            let strain: Voigt = element.strain(&displacements(v, nodes));
            *square += element.volume * contract(&apply(&tangent, &strain), &strain);
        }
    }
    squares
}
