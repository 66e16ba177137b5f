//! From elements to the torn vectors and matrices: sparsity (once), stiffness, internal forces, loads.
//!
//! Every function works on one subdomain; nothing here communicates.

pub mod internal;
pub mod loads;
pub mod pattern;
pub mod stiffness;

use crate::element::tet4::Tet4;
use crate::material::History;

/// Geometry of an element of a mesh with these points. Cut and mesh were checked before: elements are sound here.
fn geometry(points: &[[f64; 3]], nodes: &[u32; 4]) -> Tet4 {
    Tet4::new(&nodes.map(|n| points[n as usize])).expect("elements of a checked mesh have volume")
}

/// Nodal displacements of an element.
fn displacements(u: &[f64], nodes: &[u32; 4]) -> [f64; 12] {
    std::array::from_fn(|k| u[3 * nodes[k / 3] as usize + k % 3])
}

/// What an element remembers; no histories at all mean that nothing ever yielded.
fn committed(history: &[History], element: usize) -> &History {
    const VIRGIN: &History = &History { plastic_strain: [0.0; 6], kappa: 0.0 };
    history.get(element).unwrap_or(VIRGIN)
}

#[cfg(test)]
mod tests;
