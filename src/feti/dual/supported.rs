//! Subdomains that supports hold still: `K^+` with the unknowns that supports fix kept at zero.
//!
//! The multipliers of a subdomain's supports that are in balance among themselves move nothing but what the supports hold, so
//! they need not be sought: with the held unknowns at zero, `K^+` of a subdomain that has no rigid motion left answers forces as
//! the subdomain does with its supports, and what the supports carry follows from the equilibrium of the held unknowns. Rigid
//! motions, `G` and the coarse problem stay as they are. Conjugate gradients do not mind multipliers that move nothing:
//! right-hand sides have no part there.
//!
//! Without it such multipliers are the slowest where a body resists changes of its volume only: the preconditioner moves the
//! support, and holds the rest of the surface.

use faer::{Mat, Side};

use super::gather::Gather;
use crate::constraint::{Constraints, Kind};
use crate::decomposition::Subdomain;
use crate::feti::inverse::kernel::RigidModes;

/// A rigid motion of unit size moves the held unknowns of a subdomain at least by the root of this.
const RIGID: f64 = 1e-3;

/// For each own subdomain, the unknowns that supports fix, ascending; none where they leave it a rigid motion.
pub fn unknowns(
    constraints: &Constraints,
    gather: &Gather,
    subdomains: &[Subdomain],
    modes: &[RigidModes],
) -> Vec<Vec<u32>> {
    let of = |(own, (subdomain, modes)): (usize, (&Subdomain, &RigidModes))| {
        let is_support = |row: u32| matches!(constraints.rows[row as usize].kind, Kind::Support { .. });
        let entries = gather.entries(own).iter().filter(|entry| is_support(entry.row));
        let mut dofs: Vec<u32> = entries.map(|entry| entry.dof).collect();
        dofs.sort_unstable();
        let mut gram = Mat::<f64>::zeros(6, 6);
        for &dof in &dofs {
            let motion = modes.at(subdomain.points[dof as usize / 3])[dof as usize % 3];
            for i in 0..6 {
                (0..6).for_each(|j| gram[(i, j)] += motion[i] * motion[j]);
            }
        }
        let least = gram.self_adjoint_eigenvalues(Side::Lower).map_or(0.0, |values| values[0]);
        if least > RIGID { dofs } else { Vec::new() }
    };
    subdomains.iter().zip(modes).enumerate().map(of).collect()
}
