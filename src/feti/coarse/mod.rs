//! The coarse problem `G G' a = r` with `G = R'B'`, and what follows from it.
//!
//! [`problem`] sets it up and solves it with a sparse factor ([`factor`]), [`projector`] is `P = I - G'(G G')^-1 G`, [`face`] its
//! restriction to the rows that hold. [`recover`] has `e = R'f` and `R alpha`, [`motion`] the `alpha` of a solution. [`bodies`] are
//! motions of whole bodies, and [`equilibrium`] tells whether anything holds these.

pub mod bodies;
pub mod equilibrium;
pub mod face;
pub mod factor;
pub mod motion;
pub mod problem;
pub mod projector;
pub mod recover;

pub use problem::{Coarse, Floating};

#[cfg(test)]
mod tests;
