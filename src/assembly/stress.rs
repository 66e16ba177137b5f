//! Stresses at the integration points, with their places.

use super::{committed, displacements, integrated};
use crate::decomposition::Subdomain;
use crate::element::{Kind, Nodal, Point, hex8, tet4, tet10};
use crate::material::{History, Material};
use crate::tensor::Voigt;

/// An integration point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Where it is.
    pub place: [f64; 3],
    /// Volume that it stands for.
    pub weight: f64,
    /// Stress there.
    pub stress: Voigt,
}

/// The stresses at `u`, one step from the committed `history`, element by element.
pub fn samples(subdomain: &Subdomain, material: &Material, history: &[History], u: &[f64]) -> Vec<Sample> {
    match subdomain.elements.kind() {
        Kind::Tet4 => samples_of(tet4::points, &tet4::VALUES, subdomain, material, history, u),
        Kind::Tet10 => samples_of(tet10::points, &tet10::values_at_points(), subdomain, material, history, u),
        Kind::Hex8 => samples_of(hex8::points, &hex8::values_at_points(), subdomain, material, history, u),
    }
}

fn samples_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    values: &[[f64; N]; P],
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
) -> Vec<Sample> {
    let mut samples = Vec::with_capacity(P * subdomain.elements.len());
    for (nodes, points) in integrated(points, &subdomain.elements, &subdomain.points) {
        let u = displacements(u, nodes);
        for (point, values) in points.iter().zip(values) {
            let response = material.respond(&point.strain(&u), committed(history, samples.len()));
            let along = |i: usize| nodes.iter().zip(values).map(|(&n, v)| v * subdomain.points[n as usize][i]).sum();
            let place = std::array::from_fn(along);
            samples.push(Sample { place, weight: point.weight, stress: response.stress });
        }
    }
    samples
}
