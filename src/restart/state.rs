//! The state of the material as it is kept in result files, and a start from one.
//!
//! A row for each integration point that has ever flowed: the first four nodes of its element, which tell elements apart,
//! its number there, and what it remembers. Nodes count over all bodies of the scene that wrote them. So neither ranks nor
//! subdomains matter. Only the bodies that take their state need the same mesh as there. The displacement of the last fields
//! comes with it: the equilibrium with that state does not depend on it, but is near it.

use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::meshes::{MeshOf, meshes};
use super::places::{Places, Wanted, key};
use crate::comm::Comm;
use crate::comm::agree::{agree, on_root};
use crate::feti::Torn;
use crate::material::{History, Variables, history};
use crate::model::discrete::Discrete;
use crate::newton::TornProblem;
use crate::newton::committed::{Committed, Sizes};
use crate::results::hdf5::SharedFile;
use crate::results::piece::{Field, Values};
use crate::results::vtkhdf::State;
use crate::scene::{Initial, Moved, Scene};

/// What the rows belong to.
#[derive(Serialize, Deserialize)]
struct Description {
    meshes: Vec<MeshOf>,
    sizes: Sizes,
    moved: Moved,
}

/// The state that a problem has committed, with supports and obstacles moved like that.
pub fn pack(problem: &TornProblem, meshes: Vec<MeshOf>, moved: Moved) -> State {
    let (mut nodes, mut points, mut histories) = (Vec::new(), Vec::new(), Vec::new());
    for (own, subdomain) in problem.subdomains.iter().enumerate() {
        let of_element = subdomain.elements.kind().points();
        for (index, history) in problem.committed.history(own).iter().enumerate() {
            if *history != History::VIRGIN {
                let element = subdomain.elements.get(index / of_element);
                nodes.extend(key(element, &subdomain.nodes));
                points.push((index % of_element) as i64);
                histories.push(history);
            }
        }
    }
    let description = Description { meshes, sizes: problem.committed.sizes, moved };
    let mut arrays =
        vec![Field::of("nodes", 4, Values::Integer(nodes)), Field::of("point", 1, Values::Integer(points))];
    let variables = history::arrays(histories.into_iter()).into_iter();
    arrays.extend(variables.map(|(name, numbers, values)| Field::of(name, numbers, Values::Real(values))));
    State { description: serde_json::to_string(&description).expect("numbers and names can be written"), arrays }
}

/// Why a result file is no start for a scene; the same on every rank.
#[derive(Debug, Error)]
pub enum NoStart {
    /// It is not there, or may not be read.
    #[error("cannot read the result file {path}: {reason}")]
    Missing {
        /// Where it was sought.
        path: String,
        /// What the system says.
        reason: String,
    },
    /// It is something else.
    #[error("initial.result = {path}: {reason}")]
    Unfit {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
    },
}

/// What a run starts from, instead of rest.
pub struct Earlier {
    /// What the material remembers.
    pub committed: Committed,
    /// The displacement it was reached at; zero in bodies that start from rest.
    pub u: Torn,
    /// How far supports and obstacles of these bodies were moved then.
    pub moved: Moved,
}

/// The state that a scene wants to start from. Collective.
///
/// # Errors
/// If its result file cannot be read, or is of other meshes.
pub fn earlier(comm: &dyn Comm, scene: &Scene, discrete: &Discrete, initial: &Initial) -> Result<Earlier, NoStart> {
    let path = scene.directory.join(&initial.result);
    let shown = || path.display().to_string();
    let open = || match std::fs::File::open(&path)?.metadata()?.is_dir() {
        true => Err(ErrorKind::IsADirectory.into()),
        false => Ok::<_, io::Error>(()),
    };
    on_root(comm, "opening", open).map_err(|reason| NoStart::Missing { path: shown(), reason })?;
    read(comm, scene, discrete, initial, &path).map_err(|reason| NoStart::Unfit { path: shown(), reason })
}

fn read(
    comm: &dyn Comm,
    scene: &Scene,
    discrete: &Discrete,
    initial: &Initial,
    path: &Path,
) -> Result<Earlier, String> {
    let file = SharedFile::reopen(comm, path)
        .map_err(|_| "this is no result file: give the .vtkhdf that an earlier run wrote".to_owned())?;
    let description = file.read_text("state/description").ok();
    let description = description.and_then(|text| serde_json::from_str::<Description>(&text).ok());
    let Some(Description { meshes: there, sizes, moved: were }) = description else {
        return Err("it has no state to start from: solve the scene that it is of again, with this program".into());
    };
    let here = meshes(comm, scene, discrete);
    let mut taken = Vec::new();
    for (body, mesh) in here.iter().enumerate() {
        if initial.bodies.as_ref().is_none_or(|wanted| wanted.contains(&mesh.body)) {
            taken.push((same(mesh, &there)?, mesh.first_node, body));
        }
    }

    let subdomains = &discrete.decomposition.subdomains;
    let places = Places::new(subdomains, |s| taken.iter().any(|(_, _, body)| *body == s.body));
    let nodes =
        Wanted::find(&file, "VTKHDF/PointData/node", |node| moved(&taken, node).and_then(|[node]| places.node(node)))?;
    let elements = Wanted::find(&file, "state/nodes", |key| moved(&taken, key).and_then(|key| places.element(key)))?;
    let of_elements = elements.read::<i64>(&file, "state/point", 0)?;
    let count = |k: usize| subdomains[k].elements.kind().points();
    let found = || elements.rows().zip(&of_elements);
    let fit = found().all(|((_, (k, _)), point)| (0..count(k) as i64).contains(point));
    let whole = fit && places.have_nodes(&nodes);
    agree(
        comm,
        "the state",
        if whole { Ok(()) } else { Err("it is damaged: nodes or integration points are missing") },
    )?;
    let points = found().map(|((row, (k, e)), &point)| (row, (k, count(k) * e + point as usize)));
    let histories = places.histories(&file, &Wanted::new(elements.total(), points), "state")?;

    let displacement = "VTKHDF/PointData/displacement";
    let states = file.count(displacement)?.checked_div(nodes.total()).unwrap_or_default();
    let last = states.checked_sub(1).ok_or("it is damaged: it has fewer displacements than points")?;
    let u = places.at_nodes(&file, &nodes, (displacement, 3, last))?;
    file.close()?;
    let is_taken = |name: &str| taken.iter().any(|(.., body)| here[*body].body == name);
    let moved = were.on(scene, is_taken);
    Ok(Earlier { committed: Committed { histories, sizes, ..Committed::default() }, u, moved })
}

/// Nodes of a body by their numbers here; `None` if the body does not take its state from the file. Those that do have the
/// numbers of their nodes there, the first number here, and their index.
fn moved<const N: usize>(taken: &[(Range<i64>, u64, usize)], there: [i64; N]) -> Option<[i64; N]> {
    let (range, first, _) = taken.iter().find(|(range, ..)| range.contains(&there[0]))?;
    Some(there.map(|node| node - range.start + *first as i64))
}

/// The numbers in a file of a body's nodes.
fn same(mesh: &MeshOf, there: &[MeshOf]) -> Result<Range<i64>, String> {
    let body = &mesh.body;
    let Some(found) = there.iter().find(|of| of.body == *body) else {
        let known = there.iter().map(|of| &of.body[..]).collect::<Vec<_>>().join(", ");
        return Err(format!(
            "it has no body {body}, but {known}: name in initial.bodies those that take their state from it"
        ));
    };
    if found.element != mesh.element {
        return Err(format!(
            "body {body} is of {} there and of {} here: states go from mesh to the same mesh",
            found.element.name(),
            mesh.element.name()
        ));
    }
    let sizes = |of: &MeshOf| (of.nodes, of.elements);
    if sizes(found) != sizes(mesh) {
        return Err(format!(
            "body {body} has {} nodes and {} elements there, {} and {} here: states go from mesh to the same mesh",
            found.nodes, found.elements, mesh.nodes, mesh.elements
        ));
    }
    if found.fingerprint != mesh.fingerprint {
        return Err(format!(
            "nodes of body {body} are at other places there than here: states go from mesh to the same mesh"
        ));
    }
    Ok(found.first_node as i64..(found.first_node + found.nodes) as i64)
}
