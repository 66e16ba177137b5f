//! `f`: consistent nodal forces of dead loads. Linear shape functions share a constant load out evenly: a third of each
//! triangle's force to its corners, a quarter of each tetrahedron's.

use super::geometry;
use crate::decomposition::Subdomain;
use crate::mesh::surface;

/// A uniform load on a named surface or in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// Force per area, global axes.
    Traction {
        /// Index of the named surface.
        surface: usize,
        /// The traction.
        value: [f64; 3],
    },
    /// Force per area against the outward normal of each triangle.
    Pressure {
        /// Index of the named surface.
        surface: usize,
        /// The pressure.
        value: f64,
    },
    /// Force per volume, global axes.
    BodyForce {
        /// Index of the body.
        body: usize,
        /// The force.
        value: [f64; 3],
    },
}

impl Load {
    /// The same load, so many times as large.
    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::Traction { surface, value } => Self::Traction { surface, value: value.map(|v| factor * v) },
            Self::Pressure { surface, value } => Self::Pressure { surface, value: factor * value },
            Self::BodyForce { body, value } => Self::BodyForce { body, value: value.map(|v| factor * v) },
        }
    }
}

/// Adds the nodal forces of all loads to `forces`. Triangles and tetrahedra belong to one subdomain, so nothing counts
/// twice.
pub fn add(subdomain: &Subdomain, loads: &[Load], forces: &mut [f64]) {
    let mut give = |node: u32, share: [f64; 3]| (0..3).for_each(|a| forces[3 * node as usize + a] += share[a]);
    for facet in &subdomain.facets {
        let corners = facet.nodes.map(|n| subdomain.points[n as usize]);
        for load in loads {
            let share = match load {
                Load::Traction { surface, value } if *surface == facet.surface => {
                    surface::corner_force(&corners, value)
                }
                Load::Pressure { surface, value } if *surface == facet.surface => {
                    surface::area_vector(&corners).map(|n| -value * n / 3.0)
                }
                _ => continue,
            };
            facet.nodes.iter().for_each(|&node| give(node, share));
        }
    }
    for load in loads {
        let Load::BodyForce { body, value } = load else { continue };
        for nodes in subdomain.elements.iter().filter(|_| *body == subdomain.body) {
            let quarter = geometry(&subdomain.points, nodes).volume / 4.0;
            nodes.iter().for_each(|&node| give(node, value.map(|v| quarter * v)));
        }
    }
}
