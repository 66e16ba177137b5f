//! Energies from the beginning of a history: what comes in, what is stored, what is lost.
//!
//! With forces `f`, reactions, stresses and multipliers at both ends of an increment, loads and supports do the work on the left:
//!
//! ```text
//! 1/2 (f_0 + f_1)'du + of supports and obstacles  =  stored + plastic + friction + of closing
//! plastic    1/2 (s_0 + s_1) : (de - C^-1 ds)      friction  l_t'ds, at the end of the increment
//! closing    1/2 (l_0 + l_1)'dg - friction         what the size of the increment makes of contact
//! ```
//!
//! Both sides come from different numbers: loads and reactions from nodes, stored and plastic work from elements, the rest from
//! contact rows. They agree where the ends are in equilibrium. The work of closing vanishes with the size of increments.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::iterate::Iterate;
use super::iteration::Newton;
use super::problem::{SIGNIFICANT, State, TornProblem};
use super::residuals::relative;
use super::snapshot::Reached;
use crate::assembly::internal;
use crate::constraint::Kind;
use crate::feti::Torn;
use crate::model::history::Conditions;
use crate::record::state::Energies as Parts;
use crate::vector::dot;

/// Energies since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// What they are.
    pub parts: Parts,
    /// Sum of the sizes of all these parts; at least a share of the terms that energies are sums of, where bodies move without strain.
    gross: f64,
}

/// One end of an increment.
struct End<'e> {
    u: &'e Torn,
    state: &'e State,
    lambda: &'e [f64],
    loads: &'e Torn,
    rhs: &'e [f64],
}

impl Energies {
    /// What is missing, relative to the sizes of all parts.
    pub fn imbalance(&self) -> f64 {
        let Parts { external, stored, plastic, friction, closing } = self.parts;
        relative((external - stored - plastic - friction - closing).abs(), self.gross)
    }

    /// This and the parts of another increment; relative errors refer to the `least` size or more.
    fn and(&self, of: Parts, least: f64) -> Self {
        let sizes = [of.external, of.stored, of.plastic, of.friction, of.closing].map(f64::abs);
        let parts = Parts {
            external: self.parts.external + of.external,
            stored: self.parts.stored + of.stored,
            plastic: self.parts.plastic + of.plastic,
            friction: self.parts.friction + of.friction,
            closing: self.parts.closing + of.closing,
        };
        Self { parts, gross: (self.gross + sizes.iter().sum::<f64>()).max(least) }
    }
}

impl Newton<'_> {
    /// Those up to the iterate, where this is an equilibrium. Where loads follow the work they do it is one increment from rest.
    /// Collective.
    pub(super) fn energies(&self) -> Energies {
        let (problem, Iterate { u, state, lambda, .. }) = (&self.problem, &self.iterate);
        let reached = self.reached.as_ref().filter(|_| self.control.is_none());
        let start = || Reached {
            u: self.origin.clone().unwrap_or_else(|| problem.gather.zeros()),
            lambda: vec![0.0; problem.gather.rows()],
        };
        let from = reached.map_or_else(|| Cow::Owned(start()), Cow::Borrowed);
        let Conditions { mut loads, rhs, .. } = self.path.before(self.attempt);
        let state_before = problem.evaluate(&from.u);
        if reached.is_none() {
            // What holds an earlier run where it ended is let go.
            loads.clone_from(&state_before.forces);
        }
        let begin = End { u: &from.u, state: &state_before, lambda: &from.lambda, loads: &loads, rhs: &rhs };
        let end = End { u, state, lambda, loads: &problem.loads, rhs: &problem.rhs };
        problem.committed.energies.and(problem.increment_of_work(&begin, &end), SIGNIFICANT * state.terms.energy)
    }
}

impl TornProblem<'_> {
    /// The parts of the work of an increment. Three collectives and some neighbour exchanges.
    fn increment_of_work(&self, begin: &End, end: &End) -> Parts {
        // Loads by nodes; stored and plastic work by elements.
        let mut change = end.u.clone();
        change.iter_mut().flatten().zip(begin.u.iter().flatten()).for_each(|(u, before)| *u -= before);
        let mut partial = Vec::with_capacity(3 * change.len());
        for (own, region) in self.regions().iter().enumerate() {
            let of_loads = dot(&begin.loads[own], &change[own]) + dot(&end.loads[own], &change[own]);
            let [stored, plastic] = internal::work(region, [&begin.u[own], &end.u[own]]);
            partial.extend([0.5 * of_loads, stored, plastic]);
        }
        let sums = self.space.sum(&partial, 3);

        // Supports and contact by rows: forces at both ends, and how far they move beside what moves by itself.
        let mut moved = vec![0.0; self.gather.rows()];
        self.gather.apply(&change, &mut moved);
        let supports =
            [begin, end].map(|at| self.along(&self.off_balance(at), |kind| matches!(kind, Kind::Support { .. })));
        let contacts = [begin, end].map(|at| self.of_contact(at.lambda));
        let mean = |[a, b]: &[Vec<f64>; 2]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect() };
        let (supports, pressed) = (mean(&supports), mean(&contacts));
        let given: Vec<f64> = end.rhs.iter().zip(begin.rhs).map(|(c, before)| c - before).collect();
        let beside: Vec<f64> = moved.iter().zip(&given).map(|(moved, given)| moved - given).collect();
        let mut rubs = vec![0.0; self.gather.rows()];
        let tangents = self.constraints.sliders.iter().flat_map(|slider| &slider.tangents);
        tangents.for_each(|tangent| rubs[tangent.row] = end.lambda[tangent.row]);
        let pairs = [(&supports[..], &moved[..]), (&pressed, &given), (&pressed, &beside), (&rubs, &beside)];
        let [held, dragged, contact, friction] = self.space.dots(&pairs)[..] else { unreachable!("four products") };
        Parts {
            external: sums[0] - held - dragged,
            stored: sums[1],
            plastic: sums[2],
            friction,
            closing: contact - friction,
        }
    }

    /// `f - F(u) - B_I'lambda_I` at an end.
    fn off_balance(&self, at: &End) -> Torn {
        let mut left = at.loads.clone();
        left.iter_mut().flatten().zip(at.state.forces.iter().flatten()).for_each(|(f, internal)| *f -= internal);
        self.gather.add_transpose(-1.0, &self.of_contact(at.lambda), &mut left);
        left
    }
}
