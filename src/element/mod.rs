//! Finite elements: what is asked of one ([`facts`]), which there are ([`kind`]), and strains, forces and stiffness at
//! their integration points ([`point`]); finer points for what varies inside of one ([`sample`]).
//!
//! An element is one file. Elements take tensors and know no material.

pub mod cell;
pub mod facts;
pub mod hex8;
pub mod kind;
mod map;
pub mod point;
pub mod sample;
pub mod tet10;
pub mod tet4;

pub use cell::Cell;
pub use facts::{Element, Gmsh};
pub use kind::Kind;
pub(crate) use kind::by_kind;
pub use point::{Nodal, Point};
pub use sample::Sample;

/// An element of smaller shape has no volume, or a negative one: it is lost in the rounding of coordinates.
pub const DEGENERATE: f64 = 1e-13;

#[cfg(test)]
mod tests;
