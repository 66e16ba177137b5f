//! Subdomains that supports hold still ([`crate::feti::dual::supported`]): what the supports move there, and what they carry.

use std::rc::Rc;

use super::gather::Gather;
use crate::constraint::{Constraints, Kind};
use crate::feti::Torn;
use crate::feti::inverse::factor::Factors;

/// The tangents of own subdomains, and what is kept at zero in their factors.
pub struct Held<'s> {
    /// The factors.
    pub factors: &'s Factors,
    /// Lower values of the tangents.
    pub tangents: &'s [Rc<Vec<f64>>],
    /// The rows of B.
    pub constraints: &'s Constraints,
    /// B.
    pub gather: &'s Gather<'s>,
}

impl Held<'_> {
    /// Own subdomains of which unknowns are kept at zero.
    fn subdomains(&self) -> impl Iterator<Item = usize> {
        (0..self.tangents.len()).filter(|&own| !self.factors.held(own).is_empty())
    }

    /// A displacement that closes the `slack` of supports in these subdomains and is zero elsewhere; takes its part from the
    /// forces, and what it closes from the slack of all rows. One neighbour exchange.
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

    /// Adds to multipliers what supports carry in these subdomains: what `forces` and the last of the multipliers, which are in
    /// balance, leave there after the displacement `du`. One neighbour exchange.
    pub fn add_reactions<const N: usize>(&self, (forces, du): (&Torn, &Torn), multipliers: [&mut Vec<f64>; N]) {
        let mut left = self.gather.zeros();
        for own in self.subdomains() {
            let mut rest = forces[own].clone();
            self.gather.add_transpose_one(own, -1.0, multipliers[N - 1], &mut rest);
            self.subtract_product(own, &du[own], &mut rest);
            self.factors.held(own).iter().for_each(|&dof| left[own][dof as usize] = rest[dof as usize]);
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
        self.factors.symbolic(own).pattern.multiply_add(&self.tangents[own], &minus, y);
    }
}
