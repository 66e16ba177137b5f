//! What the tests of the solvers share: small dense problems whose solutions are known.

pub mod dense;
pub mod torn;
