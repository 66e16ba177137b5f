//! Total FETI: the dual of a torn problem.
//!
//! Notation of the paper: `K` block diagonal stiffness, `B` constraint rows, `R` rigid modes, `G = R'B'`,
//! `F = B K^+ B'`, `P` the projector onto `Ker G`. Each symbol has a file; none knows of optimisation. Where subdomains form
//! clusters, `R` and `K^+` are those of the clusters ([`hybrid`]).

pub mod bodies;
pub mod cholesky;
pub mod coarse;
pub mod coupling;
pub mod deluxe;
pub mod face;
pub mod factor;
pub mod flexibility;
pub mod gather;
pub mod gram;
pub mod hybrid;
pub mod kernel;
pub mod operator;
pub mod ordering;
pub mod preconditioner;
pub mod projector;
pub mod scaling;
pub mod schur;
pub mod space;
pub mod stock;
pub mod submatrix;
mod supernodes;
pub mod supported;

/// A torn vector: for each own subdomain its local unknowns.
pub type Torn = Vec<Vec<f64>>;
