//! What converged increments leave: the history of the material, and the largest sizes so far.

use serde::{Deserialize, Serialize};

use super::problem::{State, TornProblem};
use crate::assembly::internal;
use crate::feti::Torn;
use crate::material::History;

/// The state that an increment starts from; by default that of rest.
#[derive(Clone, Default)]
pub struct Committed {
    /// History of each integration point of each own subdomain; none where nothing ever yielded.
    pub histories: Vec<Vec<History>>,
    /// Least sizes that relative errors refer to.
    pub sizes: Sizes,
}

/// The largest values of the increments so far. After an unloading errors are of the size of the values before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sizes {
    /// `|u|_e` (root of energy).
    pub elastic_norm: f64,
    /// Squared norm of the nodal forces, applied or internal (force squared).
    pub force_square: f64,
    /// Largest nodal displacement (length).
    pub displacement: f64,
    /// Largest contact force (force).
    pub contact_force: f64,
}

impl Sizes {
    fn larger(self, other: Self) -> Self {
        Self {
            elastic_norm: self.elastic_norm.max(other.elastic_norm),
            force_square: self.force_square.max(other.force_square),
            displacement: self.displacement.max(other.displacement),
            contact_force: self.contact_force.max(other.contact_force),
        }
    }
}

impl Committed {
    /// History of the elements of an own subdomain; empty if nothing ever yielded there.
    pub fn history(&self, own: usize) -> &[History] {
        self.histories.get(own).map_or(&[], Vec::as_slice)
    }
}

impl TornProblem<'_> {
    /// Commits a displacement, where the problem is in this `state`, with its multipliers: from now on the problem is the next
    /// increment. Collective.
    pub fn commit(&mut self, u: &Torn, state: &State, lambda: &[f64]) {
        let sizes = Sizes { elastic_norm: self.elastic_norm(u), ..self.measure(u, state, lambda).1 };
        self.committed.sizes = self.committed.sizes.larger(sizes);
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
