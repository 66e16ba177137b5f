//! Forces and moments on each body, whose sums must be zero.
//!
//! Loads, reactions of supports and contact forces on a body add up to zero, and so do their moments about the mean of its
//! nodes, whatever the body is made of. They are summed from nodal forces: loads `f`, reactions (the part of
//! `f - F(u) - B_I'lambda_I` along support rows, reversed) and contact forces `-B_I'lambda_I`. Where a support fixes a
//! component of a contact's condition, that part of the contact force acts on the support and is in neither sum.

use super::problem::{SIGNIFICANT, State, TornProblem};
use super::residuals::larger;
use crate::constraint::Kind;
use crate::feti::Torn;
use crate::record::state::Resultant;
use crate::vector::length;

/// What acts on a body; moments are about the mean of its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyBalance {
    /// Loads.
    pub loads: Resultant,
    /// Reactions of supports.
    pub supports: Resultant,
    /// Contact forces.
    pub contacts: Resultant,
    /// Sum of the sizes of all these nodal forces.
    pub gross: f64,
    /// Root of the mean squared distance of the nodes from their mean (length).
    pub radius: f64,
}

impl BodyBalance {
    /// What is left of all that acts on the body.
    pub fn unbalanced(&self) -> Resultant {
        self.loads.plus(self.supports).plus(self.contacts)
    }
}

/// The largest unbalanced force of a body, or moment over its radius, over the largest gross force of a body. That is taken
/// as `least` (force) if it is smaller.
pub fn relative(bodies: &[BodyBalance], least: f64) -> f64 {
    let scale = bodies.iter().fold(least, |largest, body| largest.max(body.gross));
    let of_body = |body: &BodyBalance| {
        let left = body.unbalanced();
        [length(left.force), length(left.moment) / body.radius]
    };
    let worst = bodies.iter().flat_map(of_body).fold(0.0, larger);
    if worst == 0.0 { 0.0 } else { worst / scale }
}

/// Numbers of a body in the sums: three resultants, the size of all forces, the square of all arms.
const NUMBERS: usize = 20;

impl TornProblem<'_> {
    /// What acts on each of so many bodies, and the largest imbalance, relative. Two collectives and a neighbour exchange.
    pub fn balance(&self, state: &State, lambda: &[f64], bodies: usize) -> (Vec<BodyBalance>, f64) {
        let contacts = self.against(&self.of_contact(lambda));
        let of_supports = |kind| matches!(kind, Kind::Support { .. });
        let supports = self.against(&self.along(&self.unbalanced(state, lambda), of_supports));
        let centres = self.centres(bodies);
        let mut partial = vec![0.0; NUMBERS * bodies * self.subdomains.len()];
        for (own, sums) in partial.chunks_exact_mut((NUMBERS * bodies).max(1)).enumerate() {
            let subdomain = &self.subdomains[own];
            let sums = &mut sums[NUMBERS * subdomain.body..][..NUMBERS];
            let mut resultants = [Resultant::default(); 3];
            let weights = self.weights(own);
            for (node, point) in subdomain.points.iter().enumerate() {
                let arm = std::array::from_fn(|a| point[a] - centres[subdomain.body].1[a]);
                for (resultant, forces) in resultants.iter_mut().zip([&self.loads, &supports, &contacts]) {
                    let force = &forces[own][3 * node..][..3];
                    resultant.add(force, arm);
                    sums[18] += force.iter().map(|f| f * f).sum::<f64>().sqrt();
                }
                sums[19] += weights[node] * arm.iter().map(|a| a * a).sum::<f64>();
            }
            for (numbers, Resultant { force, moment }) in sums.chunks_exact_mut(6).zip(resultants) {
                numbers.copy_from_slice([force, moment].as_flattened());
            }
        }
        let sums = self.space.sum(&partial, NUMBERS * bodies);
        let of_body = |(numbers, (nodes, _)): (&[f64], &(f64, [f64; 3]))| BodyBalance {
            loads: Resultant::of(&numbers[..6]),
            supports: Resultant::of(&numbers[6..12]),
            contacts: Resultant::of(&numbers[12..18]),
            gross: numbers[18],
            radius: (numbers[19] / nodes).sqrt(),
        };
        let found: Vec<BodyBalance> = sums.chunks_exact(NUMBERS).zip(&centres).map(of_body).collect();
        // As for residuals: after an unloading, relative to the forces before.
        let before = self.committed.sizes.force_square.sqrt();
        let relative = relative(&found, before.max(SIGNIFICANT * state.terms.force_squares.sqrt()));
        (found, relative)
    }

    /// `-B'` of values of the rows.
    fn against(&self, rows: &[f64]) -> Torn {
        let mut forces = self.gather.zeros();
        self.gather.add_transpose(-1.0, rows, &mut forces);
        forces
    }

    /// One over the number of copies of each node of an own subdomain.
    fn weights(&self, own: usize) -> Vec<f64> {
        let mut weights = vec![1.0; self.subdomains[own].points.len()];
        self.constraints.copies[own].iter().for_each(|&(node, count)| weights[node as usize] = 1.0 / f64::from(count));
        weights
    }

    /// Number of nodes of each body, and their mean.
    fn centres(&self, bodies: usize) -> Vec<(f64, [f64; 3])> {
        let mut partial = vec![0.0; 4 * bodies * self.subdomains.len()];
        for (own, sums) in partial.chunks_exact_mut((4 * bodies).max(1)).enumerate() {
            let subdomain = &self.subdomains[own];
            let sums = &mut sums[4 * subdomain.body..][..4];
            for (point, weight) in subdomain.points.iter().zip(self.weights(own)) {
                (0..3).for_each(|a| sums[a] += weight * point[a]);
                sums[3] += weight;
            }
        }
        let sums = self.space.sum(&partial, 4 * bodies);
        sums.as_chunks::<4>().0.iter().map(|&[x, y, z, nodes]| (nodes, [x, y, z].map(|sum| sum / nodes))).collect()
    }
}

#[cfg(test)]
mod tests;
