//! The discrete problem of a scene: meshes, subdomains, contact pairs, rows.

use std::collections::BTreeMap;

use super::ModelError;
use super::conditions::{self, RightHandSides};
use super::contacts::{self, Contacts};
use super::extent::{self, Extent};
use super::meshes::{MeshError, Meshes};
use crate::assembly::loads::Load;
use crate::comm::{Comm, maximum};
use crate::constraint::links::Linked;
use crate::constraint::{Constraints, Support};
use crate::decomposition::{self, Bodies, BodyMesh, Cut, Decomposition, Patch, Surface, cost};
use crate::material::{Law, Material};
use crate::mesh::Face;
use crate::monitor::timing::peak_rss_mb;
use crate::scene::{self, Groups, Scene, SurfaceName};

/// One rank's part of the discrete problem.
pub struct Discrete {
    /// Bodies, in the order of their names.
    pub bodies: Vec<BodyMesh>,
    /// Materials of the scene, in the order of their names.
    pub materials: Vec<Material>,
    /// Surfaces that the scene names.
    pub surfaces: Vec<Surface>,
    /// Own subdomains and interface.
    pub decomposition: Decomposition,
    /// What may touch what, and the conditions of it.
    pub contacts: Contacts,
    /// Least and largest coordinates of each body.
    pub extents: Vec<Extent>,
    /// Supports, in the order of their names.
    pub supports: Vec<Support>,
    /// Loads, in the order of their names.
    pub loads: Vec<Load>,
    /// Own rows of B.
    pub constraints: Constraints,
    /// Right-hand sides of the rows over the load history.
    pub right_hand_sides: RightHandSides,
    /// What the user should know of the meshes.
    pub warnings: Vec<String>,
    /// Largest resident memory of a rank until meshes that are no bricks were read or made, and cut, in MiB.
    pub reading_mb: Option<f64>,
}

/// Discretises a scene. Collective.
///
/// # Errors
/// If contacts cannot be paired or supports contradict each other.
pub fn discretise(scene: &Scene, comm: &dyn Comm) -> Result<Discrete, ModelError> {
    discretise_expecting(scene, None, comm)
}

/// As [`discretise`], but spreads the subdomains that are expected to yield (see `decomposition::tear`) over the ranks.
///
/// # Errors
/// As there.
pub fn discretise_expecting(
    scene: &Scene,
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> Result<Discrete, ModelError> {
    discretise_meshes(scene, Meshes::new(scene, comm)?, yielding, comm)
}

/// As [`discretise_expecting`], with meshes that are there already.
///
/// # Errors
/// As there.
pub fn discretise_meshes(
    scene: &Scene,
    Meshes { bodies, solids, mut warnings }: Meshes,
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> Result<Discrete, ModelError> {
    // The surfaces that the scene names.
    let materials: Vec<Material> = scene.material.values().copied().collect();
    let named = Named::new(scene, &bodies);

    // Subdomains.
    let torn = Bodies { bodies: &bodies, surfaces: &named.surfaces };
    let cut = cut(&scene.decomposition.method, &bodies);
    can_be_cut(scene, &bodies, cut)?;
    let tetrahedra = decomposition::tetrahedra(&bodies);
    let groups = |count| groups(scene, is_thin(&bodies, cut), count, tetrahedra);
    let decomposition = decomposition::tear(&torn, solids, cut, &groups, yielding, comm);
    let reading_mb = reading_mb(&bodies, comm);

    // What holds, touches and loads them.
    let supports: Vec<Support> = scene.support.iter().map(|(name, s)| support(name, s, &named)).collect();
    let extents = extent::extents(comm, &decomposition.subdomains, bodies.len());
    let given = contacts::Given {
        scene,
        decomposition: &decomposition,
        supports: &supports,
        extents: &extents,
        nodes: bodies.iter().map(|body| body.counts().nodes).sum(),
    };
    let (mut contacts, of_contacts) = contacts::pair(comm, &given, |name| named.index(name))?;
    warnings.extend(of_contacts);
    let loads = scene.load.values().map(|it| load(scene, it, &named)).collect();

    // Rows of B.
    let young: Vec<f64> = decomposition.subdomains.iter().map(|s| materials[s.material].hooke().young).collect();
    let linked = Linked::new(comm, &decomposition, &mut contacts.pairs, &young);
    let given = conditions::Given { decomposition: &decomposition, supports: &supports, contacts: &contacts };
    let (constraints, right_hand_sides, of_slides) = conditions::constraints(scene, comm, &given, linked)?;
    warnings.extend(of_slides);
    let surfaces = named.surfaces;
    Ok(Discrete {
        bodies,
        materials,
        surfaces,
        decomposition,
        contacts,
        extents,
        supports,
        loads,
        constraints,
        right_hand_sides,
        warnings,
        reading_mb,
    })
}

/// The surfaces that a scene names, each once.
struct Named {
    surfaces: Vec<Surface>,
    /// Index of each name among them.
    of_name: BTreeMap<SurfaceName, usize>,
}

impl Named {
    fn new(scene: &Scene, bodies: &[BodyMesh]) -> Self {
        let surface = |name: &SurfaceName| {
            let body = body_number(scene, &name.body);
            let patch = match (bodies[body].brick(), name.face()) {
                (Some(_), Some(face)) => Patch::Face(Face::ALL[face as usize]),
                _ => Patch::Named(name.surface.clone()),
            };
            Surface { body, patch }
        };
        let mut surfaces: Vec<Surface> = scene.surfaces().map(surface).collect();
        surfaces.sort_unstable();
        surfaces.dedup();
        let index = |name| surfaces.binary_search(&surface(name)).expect("every named surface is listed");
        let of_name = scene.surfaces().map(|name| (name.clone(), index(name))).collect();
        Self { surfaces, of_name }
    }

    fn index(&self, name: &SurfaceName) -> usize {
        self.of_name[name]
    }
}

/// Index of a body that the scene names.
fn body_number(scene: &Scene, name: &str) -> usize {
    scene.body.keys().position(|known| known == name).expect("a checked scene names its bodies")
}

fn support(name: &str, support: &scene::Support, named: &Named) -> Support {
    Support {
        name: name.to_owned(),
        surface: named.index(&support.surface),
        fixed: scene::Axis::ALL.map(|a| support.fix.contains(&a)),
        displacement: support.displacement.unwrap_or_default(),
    }
}

fn load(scene: &Scene, load: &scene::Load, named: &Named) -> Load {
    match load {
        scene::Load::Traction { surface, traction } => {
            Load::Traction { surface: named.index(surface), value: *traction }
        }
        scene::Load::Pressure { surface, pressure } => {
            Load::Pressure { surface: named.index(surface), value: *pressure }
        }
        scene::Load::BodyForce { body, body_force } => {
            Load::BodyForce { body: body_number(scene, body), value: *body_force }
        }
    }
}

/// The largest resident memory of a rank so far if a mesh was read or made. Collective.
fn reading_mb(bodies: &[BodyMesh], comm: &dyn Comm) -> Option<f64> {
    let megabytes = maximum(comm, &[peak_rss_mb().unwrap_or(f64::NAN)]);
    let has_read = bodies.iter().any(|body| body.brick().is_none());
    Some(megabytes[0]).filter(|megabytes| has_read && megabytes.is_finite())
}

/// How the scene wants its bodies cut.
pub fn cut(wanted: &scene::Method, bodies: &[BodyMesh]) -> Cut {
    let best = || {
        let regions = bodies.iter().map(|body| body.materials.len()).sum();
        cost::subdomains(decomposition::tetrahedra(bodies), regions)
    };
    match *wanted {
        scene::Method::Bricks { cells } => Cut::Bricks(cells),
        scene::Method::Metis { subdomains } => Cut::Parts(subdomains.unwrap_or_else(best)),
        scene::Method::Auto => boxes(bodies, best()).map_or_else(|| Cut::Parts(best()), Cut::Bricks),
    }
}

/// Whether a body has few boxes across: groups of groups of such boxes are plates or bars, which are bound badly.
pub fn is_thin(bodies: &[BodyMesh], cut: Cut) -> bool {
    let Cut::Bricks(cells) = cut else { return false };
    let across = |body: &BodyMesh| decomposition::bricks::along(body, cells).into_iter().min();
    bodies.iter().filter_map(across).any(|boxes| boxes < ACROSS)
}

/// As many boxes make two groups of two.
const ACROSS: usize = 4;

/// Sizes of the groups of each level, for so many subdomains of so many linear tetrahedra.
pub fn groups(scene: &Scene, is_thin: bool, subdomains: usize, tetrahedra: u64) -> Vec<usize> {
    match &scene.decomposition.cluster {
        None => cost::groups(subdomains, tetrahedra, is_thin),
        Some(Groups::Equal(size)) => cost::levels(subdomains, *size),
        Some(Groups::Levels(sizes)) => sizes.clone(),
    }
}

/// Cells of the cubes that divide all bodies into the number of boxes nearest to the `best`; none if that is far from it.
fn boxes(bodies: &[BodyMesh], best: usize) -> Option<[usize; 3]> {
    let cells: Vec<[usize; 3]> =
        bodies.iter().map(|body| body.brick().map(|brick| brick.cells)).collect::<Option<_>>()?;
    let fits = |edge: &usize| cells.iter().flatten().all(|cells| cells.is_multiple_of(*edge));
    let count = |edge: usize| bodies.iter().map(|body| decomposition::bricks::count(body, [edge; 3])).sum::<usize>();
    let apart = |edge: usize| (count(edge) as f64 / best as f64).ln().abs();
    let edge = EDGES.rev().filter(fits).min_by(|&a, &b| apart(a).total_cmp(&apart(b)))?;
    (apart(edge) <= f64::ln(FAR)).then_some([edge; 3])
}

/// Cells along the edge of a box.
const EDGES: std::ops::RangeInclusive<usize> = 2..=12;
/// So many times too many or too few boxes cost more than parts of any shape would.
const FAR: f64 = 4.0;

/// Refuses more faces than 31 bits can count.
pub fn can_be_cut(scene: &Scene, bodies: &[BodyMesh], cut: Cut) -> Result<(), MeshError> {
    let faces = |body: &BodyMesh| body.counts().elements.saturating_mul(body.kind.faces().len() as u64);
    let too_many = |(_, body): &(&String, &BodyMesh)| faces(body) > i32::MAX as u64;
    let found = scene.body.keys().zip(bodies).filter(|_| matches!(cut, Cut::Parts(_))).find(too_many);
    let refusal = |(name, body): (&String, &BodyMesh)| {
        let (elements, faces) = (body.counts().elements, faces(body));
        MeshError::Bad(format!(
            "body.{name}: its {elements} elements have {faces} faces, more than the {} that METIS could count; cut bricks into \
             boxes (decomposition.cells), or take larger cells",
            i32::MAX
        ))
    };
    found.map_or(Ok(()), |body| Err(refusal(body)))
}
