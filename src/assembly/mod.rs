//! From elements to the torn vectors and matrices: sparsity (once), stiffness, internal forces, loads.
//!
//! Every function works on one subdomain; nothing here communicates.

pub mod flow;
pub mod gradients;
pub mod internal;
pub mod loads;
pub mod stiffness;
pub mod stress;

use crate::decomposition::Subdomain;
use crate::element::{Nodal, Point};
use crate::material::{History, Material};
use crate::mesh::Elements;

/// A subdomain with the law of its material and the committed history of its integration points, element by element; no histories
/// at all mean that nothing ever yielded.
#[derive(Clone, Copy)]
pub struct Region<'a> {
    /// Its mesh.
    pub subdomain: &'a Subdomain,
    /// Its material.
    pub material: &'a Material,
    /// What its points remember.
    pub history: &'a [History],
}

/// Nodes and integration points of each element; nodes are at `places`. Cut and mesh were checked before: elements are
/// sound here.
#[inline]
fn integrated<'a, const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]> + 'a,
    elements: &'a Elements,
    places: &'a [[f64; 3]],
) -> impl Iterator<Item = (&'a [u32; N], [Point<N>; P])> {
    elements.of::<N>().iter().map(move |nodes| {
        (nodes, points(&nodes.map(|n| places[n as usize])).expect("elements of a checked mesh have volume"))
    })
}

/// Nodal displacements of an element.
#[inline]
fn displacements<const N: usize>(u: &[f64], nodes: &[u32; N]) -> Nodal<N> {
    nodes.map(|n| std::array::from_fn(|i| u[3 * n as usize + i]))
}

/// What an integration point remembers; no histories at all mean that nothing ever yielded.
#[inline]
fn committed(history: &[History], point: usize) -> &History {
    const VIRGIN: &History = &History { plastic_strain: [0.0; 6], kappa: 0.0 };
    history.get(point).unwrap_or(VIRGIN)
}

#[cfg(test)]
pub(crate) mod orders;
#[cfg(test)]
mod tests;
