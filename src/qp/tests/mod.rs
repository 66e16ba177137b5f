//! What the tests of the solvers share: small dense problems whose solutions are known.

mod bits;
pub mod dense;
mod discs;
mod ranks;
pub mod torn;
