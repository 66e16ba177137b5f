//! Total FETI: the dual of a torn problem.
//!
//! Notation of the paper: `K` block diagonal stiffness, `B` constraint rows, `R` rigid modes, `G = R'B'`,
//! `F = B K^+ B'`, `P` the projector onto `Ker G`. Four rooms, from the ground up. None knows of quadratic programs; of
//! [`crate::qp`] they take nonnegative least squares, for what contacts can hold:
//!
//! - [`inverse`]: `R` and `K^+` of each subdomain, and which factors are kept;
//! - [`dual`]: `B`, `F`, and inner products of multipliers;
//! - [`coarse`]: `G`, `(G G')^-1`, `P`, and the rigid motions `alpha`;
//! - [`preconditioner`]: approximate inverses of `F`.
//!
//! Where subdomains form clusters, `R` and `K^+` are those of the clusters ([`inverse::hybrid`]).

pub mod coarse;
pub mod dual;
pub mod inverse;
pub mod preconditioner;

/// A torn vector: for each own subdomain its local unknowns.
pub type Torn = Vec<Vec<f64>>;
