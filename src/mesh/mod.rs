//! Meshes: where nodes are and which of them make a cell, an element, a surface.
//!
//! [`brick`] numbers and places a structured body without storing it, [`face`] names its six faces; [`mapped`] bodies are
//! structured too, but curved or of unequal cells, and stored. [`gmsh`] reads files into a [`solid`] mesh, with cells
//! [`split`] into tetrahedra where these are wanted, and put in [`placement`]. Each rank has a [`portion`] of what is stored:
//! pieces of a [`curve`], as many as there are ranks, or as [`wholes`] have parts. [`elements`] are known by their nodes;
//! [`faces`] tells which are neighbours, [`joints`] also on other ranks, [`marked`] brings names to faces, [`form`] finds what is
//! round. [`surface`] integrates over boundary faces, [`quality`] counts elements that no computation could use, [`whole`] finds
//! what only looks joined ([`boxes`] of what is [`near`]) and the pieces of a mesh by their [`connectivity`]. No displacements, no material.

pub mod bisection;
pub mod boxes;
pub mod brick;
pub mod connectivity;
pub mod curve;
pub mod elements;
pub mod face;
pub mod faces;
pub mod form;
pub mod gmsh;
pub mod joints;
pub mod mapped;
pub mod marked;
pub mod near;
pub mod placement;
pub mod portion;
pub mod quality;
pub mod solid;
pub mod split;
pub mod surface;
pub mod whole;
pub mod wholes;

pub use brick::{Block, Brick};
pub use elements::Elements;
pub use face::Face;
pub use mapped::Mapped;
pub use portion::Portion;
pub use solid::SolidMesh;
