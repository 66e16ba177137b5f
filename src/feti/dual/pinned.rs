//! Supports of subdomains whose supported unknowns are pinned ([`crate::feti::inverse::pins`]): how far they move, and what
//! they carry.
//!
//! The factor of such a subdomain keeps these unknowns at zero. Prescribed displacements there are a lift `w` that is known, and the
//! rest is solved for with `f - K w`. The supports carry what equilibrium of the pinned unknowns leaves: `f - B'lambda - K du`.

use super::operator::DualOperator;
use crate::constraint::{Constraints, Kind};
use crate::feti::Torn;

impl DualOperator<'_> {
    /// Own subdomains with pinned unknowns.
    fn pinned(&self) -> impl Iterator<Item = usize> {
        (0..self.torn.len()).filter(|&own| !self.inverse.pinned(own).is_empty())
    }

    /// `w`, a displacement that closes the `slack` of supports in subdomains with pinned unknowns and is zero elsewhere; `None` if
    /// no rank has any. Subtracts `K w` from the forces and `B w` from the slack. One neighbour exchange.
    pub fn lift(&self, constraints: &Constraints, forces: &mut Torn, slack: &mut [f64]) -> Option<Torn> {
        if !self.inverse.pins() {
            return None;
        }
        let mut lifted = self.gather.zeros();
        for own in self.pinned() {
            for entry in self.gather.entries(own) {
                let row = &constraints.rows[entry.row as usize];
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
        Some(lifted)
    }

    /// Adds to multipliers what supports carry in subdomains with pinned unknowns: `forces - B'balanced - K du` there. One
    /// neighbour exchange, none if no rank has pinned unknowns.
    pub(super) fn add_reactions(
        &self,
        constraints: &Constraints,
        (forces, du): (&Torn, &Torn),
        [lambda, balanced]: [&mut Vec<f64>; 2],
    ) {
        if !self.inverse.pins() {
            return;
        }
        let mut left = self.gather.zeros();
        for own in self.pinned() {
            let mut rest = forces[own].clone();
            self.gather.add_transpose_one(own, -1.0, balanced, &mut rest);
            self.subtract_product(own, &du[own], &mut rest);
            self.inverse.pinned(own).iter().for_each(|&dof| left[own][dof as usize] = rest[dof as usize]);
        }
        let mut carried = vec![0.0; self.gather.rows()];
        self.gather.apply(&left, &mut carried);
        for multipliers in [lambda, balanced] {
            constraints.add_forces(&carried, |kind| !kind.is_contact(), multipliers);
        }
    }

    /// `y -= K x`.
    fn subtract_product(&self, own: usize, x: &[f64], y: &mut [f64]) {
        let minus: Vec<f64> = x.iter().map(|x| -x).collect();
        let (symbolic, values) = self.inverse.stiffness(own);
        symbolic.pattern.multiply_add(values, &minus, y);
    }
}
