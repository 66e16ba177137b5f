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
//! `J(u_h) - J` is also what the potential is above the plane that touches it at the exact strain, so recovered stresses `sigma*` tell it
//! too: with a strain `e` of theirs,
//!
//! ```text
//! int Psi(eps_h) - Psi(e) - sigma* : (eps_h - e).
//! ```
//!
//! Where nothing hardens strains beside a mechanism are many times smaller than those in it. A polynomial through both tells of strains beside it
//! that are not there, and stresses of what flows may be anything that does not move it. Either distance may then be many times too large,
//! but seldom both in one element: there the smaller one is taken.
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
use crate::vector::difference;
use crate::work;

/// The distance (energy) in each element of each own subdomain. On all ranks it is `perfect` if some material of the scene flows without
/// hardening. Collective.
pub fn distances(sums: &NodeSums, regions: &[Region], u: &Torn, perfect: bool) -> Vec<Vec<f64>> {
    let subdomains: Vec<&Subdomain> = regions.iter().map(|region| region.subdomain).collect();
    let strains = recovery::recover(sums, &subdomains, |own| stress::strains(&regions[own], &u[own]));
    let stresses = perfect.then(|| recovery::recover(sums, &subdomains, |own| stress::samples(&regions[own], &u[own])));
    let of = |(own, (region, u)): (usize, (&Region, &Vec<f64>))| {
        let (elements, rule) = (&region.subdomain.elements, rule::squares(region.subdomain.elements.kind()));
        let points = elements.kind().points();
        let stresses = stresses.as_ref().filter(|_| region.material.has_limit()).map(|stresses| &stresses[own]);
        let ways = 1 + usize::from(stresses.is_some());
        work::each(elements.len() * rule.len(), ways * (12 * (elements.kind().nodes() + points) + 2 * LAW), 0);
        let samples = stress::strains(region, u);
        let distances = integrals(elements, &samples, &rule, |index, nodes, samples, place| {
            let strain = between(samples, place);
            let history = region.committed(points * index + nearest(place));
            let at = |nodal: &[Voigt]| interpolated(nodal, nodes, &place.nodes);
            let of_strain = region.material.divergence(&strain, &difference(at(&strains[own]), strain), history);
            let of_stress = stresses.map_or(of_strain, |stresses| {
                let other = region.material.strain(&at(stresses), history);
                region.material.divergence(&other, &difference(strain, other), history)
            });
            [of_strain, of_stress]
        });
        distances.into_iter().map(|[of_strain, of_stress]| of_strain.min(of_stress)).collect()
    };
    regions.iter().zip(u).enumerate().map(of).collect()
}
