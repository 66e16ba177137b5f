//! The pipeline from a scene to a solution: the only file that sees every stage.

use thiserror::Error;

use crate::assembly::loads::{self, Traction};
use crate::comm::Comm;
use crate::constraint::{ConstraintError, Constraints, Kind, Support};
use crate::contact::surface::GatheredSurface;
use crate::contact::{ContactError, ContactPair, matching};
use crate::decomposition::{self, BodyMesh, Cut, Decomposition, Surface};
use crate::feti::coarse::{Coarse, Floating};
use crate::feti::factor::{Factors, analyse};
use crate::feti::gather::Gather;
use crate::feti::interior::{self, InteriorFactors};
use crate::feti::kernel::RigidModes;
use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::{self, Preconditioner};
use crate::feti::projector::Projector;
use crate::feti::space::RowSpace;
use crate::material::Material;
use crate::mesh::{Brick, Face};
use crate::monitor::timing::Timer;
use crate::newton::{self, Settings, Solution, StepSettings, StepSolver, TornProblem};
use crate::qp::mprgp::Expansion;
use crate::scene::{self, Scene, SurfaceName};

/// Why a scene has no discrete problem.
#[derive(Debug, Error)]
pub enum StudyError {
    /// Contact surfaces cannot be paired.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Supports contradict each other.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// Some body can move freely.
    #[error(transparent)]
    Floating(#[from] Floating),
}

/// One rank's part of the discrete problem.
pub struct Discrete {
    /// Bodies, in the order of their names.
    pub bodies: Vec<BodyMesh>,
    /// Their materials.
    pub materials: Vec<Material>,
    /// Surfaces that the scene names.
    pub surfaces: Vec<Surface>,
    /// Own subdomains and interface.
    pub decomposition: Decomposition,
    /// All contact pairs of the scene.
    pub pairs: Vec<ContactPair>,
    /// Supports, in the order of their names.
    pub supports: Vec<Support>,
    /// Tractions.
    pub tractions: Vec<Traction>,
    /// Own rows of B.
    pub constraints: Constraints,
}

/// Discretises a scene. Collective.
///
/// # Errors
/// If contacts cannot be paired or supports contradict each other: the same error on every rank.
pub fn discretise(scene: &Scene, comm: &dyn Comm) -> Result<Discrete, StudyError> {
    let names: Vec<&String> = scene.body.keys().collect();
    let bodies = decomposition::number_bodies(
        scene.body.values().map(|b| Brick { origin: b.brick.origin, size: b.brick.size, cells: b.brick.cells }).collect(),
    );
    let materials = scene.body.values().map(|b| material(&scene.material[&b.material])).collect();
    let surface = |name: &SurfaceName| Surface {
        body: names.iter().position(|n| **n == name.body).expect("a checked scene names its bodies"),
        face: Face::ALL[name.face as usize],
    };
    let mut surfaces: Vec<Surface> = scene
        .support
        .values()
        .map(|s| &s.surface)
        .chain(scene.load.values().map(|l| &l.surface))
        .chain(scene.contact.values().flat_map(|c| [&c.slave, &c.master]))
        .map(surface)
        .collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    let index = |name: &SurfaceName| surfaces.binary_search(&surface(name)).expect("every named surface is listed");

    let cut = match scene.decomposition {
        scene::Decomposition::Bricks { cells } => Cut::Bricks(cells),
        scene::Decomposition::Metis { subdomains } => Cut::Metis(subdomains),
    };
    let decomposition = decomposition::tear(&bodies, &surfaces, cut, comm);

    let mut pairs = Vec::new();
    for (number, (name, contact)) in scene.contact.iter().enumerate() {
        let gather = |s: &SurfaceName| GatheredSurface::gather(comm, &decomposition.subdomains, index(s));
        pairs.extend(matching::pair(number, name, &gather(&contact.slave), &gather(&contact.master))?);
    }
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
    let tractions = scene.load.values().map(|l| Traction { surface: index(&l.surface), value: l.traction }).collect();
    let constraints = Constraints::new(comm, &decomposition, &supports, &pairs)?;
    Ok(Discrete { bodies, materials, surfaces, decomposition, pairs, supports, tractions, constraints })
}

fn material(m: &scene::Material) -> Material {
    Material { young: m.young, poisson: m.poisson, yield_stress: m.yield_stress, hardening: m.hardening }
}

/// Solves a discretised scene. Collective.
///
/// # Errors
/// If the constraints leave a rigid motion free: on every rank.
pub fn solve(scene: &Scene, discrete: &Discrete, comm: &dyn Comm, timer: &Timer) -> Result<Solution, StudyError> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains[..]);
    let gather = Gather::new(comm, shares, constraints, subdomains.iter().map(|s| s.dofs()).collect());
    let space = RowSpace::new(comm, shares, constraints);
    let modes: Vec<RigidModes> = subdomains.iter().map(|s| RigidModes::new(&s.points)).collect();
    let coarse = timer.time("coarse setup", || Coarse::new(comm, shares, subdomains, &modes, constraints, &gather))?;
    let symbolic = timer.time("symbolic analysis", || analyse(subdomains));
    let interior = || {
        let boundaries = preconditioner::boundaries(&gather, subdomains.len());
        InteriorFactors::new(interior::analyse(&symbolic, boundaries))
    };
    let interior = match scene.solver.preconditioner {
        scene::Preconditioner::None => None,
        scene::Preconditioner::Lumped => Some(None),
        scene::Preconditioner::Dirichlet => Some(Some(timer.time("symbolic analysis", interior))),
    };
    let preconditioner = interior.map(|interior| Preconditioner::new(&gather, interior));
    let factors = Factors::new(symbolic);
    let mut loads = gather.zeros();
    for (subdomain, f) in subdomains.iter().zip(&mut loads) {
        loads::add_tractions(subdomain, &discrete.tractions, f);
    }
    let problem = TornProblem {
        subdomains,
        materials: subdomains.iter().map(|s| discrete.materials[s.body]).collect(),
        modes: &modes,
        loads,
        constraints,
        gather: &gather,
        space: &space,
        yields: discrete.materials.iter().any(|m| m.yield_stress.is_some()),
    };
    let solver = &scene.solver;
    let step = StepSettings {
        tolerance: solver.qp_tolerance,
        products: solver.qp_limit,
        expansion: match solver.expansion {
            scene::Expansion::ProjectedCg => Expansion::ProjectedCg,
            scene::Expansion::Fixed => Expansion::Fixed,
        },
    };
    let settings =
        Settings { tolerance: solver.newton_tolerance, residual: solver.residual_tolerance, limit: solver.newton_limit };
    let mut steps = StepSolver::new(DualOperator::new(factors, &gather), Projector { coarse }, preconditioner, step, subdomains.len());
    Ok(newton::solve(&problem, &mut steps, &settings, timer, &mut |r| println!("{r:?}")))
}

/// Numbers of gluing, support and contact rows over all ranks. Collective.
pub fn count_rows(discrete: &Discrete, comm: &dyn Comm) -> [usize; 3] {
    let space = RowSpace::new(comm, &discrete.decomposition.shares, &discrete.constraints);
    let mut partial = Vec::new();
    for rows in space.owned() {
        let mut counts = [0.0; 3];
        for &row in rows {
            counts[match discrete.constraints.rows[row as usize].kind {
                Kind::Gluing => 0,
                Kind::Support { .. } => 1,
                Kind::Contact { .. } => 2,
            }] += 1.0;
        }
        partial.extend(counts);
    }
    let sum = space.sum(&partial, 3);
    [0, 1, 2].map(|k| sum[k] as usize)
}
