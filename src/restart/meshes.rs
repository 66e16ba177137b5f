//! What tells the meshes of bodies apart, whatever subdomains and ranks they belong to: states go only where they are from.

use serde::{Deserialize, Serialize};

use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::Counts;
use crate::element::Kind;
use crate::model::discrete::Discrete;
use crate::scene::Scene;

/// The mesh of a body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshOf {
    /// Name of the body.
    pub body: String,
    /// Its element.
    pub element: Kind,
    /// Number of its first node among those of all bodies.
    pub first_node: u64,
    /// How many nodes it has.
    pub nodes: u64,
    /// How many elements.
    pub elements: u64,
    /// Of elements and places of nodes.
    pub fingerprint: u64,
}

/// The meshes of all bodies, by name. Collective.
pub fn meshes(comm: &dyn Comm, scene: &Scene, discrete: &Discrete) -> Vec<MeshOf> {
    let bodies = scene.body.iter().zip(&discrete.bodies).zip(fingerprints(comm, discrete));
    let mesh_of = bodies.map(|(((name, body), mesh), fingerprint)| {
        let Counts { nodes, elements, .. } = mesh.counts();
        let (body, element, first_node) = (name.clone(), body.element, mesh.first_node);
        MeshOf { body, element, first_node, nodes, elements, fingerprint }
    });
    mesh_of.collect()
}

/// A number for each body, of all elements with the places and the numbers within the body of their nodes. Collective.
pub fn fingerprints(comm: &dyn Comm, discrete: &Discrete) -> Vec<u64> {
    let mut mine = vec![0_u64; discrete.bodies.len()];
    for subdomain in &discrete.decomposition.subdomains {
        let first_node = discrete.bodies[subdomain.body].first_node;
        for nodes in &subdomain.elements {
            let mut hasher = crc32fast::Hasher::new();
            for &node in nodes {
                hasher.update(&(subdomain.nodes[node as usize] - first_node).to_le_bytes());
                subdomain.points[node as usize].iter().for_each(|x| hasher.update(&x.to_le_bytes()));
            }
            mine[subdomain.body] = mine[subdomain.body].wrapping_add(u64::from(hasher.finalize()));
        }
    }
    let mut sums = vec![0_u64; mine.len()];
    for of_rank in all_gather_u64(comm, &mine).chunks(mine.len()) {
        sums.iter_mut().zip(of_rank).for_each(|(sum, part)| *sum = sum.wrapping_add(*part));
    }
    sums
}
