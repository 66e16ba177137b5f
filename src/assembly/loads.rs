//! `f`: consistent nodal forces of tractions, a third of each triangle's force to each corner.

use crate::decomposition::Subdomain;
use crate::mesh::surface;

/// A traction on a named surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traction {
    /// Index of the named surface.
    pub surface: usize,
    /// Force per area, global axes.
    pub value: [f64; 3],
}

/// Adds the nodal forces of all tractions to `forces`. A triangle belongs to one subdomain, so nothing counts twice.
pub fn add_tractions(subdomain: &Subdomain, tractions: &[Traction], forces: &mut [f64]) {
    for facet in &subdomain.facets {
        let corners = facet.nodes.map(|n| subdomain.points[n as usize]);
        for traction in tractions.iter().filter(|t| t.surface == facet.surface) {
            let share = surface::corner_force(&corners, &traction.value);
            for &node in &facet.nodes {
                (0..3).for_each(|a| forces[3 * node as usize + a] += share[a]);
            }
        }
    }
}
