//! Residuals of the glued, undecomposed problem, computed from the displacement and the contact forces alone.
//!
//! With `v = f - F(u) - B_I'lambda_I` and the copies of each node added up, equilibrium asks that what is left at the
//! unsupported components is zero. Nothing of the dual solver's recurrences is used.

use serde::{Deserialize, Serialize};

use super::committed::Sizes;
use super::problem::{SIGNIFICANT, State, TornProblem};
use crate::constraint::Kind;
use crate::constraint::law::Law;
use crate::feti::Torn;
use crate::work;

/// Relative residuals; all are zero for the exact solution. The sizes that they refer to are never less than the largest ones
/// of former increments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// Euclidean norm of the unbalanced nodal forces over that of the applied or internal nodal forces (or a hundred
    /// millionth of the terms that these are sums of, where bodies move without strain and none yields).
    pub equilibrium: f64,
    /// Largest distance of a copy from its node's mean, or of a supported node from its prescribed value, over the
    /// largest displacement.
    pub gluing: f64,
    /// Deepest penetration over the largest displacement.
    pub gap: f64,
    /// Largest product of contact force and gap over largest contact force times largest displacement.
    pub complementarity: f64,
    /// How far contact forces are from the law of friction ([`super::friction`]); zero without friction.
    #[serde(default)]
    pub friction: f64,
}

impl Residuals {
    /// The largest of them; NaN if any is.
    pub fn largest(&self) -> f64 {
        [self.equilibrium, self.gluing, self.gap, self.complementarity, self.friction].into_iter().fold(0.0, larger)
    }
}

/// `a / b`; zero if `a` is, whatever `b`.
pub(super) fn relative(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// The larger one; NaN if any is.
pub fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}

impl TornProblem<'_> {
    /// Residuals at a displacement with the contact part of the multipliers. Collective.
    pub fn residuals(&self, u: &Torn, state: &State, lambda: &[f64]) -> Residuals {
        self.measure(u, state, lambda).0
    }

    /// The residuals, and the sizes of this solution except its elastic norm. Collective.
    pub(super) fn measure(&self, u: &Torn, state: &State, lambda: &[f64]) -> (Residuals, Sizes) {
        // Forces at the unsupported components of the glued problem: unbalanced, applied, internal.
        let unbalanced = self.unbalanced(state, lambda);
        let mut free = unbalanced.clone();
        self.remove(&mut free, |kind| !kind.is_contact());
        let mut applied = self.loads.clone();
        self.remove(&mut applied, |kind| kind == Kind::Gluing);
        let mut internal = state.forces.clone();
        self.remove(&mut internal, |kind| kind == Kind::Gluing);
        let squares = self.glued_squares([&free, &applied, &internal]);

        // Only where nothing yields may all forces be round-off: bodies that move without strain.
        let terms = if state.plastic == 0 { SIGNIFICANT * state.terms.force_squares.sqrt() } else { 0.0 };

        // The largest distance between copies, penetration, product of force and gap, contact force, and displacement.
        let slack = self.slack(u);
        let mut worst = [0.0_f64; 5];
        for ((row, &s), &force) in self.constraints.rows.iter().zip(&slack).zip(lambda) {
            let (gap, force) = (s / row.scale, row.scale * force);
            let found = match row.law() {
                Law::Equality => [s.abs() / row.length, 0.0, 0.0, 0.0, 0.0],
                Law::Friction => [0.0; 5],
                law => [0.0, law.violation(gap).abs(), (gap * force).abs(), force.abs(), 0.0],
            };
            for (w, f) in worst.iter_mut().zip(found) {
                *w = if f.is_nan() { f } else { w.max(f) };
            }
        }
        worst[4] = largest_displacement(u);
        let [glue, gap, product, contact_force, displacement] = worst.map(|w| self.space.maximum(w));
        let force_square = squares[1].max(squares[2]);
        let before = &self.committed.sizes;
        let size = larger(before.displacement, displacement);
        let pressed = larger(before.contact_force, contact_force);
        let residuals = Residuals {
            equilibrium: relative(squares[0].sqrt(), force_square.max(before.force_square).sqrt().max(terms)),
            gluing: relative(glue, size),
            gap: relative(gap, size),
            complementarity: relative(product, pressed * size),
            friction: self.friction_residual(&slack, lambda, (pressed, size)),
        };
        let force_square = force_square.max(terms * terms);
        (residuals, Sizes { elastic_norm: 0.0, force_square, displacement, contact_force })
    }

    /// `f - F(u) - B_I'lambda_I`, torn: after adding up copies, minus the reactions.
    pub(super) fn unbalanced(&self, state: &State, lambda: &[f64]) -> Torn {
        let mut v = self.unbalance(state);
        self.gather.add_transpose(-1.0, &self.of_contact(lambda), &mut v);
        v
    }

    /// `lambda_I`: the multipliers of contact, zeros in place of the others.
    pub(super) fn of_contact(&self, lambda: &[f64]) -> Vec<f64> {
        let rows = self.constraints.rows.iter().zip(lambda);
        rows.map(|(row, &l)| if row.kind.is_contact() { l } else { 0.0 }).collect()
    }

    /// Force of each support on the bodies, `[support][component]`. Collective.
    pub fn reactions(&self, state: &State, lambda: &[f64], supports: usize) -> Vec<[f64; 3]> {
        let mut rows = vec![0.0; self.gather.rows()];
        self.gather.apply(&self.unbalanced(state, lambda), &mut rows);
        let mut partial = vec![0.0; 3 * supports * self.space.owned().len()];
        for (sum, owned) in partial.chunks_exact_mut((3 * supports).max(1)).zip(self.space.owned()) {
            for row in owned.clone() {
                let (value, force, row) = (rows[row], lambda[row], &self.constraints.rows[row]);
                if let Kind::Support { support, axis } = row.kind {
                    sum[3 * support + axis] -= value / row.scale;
                }
                for fixed in &row.fixed {
                    sum[3 * fixed.support + fixed.axis] += row.scale * force * fixed.weight;
                }
            }
        }
        let sum = self.space.sum(&partial, 3 * supports);
        sum.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect()
    }

    /// Removes from a torn vector its part along the rows of some kinds. Without the part along gluing rows all copies have
    /// the mean; without the part along support rows as well, supported components are zero.
    fn remove(&self, v: &mut Torn, kinds: impl Fn(Kind) -> bool) {
        self.gather.add_transpose(-1.0, &self.along(v, kinds), v);
    }

    /// Coefficients `x` of a torn vector along the rows of some kinds, zero elsewhere: `B'x` is that part of the vector.
    pub(super) fn along(&self, v: &Torn, kinds: impl Fn(Kind) -> bool) -> Vec<f64> {
        let mut rows = vec![0.0; self.gather.rows()];
        self.gather.apply(v, &mut rows);
        for (value, row) in rows.iter_mut().zip(&self.constraints.rows) {
            *value = if kinds(row.kind) { *value / (row.length * row.length) } else { 0.0 };
        }
        rows
    }

    /// Squared norms over the nodes of the undecomposed mesh, of torn vectors whose copies all have the mean `x`. The sum over
    /// the `m` copies of a node is `m x`: its square is `m` times the squares of the copies.
    fn glued_squares<const N: usize>(&self, vectors: [&Torn; N]) -> Vec<f64> {
        let mut partial = Vec::with_capacity(N * self.subdomains.len());
        for (own, copies) in self.constraints.copies.iter().enumerate() {
            for vector in vectors {
                work::each(vector[own].len(), 2, size_of::<f64>());
                let mut square = vector[own].iter().map(|x| x * x).sum::<f64>();
                for &(node, count) in copies {
                    let at = 3 * node as usize;
                    let local: f64 = vector[own][at..at + 3].iter().map(|x| x * x).sum();
                    square += (f64::from(count) - 1.0) * local;
                }
                partial.push(square);
            }
        }
        self.space.sum(&partial, N)
    }
}

/// Largest Euclidean norm of a nodal displacement on this rank; NaN if any is.
pub fn largest_displacement(u: &Torn) -> f64 {
    u.iter()
        .flat_map(|local| local.chunks_exact(3))
        .map(|u| (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt())
        .fold(0.0, larger)
}
