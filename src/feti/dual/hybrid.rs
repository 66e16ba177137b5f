//! Hybrid Total FETI: `K~^+`, the generalised inverse of the stiffness of clusters whose members hold together.
//!
//! Members of a cluster are bound for good: rigid motions of the members do not change the jumps of the gluing rows between
//! them. So a cluster has six rigid motions and the coarse problem six unknowns a cluster; all else between members is left to
//! the multipliers. With `Q` that balances the members of each group by these rows ([`Balance`]),
//!
//! ```text
//! K~^+ = Q' K^+ Q,    Q t = t - B'c,  c from R't,    Q'u = u - R a,  a from B u
//! ```
//!
//! Nothing in `Q` depends on the material. Multipliers `c` move nothing, which conjugate gradients do not mind: right-hand sides
//! have no part there.
//!
//! Klawonn and Rheinbach, "Highly scalable parallel domain decomposition methods with an application to biomechanics", ZAMM 90
//! (2010), hybrid FETI; Merta, Riha, Meca, Markopoulos, Brzobohaty, Kozubek and Vondrak, "Intel Xeon Phi acceleration of hybrid
//! total FETI solver", Adv. Eng. Software 112 (2017), hybrid Total FETI. Both bind members by averages over faces.

use thiserror::Error;

use super::Interconnection;
use super::gather::Gather;
use super::levels::Balance;
use crate::constraint::Constraints;
use crate::decomposition::{Decomposition, Subdomain};
use crate::feti::Torn;
use crate::feti::inverse::Inverse;
use crate::feti::inverse::kernel::RigidModes;

/// The members of a group are not held by each other.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "subdomains around subdomain {subdomain} have no faces in common and form a cluster: set decomposition.cluster = 1"
)]
pub struct Loose {
    /// The first of the group.
    pub subdomain: usize,
}

/// What binds the members of clusters.
pub struct Hybrid<'a> {
    balance: Balance<'a>,
    gather: &'a Gather<'a>,
    subdomains: &'a [Subdomain],
    /// Modes of own subdomains, in terms of their shapes.
    modes: &'a [RigidModes],
    /// `c` of the last solve, in all rows.
    forces: Vec<f64>,
    jumps: Vec<f64>,
}

impl<'a> Hybrid<'a> {
    /// Of the clusters of a decomposition; `None` if each is a single subdomain. Collective.
    ///
    /// # Errors
    /// If nothing holds the members of a group together: on every rank.
    pub fn of_clusters(
        connection: &'a Interconnection<'a>,
        decomposition: &'a Decomposition,
        constraints: &Constraints,
    ) -> Result<Option<Self>, Loose> {
        let is_plain = decomposition.clusters.are_single();
        let balance = (!is_plain).then(|| Balance::new(connection, decomposition, constraints)).transpose();
        let balance = balance.map_err(|subdomain| Loose { subdomain })?;
        Ok(balance.map(|balance| Self::new(balance, connection, &decomposition.subdomains)))
    }

    fn new(balance: Balance<'a>, connection: &'a Interconnection<'a>, subdomains: &'a [Subdomain]) -> Self {
        let (gather, modes, rows) = (&connection.gather, &connection.motions.shapes[..], connection.gather.rows());
        Self { balance, gather, subdomains, modes, forces: vec![0.0; rows], jumps: vec![0.0; rows] }
    }

    /// `x = K~^+ x`. Two neighbour exchanges and two messages up and down the tree for each level. Collective.
    pub fn solve(&mut self, inverse: &mut Inverse, x: &mut Torn) {
        let resultants = |((s, modes), x): ((&Subdomain, &RigidModes), &Vec<f64>)| modes.resultants(&s.shape, x);
        let resultants = self.subdomains.iter().zip(self.modes).zip(&*x).flat_map(resultants).collect();
        self.balance.forces(resultants, &mut self.forces);
        self.gather.add_transpose(-1.0, &self.forces, x);
        inverse.solve(x);
        self.bring_together(x);
    }

    /// Moves the members of clusters as rigid bodies to where a displacement keeps them together; no forces then. Collective.
    pub fn rejoin(&mut self, u: &mut Torn) {
        self.forces.fill(0.0);
        self.bring_together(u);
    }

    /// `u = Q'u`.
    fn bring_together(&mut self, u: &mut Torn) {
        self.gather.apply(u, &mut self.jumps);
        let motions = self.balance.motions(&mut self.jumps);
        let of_members = motions.as_chunks().0.iter().zip(self.subdomains).zip(self.modes).zip(u);
        for (((amplitudes, subdomain), modes), u) in of_members {
            modes.add_motion(&subdomain.shape, amplitudes.map(|a: f64| -a), u);
        }
    }

    /// `z = M r` by a preconditioner that does not know of groups. Multipliers and jumps are brought near those that all rigid motions of
    /// subdomains and groups leave, which makes up for most of the iterations that clusters cost. Collective.
    pub fn precondition(&self, r: &[f64], z: &mut [f64], apply: impl FnOnce(&[f64], &mut [f64])) {
        let mut jumps = r.to_vec();
        self.balance.relax_transposed(&mut jumps);
        apply(&jumps, z);
        self.balance.relax(z);
    }

    /// Multipliers by which members held each other in the last [`Hybrid::solve`], in all rows.
    pub fn forces(&self) -> &[f64] {
        &self.forces
    }
}

#[cfg(test)]
mod tests;
