//! Stresses at the integration points, with their places.

use super::Region;
use super::visit::{LAW, Visited, Visitor, for_each_element, strain_flops};
use crate::material::Law;
use crate::tensor::Voigt;
use crate::work;

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

/// The stresses at `u`, one step from the committed history, element by element.
pub fn samples(region: &Region, u: &[f64]) -> Vec<Sample> {
    let elements = &region.subdomain.elements;
    let (nodes, points) = (elements.kind().nodes(), elements.kind().points());
    let samples = Vec::with_capacity(points * elements.len());
    work::each(elements.len(), points * (strain_flops(nodes) + LAW + 6 * nodes), nodes * size_of::<[f64; 3]>());
    let mut stresses = Stresses { region, u, samples };
    for_each_element(elements, &region.subdomain.points, &mut stresses);
    stresses.samples
}

struct Stresses<'a> {
    region: &'a Region<'a>,
    u: &'a [f64],
    samples: Vec<Sample>,
}

impl Visitor for Stresses<'_> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let Region { subdomain, material, .. } = self.region;
        let u = element.nodal(self.u);
        for ((index, point), values) in element.points().zip(element.values) {
            let response = material.respond(&point.strain(&u), self.region.committed(index));
            let of_nodes = || element.nodes.iter().zip(values);
            let along = |i: usize| of_nodes().map(|(&n, v)| v * subdomain.points[n as usize][i]).sum();
            let place = std::array::from_fn(along);
            self.samples.push(Sample { place, weight: point.weight, stress: response.stress });
        }
    }
}
