//! The discrete problem of a scene: meshes, subdomains, contact pairs, rows.

use super::ModelError;
use super::bodies::{MeshError, Meshes};
use super::conditions::{self, RightHandSides};
use super::contacts::{self, Paired};
use super::extent::{self, Extent, Site};
use crate::assembly::loads::Load;
use crate::comm::Comm;
use crate::constraint::{Constraints, Support};
use crate::contact::{ContactPair, MasterNode};
use crate::decomposition::{self, Bodies, BodyMesh, Cut, Decomposition, Patch, Surface, cost};
use crate::material::{Law, Material};
use crate::mesh::Face;
use crate::monitor::timing::peak_rss_mb;
use crate::record::counts::ContactRow;
use crate::scene::{self, Scene, SurfaceName};
use crate::study::contact::Touching;

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
    /// Names of the contacts.
    pub contacts: Vec<String>,
    /// How they were paired.
    pub contact_rows: Vec<ContactRow>,
    /// All contact pairs of the scene.
    pub pairs: Vec<ContactPair>,
    /// Nodes of all master surfaces that have slaves opposite.
    pub masters: Vec<MasterNode>,
    /// Where each of the pairs is.
    pub sites: Vec<Site>,
    /// Least and largest coordinates of each body.
    pub extents: Vec<Extent>,
    /// Supports, in the order of their names.
    pub supports: Vec<Support>,
    /// Loads, in the order of their names.
    pub loads: Vec<Load>,
    /// Own rows of B.
    pub constraints: Constraints,
    /// What the user should know of the meshes.
    pub warnings: Vec<String>,
    /// Indices of the surfaces in contact.
    pub touching: Vec<usize>,
    /// Right-hand sides of the rows over the load history.
    pub right_hand_sides: RightHandSides,
    /// Largest resident memory of rank 0 until meshes from files were read and sent out, in MiB.
    pub reading_mb: Option<f64>,
}

impl Discrete {
    /// Its contacts, for results.
    pub fn touching(&self) -> Touching<'_> {
        Touching { names: &self.contacts, pairs: &self.pairs, masters: &self.masters }
    }
}

/// Discretises a scene. Collective.
///
/// # Errors
/// If contacts cannot be paired or supports contradict each other.
pub fn discretise(scene: &Scene, comm: &dyn Comm) -> Result<Discrete, ModelError> {
    discretise_expecting(scene, None, comm)
}

/// As [`discretise`], but spreads the subdomains that are expected to yield (see [`decomposition::tear`]) over the ranks.
///
/// # Errors
/// As there.
pub fn discretise_expecting(
    scene: &Scene,
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> Result<Discrete, ModelError> {
    let Meshes { bodies, solids, mut warnings } = Meshes::new(scene, comm)?;
    let materials: Vec<Material> = scene.material.values().copied().collect();
    let number =
        |name: &str| scene.body.keys().position(|known| known == name).expect("a checked scene names its bodies");
    let surface = |name: &SurfaceName| {
        let body = number(&name.body);
        let patch = match (bodies[body].brick(), name.face()) {
            (Some(_), Some(face)) => Patch::Face(Face::ALL[face as usize]),
            _ => Patch::Named(name.surface.clone()),
        };
        Surface { body, patch }
    };
    let mut surfaces: Vec<Surface> = scene.surfaces().map(surface).collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    let index = |name: &SurfaceName| surfaces.binary_search(&surface(name)).expect("every named surface is listed");
    let touching: Vec<usize> = scene.contact.values().flat_map(scene::Contact::surfaces).map(index).collect();

    let torn = Bodies { bodies: &bodies, meshes: &solids, surfaces: &surfaces, contact: &touching };
    let cut = cut(&scene.decomposition.method, &bodies);
    can_be_cut(scene, &bodies, cut)?;
    let decomposition = decomposition::tear(&torn, cut, scene.decomposition.cluster, yielding, comm);
    drop(solids);
    let reading_mb = reading_mb(&bodies, comm);

    let supports: Vec<Support> = scene
        .support
        .iter()
        .map(|(name, s)| Support {
            name: name.clone(),
            surface: index(&s.surface),
            fixed: scene::Axis::ALL.map(|a| s.fix.contains(&a)),
            displacement: s.displacement.unwrap_or_default(),
        })
        .collect();
    let extents = extent::extents(comm, &decomposition.subdomains, bodies.len());
    let Paired { pairs, masters, sites, rows: contact_rows, warnings: of_contacts } =
        contacts::pair(scene, comm, &decomposition, &supports, &extents, index)?;
    warnings.extend(of_contacts);
    let load = |load: &scene::Load| match load {
        scene::Load::Traction { surface, traction } => Load::Traction { surface: index(surface), value: *traction },
        scene::Load::Pressure { surface, pressure } => Load::Pressure { surface: index(surface), value: *pressure },
        scene::Load::BodyForce { body, body_force } => Load::BodyForce { body: number(body), value: *body_force },
    };
    let loads = scene.load.values().map(load).collect();
    let contacts: Vec<String> = scene.contact.keys().cloned().collect();
    let young: Vec<f64> = decomposition.subdomains.iter().map(|s| materials[s.material].hooke().young).collect();
    let stiffness = comm.all_gather(&young, &decomposition.shares.counts(1));
    let given = conditions::Given {
        decomposition: &decomposition,
        supports: &supports,
        contacts: &contacts,
        pairs: &pairs,
        stiffness: &stiffness,
    };
    let (constraints, right_hand_sides) = conditions::constraints(scene, comm, &given)?;
    Ok(Discrete {
        bodies,
        materials,
        surfaces,
        decomposition,
        contacts,
        contact_rows,
        pairs,
        masters,
        sites,
        extents,
        supports,
        loads,
        constraints,
        warnings,
        touching,
        reading_mb,
        right_hand_sides,
    })
}

/// Rank 0's largest resident memory so far if it has read a mesh. Collective.
fn reading_mb(bodies: &[BodyMesh], comm: &dyn Comm) -> Option<f64> {
    let mut megabytes = [peak_rss_mb().unwrap_or(f64::NAN)];
    comm.broadcast(&mut megabytes);
    let has_read = bodies.iter().any(|body| body.brick().is_none());
    Some(megabytes[0]).filter(|megabytes| has_read && megabytes.is_finite())
}

/// How the scene wants its bodies cut.
pub fn cut(wanted: &scene::Method, bodies: &[BodyMesh]) -> Cut {
    // As many nodes as the paper's boxes have.
    let degree = bodies.iter().map(|body| body.kind.degree()).max().unwrap_or(1);
    let boxes = scene::PAPER_CELLS.map(|cells| cells / degree);
    let divides = |body: &BodyMesh| body.brick().is_some_and(|b| (0..3).all(|a| b.cells[a].is_multiple_of(boxes[a])));
    match *wanted {
        scene::Method::Bricks { cells } => Cut::Bricks(cells),
        scene::Method::Auto if bodies.iter().all(divides) => Cut::Bricks(boxes),
        scene::Method::Metis { subdomains: Some(parts) } => Cut::Metis(parts),
        scene::Method::Metis { subdomains: None } | scene::Method::Auto => {
            let regions = bodies.iter().map(|body| body.materials.len()).sum();
            Cut::Metis(cost::subdomains(decomposition::tetrahedra(bodies), regions))
        }
    }
}

/// Refuses what METIS, whose integers have 32 bits, would lose count of.
pub fn can_be_cut(scene: &Scene, bodies: &[BodyMesh], cut: Cut) -> Result<(), MeshError> {
    let faces = |body: &BodyMesh| body.counts().elements.saturating_mul(body.kind.faces().len() as u64);
    let too_many = |(_, body): &(&String, &BodyMesh)| faces(body) > i32::MAX as u64;
    let found = scene.body.keys().zip(bodies).filter(|_| matches!(cut, Cut::Metis(_))).find(too_many);
    let refusal = |(name, body): (&String, &BodyMesh)| {
        let (elements, faces) = (body.counts().elements, faces(body));
        MeshError::Bad(format!(
            "body.{name}: its {elements} elements have {faces} faces, more than the {} that METIS can count; cut bricks into \
             boxes (decomposition.cells), or take larger cells",
            i32::MAX
        ))
    };
    found.map_or(Ok(()), |body| Err(refusal(body)))
}
