//! Supports of subdomains whose supported unknowns are pinned ([`crate::feti::inverse::pinnable`]): how far they move, and what
//! they carry.
//!
//! The factor of such a subdomain keeps these unknowns at zero. Prescribed displacements there are a lift `w` that is known, and the
//! rest is solved for with `f - K w`. The supports carry what equilibrium of the pinned unknowns leaves: `f - B'lambda - K du`.

use crate::constraint::{Constraints, Kind};
use crate::feti::Torn;
use crate::feti::dual::gather::Gather;
use crate::feti::inverse::Inverse;

/// Own subdomains with pinned unknowns, and their rows.
pub struct Pinned<'s> {
    inverse: &'s Inverse,
    constraints: &'s Constraints,
    gather: &'s Gather<'s>,
}

impl<'s> Pinned<'s> {
    /// Those of an inverse as it was updated last.
    pub fn new(inverse: &'s Inverse, constraints: &'s Constraints, gather: &'s Gather<'s>) -> Self {
        Self { inverse, constraints, gather }
    }

    fn subdomains(&self) -> impl Iterator<Item = usize> {
        (0..self.constraints.entries.len()).filter(|&own| !self.inverse.pinned(own).is_empty())
    }

    /// `w`, a displacement that closes the `slack` of supports in these subdomains and is zero elsewhere. Subtracts `K w` from the
    /// forces and `B w` from the slack. One neighbour exchange.
    pub fn lift(&self, forces: &mut Torn, slack: &mut [f64]) -> Torn {
        let mut lifted = self.gather.zeros();
        for own in self.subdomains() {
            for entry in self.gather.entries(own) {
                let row = &self.constraints.rows[entry.row as usize];
                if matches!(row.kind, Kind::Support { .. }) {
                    let sum: f64 = row.terms.iter().map(|term| term.value).sum();
                    lifted[own][entry.dof as usize] = slack[entry.row as usize] / sum;
                }
            }
            self.subtract_product(own, &lifted[own], &mut forces[own]);
        }
        let mut closed = vec![0.0; slack.len()];
        self.gather.apply(&lifted, &mut closed);
        slack.iter_mut().zip(closed).for_each(|(slack, closed)| *slack -= closed);
        lifted
    }

    /// Adds to multipliers what supports carry in these subdomains, `forces - B'lambda - K du` at pinned unknowns with the last of
    /// the multipliers, which are in balance. One neighbour exchange.
    pub fn add_reactions<const N: usize>(&self, (forces, du): (&Torn, &Torn), multipliers: [&mut Vec<f64>; N]) {
        let mut left = self.gather.zeros();
        for own in self.subdomains() {
            let mut rest = forces[own].clone();
            self.gather.add_transpose_one(own, -1.0, multipliers[N - 1], &mut rest);
            self.subtract_product(own, &du[own], &mut rest);
            self.inverse.pinned(own).iter().for_each(|&dof| left[own][dof as usize] = rest[dof as usize]);
        }
        let mut carried = vec![0.0; self.gather.rows()];
        self.gather.apply(&left, &mut carried);
        for lambda in multipliers {
            self.constraints.add_forces(&carried, |kind| !kind.is_contact(), lambda);
        }
    }

    /// `y -= K x`.
    fn subtract_product(&self, own: usize, x: &[f64], y: &mut [f64]) {
        let minus: Vec<f64> = x.iter().map(|x| -x).collect();
        let (symbolic, values) = self.inverse.stiffness(own);
        symbolic.pattern.multiply_add(values, &minus, y);
    }
}
