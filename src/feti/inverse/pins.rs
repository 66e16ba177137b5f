//! Unknowns that the factors of weak subdomains keep at zero: those that supports fix, where they leave no rigid motion.
//!
//! The multipliers of such supports that are in balance among themselves move nothing but the supported unknowns. With these
//! unknowns pinned at zero, `K^+` answers forces as the subdomain does on its supports, these multipliers have nothing to do, and
//! equilibrium tells afterwards what the supports carry ([`crate::feti::dual::pinned`]). Rigid motions, `G` and the coarse problem
//! stay as they are. `F` is zero along these multipliers; conjugate gradients do not mind, for right-hand sides are, too.
//!
//! Without it these multipliers converge slowest where a body resists changes of its volume only: the preconditioner moves the
//! support, and holds the rest of the surface.

use faer::{Mat, Side};

use super::kernel::RigidModes;
use crate::constraint::{Constraints, Kind};
use crate::decomposition::Subdomain;

/// A rigid motion of unit size moves the supported unknowns of a subdomain at least by the root of this.
const RIGID: f64 = 1e-3;

/// For each own subdomain, the unknowns that supports fix, ascending; none where they leave it a rigid motion.
pub fn unknowns(constraints: &Constraints, subdomains: &[Subdomain], modes: &[RigidModes]) -> Vec<Vec<u32>> {
    let of = |(own, (subdomain, modes)): (usize, (&Subdomain, &RigidModes))| {
        let is_support = |row: u32| matches!(constraints.rows[row as usize].kind, Kind::Support { .. });
        let entries = constraints.entries[own].iter().filter(|entry| is_support(entry.row));
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
