//! From the bodies of a scene to their meshes: bricks by formula, other structured bodies made by rank 0, volumes of mesh
//! files read by it.
//!
//! A file that several bodies name is read once. What rank 0 finds wrong is everybody's error.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use thiserror::Error;

use crate::comm::Comm;
use crate::comm::agree::root_texts;
use crate::decomposition::{BodyMesh, Counts, Shape, number_bodies};
use crate::element::Kind;
use crate::mesh::boxes::around;
use crate::mesh::gmsh::{Msh, Problem};
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
    /// On rank 0 the meshes of bodies that are no bricks, by body; empty elsewhere.
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
        let found = if comm.rank() == 0 { read(scene) } else { Ok(Found::default()) };
        let texts = match &found {
            Ok(Found { warnings, .. }) => root_texts(comm, ["", ""].into_iter().chain(warnings.iter().map(|w| &w[..]))),
            Err(MeshError::Bad(text)) => root_texts(comm, ["bad", text]),
            Err(MeshError::Unreadable(text)) => root_texts(comm, ["unreadable", text]),
        };
        match &texts[0][..] {
            "bad" => return Err(MeshError::Bad(texts[1].clone())),
            "unreadable" => return Err(MeshError::Unreadable(texts[1].clone())),
            _ => {}
        }
        let solids = found?.solids;
        let mine = solids.values().flat_map(|m| [m.points.len() as u64, m.cells, m.elements.len() as u64]).collect();
        let outgoing = if comm.rank() == 0 { vec![mine; comm.size()] } else { vec![Vec::new(); comm.size()] };
        let mut counts = comm.all_to_all(outgoing).swap_remove(0).into_iter();
        let mut shape = |body: &scene::Body| match &body.shape {
            scene::Shape::Brick(b) => brick(b),
            _ => {
                let [nodes, cells, elements] = [(); 3].map(|()| counts.next().expect("every mesh is counted"));
                Shape::Mesh(Counts { nodes, cells, elements })
            }
        };
        let bodies = number_bodies(scene.body.values().map(|body| (body.element, shape(body), materials(scene, body))));
        Ok(Self { bodies, solids, warnings: texts[2..].to_vec() })
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

/// What rank 0 reads.
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

fn read(scene: &Scene) -> Result<Found, MeshError> {
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
        let msh = Msh::read(path).map_err(|problem| {
            let text = format!("{}: {problem}", path.display());
            if matches!(problem, Problem::Read(_)) { MeshError::Unreadable(text) } else { MeshError::Bad(text) }
        })?;
        for FromFile { index, name, gmsh, kind } in bodies {
            let surfaces: Vec<&str> = surfaces_of(scene, name).into_iter().collect();
            let problem = |problem: Problem| MeshError::Bad(format!("body.{name}: {}: {problem}", path.display()));
            let volumes: Vec<&str> = gmsh.volumes().iter().map(|name| &name[..]).collect();
            let mut mesh = msh.body(&volumes, &surfaces, *kind).map_err(problem)?;
            join_equal(&scene.body[*name], &volumes, &mut mesh);
            place(gmsh, &mut mesh);
            found.warnings.extend(check(scene, name, &mesh)?);
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
            let mesh = mapped.mesh(body.element);
            found.warnings.extend(check(scene, name, &mesh)?);
            found.solids.insert(index, mesh);
        }
    }
    count(scene, &found)?;
    Ok(found)
}

/// The structured body that is to be meshed, if it is one.
fn mapped(shape: &scene::Shape) -> Option<Mapped> {
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
        mesh.regions.clear();
    }
    let region = |volume: &&str| names.iter().position(|name| body.material.of(volume) == Some(name));
    let of_volumes: Vec<Option<usize>> = volumes.iter().map(region).collect();
    for region in &mut mesh.regions {
        *region = of_volumes[*region as usize].expect("every volume of a checked scene has a material") as u32;
    }
}

fn place(gmsh: &Gmsh, mesh: &mut SolidMesh) {
    let rotation = gmsh.rotate.map(|r| (r.axis, r.angle_deg));
    Placement { scale: gmsh.scale, rotation, translation: gmsh.translate }.apply(&mut mesh.points);
}

/// Elements of worse shape are worth a word.
const POOR_SHAPE: f64 = 0.01;

/// Looks at one body; returns warnings.
fn check(scene: &Scene, body: &str, mesh: &SolidMesh) -> Result<Vec<String>, MeshError> {
    let quality = Quality::of(mesh);
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
        warnings.push(format!(
            "body {body}: its flattest element has {:.1e} of the shape of a regular one, which costs accuracy; try \
             `Mesh.OptimizeNetgen = 1;`",
            quality.worst_shape
        ));
    }
    let pieces = mesh.pieces.iter().max().map_or(1, |&last| last as usize + 1);
    if pieces > 1 {
        warnings.push(format!("body {body}: it is in {pieces} pieces that nothing joins; each has to be held"));
    }
    for (name, held) in held(scene, body, mesh, pieces) {
        match held.refusal().filter(|_| !scene.touches(body)) {
            Some(rule) => return Err(MeshError::Bad(format!("body.{name}: {rule}"))),
            None => warnings.extend(held.warning().filter(|_| warnings.len() < MOST_WARNINGS)),
        }
    }
    Ok(warnings)
}

/// Warnings that one body gives rise to.
const MOST_WARNINGS: usize = 10;

/// What the supports do for each piece of a body, and what to call it.
fn held(scene: &Scene, body: &str, mesh: &SolidMesh, pieces: usize) -> Vec<(String, Held)> {
    let mut of_node = vec![0; mesh.points.len()];
    let mut rooms = vec![Vec::new(); pieces];
    for (element, nodes) in mesh.elements.iter().enumerate().filter(|_| pieces > 1) {
        let piece = mesh.piece(element);
        nodes.iter().for_each(|&node| of_node[node as usize] = piece);
        let places = nodes.iter().map(|&node| &mesh.points[node as usize]);
        rooms[piece] = around(rooms[piece].iter().chain(places)).to_vec();
    }
    let mut supported: Vec<Vec<([f64; 3], &[Axis])>> = vec![Vec::new(); pieces];
    for support in scene.support.values().filter(|s| s.surface.body == body) {
        let nodes: BTreeSet<u32> = mesh.surface(&support.surface.surface).iter().flatten().copied().collect();
        for node in nodes.into_iter().map(|node| node as usize) {
            supported[of_node[node]].push((mesh.points[node], &support.fix));
        }
    }
    let name = |room: &Vec<[f64; 3]>| match room[..] {
        [low, high] => {
            let [x, y, z]: [f64; 3] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
            format!("{body}, its piece around ({x:.6}, {y:.6}, {z:.6})")
        }
        _ => body.to_owned(),
    };
    let each = rooms.iter().zip(&supported);
    each.map(|(room, supported)| (name(room), Held::at(&name(room), supported))).collect()
}

/// Refuses more subdomains than elements; of bricks alone the scene's own checks do.
fn count(scene: &Scene, found: &Found) -> Result<(), MeshError> {
    let Method::Metis { subdomains: Some(subdomains) } = scene.decomposition.method else { return Ok(()) };
    let bricks =
        scene.body.values().filter_map(|b| Some(b.brick()?.cell_count() * b.element.cell().per_hexahedron() as usize));
    let elements =
        found.solids.values().map(|mesh| mesh.elements.len()).chain(bricks).fold(0_usize, usize::saturating_add);
    if subdomains <= elements {
        return Ok(());
    }
    let rule = format!("there are only {elements} elements to share out");
    Err(MeshError::Bad(format!("decomposition.subdomains = {subdomains}: {rule}")))
}
