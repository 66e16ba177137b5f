//! The dual operator `F = B K^+ B'` and the space of the multipliers that it acts on.
//!
//! [`gather`] applies `B` and `B'`, [`operator`] applies `F`, [`space`] has inner products and sums over all ranks, [`gram`] and
//! [`coupling`] solve with parts of `B B'`. Unknowns that supports hold still leave `K` ([`supported`], [`held`]).

pub mod coupling;
pub mod gather;
pub mod gram;
pub mod held;
pub mod operator;
pub mod space;
pub mod supported;
