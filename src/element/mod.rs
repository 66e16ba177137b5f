//! Finite elements: shape gradients, strains and nodal forces. Elements take tensors and know no material.

pub mod tet4;

pub use tet4::Tet4;
