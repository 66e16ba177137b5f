//! How far a number that a solution has is from that of the exact one: errors of the strain, weighted.
//!
//! The number `Q` has a dual solution `z`: what it is more sensitive to. With the errors `e` of the strain of the solution and `e_z` of
//! the strain of the dual one
//!
//! ```text
//! Q(u) - Q(u_h) ~ int (sigma(eps_h + e) - sigma(eps_h)) : e_z
//! ```
//!
//! (Becker and Rannacher, Acta Numerica 10 (2001), for errors that are orthogonal to what the mesh has). Both errors are taken to be what
//! recovered strains differ by ([`super`]). Elements of both signs cancel, so that the sum of the sizes
//!
//! ```text
//! 2 (D D_z)^(1/2),   D of [`super::bregman`],   D_z = 1/2 e_z : C : e_z with the tangent C
//! ```
//!
//! is what tells from mesh to mesh how errors fall.
//!
//! It is an estimate, no bound. Contact is in it by the rows that the dual solution keeps; that they change is not.

use super::{between, integrals, interpolated, nearest, recovery, rule};
use crate::assembly::Region;
use crate::assembly::stress;
use crate::assembly::visit::LAW;
use crate::decomposition::Subdomain;
use crate::decomposition::sums::NodeSums;
use crate::feti::Torn;
use crate::material::Law;
use crate::tensor::{Voigt, apply, contract};
use crate::work;

/// What each element of each own subdomain has of the error of a number.
pub struct Weighted {
    /// With its sign.
    pub signed: Vec<Vec<f64>>,
    /// At most so much, see the header.
    pub sizes: Vec<Vec<f64>>,
}

/// Estimates the error of the number whose dual solution is `z`, at `u`. Collective.
pub fn weighted(sums: &NodeSums, regions: &[Region], u: &Torn, z: &Torn) -> Weighted {
    let subdomains: Vec<&Subdomain> = regions.iter().map(|region| region.subdomain).collect();
    let [of_u, of_z] =
        [u, z].map(|v| recovery::recover(sums, &subdomains, |own| stress::strains(&regions[own], &v[own])));
    let of = |own: usize| of_region(&regions[own], [&u[own], &z[own]], [&of_u[own], &of_z[own]]);
    let (signed, sizes) = (0..regions.len()).map(of).unzip();
    Weighted { signed, sizes }
}

/// Of a subdomain, from displacements and recovered strains.
fn of_region(region: &Region, displacements: [&[f64]; 2], recovered: [&[Voigt]; 2]) -> (Vec<f64>, Vec<f64>) {
    let elements = &region.subdomain.elements;
    let (rule, points) = (rule::squares(elements.kind()), elements.kind().points());
    work::each(elements.len() * rule.len(), 24 * (elements.kind().nodes() + points) + 4 * LAW, 0);
    let [samples, of_dual] = displacements.map(|v| stress::strains(region, v));
    let sums = integrals(elements, &samples, &rule, |index, nodes, samples, place| {
        let own = points * index..points * (index + 1);
        let [strain, of_dual] = [samples, &of_dual[own.clone()]].map(|samples| between(samples, place));
        let [change, weight] = [(recovered[0], strain), (recovered[1], of_dual)].map(|(nodal, strain)| {
            let better = interpolated(nodal, nodes, &place.nodes);
            std::array::from_fn(|s| better[s] - strain[s])
        });
        let (material, history) = (region.material, region.committed(own.start + nearest(place)));
        let [there, here] = [std::array::from_fn(|s| strain[s] + change[s]), strain]
            .map(|strain| material.respond(&strain, history).stress);
        let stress = std::array::from_fn(|s| there[s] - here[s]);
        let of_weight = 0.5 * contract(&apply(&material.stiffness(&strain, history, None), &weight), &weight);
        [contract(&stress, &weight), material.divergence(&strain, &change, history), of_weight]
    });
    sums.into_iter().map(|[signed, primal, dual]| (signed, 2.0 * (primal.max(0.0) * dual.max(0.0)).sqrt())).unzip()
}
