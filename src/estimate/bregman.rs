//! How far the energy of a solution is above the least one, element by element.
//!
//! The strain `eps*` is recovered from that of the finite elements as stresses are ([`super`]). If it were the exact one,
//! `J(u_h) - J` would be, but for what contact does,
//!
//! ```text
//! int Psi(eps*) - Psi(eps_h) - sigma_h : (eps* - eps_h),
//! ```
//!
//! the Bregman distance of the convex potential `Psi`. Where the material yields it sees what the elastic energy of the
//! difference of stresses does not: stresses hardly change there with the strain.
//!
//! It is an estimate, no bound: the recovered strain lies between that of the elements and the exact one where this is singular, so
//! the distance is too small there; how much so hardly changes from mesh to mesh.

use super::{between, integrals, interpolated, nearest, recovery, rule};
use crate::assembly::Region;
use crate::assembly::stress;
use crate::assembly::visit::LAW;
use crate::decomposition::Subdomain;
use crate::decomposition::sums::NodeSums;
use crate::feti::Torn;
use crate::material::Law;
use crate::tensor::Voigt;
use crate::work;

/// The distance (energy) in each element of each own subdomain. Collective.
pub fn distances(sums: &NodeSums, regions: &[Region], u: &Torn) -> Vec<Vec<f64>> {
    let subdomains: Vec<&Subdomain> = regions.iter().map(|region| region.subdomain).collect();
    let recovered = recovery::recover(sums, &subdomains, |own| stress::strains(&regions[own], &u[own]));
    let of = |((region, u), nodal): ((&Region, &Vec<f64>), &Vec<Voigt>)| {
        let (elements, rule) = (&region.subdomain.elements, rule::squares(region.subdomain.elements.kind()));
        let points = elements.kind().points();
        work::each(elements.len() * rule.len(), 12 * (elements.kind().nodes() + points) + 2 * LAW, 0);
        let samples = stress::strains(region, u);
        let distances = integrals(elements, &samples, &rule, |index, nodes, samples, place| {
            let strain = between(samples, place);
            let mut change = interpolated(nodal, nodes, &place.nodes);
            change.iter_mut().zip(strain).for_each(|(change, s)| *change -= s);
            let history = region.committed(points * index + nearest(place));
            [region.material.divergence(&strain, &change, history)]
        });
        distances.into_iter().flatten().collect()
    };
    regions.iter().zip(u).zip(&recovered).map(of).collect()
}
