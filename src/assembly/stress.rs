//! Stresses and strains at the integration points, with their places.

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
    /// Stress or strain there.
    pub value: Voigt,
}

/// The stresses at `u`, one step from the committed history, element by element.
pub fn samples(region: &Region, u: &[f64]) -> Vec<Sample> {
    of(region, u, LAW, |index, strain| region.material.respond(strain, region.committed(index)).stress)
}

/// The strains at `u`, element by element (engineering shears).
pub fn strains(region: &Region, u: &[f64]) -> Vec<Sample> {
    of(region, u, 0, |_, strain| *strain)
}

/// A value of each point by its number and its strain, which takes so many operations.
fn of(region: &Region, u: &[f64], flops: usize, value: impl Fn(usize, &Voigt) -> Voigt) -> Vec<Sample> {
    let elements = &region.subdomain.elements;
    let (nodes, points) = (elements.kind().nodes(), elements.kind().points());
    let samples = Vec::with_capacity(points * elements.len());
    work::each(elements.len(), points * (strain_flops(nodes) + flops + 6 * nodes), nodes * size_of::<[f64; 3]>());
    let mut pass = Pass { region, u, value, samples };
    for_each_element(elements, &region.subdomain.points, &mut pass);
    pass.samples
}

struct Pass<'a, F> {
    region: &'a Region<'a>,
    u: &'a [f64],
    value: F,
    samples: Vec<Sample>,
}

impl<F: Fn(usize, &Voigt) -> Voigt> Visitor for Pass<'_, F> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let points = &self.region.subdomain.points;
        let u = element.nodal(self.u);
        for ((index, point), values) in element.points().zip(element.values) {
            let of_nodes = || element.nodes.iter().zip(values);
            let along = |i: usize| of_nodes().map(|(&n, v)| v * points[n as usize][i]).sum();
            let place = std::array::from_fn(along);
            self.samples.push(Sample { place, weight: point.weight, value: (self.value)(index, &point.strain(&u)) });
        }
    }
}
