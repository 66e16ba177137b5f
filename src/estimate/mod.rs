//! How far the stress of finite elements is from the exact one: superconvergent patch recovery (Zienkiewicz and Zhu 1992,
//! doi 10.1002/nme.1620330702 and .1620330703).
//!
//! Around every vertex a polynomial of the degree of the shape functions is fitted to the stresses in the elements there,
//! at the integration points of tetrahedra and at the centres of hexahedra. Its value is the recovered stress `sigma*` at the
//! vertex; at the middle of an edge it is the mean of those of both ends; shape functions interpolate. At the boundary, where
//! a patch sees one side only, polynomials come from the neighbours inside, or else from theirs; the own one is taken where there
//! are none (plates one element thick), and in quadratic elements where the samples tell it: quadratic extrapolation is
//! worse. The estimate is
//!
//! ```text
//! eta^2 = int (sigma* - sigma_h) : C^-1 : (sigma* - sigma_h),   compared with   |sigma_h|^2 = int sigma_h : C^-1 : sigma_h
//! ```
//!
//! the elastic complementary energy of the difference, for plastic states too: what the energy error bounds there (see
//! [`crate::newton::certificate`]). Patches end where bodies and materials do, so stresses may jump at contacts and
//! where materials meet. They do not end where subdomains do: the estimate depends on the mesh alone, and to the last bit not on the ranks.
//!
//! It is an estimate, no bound: nearly exact for smooth solutions, and blind to what the mesh does not resolve at all. Measured
//! over the true error (`tests`), from meshes that hardly resolve the solution to fine ones: waves 1.45 to 1.02 with linear
//! tetrahedra, 1.33 to 1.06 with hexahedra, 0.84 to 1.02 with quadratic tetrahedra; a sector of a hollow sphere 1.18 to 0.99, 1.53
//! to 0.96, 0.95 to 1.07; bending 1.00. `fetiplast verify` measures it through the whole program, for plastic states and contact
//! too. At a plastic front the stress has a kink: quadratic tetrahedra have a small error if faces lie along it, and the estimate,
//! whose patches know nothing of that, is rather too large; if elements lie across it, rather too small.

pub mod bregman;
pub mod contact;
mod polynomial;
mod recovery;
mod rule;
pub mod weighted;

use self::rule::Place;
use crate::assembly::Region;
use crate::assembly::stress::{self, Sample};
use crate::decomposition::Subdomain;
use crate::decomposition::sums::NodeSums;
use crate::element::Kind;
use crate::feti::Torn;
use crate::material::Law;
use crate::mesh::Elements;
use crate::tensor::Voigt;
use crate::work;

/// Squares of the discretisation error of own elements, and of their stress.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// `int (sigma* - sigma_h) : C^-1 : (sigma* - sigma_h)` over each element of each own subdomain (energy).
    pub errors: Vec<Vec<f64>>,
    /// `int sigma_h : C^-1 : sigma_h` over each own subdomain (energy).
    pub stresses: Vec<f64>,
}

/// Estimates the error of the stresses at `u`. Collective.
pub fn estimate(sums: &NodeSums, regions: &[Region], u: &Torn) -> Estimate {
    let subdomains: Vec<&Subdomain> = regions.iter().map(|region| region.subdomain).collect();
    // All samples together would take more memory than it takes time to have them twice.
    let recovered = recovery::recover(sums, &subdomains, |own| stress::samples(&regions[own], &u[own]));
    difference(regions, u, rule::squares, |own, nodes, values| interpolated(&recovered[own], nodes, values))
}

/// The error itself, in the same norm, where the exact stress is known: of an own subdomain at a place.
pub fn error(regions: &[Region], u: &Torn, exact: impl Fn(usize, [f64; 3]) -> Voigt) -> Estimate {
    let at = |own: usize, nodes: &[u32], values: &[f64]| {
        let points = &regions[own].subdomain.points;
        let along = |i: usize| nodes.iter().zip(values).map(|(&n, value)| value * points[n as usize][i]).sum();
        exact(own, std::array::from_fn(along))
    };
    difference(regions, u, rule::fine, at)
}

/// What is given at the nodes of a subdomain, between those of an element where shape functions have such values.
fn interpolated(nodal: &[Voigt], nodes: &[u32], values: &[f64]) -> Voigt {
    let mut sum = [0.0; 6];
    for (&node, value) in nodes.iter().zip(values) {
        sum.iter_mut().zip(nodal[node as usize]).for_each(|(sum, x)| *sum += value * x);
    }
    sum
}

/// The integrals over each element of densities, which are told of the number of the element, its nodes, its samples and a place
/// of the rule.
fn integrals<const N: usize>(
    elements: &Elements,
    samples: &[Sample],
    rule: &[Place],
    densities: impl Fn(usize, &[u32], &[Sample], &Place) -> [f64; N],
) -> Vec<[f64; N]> {
    let of_element = |(index, (nodes, samples)): (usize, (&[u32], &[Sample]))| {
        let mut sums = [0.0; N];
        for place in rule {
            let volume: f64 = place.volume.iter().zip(samples).map(|(c, s)| c * s.weight).sum();
            let densities = densities(index, nodes, samples, place);
            sums.iter_mut().zip(densities).for_each(|(sum, density)| *sum += volume * density);
        }
        sums
    };
    elements.iter().zip(samples.chunks_exact(elements.kind().points())).enumerate().map(of_element).collect()
}

/// What samples of an element are at a place of the rule.
fn between(samples: &[Sample], place: &Place) -> Voigt {
    let mut value = [0.0; 6];
    for (c, sample) in place.samples.iter().zip(samples) {
        value.iter_mut().zip(sample.value).for_each(|(value, s)| *value += c * s);
    }
    value
}

/// The number of the integration point that is nearest to a place of the rule.
fn nearest(place: &Place) -> usize {
    let points = 0..place.samples.len();
    points.max_by(|&a, &b| place.samples[a].total_cmp(&place.samples[b])).expect("elements have points")
}

/// How far the stresses at `u` are from others, integrated by a rule: `stress` gives these from the number of an own subdomain, the
/// nodes of an element and the values of their shape functions.
fn difference(
    regions: &[Region],
    u: &Torn,
    rule: impl Fn(Kind) -> Vec<Place>,
    stress: impl Fn(usize, &[u32], &[f64]) -> Voigt,
) -> Estimate {
    let of = |(own, (region, u)): (usize, (&Region, &Vec<f64>))| {
        let samples = stress::samples(region, u);
        let rule = rule(region.subdomain.elements.kind());
        let errors = squares(region, &samples, &rule, |nodes, values| stress(own, nodes, values));
        let hooke = region.material.hooke();
        let size = samples.iter().map(|s| s.weight * hooke.complementary_square(&s.value)).sum::<f64>();
        (errors, size)
    };
    let (errors, stresses) = regions.iter().zip(u).enumerate().map(of).unzip();
    Estimate { errors, stresses }
}

/// `int (sigma - sigma_h) : C^-1 : (sigma - sigma_h)` over each element, where `stress` gives sigma from the nodes of an
/// element and the values of their shape functions.
fn squares(region: &Region, samples: &[Sample], rule: &[Place], stress: impl Fn(&[u32], &[f64]) -> Voigt) -> Vec<f64> {
    let elements = &region.subdomain.elements;
    // At each place of the rule the recovered stress, what it differs by, and its energy.
    let of_place = 12 * (elements.kind().nodes() + elements.kind().points()) + 30;
    work::each(elements.len() * rule.len(), of_place, 0);
    work::each(samples.len(), 0, size_of::<Sample>());
    let squares = integrals(elements, samples, rule, |_, nodes, samples, place| {
        let mut difference = stress(nodes, &place.nodes);
        for (c, sample) in place.samples.iter().zip(samples) {
            difference.iter_mut().zip(sample.value).for_each(|(d, s)| *d -= c * s);
        }
        [region.material.hooke().complementary_square(&difference)]
    });
    squares.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests;
