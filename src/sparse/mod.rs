//! Sparse algebra that knows nothing of FETI: patterns of symmetric matrices, orderings, and Cholesky factors.
//!
//! [`pattern`] is what a matrix looks like, [`ordering`] in which order its unknowns are eliminated, [`cholesky`] factorises and
//! solves on `supernodes` of its `number`s, [`submatrix`] does so for some of the unknowns.

pub mod cholesky;
pub mod fronts;
mod number;
pub mod ordering;
pub mod pattern;
pub mod submatrix;
mod supernodes;
