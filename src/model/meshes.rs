//! From the bodies of a scene to their meshes: bricks by formula, other structured bodies and volumes of mesh files in parts,
//! one on each rank.
//!
//! A file that several bodies name is read once. What is wrong is found by all ranks together, and everybody's error.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use thiserror::Error;

use crate::comm::agree::root_texts;
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::{BodyMesh, Counts, Shape, number_bodies};
use crate::element::Kind;
use crate::mesh::boxes::{Box3, around};
use crate::mesh::gmsh::{LARGE, Msh, Problem};
use crate::mesh::placement::Placement;
use crate::mesh::quality::Quality;
use crate::mesh::{Brick, Mapped, SolidMesh};
use crate::scene::{self, Axis, Gmsh, Held, Method, Scene};

/// Why there are no meshes; the same on every rank.
#[derive(Debug, Error)]
pub enum MeshError {
    /// A mesh or what the scene wants of it is bad.
    #[error("{0}")]
    Bad(String),
    /// A mesh file cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

/// The meshes of all bodies.
#[derive(Default)]
pub struct Meshes {
    /// In the order of the bodies' names.
    pub bodies: Vec<BodyMesh>,
    /// This rank's parts of the meshes of bodies that are no bricks, by body.
    pub solids: BTreeMap<usize, SolidMesh>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Meshes {
    /// Reads mesh files and counts. Collective.
    ///
    /// # Errors
    /// If a file cannot be read, or is not what the scene wants.
    pub fn new(scene: &Scene, comm: &dyn Comm) -> Result<Self, MeshError> {
        let Found { solids, warnings } = read(scene, comm)?;
        Ok(Self { warnings, ..Self::of(scene, solids) })
    }

    /// Of this rank's parts of the meshes of all bodies that are no bricks.
    ///
    /// # Panics
    /// If one is missing.
    pub fn of(scene: &Scene, solids: BTreeMap<usize, SolidMesh>) -> Self {
        let shape = |(index, body): (usize, &scene::Body)| match &body.shape {
            scene::Shape::Brick(b) => brick(b),
            _ => Shape::Mesh(solids[&index].counts),
        };
        let shapes = scene.body.values().enumerate();
        let bodies = number_bodies(shapes.map(|(k, body)| (body.element, shape((k, body)), materials(scene, body))));
        Self { bodies, solids, warnings: Vec::new() }
    }
}

/// The bodies of a scene of bricks alone.
pub fn bricks(scene: &Scene) -> Option<Vec<BodyMesh>> {
    let shape = |body: &scene::Body| Some((body.element, brick(body.brick()?), materials(scene, body)));
    let shapes = scene.body.values().map(shape);
    shapes.collect::<Option<Vec<_>>>().map(number_bodies)
}

/// The bodies of a scene whose meshes have these sizes, body by body.
pub(crate) fn of_counts(scene: &Scene, counts: impl Iterator<Item = Counts>) -> Vec<BodyMesh> {
    let shape = |(body, counts): (&scene::Body, Counts)| {
        (body.element, body.brick().map_or(Shape::Mesh(counts), brick), materials(scene, body))
    };
    number_bodies(scene.body.values().zip(counts).map(shape))
}

fn brick(b: &scene::Brick) -> Shape {
    Shape::Brick(Brick { origin: b.origin, size: b.size, cells: b.cells })
}

/// Numbers of a body's materials among those of the scene, ascending.
fn materials(scene: &Scene, body: &scene::Body) -> Vec<usize> {
    let names = body.material.names();
    let number = |name: &&str| scene.material.keys().position(|known| known == name);
    names.iter().map(|name| number(name).expect("a checked scene names its materials")).collect()
}

/// What is read or made.
#[derive(Default)]
struct Found {
    solids: BTreeMap<usize, SolidMesh>,
    warnings: Vec<String>,
}

/// A body from a mesh file.
struct FromFile<'a> {
    index: usize,
    name: &'a String,
    gmsh: &'a Gmsh,
    kind: Kind,
}

fn read(scene: &Scene, comm: &dyn Comm) -> Result<Found, MeshError> {
    let mut files: BTreeMap<PathBuf, Vec<FromFile>> = BTreeMap::new();
    for (index, (name, body)) in scene.body.iter().enumerate() {
        if let Some(gmsh) = body.gmsh() {
            files.entry(scene.directory.join(&gmsh.file)).or_default().push(FromFile {
                index,
                name,
                gmsh,
                kind: body.element,
            });
        }
    }
    let mut found = Found::default();
    for (path, bodies) in &files {
        let msh = Msh::read(comm, path, LARGE).map_err(|problem| {
            let text = format!("{}: {problem}", path.display());
            if problem.is_unreadable() { MeshError::Unreadable(text) } else { MeshError::Bad(text) }
        })?;
        for FromFile { index, name, gmsh, kind } in bodies {
            let surfaces: Vec<&str> = surfaces_of(scene, name).into_iter().collect();
            let problem = |problem: Problem| MeshError::Bad(format!("body.{name}: {}: {problem}", path.display()));
            let volumes: Vec<&str> = gmsh.volumes().iter().map(|name| &name[..]).collect();
            let mut mesh = msh.body(comm, &volumes, &surfaces, *kind).map_err(problem)?;
            join_equal(&scene.body[*name], &volumes, &mut mesh);
            place(gmsh, &mut mesh);
            found.warnings.extend(check(scene, name, &mesh, comm)?);
            found.solids.insert(*index, mesh);
        }
        let used: BTreeSet<_> = bodies.iter().flat_map(|b| b.gmsh.volumes()).collect();
        let unused: Vec<_> = msh.volume_names().into_iter().filter(|name| !used.contains(name)).collect();
        if bodies.iter().all(|b| b.gmsh.volume.is_some()) && !unused.is_empty() {
            found.warnings.push(format!("{}: no body is made of volume {}", path.display(), unused.join(", ")));
        }
    }
    for (index, (name, body)) in scene.body.iter().enumerate() {
        if let Some(mapped) = mapped(&body.shape) {
            let mesh = mapped.mesh(comm, body.element);
            found.warnings.extend(check(scene, name, &mesh, comm)?);
            found.solids.insert(index, mesh);
        }
    }
    count(scene, &found)?;
    Ok(found)
}

/// The structured body that is to be meshed, if it is one.
pub fn mapped(shape: &scene::Shape) -> Option<Mapped> {
    match shape {
        scene::Shape::Brick(_) | scene::Shape::Gmsh(_) => None,
        scene::Shape::Sphere(scene::Sphere { inner, outer, cells }) => {
            Some(Mapped::Sphere { radii: [*inner, *outer], cells: *cells })
        }
        scene::Shape::Cylinder(scene::Cylinder { inner, outer, height, cells }) => {
            Some(Mapped::Cylinder { radii: [*inner, *outer], height: *height, cells: *cells })
        }
        scene::Shape::Grid(scene::Grid { x, y, z }) => Some(Mapped::Grid { planes: [x.clone(), y.clone(), z.clone()] }),
    }
}

/// Names of a body's surfaces that the scene uses.
fn surfaces_of<'a>(scene: &'a Scene, body: &str) -> BTreeSet<&'a str> {
    scene.surfaces().filter(|surface| surface.body == body).map(|surface| &surface.surface[..]).collect()
}

/// Makes one region of volumes with one material.
fn join_equal(body: &scene::Body, volumes: &[&str], mesh: &mut SolidMesh) {
    let names: Vec<&str> = body.material.names().into_iter().collect();
    if names.len() == 1 {
        return mesh.portion.wholes.fill(0);
    }
    let region = |volume: &&str| names.iter().position(|name| body.material.of(volume) == Some(name));
    let of_volumes: Vec<Option<usize>> = volumes.iter().map(region).collect();
    for region in &mut mesh.portion.wholes {
        *region = of_volumes[*region as usize].expect("every volume of a checked scene has a material") as u32;
    }
}

fn place(gmsh: &Gmsh, mesh: &mut SolidMesh) {
    let rotation = gmsh.rotate.map(|r| (r.axis, r.angle_deg));
    Placement { scale: gmsh.scale, rotation, translation: gmsh.translate }.apply(&mut mesh.portion.points);
}

/// Elements of worse shape are worth a word.
const POOR_SHAPE: f64 = 0.01;

/// Looks at one body; returns warnings. Collective.
fn check(scene: &Scene, body: &str, mesh: &SolidMesh, comm: &dyn Comm) -> Result<Vec<String>, MeshError> {
    let quality = Quality::of(comm, &mesh.portion);
    if !quality.is_sound() {
        // Sound by itself: the coordinates of the scene have lost its digits.
        let keys = match scene.body[body].gmsh() {
            Some(_) => "gmsh.scale and gmsh.translate",
            None => "its radii, lengths and cells",
        };
        return Err(MeshError::Bad(format!("body.{body}: {keys} leave elements without volume")));
    }
    let mut warnings = Vec::new();
    if quality.worst_shape < POOR_SHAPE {
        let way = match scene.body[body].gmsh() {
            Some(_) => "try `Mesh.OptimizeNetgen = 1;`",
            None => "cells with more even sides have none",
        };
        warnings.push(format!(
            "body {body}: its flattest element has {:.1e} of the shape of a regular one, which costs accuracy; {way}",
            quality.worst_shape
        ));
    }
    let pieces = mesh.piece_count;
    if pieces > 1 {
        warnings.push(format!("body {body}: it is in {pieces} pieces that nothing joins; each has to be held"));
    }
    for (name, refusal, warning) in held(scene, body, mesh, comm) {
        if !refusal.is_empty() && !scene.touches(body) {
            return Err(MeshError::Bad(format!("body.{name}: {refusal}")));
        }
        if !warning.is_empty() && warnings.len() < MOST_WARNINGS {
            warnings.push(warning);
        }
    }
    Ok(warnings)
}

/// Warnings that one body gives rise to.
const MOST_WARNINGS: usize = 10;

/// What to call each piece of a body, why to refuse it and what to warn of, if it is not held; else nothing. Rank 0 looks at the
/// supported nodes. Collective.
fn held(scene: &Scene, body: &str, mesh: &SolidMesh, comm: &dyn Comm) -> Vec<(String, String, String)> {
    let SolidMesh { portion, pieces, piece_count, .. } = mesh;
    let mut of_node = vec![0; portion.nodes.len()];
    for (nodes, &piece) in portion.elements.iter().zip(pieces) {
        nodes.iter().for_each(|&node| of_node[node as usize] = piece);
    }
    let supports: Vec<&scene::Support> = scene.support.values().filter(|s| s.surface.body == body).collect();
    let mut mine: BTreeSet<[u64; 6]> = BTreeSet::new();
    for (k, support) in (0..).zip(&supports) {
        for node in mesh.surface(&support.surface.surface).iter().flatten() {
            let own = portion.nodes.binary_search(node).expect("the node is here");
            let [x, y, z] = portion.points[own].map(f64::to_bits);
            mine.insert([of_node[own].into(), k, (*node).into(), x, y, z]);
        }
    }
    let mut outgoing = vec![Vec::new(); comm.size()];
    outgoing[0] = mine.into_iter().flatten().collect();
    let all: BTreeSet<[u64; 6]> =
        comm.all_to_all(outgoing).iter().flat_map(|theirs| theirs.as_chunks().0).copied().collect();
    let mut supported: Vec<Vec<([f64; 3], &[Axis])>> = vec![Vec::new(); *piece_count];
    for [piece, support, _, x, y, z] in all {
        supported[piece as usize].push(([x, y, z].map(f64::from_bits), &supports[support as usize].fix));
    }
    let names = names(body, mesh, comm);
    let texts = names.iter().zip(&supported).flat_map(|(name, supported)| {
        let held = Held::at(name, supported);
        [held.refusal(), held.warning()].map(Option::unwrap_or_default)
    });
    let texts: Vec<String> = if comm.rank() == 0 { texts.collect() } else { Vec::new() };
    let mut texts = root_texts(comm, texts.iter().map(|text| &text[..])).into_iter();
    let mut next = || texts.next().expect("there are two texts for each piece");
    names.into_iter().map(|name| (name, next(), next())).collect()
}

/// What to call each piece of a body. Collective.
fn names(body: &str, SolidMesh { portion, pieces, piece_count, .. }: &SolidMesh, comm: &dyn Comm) -> Vec<String> {
    if *piece_count == 1 {
        return vec![body.to_owned()];
    }
    let mut rooms: BTreeMap<u64, Box3> = BTreeMap::new();
    for (element, &piece) in pieces.iter().enumerate() {
        let its = around(&portion.places(element));
        rooms.entry(piece.into()).and_modify(|room| *room = around(room.iter().chain(&its))).or_insert(its);
    }
    let words = |(piece, room): (&u64, &Box3)| {
        std::iter::once(*piece).chain(room.as_flattened().iter().map(|x| x.to_bits())).collect::<Vec<_>>()
    };
    let mine: Vec<u64> = rooms.iter().flat_map(words).collect();
    for &[piece, a, b, c, d, e, f] in all_gather_u64(comm, &mine).as_chunks::<7>().0 {
        let [low, high] = [[a, b, c], [d, e, f]].map(|x| x.map(f64::from_bits));
        let room = rooms.entry(piece).or_insert([low, high]);
        *room = around(room.iter().chain([&low, &high]));
    }
    let name = |[low, high]: &Box3| {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
        format!("{body}, its piece around ({x:.6}, {y:.6}, {z:.6})")
    };
    rooms.values().map(name).collect()
}

/// Refuses more subdomains than elements; of bricks alone the scene's own checks do.
fn count(scene: &Scene, found: &Found) -> Result<(), MeshError> {
    let Method::Metis { subdomains: Some(subdomains) } = scene.decomposition.method else { return Ok(()) };
    let bricks =
        scene.body.values().filter_map(|b| Some(b.brick()?.cell_count() * b.element.cell().per_hexahedron() as usize));
    let elements = found
        .solids
        .values()
        .map(|mesh| mesh.counts.elements as usize)
        .chain(bricks)
        .fold(0_usize, usize::saturating_add);
    if subdomains <= elements {
        return Ok(());
    }
    let rule = format!("there are only {elements} elements to share out");
    Err(MeshError::Bad(format!("decomposition.subdomains = {subdomains}: {rule}")))
}
