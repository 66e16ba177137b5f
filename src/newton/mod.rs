//! Semismooth Newton for `min J(v) = Psi(v) - f'v` over the admissible displacements (paper, section 3).
//!
//! `J` is convex and every iterate is made feasible, so the step of the quadratic model is a descent direction and the
//! method, damped by `J`, converges from anywhere; the direction of plastic flow is an unknown of its own
//! ([`crate::assembly::flow`]), so that steps are seldom damped. [`Newton`] is the whole history of loads as a value: its caller
//! steps it and advances it from increment to increment ([`path`]).
//!
//! [`problem`] is what is minimised, [`committed`] what former increments left behind. A [`step`] takes tangents to FETI and the
//! [`program`] of a step to its QP solver ([`dual`]), as exactly as [`forcing`] says; [`damping`] finds its length. [`residuals`],
//! [`balance`], [`energies`], [`certificate`] and [`errors`] tell how good an iterate is.

pub mod balance;
pub mod certificate;
mod commit;
pub mod committed;
pub mod control;
pub mod damping;
pub mod dual;
pub mod energies;
pub mod errors;
pub mod forcing;
pub mod friction;
pub mod iterate;
pub mod iteration;
pub mod limit;
pub mod outcome;
pub mod path;
pub mod problem;
pub mod program;
mod radii;
pub mod residuals;
pub mod response;
pub mod snapshot;
pub mod solution;
pub mod step;

pub use energies::Energies;
pub use iterate::Iterate;
pub use iteration::{Newton, Settings};
pub use limit::Bounds;
pub use outcome::{Next, Outcome, StepRecord};
pub use problem::TornProblem;
pub use program::ProgramSettings;
pub use snapshot::{Begin, Snapshot, Start};
pub use step::{SolverState, StepSolver};

#[cfg(test)]
mod tests;
