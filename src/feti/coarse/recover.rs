//! Rigid motions of the torn problem: `e = R'f_k` and the `R a` of `du = K^+ (f_k - B'lambda) + R a` (paper, section 4).
//!
//! The amplitudes satisfy the equalities and the closed contacts in the least-squares sense,
//! `a = (G G')^-1 G (c - B K^+ (f_k - B'lambda))` with `G` restricted to those rows; at the solution exactly.

use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::feti::coarse::Coarse;
use crate::feti::inverse::kernel::RigidModes;

/// `R'f`, six numbers a cluster, from own subdomains, whole on every rank. One all-gather.
pub fn resultants(subdomains: &[Subdomain], modes: &[RigidModes], coarse: &Coarse, forces: &Torn) -> Vec<f64> {
    let mut mine = Vec::new();
    for ((subdomain, modes), f) in subdomains.iter().zip(modes).zip(forces) {
        mine.extend(modes.resultants(&subdomain.points, f));
    }
    coarse.share(&mine)
}

/// Adds `factor R a` to a torn displacement.
pub fn add_rigid_motion(
    subdomains: &[Subdomain],
    modes: &[RigidModes],
    coarse: &Coarse,
    factor: f64,
    amplitudes: &[f64],
    torn: &mut Torn,
) {
    for ((subdomain, modes), local) in subdomains.iter().zip(modes).zip(torn) {
        let amplitudes = coarse.of_subdomain(subdomain.id, amplitudes).map(|a| factor * a);
        modes.add_motion(&subdomain.points, amplitudes, local);
    }
}
