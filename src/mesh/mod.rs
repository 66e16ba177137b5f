//! Meshes: where nodes are and which of them make a cell, an element, a surface.
//!
//! [`brick`] numbers and places a structured body without storing it, [`face`] names its six faces, [`surface`]
//! integrates over boundary triangles, [`quality`] counts elements that no computation could use. No displacements,
//! no material.

pub mod brick;
pub mod face;
pub mod quality;
pub mod surface;

pub use brick::{Block, Brick};
pub use face::Face;
