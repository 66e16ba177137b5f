//! What holds together in groups of subdomains ([`Clusters`](crate::decomposition::Clusters)), level by level.
//!
//! [`tree`] carries numbers between subdomains and their groups, which ranks may share, [`halo`] between neighbouring subdomains.
//! [`motions`] has the rigid modes of groups. [`gluing`] is `G` of the equalities, kept as [`levers`], [`stiffness`] its products, and
//! [`balance`] balances the members of each group by them.

pub mod balance;
pub mod gluing;
pub mod halo;
pub mod levers;
pub mod motions;
pub mod stiffness;
pub mod tree;

pub use balance::Balance;
pub use halo::Halo;
pub use motions::Motions;
pub use tree::Tree;

#[cfg(test)]
mod tests;
