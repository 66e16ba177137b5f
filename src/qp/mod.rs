//! Quadratic programming with bounds and a projector: pure optimisation, no meshes, no FETI.
//!
//! The problem is min 1/2 x'A x - x'b over { x >= l, G x = 0 }, known by products with A and with the orthogonal
//! projector P onto the null space of G ([`quadratic`]). A needs to be positive definite on that null space only. Instead of
//! bounds, pairs of entries may have discs that they stay in.
//!
//! - [`smalse`]: bounds and equalities, convergence guaranteed; its inner loop is [`mprgp`] on [`feasible`], the
//!   only one that knows [`discs`];
//! - [`pcpg`]: equalities only, with all search directions kept;
//! - [`active_set`]: guesses the active bounds, solves for equalities, corrects the guess: fast, but without a proof;
//! - [`slides`]: discs in active sets;
//! - [`power`]: estimate of the norm of P A P that the penalty and the step lengths are scaled by.
//!
//! A solver never fails with an error: it ends with an [`Outcome`] and the best it has.

pub mod active_set;
pub mod discs;
pub mod feasible;
pub mod inside;
pub mod mprgp;
pub mod pcpg;
pub mod power;
pub mod quadratic;
pub mod slides;
pub mod smalse;

mod penalty;

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

/// How a solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The tolerance is met.
    Converged,
    /// The allowed products are used up.
    LimitReached,
    /// An inner product was NaN or infinite.
    NotFinite,
    /// The active set does not settle: another solver has to do it.
    Cycled,
    /// A direction without curvature and without a bound: the problem has no minimum, or A is not semidefinite.
    Unbounded,
}

/// What a solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// Updates of the equality multiplier (SMALSE-M).
    pub outer: usize,
    /// Equality problems solved for guessed active sets.
    pub sets: usize,
    /// Conjugate gradient steps.
    pub cg: usize,
    /// Steps that ran into bounds or along circles.
    pub expansions: usize,
    /// Steps that left bounds.
    pub proportionings: usize,
    /// Products with A, the ones for fresh gradients included.
    pub hessian: usize,
    /// Applications of the preconditioner.
    pub preconditioner: usize,
}

impl std::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        self.outer += other.outer;
        self.sets += other.sets;
        self.cg += other.cg;
        self.expansions += other.expansions;
        self.proportionings += other.proportionings;
        self.hessian += other.hessian;
        self.preconditioner += other.preconditioner;
    }
}

/// When to stop: a gradient norm of `max(relative * reference, absolute, drop * first)` is small enough.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Tolerance relative to the reference.
    pub relative: f64,
    /// What the relative tolerance refers to; if absent the first projected gradient.
    pub reference: Option<f64>,
    /// Tolerance in the units of the gradient.
    pub absolute: f64,
    /// The tolerance where the first gradient norm is below it: what there is may be nothing but rounding.
    pub rounding: f64,
    /// Tolerance relative to the gradient norm at the start: to reduce it by this factor is enough. 0 to reach the other
    /// tolerances.
    pub drop: f64,
    /// Products with A that may be spent.
    pub products: usize,
}

impl Limits {
    /// The gradient norm to reach from `first`.
    pub fn target(&self, first: f64) -> f64 {
        let absolute = if self.told(first).is_some() { self.absolute } else { self.rounding };
        (self.relative * self.reference.unwrap_or(first)).max(absolute).max(self.drop * first)
    }

    /// A first gradient norm, unless it may be nothing but rounding.
    pub fn told(&self, first: f64) -> Option<f64> {
        (first > self.rounding).then_some(first)
    }
}
