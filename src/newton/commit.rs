//! Commits the end of an increment: histories at the integration points, and the largest sizes so far.

use super::committed::Sizes;
use super::iterate::Iterate;
use super::problem::TornProblem;
use crate::assembly::internal;
use crate::feti::Torn;

impl TornProblem<'_> {
    /// Commits the end of an increment: from now on the problem is the next one. Collective.
    pub fn commit(&mut self, Iterate { u, state, lambda, energies, .. }: &Iterate) {
        self.committed.energies = energies.unwrap_or_default();
        let sizes = Sizes { elastic_norm: self.elastic_norm(u), ..self.measure(u, state, lambda).1 };
        self.committed.sizes = self.committed.sizes.larger(sizes);
        self.commit_slips(&self.slack(u));
        self.committed.histories.resize_with(u.len(), Vec::new);
        for own in (0..u.len()).filter(|&own| state.yielding[own] > 0) {
            self.committed.histories[own] = internal::commit(&self.region(own), &u[own]);
        }
    }

    /// `|u|_e`. One collective.
    fn elastic_norm(&self, u: &Torn) -> f64 {
        let square = |own: usize| internal::elastic_squares(&self.region(own), [&u[own]])[0];
        let partial: Vec<f64> = (0..u.len()).map(square).collect();
        self.space.sum(&partial, 1)[0].sqrt()
    }
}
