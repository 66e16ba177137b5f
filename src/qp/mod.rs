//! Quadratic programming with bounds and a projector: pure optimisation, no meshes, no FETI.

pub mod quadratic;
