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
use crate::material::{History, Law};
use crate::tensor::Voigt;
use crate::work;

/// The distance (energy) in each element of each own subdomain. On all ranks it is `perfect` if some material of the scene flows without
/// hardening. Collective.
pub fn distances(sums: &NodeSums, regions: &[Region], u: &Torn, perfect: bool) -> Vec<Vec<f64>> {
    let subdomains: Vec<&Subdomain> = regions.iter().map(|region| region.subdomain).collect();
    let strains = recovery::recover(sums, &subdomains, |own| stress::strains(&regions[own], &u[own]));
    let of_strains = from(regions, u, &strains, |region, history, strain, recovered| {
        region.material.divergence(&strain, &difference(&recovered, &strain), history)
    });
    if !perfect {
        return of_strains;
    }
    let stresses = recovery::recover(sums, &subdomains, |own| stress::samples(&regions[own], &u[own]));
    let of_stresses = from(regions, u, &stresses, |region, history, strain, recovered| {
        let own = region.material.strain(&recovered, history);
        region.material.divergence(&own, &difference(&strain, &own), history)
    });
    let smaller = |((region, strains), stresses): ((&Region, Vec<f64>), Vec<f64>)| match region.material.has_limit() {
        true => strains.into_iter().zip(stresses).map(|(a, b)| a.min(b)).collect(),
        false => strains,
    };
    regions.iter().zip(of_strains).zip(of_stresses).map(smaller).collect()
}

/// The integral over each element of a density, which is told of the history, the strain and what was recovered.
fn from(
    regions: &[Region],
    u: &Torn,
    recovered: &[Vec<Voigt>],
    density: impl Fn(&Region, &History, Voigt, Voigt) -> f64,
) -> Vec<Vec<f64>> {
    let of = |((region, u), nodal): ((&Region, &Vec<f64>), &Vec<Voigt>)| {
        let (elements, rule) = (&region.subdomain.elements, rule::squares(region.subdomain.elements.kind()));
        let points = elements.kind().points();
        work::each(elements.len() * rule.len(), 12 * (elements.kind().nodes() + points) + 2 * LAW, 0);
        let samples = stress::strains(region, u);
        let distances = integrals(elements, &samples, &rule, |index, nodes, samples, place| {
            let history = region.committed(points * index + nearest(place));
            [density(region, history, between(samples, place), interpolated(nodal, nodes, &place.nodes))]
        });
        distances.into_iter().flatten().collect()
    };
    regions.iter().zip(u).zip(recovered).map(of).collect()
}

fn difference(a: &Voigt, b: &Voigt) -> Voigt {
    std::array::from_fn(|i| a[i] - b[i])
}
