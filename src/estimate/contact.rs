//! What the conditions of contact add to the error of the energy, element by element.
//!
//! It is the [consistency error](consistency) of each face of the slave, whatever its sign, `COUNTED` of it: pressures that pass from a node
//! to the next make it too large. Where surfaces touch that fit each other it is next to nothing; on coarse meshes of bodies that
//! do not, such as a pin in a wider bore, it is most of the error.

use std::collections::HashMap;

use crate::comm::Comm;
use crate::contact::consistency::{self, State};
use crate::contact::mortar;
use crate::contact::patch::Patch;
use crate::contact::surface::GatheredSurface;
use crate::decomposition::{Decomposition, Subdomain};
use crate::mesh::faces::key;

/// Of what conditions add this share was found in the energy: 0.15 to 0.3 where pressures end within an element or two, on pins in
/// bores and balls in bowls.
const COUNTED: f64 = 0.2;

/// A contact whose conditions are looked at: what a rank has of it.
pub struct Touching {
    slave: Patch,
    /// What is opposite, if conditions are means.
    master: Option<GatheredSurface>,
    /// Whether distances are given in place of those of the meshes.
    are_given: bool,
    /// What corners of quadratic faces get of the functions of middles, where nodes have conditions.
    share: f64,
    /// For each own face its number on the slave, its own subdomain, and the element that it is of.
    faces: Vec<(usize, usize, usize)>,
}

impl Touching {
    /// Of the surfaces with these indices; a master is told where conditions are means. Collective.
    pub fn new(
        comm: &dyn Comm,
        decomposition: &Decomposition,
        (slave, master): (usize, Option<usize>),
        (are_given, share): (bool, f64),
    ) -> Self {
        let slave = Patch::new(comm, decomposition, slave);
        let master = master.map(|surface| {
            let master = Patch::new(comm, decomposition, surface);
            master.near(comm, &mortar::lines(&slave.surface)).into_owned()
        });
        let mut behind: HashMap<usize, HashMap<Vec<u32>, usize>> = HashMap::new();
        let place = |(face, id, facet): (usize, usize, usize)| {
            let own = decomposition.own_index(id as u32).expect("the face is an own one");
            let subdomain = &decomposition.subdomains[own];
            let elements = behind.entry(own).or_insert_with(|| elements(subdomain));
            (face, own, elements[&key(&subdomain.facets[facet].nodes)])
        };
        let faces = slave.own().map(place).collect();
        Self { slave, master, are_given, share, faces }
    }

    /// Nodes whose displacements are needed.
    pub fn nodes(&self) -> impl Iterator<Item = u64> {
        self.master.iter().flat_map(|master| self.slave.surface.nodes.iter().chain(&master.nodes)).copied()
    }

    /// By how much energy elements on the slave are off: own subdomain, element, energy; for each face of an element one. `state` knows
    /// the condition of a node on one of the smooth parts around it, `displacement` that of a node.
    pub fn errors(
        &self,
        state: impl Fn(u64, u32) -> Option<State>,
        displacement: impl Fn(u64) -> [f64; 3],
    ) -> Vec<(usize, usize, f64)> {
        let slave = &self.slave.surface;
        let state = |index: usize| state(slave.nodes[index], slave.parts[index]);
        let works = match &self.master {
            None => consistency::of_nodes(slave, self.share, state),
            Some(master) => {
                let pressure = |index: usize| state(index).map(|state| state.pressure);
                consistency::of_means(slave, master, pressure, displacement, self.are_given)
            }
        };
        self.faces.iter().map(|&(face, own, element)| (own, element, COUNTED * works[face].abs())).collect()
    }
}

/// The element behind each facet of a subdomain, by the facet's [`key`].
fn elements(subdomain: &Subdomain) -> HashMap<Vec<u32>, usize> {
    let mut behind: HashMap<Vec<u32>, usize> =
        subdomain.facets.iter().map(|facet| (key(&facet.nodes), usize::MAX)).collect();
    for (element, nodes) in subdomain.elements.iter().enumerate() {
        for face in subdomain.elements.kind().faces() {
            let face: Vec<u32> = face.iter().map(|&node| nodes[node]).collect();
            if let Some(of) = behind.get_mut(&key(&face)) {
                *of = element;
            }
        }
    }
    behind
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{on_ranks, two_bricks, two_bricks_by_metis};

    /// One face of each element is on the surface, or none: what it has there is pressure times distance times its area.
    #[test]
    fn elements_behind_the_faces_have_what_these_have() {
        for scene in [two_bricks(&["decomposition.cells=[1, 1, 1]"]), two_bricks_by_metis(9)] {
            for ranks in [1, 3] {
                let areas = on_ranks(&scene, ranks, |setup| {
                    let decomposition = &setup.discrete.decomposition;
                    let surface = setup.discrete.contacts.surfaces[0].slave;
                    let touching = Touching::new(setup.comm, decomposition, (surface, None), (false, 0.2));
                    let found = touching.errors(|_, _| Some(State { pressure: 2.0, gap: -3.0 }), |_| [0.0; 3]);
                    let facets = decomposition.subdomains.iter().flat_map(|subdomain| &subdomain.facets);
                    assert_eq!(found.len(), facets.filter(|facet| facet.surface == surface).count());
                    for &(own, element, energy) in &found {
                        let subdomain = &decomposition.subdomains[own];
                        let nodes = subdomain.elements.get(element);
                        let on_surface = |facet: &&crate::decomposition::subdomain::Facet| {
                            facet.surface == surface && facet.nodes.iter().all(|node| nodes.contains(node))
                        };
                        let facet = subdomain.facets.iter().find(on_surface).expect("the element is behind a face");
                        let corners = [0, 1, 2].map(|k| subdomain.points[facet.nodes[k] as usize]);
                        let expected = COUNTED * 6.0 * crate::mesh::surface::area(&corners);
                        assert!((energy - expected).abs() < 1e-12 * expected);
                    }
                    found.iter().map(|(.., energy)| energy / (6.0 * COUNTED)).sum::<f64>()
                });
                let whole = on_ranks(&scene, 1, |setup| {
                    let surface = setup.discrete.contacts.surfaces[0].slave;
                    let slave = Patch::new(setup.comm, &setup.discrete.decomposition, surface).surface;
                    slave.corners().map(|corners| crate::mesh::surface::area(&corners)).sum::<f64>()
                });
                assert!((areas.iter().sum::<f64>() - whole[0]).abs() < 1e-12 * whole[0]);
            }
        }
    }
}
