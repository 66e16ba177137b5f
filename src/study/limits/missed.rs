//! The pressure that is missing where the other side enters faces of the slave between their nodes.
//!
//! To push a face of width `h` back by the depth `d` takes a stress of about `s(d / h)`, what the softest material of the contact, as it
//! is at rest, answers to a compression by that strain that keeps the volume: `3 mu d / h`, or what it yields at. Beside the largest
//! pressure `p` of the contact that is the share
//!
//! ```text
//! s(d / h) / (p + s(d / h))
//! ```
//!
//! of all: one where nothing touches. Under rigid balls and cylinders on hexahedra the energy was too small by 0.04, 0.26, 0.45 and
//! 0.66 of itself where it was 0.12, 0.31, 0.57 and 0.67. Tetrahedra are stiffer, and on coarse meshes that makes up for some of it.
//!
//! Obstacles are looked for at places of each face ([`entry`]). Of a surface that meets means over faces its nodes are looked at, where
//! the slave between them is linear from corner to corner; that matters where the slave has the coarser mesh. Depths that are next to
//! nothing beside the strain of the bodies are none: surfaces that touch without pressure are apart by rounding.

use std::collections::HashMap;

use super::{ContactState, Worst, obstacle_factor};
use crate::comm::{Comm, maximum, of_largest};
use crate::contact::entry::{self, Entry};
use crate::contact::{MasterNode, Site};
use crate::material::{Law, Material, Variables};
use crate::model::Discrete;
use crate::model::contacts::{Contacts, Surfaces};
use crate::newton::Newton;
use crate::scene::{Contact, Obstacle, Scene, Sides};
use crate::tensor::von_mises;
use crate::vector::{difference, dot};

/// Depths over widths below this share of the largest strain are none.
const NOTICED: f64 = 0.01;

/// Which contacts are looked at. Planes enter no face whose nodes are outside, nodes that meet nodes have conditions of their own, and
/// distances that are given are not those of the places.
fn looked_at(scene: &Scene, discrete: &Discrete) -> Vec<bool> {
    let of = |(contact, surfaces): (&Contact, &Surfaces)| {
        let may_enter = match &contact.sides {
            Sides::Rigid { obstacle, .. } => !matches!(obstacle, Obstacle::Plane { .. }),
            Sides::Named { .. } | Sides::Either(_) => surfaces.is_mortar,
        };
        may_enter && contact.clearance.is_none()
    };
    scene.contact.values().zip(&discrete.contacts.surfaces).map(of).collect()
}

/// Nodes whose displacements are needed.
pub(super) fn nodes(scene: &Scene, discrete: &Discrete) -> impl Iterator<Item = u64> {
    let looked_at = looked_at(scene, discrete);
    let of_master = |master: &MasterNode| {
        let pairs = master.pairs.iter().filter_map(|(pair, _)| discrete.contacts.pairs.get(*pair));
        pairs.map(|pair| pair.slave).chain([master.node]).collect::<Vec<_>>()
    };
    discrete.contacts.masters.iter().filter(move |master| looked_at[master.contact]).flat_map(of_master)
}

/// A solution, and the displacements of [`nodes`].
pub(super) struct Missed<'a> {
    pub scene: &'a Scene,
    pub discrete: &'a Discrete,
    pub newton: &'a Newton<'a>,
    pub of_nodes: &'a HashMap<u64, [f64; 3]>,
}

impl Missed<'_> {
    /// Adds the largest share of all contacts; `strain` is the largest one of this rank. Collective.
    pub fn add(&self, worst: &mut Worst, comm: &dyn Comm, states: &[ContactState], strain: f64) {
        let &Self { scene, discrete, .. } = self;
        let pairs = &discrete.contacts.pairs;
        let mut most = vec![strain];
        most.resize(1 + scene.contact.len(), 0.0);
        for state in states {
            let of = 1 + pairs[state.pair].contact;
            most[of] = most[of].max(state.pressure(pairs));
        }
        let most = maximum(comm, &most);
        let looked_at = looked_at(scene, discrete);
        for ((number, (name, contact)), pressure) in scene.contact.iter().enumerate().zip(&most[1..]) {
            if !looked_at[number] {
                continue;
            }
            let Worst { value, place: [x, y, z], .. } = match &contact.sides {
                Sides::Rigid { obstacle, .. } => self.in_faces((number, name, contact), obstacle),
                Sides::Named { .. } | Sides::Either(_) => self.at_masters(number, contact),
            };
            let [depth, place @ ..] = of_largest(comm, value, [value, x, y, z]);
            if depth > NOTICED * most[0] {
                let bodies = contact.surfaces().map(|surface| &scene.body[&surface.body]);
                let materials = bodies.flat_map(|body| body.material.names()).map(|name| &scene.material[name]);
                let missing = materials.map(|material| resistance(material, depth)).fold(f64::INFINITY, f64::min);
                worst.add(missing / (missing + pressure), number, || place);
            }
        }
    }

    /// The largest depth of an obstacle over the width of a face.
    fn in_faces(&self, (number, name, contact): (usize, &str, &Contact), obstacle: &Obstacle) -> Worst {
        let mut most = Worst::NONE;
        let factor = obstacle_factor(self.scene, name, self.newton.at());
        let moved = contact.displacement().map(|d| d * factor);
        let slave = self.discrete.contacts.surfaces[number].slave;
        for (subdomain, u) in self.newton.problem().subdomains.iter().zip(&self.newton.iterate().u) {
            for facet in subdomain.facets.iter().filter(|facet| facet.surface == slave) {
                let nodes = || facet.nodes.iter().map(|&node| node as usize);
                let places: Vec<_> = nodes().map(|node| subdomain.points[node]).collect();
                let motions: Vec<_> = nodes().map(|node| difference(u.as_chunks::<3>().0[node], moved)).collect();
                if let Some(Entry { depth, width, place }) = entry::deepest(obstacle, &places, &motions, contact.gap) {
                    most.add(depth / width, number, || place);
                }
            }
        }
        most
    }

    /// The largest depth of a master node in a face of the slave over the width of that.
    fn at_masters(&self, number: usize, contact: &Contact) -> Worst {
        let mut most = Worst::NONE;
        let Contacts { pairs, masters, .. } = &self.discrete.contacts;
        for master in masters.iter().filter(|master| master.contact == number) {
            let of_pair = |&(index, weight): &(usize, f64)| {
                let pair = pairs.get(index)?;
                let motion = difference(self.of_nodes[&master.node], self.of_nodes[&pair.slave]);
                Some((weight * dot(pair.normal, motion), weight, pairs.site(index)))
            };
            let Some(around) = master.pairs.iter().map(of_pair).collect::<Option<Vec<_>>>() else { continue };
            let closed = around.iter().map(|(motion, ..)| motion).sum::<f64>();
            let (_, _, Site { place, facet }) =
                around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("a master node has slave nodes opposite");
            most.add(-(master.distance + contact.gap + closed) / facet, number, || place);
        }
        most
    }
}

/// The stress that a material at rest has where it is compressed so, and its volume is kept.
fn resistance(material: &Material, strain: f64) -> f64 {
    let compression = [-strain, 0.5 * strain, 0.5 * strain, 0.0, 0.0, 0.0];
    von_mises(&material.respond(&compression, &Variables::VIRGIN).stress)
}
