//! Names of bodies and surfaces for result files, so that their meshes can be those of other scenes.

use crate::comm::Comm;
use crate::decomposition::Patch;
use crate::mesh::gmsh::own::{Names, WIDTH};
use crate::model::Discrete;
use crate::results::piece::Field;
use crate::scene::{Face, Scene};

/// The arrays of [`crate::mesh::gmsh::own`].
pub(super) fn arrays(comm: &dyn Comm, scene: &Scene, discrete: &Discrete) -> Vec<Field> {
    let text = serde_json::to_string(&names(scene, discrete)).expect("names and numbers can be written");
    // Rank 0's counts.
    let bytes = if comm.rank() == 0 { text.bytes().map(i64::from).collect() } else { Vec::new() };
    let mut rows = Vec::new();
    for subdomain in &discrete.decomposition.subdomains {
        for facet in &subdomain.facets {
            let nodes = facet.nodes.iter().map(|&node| subdomain.nodes[node as usize] as i64);
            let padded = nodes.chain(std::iter::repeat(-1)).take(WIDTH);
            rows.extend(std::iter::once(facet.surface as i64).chain(padded));
        }
    }
    vec![Field::integer("names", bytes), Field { components: WIDTH + 1, ..Field::integer("facets", rows) }]
}

/// A body of one material is one volume, of its name; one of several has a volume for each, with the material's name behind a dot.
fn names(scene: &Scene, discrete: &Discrete) -> Names {
    let mut volumes = Vec::new();
    for (index, (name, body)) in scene.body.iter().enumerate() {
        let of_body = body.material.names();
        for (material, of) in scene.material.keys().enumerate().filter(|(_, of)| of_body.contains(of.as_str())) {
            let name = if of_body.len() == 1 { name.clone() } else { format!("{name}.{of}") };
            volumes.push((index as i64, material as i64, name));
        }
    }
    let name = |patch: &Patch| match patch {
        Patch::Face(face) => Face::ALL[*face as usize].name().to_owned(),
        Patch::Named(name) => name.clone(),
    };
    Names { volumes, surfaces: discrete.surfaces.iter().map(|surface| name(&surface.patch)).collect() }
}
