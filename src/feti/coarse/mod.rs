//! The coarse problem `G G' a = r` with `G = R'B'`, and what follows from it.
//!
//! [`equalities`] and [`contacts`] are `G`, [`problem`] what ranks make of it together. [`base`] has the [`factor`] of the equalities, on which [`face`], the
//! coarse problem of the rows that hold, is built; [`projector`] is `P = I - G'(G G')^-1 G` of all rows. [`recover`] has `e = R'f` and `R alpha`, [`motion`] the
//! `alpha` of a solution. Of rows along which surfaces slide [`sliding`] has what is kept. [`bodies`] are motions of whole bodies,
//! [`cones`] what friction can exert on them, and [`equilibrium`] tells whether anything holds these, by [`nnls`]: whether a
//! force can be made of pushes.

mod base;
pub mod bodies;
mod cones;
mod contacts;
mod equalities;
pub mod equilibrium;
pub mod face;
pub mod factor;
pub mod motion;
mod nnls;
pub mod problem;
pub mod projector;
pub mod recover;
pub mod sliding;

pub use problem::{Coarse, Floating};

#[cfg(test)]
mod tests;
