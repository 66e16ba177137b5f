//! Meshes: where nodes are and which of them make a cell, an element, a surface.
//!
//! [`brick`] numbers and places a structured body without storing it, [`face`] names its six faces. [`gmsh`] reads files
//! into [`tets`], with cells [`split`] into tetrahedra and put in [`placement`]. [`faces`] tells which elements are
//! neighbours, [`surface`] integrates over boundary triangles, [`quality`] counts elements that no computation could use.
//! No displacements, no material.

pub mod brick;
pub mod face;
pub mod faces;
pub mod gmsh;
pub mod placement;
pub mod quality;
pub mod split;
pub mod surface;
pub mod tets;

pub use brick::{Block, Brick};
pub use face::Face;
pub use tets::TetMesh;
