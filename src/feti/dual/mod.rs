//! The dual operator `F = B K^+ B'` and the space of the multipliers that it acts on.
//!
//! [`gather`] applies `B` and `B'` by the [`slots`] of rows, [`operator`] applies `F`, [`space`] has inner products and sums over all
//! ranks, [`gram`] and [`coupling`] solve with parts of `B B'`, [`blocks`] has sums of `G G'`. [`hybrid`] joins subdomains to clusters, by
//! what [`levels`] has of their groups. [`pinned`] has the supports of unknowns that `K^+` keeps at zero. [`interconnection`] has `B`, inner products and `R`
//! in one piece.

pub mod blocks;
pub mod coupling;
pub mod gather;
pub mod gram;
pub mod hybrid;
pub mod interconnection;
pub mod levels;
pub mod operator;
pub mod pinned;
pub mod slots;
pub mod space;

pub use interconnection::Interconnection;
