//! `f`: consistent nodal forces of dead loads, shared out by the shape functions of each face and element.

use super::visit::{Visited, Visitor, for_each_element};
use crate::decomposition::Subdomain;
use crate::element::sample;
use crate::mesh::surface;

/// A load on a named surface or in a body.
#[derive(Clone, Copy, Debug)]
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
    /// Force per volume that varies from place to place, global axes. Scenes have none: it is for manufactured solutions.
    Field {
        /// Index of the body.
        body: usize,
        /// The force at a place.
        value: fn([f64; 3]) -> [f64; 3],
        /// Its factor.
        factor: f64,
    },
}

impl Load {
    /// The same load, so many times as large.
    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::Traction { surface, value } => Self::Traction { surface, value: value.map(|v| factor * v) },
            Self::Pressure { surface, value } => Self::Pressure { surface, value: factor * value },
            Self::BodyForce { body, value } => Self::BodyForce { body, value: value.map(|v| factor * v) },
            Self::Field { body, value, factor: own } => Self::Field { body, value, factor: factor * own },
        }
    }
}

/// Adds the nodal forces of all loads to `forces`. Faces and elements belong to one subdomain, so nothing counts
/// twice.
pub fn add(subdomain: &Subdomain, loads: &[Load], forces: &mut [f64]) {
    let mut give = |node: u32, share: [f64; 3]| (0..3).for_each(|a| forces[3 * node as usize + a] += share[a]);
    for facet in &subdomain.facets {
        let face: Vec<[f64; 3]> = facet.nodes.iter().map(|&n| subdomain.points[n as usize]).collect();
        for load in loads {
            match load {
                Load::Traction { surface, value } if *surface == facet.surface => {
                    let areas = surface::areas(&face);
                    facet.nodes.iter().zip(areas).for_each(|(&node, area)| give(node, value.map(|v| area * v)));
                }
                Load::Pressure { surface, value } if *surface == facet.surface => {
                    let shares = surface::shares(&face);
                    facet.nodes.iter().zip(shares).for_each(|(&node, share)| give(node, share.map(|n| -value * n)));
                }
                _ => {}
            }
        }
    }
    for load in loads {
        match load {
            Load::BodyForce { body, value } if *body == subdomain.body => {
                let give = |node: u32, volume: f64| give(node, value.map(|v| volume * v));
                for_each_element(&subdomain.elements, &subdomain.shape, &mut Volumes(give));
            }
            Load::Field { body, value, factor } if *body == subdomain.body => {
                share_field(subdomain, |place| value(place).map(|v| factor * v), &mut give);
            }
            _ => {}
        }
    }
}

/// Tells the integral over each element of a field times its nodes' shape functions.
fn share_field(subdomain: &Subdomain, field: impl Fn([f64; 3]) -> [f64; 3], give: &mut impl FnMut(u32, [f64; 3])) {
    for nodes in &subdomain.elements {
        let places: Vec<[f64; 3]> = nodes.iter().map(|&n| subdomain.points[n as usize]).collect();
        for sample in sample::samples(subdomain.elements.kind(), &places) {
            let force = field(sample.value(&places)).map(|f| sample.weight * f);
            nodes.iter().zip(&sample.values).for_each(|(&node, value)| give(node, force.map(|f| value * f)));
        }
    }
}

/// Tells the integral over each element of its nodes' shape functions.
struct Volumes<F>(F);

impl<F: FnMut(u32, f64)> Visitor for Volumes<F> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        for (point, values) in element.points.iter().zip(element.values) {
            element.nodes.iter().zip(values).for_each(|(&node, value)| (self.0)(node, point.weight * value));
        }
    }
}
