//! The pipeline from a scene to results: the only file that sees every stage.

mod conditions;

use std::cell::{Cell, RefCell};
use std::time::SystemTime;

use thiserror::Error;

use crate::assembly::loads::Traction;
use crate::bodies::{self, MeshError, Meshes};
use crate::cascade;
use crate::comm::{Comm, Shares, all_gather_u64, ordered_sum};
use crate::constraint::{Constraints, Kind, Support, dirichlet};
use crate::contact::surface::GatheredSurface;
use crate::contact::{ContactError, ContactPair, matching, mortar, rigid};
use crate::decomposition::bricks::Boxes;
use crate::decomposition::twins::twins;
use crate::decomposition::{self, Bodies, BodyMesh, Cut, Decomposition, Patch, Surface, cost};
use crate::feti::Torn;
use crate::feti::cholesky::Precision;
use crate::feti::coarse::{Coarse, Floating};
use crate::feti::coupling::Coupling;
use crate::feti::factor::{Factors, analyse};
use crate::feti::gather::Gather;
use crate::feti::kernel::RigidModes;
use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::{self, Preconditioner};
use crate::feti::projector::Projector;
use crate::feti::schur::Schur;
use crate::feti::space::RowSpace;
use crate::material::Material;
use crate::mesh::Face;
use crate::monitor::events::Event;
use crate::monitor::timing::{Timer, peak_rss_mb};
use crate::newton::loading::{self, At, Followed, Progress};
use crate::newton::{
    self, Committed, Method, ProgramSettings, Settings, Solution, StepRecord, StepSolver, TornProblem, Watch,
};
use crate::qp::mprgp::Expansion;
use crate::results::fields::{self, ContactState};
use crate::results::piece::Piece;
use crate::results::summary::{Counters, NewtonRow, Residuals, Sizes, State, StepRow, Summary};
use crate::results::vtkhdf::Records;
use crate::results::{provenance, summary};
use crate::scene::{self, Scene, SurfaceName};
pub use conditions::RightHandSides;

/// Why a scene has no discrete problem; the same on every rank.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A mesh file is missing or bad.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A contact has no conditions, or impossible ones.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Supports contradict each other.
    #[error("{0}")]
    Supports(String),
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
    /// Names of the contacts.
    pub contacts: Vec<String>,
    /// All contact pairs of the scene.
    pub pairs: Vec<ContactPair>,
    /// Supports, in the order of their names.
    pub supports: Vec<Support>,
    /// Tractions.
    pub tractions: Vec<Traction>,
    /// Own rows of B.
    pub constraints: Constraints,
    /// What the user should know of the meshes.
    pub warnings: Vec<String>,
    /// Indices of the surfaces in contact.
    pub touching: Vec<usize>,
    /// Largest resident memory of rank 0 until meshes from files were read and sent out, in MiB.
    pub reading_mb: Option<f64>,
    /// Their right-hand sides over the load history.
    pub right_hand_sides: RightHandSides,
}

/// Discretises a scene. Collective.
///
/// # Errors
/// If contacts cannot be paired or supports contradict each other.
pub fn discretise(scene: &Scene, comm: &dyn Comm) -> Result<Discrete, StudyError> {
    discretise_by_cost(scene, None, comm)
}

/// As [`discretise`], but spreads the subdomains over the ranks by their costs.
///
/// # Errors
/// As there.
pub fn discretise_by_cost(scene: &Scene, costs: Option<&[u64]>, comm: &dyn Comm) -> Result<Discrete, StudyError> {
    let Meshes { bodies, tets, warnings } = Meshes::new(scene, comm)?;
    let materials = scene.body.values().map(|b| material(&scene.material[&b.material])).collect();
    let surface = |name: &SurfaceName| {
        let body = scene.body.keys().position(|known| *known == name.body).expect("a checked scene names its bodies");
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

    let torn = Bodies { bodies: &bodies, meshes: &tets, surfaces: &surfaces, contact: &touching };
    let decomposition = decomposition::tear(&torn, cut(&scene.decomposition, &bodies), costs, comm);
    drop(tets);
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
    let mut pairs = Vec::new();
    for (number, (name, contact)) in scene.contact.iter().enumerate() {
        let gather = |s: &SurfaceName| GatheredSurface::gather(comm, &decomposition.subdomains, index(s));
        let slave = gather(contact.slave());
        pairs.extend(match contact {
            scene::Contact::Surfaces { master, .. } => {
                let master = gather(master);
                match matching::pair(number, &slave, &master) {
                    Some(pairs) if pairs.is_empty() => return Err(ContactError::Apart { name: name.clone() }.into()),
                    Some(pairs) => pairs,
                    None => {
                        let held = dirichlet::held(comm, &decomposition.interface, &supports, &slave.nodes);
                        mortar::pair(number, name, &slave, &master, &held)?
                    }
                }
            }
            scene::Contact::Rigid { rigid: obstacle, .. } => rigid::pair(number, name, &slave, obstacle)?,
        });
    }
    let tractions = scene.load.values().map(|l| Traction { surface: index(&l.surface), value: l.traction }).collect();
    let contacts: Vec<String> = scene.contact.keys().cloned().collect();
    let given =
        conditions::Given { decomposition: &decomposition, supports: &supports, contacts: &contacts, pairs: &pairs };
    let (constraints, right_hand_sides) = conditions::constraints(scene, comm, &given)?;
    Ok(Discrete {
        bodies,
        materials,
        surfaces,
        decomposition,
        contacts,
        pairs,
        supports,
        tractions,
        constraints,
        warnings,
        touching,
        reading_mb,
        right_hand_sides,
    })
}

/// Overlap, in diameters of a slave node's share of the surface, that may remain where supports hold both sides.
const HELD_OVERLAP: f64 = 1e-6;

/// Refuses contacts that supports violate. Collective.
fn refuse_held(
    comm: &dyn Comm,
    names: &[String],
    pairs: &[ContactPair],
    constraints: &Constraints,
) -> Result<(), ContactError> {
    let mine: Vec<u64> = constraints.idle.iter().flat_map(|&(pair, left)| [pair as u64, left.to_bits()]).collect();
    let all = all_gather_u64(comm, &mine);
    let mut depths: Vec<(usize, f64)> =
        all.chunks_exact(2).map(|idle| (idle[0] as usize, -f64::from_bits(idle[1]))).collect();
    depths.sort_by_key(|(pair, _)| *pair);
    depths.dedup_by_key(|(pair, _)| *pair);
    depths.retain(|&(pair, depth)| depth > HELD_OVERLAP * pairs[pair].area.sqrt());
    let Some(&(first, _)) = depths.first() else { return Ok(()) };
    let contact = pairs[first].contact;
    let of_contact = || depths.iter().filter(|(pair, _)| pairs[*pair].contact == contact);
    let depth = of_contact().fold(0.0_f64, |deepest, (_, depth)| deepest.max(*depth));
    Err(ContactError::Held { name: names[contact].clone(), nodes: of_contact().count(), depth })
}

/// Rank 0's largest resident memory so far if it has read a mesh. Collective.
fn reading_mb(bodies: &[BodyMesh], comm: &dyn Comm) -> Option<f64> {
    let mut megabytes = [peak_rss_mb().unwrap_or(f64::NAN)];
    comm.broadcast(&mut megabytes);
    let has_read = bodies.iter().any(|body| body.brick().is_none());
    Some(megabytes[0]).filter(|megabytes| has_read && megabytes.is_finite())
}

/// How the scene wants its bodies cut.
fn cut(wanted: &scene::Decomposition, bodies: &[BodyMesh]) -> Cut {
    let divides =
        |body: &BodyMesh| body.brick().is_some_and(|b| (0..3).all(|a| b.cells[a] % scene::PAPER_CELLS[a] == 0));
    match *wanted {
        scene::Decomposition::Bricks { cells } => Cut::Bricks(cells),
        scene::Decomposition::Auto if bodies.iter().all(divides) => Cut::Bricks(scene::PAPER_CELLS),
        scene::Decomposition::Metis { subdomains: Some(parts) } => Cut::Metis(parts),
        scene::Decomposition::Metis { subdomains: None } | scene::Decomposition::Auto => {
            Cut::Metis(cost::subdomains(bodies.iter().map(|b| b.counts().elements).sum(), bodies.len()))
        }
    }
}

fn material(m: &scene::Material) -> Material {
    let scene::Material { young, poisson, yield_stress, hardening, kinematic_hardening } = *m;
    Material { young, poisson, yield_stress, hardening, kinematic_hardening }
}

/// Counts what a discrete problem consists of, in the paper's way. Collective.
pub fn sizes(discrete: &Discrete, comm: &dyn Comm) -> Sizes {
    let Discrete { decomposition, constraints, bodies, .. } = discrete;
    let space = RowSpace::new(comm, &decomposition.shares, constraints);
    let mut partial = Vec::new();
    for (rows, subdomain) in space.owned().iter().zip(&decomposition.subdomains) {
        let touches = subdomain.facets.iter().any(|facet| discrete.touching.contains(&facet.surface));
        let mut counts = [subdomain.dofs() as f64, 0.0, 0.0, 0.0, f64::from(touches)];
        for &row in rows {
            counts[match constraints.rows[row as usize].kind {
                Kind::Gluing => 1,
                Kind::Support { .. } => 2,
                Kind::Contact { .. } => 3,
            }] += 1.0;
        }
        partial.extend(counts);
    }
    let sum: Vec<u64> = space.sum(&partial, 5).into_iter().map(|n| n as u64).collect();
    Sizes {
        nodes: bodies.iter().map(|b| b.counts().nodes).sum(),
        cells: bodies.iter().map(|b| b.counts().cells).sum(),
        elements: bodies.iter().map(|b| b.counts().elements).sum(),
        subdomains: decomposition.shares.total() as u64,
        contact_subdomains: sum[4],
        primal_dofs: sum[0],
        gluing_rows: sum[1],
        dirichlet_rows: sum[2],
        contact_rows: sum[3],
        dual_dofs: sum[1] + sum[2] + sum[3],
    }
}

/// Memory that solving would take on all ranks together, in MiB: factors, tangents, multipliers and coarse problem.
/// Subdomains of equal connectivity are analysed once. Collective.
pub fn memory_estimate_mb(scene: &Scene, discrete: &Discrete, comm: &dyn Comm) -> f64 {
    let Discrete { decomposition, constraints, .. } = discrete;
    let analysed = analyse(&decomposition.subdomains);
    // The interior factor of the Dirichlet preconditioner is about a third of the whole one on cubes.
    let interior = if scene.solver.preconditioner == scene::Preconditioner::Dirichlet { 1.35 } else { 1.0 };
    let factors = if scene.solver.precision == scene::Precision::Mixed { 0.5 * interior } else { interior };
    let doubles: f64 = analysed
        .iter()
        .map(|s| {
            factors * s.analysis().factor_length() as f64
                + 1.5 * s.pattern.rows.len() as f64
                + 12.0 * s.pattern.dofs() as f64
        })
        .sum();
    // A row of G' and a row's terms; the coarse factor is small beside them.
    let slots = 12.0 * constraints.slot_subdomain.len() as f64;
    let mine = 8.0 * (doubles + slots) / f64::from(1 << 20);
    ordered_sum(comm, &Shares(vec![1; comm.size()]), &[mine], 1)[0] + PROCESS_MB * comm.size() as f64
}

/// What a process takes before it holds anything (MPI, HDF5), in MiB.
const PROCESS_MB: f64 = 30.0;

/// What a solved scene gives.
pub struct Solved {
    /// Numbers for scripts: sizes, counts, forces, energies, residuals.
    pub summary: Summary,
    /// This rank's mesh and fields.
    pub piece: Piece,
    /// What is stored beside the fields.
    pub records: Records,
    /// This rank's displacement.
    pub u: Torn,
    /// Closed contact pairs whose rows are on this rank, by index.
    pub closed: Vec<u64>,
}

/// What a solved scene suggests as the start on a finer mesh of the same bodies. Collective.
pub fn refine(comm: &dyn Comm, coarse: (&Discrete, &Solved), fine: &Discrete) -> newton::Start {
    let (coarse, solved) = coarse;
    let u = cascade::interpolate(
        comm,
        (&coarse.bodies, &coarse.decomposition.subdomains, &solved.u),
        (&fine.bodies, &fine.decomposition.subdomains),
    );
    let (from, to) = ((&coarse.bodies[..], &coarse.pairs[..]), (&fine.bodies[..], &fine.pairs[..]));
    let closed = cascade::closed_contacts(comm, from, &solved.closed, to);
    let held = |kind| if let Kind::Contact { pair } = kind { closed[pair] } else { true };
    newton::Start { u, held: fine.constraints.rows.iter().map(|row| held(row.kind)).collect() }
}

/// What the subdomains of a finer mesh are likely to cost, from where a solved scene yields. `None` if they are not known
/// before the mesh is cut. Collective.
pub fn expected_costs(comm: &dyn Comm, coarse: (&Discrete, &Solved), fine: &Scene) -> Option<Vec<u64>> {
    let bodies = bodies::bricks(fine)?;
    let Cut::Bricks(cells) = cut(&fine.decomposition, &bodies) else { return None };
    let (coarse, solved) = coarse;
    let boxes = Boxes::new(&bodies, cells);
    let material = |body: usize| &coarse.materials[body];
    Some(cascade::costs(comm, (&coarse.bodies, &coarse.decomposition.subdomains, &solved.u), material, &boxes))
}

/// Solves a discretised scene, from rest or from a start; `report` is told what happens. Collective.
///
/// # Errors
/// If the constraints leave a rigid motion free.
pub fn solve(
    scene: &Scene,
    discrete: &Discrete,
    comm: &dyn Comm,
    start: Option<newton::Start>,
    timer: &Timer,
    report: &mut dyn FnMut(Event),
) -> Result<Solved, StudyError> {
    let started = SystemTime::now();
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains[..]);
    let gather = Gather::new(comm, shares, constraints, subdomains.iter().map(|s| s.dofs()).collect());
    let space = RowSpace::new(comm, shares, constraints);
    let modes: Vec<RigidModes> = subdomains.iter().map(|s| RigidModes::new(&s.points)).collect();
    let coarse = timer.time("coarse set-up", || Coarse::new(comm, shares, subdomains, &modes, constraints, &gather))?;
    let symbolic = timer.time("symbolic analysis", || analyse(subdomains));
    let precision = match scene.solver.precision {
        scene::Precision::Mixed => Precision::Single,
        scene::Precision::Double => Precision::Double,
    };
    let schur = |precision| {
        let boundaries = preconditioner::boundaries(&gather, subdomains.len());
        timer.time("symbolic analysis", || Schur::new(&symbolic, boundaries, precision))
    };
    let preconditioner = match scene.solver.preconditioner {
        scene::Preconditioner::None => None,
        scene::Preconditioner::Lumped => Some(Preconditioner::new(&gather, schur(None))),
        scene::Preconditioner::Dirichlet => Some(Preconditioner::new(&gather, schur(Some(precision)))),
    };
    let (loading::Conditions { loads, rhs }, stages) = conditions::stages(scene, discrete, &|| gather.zeros());
    let mut problem = TornProblem {
        subdomains,
        materials: subdomains.iter().map(|s| discrete.materials[s.body]).collect(),
        modes: &modes,
        loads,
        rhs,
        committed: Committed::default(),
        constraints,
        gather: &gather,
        coupling: RefCell::new(Coupling::new(constraints)),
        space: &space,
        yields: discrete.materials.iter().any(|m| m.yield_stress.is_some()),
    };
    let solver = &scene.solver;
    let method = match (solver.qp, solver.expansion) {
        (scene::Qp::ActiveSet, _) => Method::ActiveSet,
        (scene::Qp::SmalseM, scene::Expansion::ProjectedCg) => Method::Smalse(Expansion::ProjectedCg),
        (scene::Qp::SmalseM, scene::Expansion::Fixed) => Method::Smalse(Expansion::Fixed),
    };
    let programs = ProgramSettings { method, tolerance: solver.qp_tolerance, products: solver.qp_limit };
    let settings = Settings {
        tolerance: solver.newton_tolerance,
        residual: solver.residual_tolerance,
        limit: solver.newton_limit,
    };
    let operator = DualOperator::new(Factors::new(symbolic, precision), &gather);
    let mut steps = StepSolver::new(operator, Projector { coarse }, preconditioner, programs, twins(comm, subdomains));
    let report = RefCell::new(report);
    let alive = |step, applications| {
        report.borrow_mut()(Event::Inner { step: step as u64, hessian_multiplications: applications as u64 });
    };
    let number = Cell::new(1);
    let step = |record: &StepRecord| report.borrow_mut()(Event::NewtonStep(newton_row(number.get(), record)));
    let watch = Watch { timer, alive: &alive, step: &step };
    // A scene that has a start has no history: the right-hand sides at its beginning are those of its end.
    let start = start.map(|mut start| {
        problem.make_admissible(&mut start.u);
        start
    });
    let mut piece = fields::mesh(subdomains, comm.rank());
    let (mut rows, mut closed): (Vec<StepRow>, Vec<u64>) = Default::default();
    let mut tell = |problem: &TornProblem, progress: Progress| match progress {
        Progress::Attempt(at) => {
            number.set(at.number);
            place(scene, at).into_iter().for_each(|place| report.borrow_mut()(Event::Increment(place)));
        }
        Progress::Halved(at, outcome) => {
            let (place, reason) = (place(scene, at).unwrap_or_default(), outcome.message().unwrap_or_default());
            report.borrow_mut()(Event::Warning(format!("{place}: {reason}; the increment is halved")));
        }
        Progress::Solution(at, solution) => {
            let contact = contact_states(problem, solution);
            fields::record(&mut piece, at.time(), problem, &solution.u, &discrete.pairs, &contact);
            rows.push(step_row(scene, discrete, problem, at, solution, &contact));
            closed = contact.iter().filter(|state| state.force > 0.0).map(|state| state.pair as u64).collect();
        }
    };
    let followed = loading::follow(&mut problem, &mut steps, &settings, start, stages, &watch, &mut tell);

    let summary = summarise(scene, discrete, &followed, rows, comm);
    let records = Records {
        provenance: provenance::collect(comm, &scene.to_toml(), shares, started),
        convergence: convergence(&summary.newton),
    };
    Ok(Solved { summary, piece, records, u: followed.solution.u, closed })
}

/// Where in the history an attempt leads, in words; scenes without `[[step]]` have no history to speak of.
fn place(scene: &Scene, at: At) -> Option<String> {
    let step = scene.step.get(at.stage)?;
    let mut text = format!("load step {}", at.stage + 1);
    if !step.name.is_empty() {
        text += &format!(" ({})", step.name);
    }
    if step.increments > 1 {
        text += &format!(", increment {} of {}", at.increment, step.increments);
    }
    if at.fraction != at.increment as f64 / step.increments as f64 {
        text += &format!(", up to {:.4} of the step", at.fraction);
    }
    Some(text)
}

/// An increment in numbers.
fn step_row(
    scene: &Scene,
    discrete: &Discrete,
    problem: &TornProblem,
    at: At,
    solution: &Solution,
    contact: &[ContactState],
) -> StepRow {
    StepRow {
        step: at.stage as u64 + 1,
        name: scene.steps()[at.stage].name.clone(),
        increment: at.increment as u64,
        time: at.time(),
        halvings: at.halvings as u64,
        converged: solution.outcome == newton::Outcome::Converged,
        state: state(discrete, problem, solution, contact),
    }
}

fn newton_row(increment: usize, record: &StepRecord) -> NewtonRow {
    NewtonRow {
        increment: increment as u64,
        step: record.number as u64,
        criterion: record.criterion,
        residual: record.residual,
        damping: record.damping,
        plastic_elements: record.plastic_elements as u64,
        active_contacts: record.active_contacts as u64,
        energy: record.energy,
        qp_iterations: (record.statistics.outer + record.statistics.sets) as u64,
        hessian_multiplications: record.applications as u64,
        factorisations: record.factorisations as u64,
        seconds: record.seconds,
    }
}

/// The Newton steps as columns of a table; with more than one increment the first says which.
fn convergence(rows: &[NewtonRow]) -> Vec<(String, Vec<f64>)> {
    let column = |name: &str, value: fn(&NewtonRow) -> f64| (name.to_owned(), rows.iter().map(value).collect());
    let several = rows.iter().any(|row| row.increment > 1);
    let increment = several.then(|| column("increment", |r| r.increment as f64));
    let columns = [
        column("criterion", |r| r.criterion),
        column("residual", |r| r.residual),
        column("damping", |r| r.damping),
        column("energy", |r| r.energy),
        column("plastic_elements", |r| r.plastic_elements as f64),
        column("active_contacts", |r| r.active_contacts as f64),
        column("hessian_multiplications", |r| r.hessian_multiplications as f64),
        column("factorisations", |r| r.factorisations as f64),
    ];
    increment.into_iter().chain(columns).collect()
}

/// Contact of every pair whose row is on this rank.
fn contact_states(problem: &TornProblem, solution: &Solution) -> Vec<ContactState> {
    let slack = problem.slack(&solution.u);
    let rows = problem.constraints.rows.iter().zip(&slack).zip(&solution.lambda);
    rows.filter_map(|((row, slack), lambda)| {
        let Kind::Contact { pair } = row.kind else { return None };
        Some(ContactState { pair, force: row.scale * lambda, gap: slack / row.scale })
    })
    .collect()
}

/// The numbers of a run; what belongs to the whole run (times, scene name, ranks) is filled in by the caller.
fn summarise(scene: &Scene, discrete: &Discrete, followed: &Followed, rows: Vec<StepRow>, comm: &dyn Comm) -> Summary {
    let Followed { solution, steps, failure } = followed;
    let sizes = sizes(discrete, comm);
    let state = rows.last().map(|row| row.state.clone()).unwrap_or_default();
    let total = |count: fn(&StepRecord) -> usize| Some(steps.iter().map(|(_, s)| count(s)).sum::<usize>() as u64);
    let message = |(at, outcome): &(At, newton::Outcome)| {
        let message = outcome.message()?;
        Some(place(scene, *at).map_or(message.clone(), |place| format!("{place}: {message}")))
    };
    Summary {
        title: scene.title.clone(),
        converged: Some(failure.is_none()),
        plastic_fraction: Some(solution.plastic_elements as f64 / sizes.elements as f64),
        newton_iterations: Some(steps.len() as u64),
        qp: qp_name(scene, discrete.constraints.has_inequalities).to_owned(),
        counters: Counters {
            smalse_iterations: total(|s| s.statistics.outer),
            active_set_iterations: total(|s| s.statistics.sets),
            dual_iterations: total(|s| s.statistics.cg + s.statistics.expansions + s.statistics.proportionings),
            hessian_multiplications: total(|s| s.applications),
            preconditioner_applications: total(|s| s.statistics.preconditioner),
            factorisations: total(|s| s.factorisations),
        },
        error: failure.as_ref().and_then(message),
        newton: steps.iter().map(|(increment, record)| newton_row(*increment, record)).collect(),
        steps: rows,
        state,
        sizes,
        ..summary::Summary::default()
    }
}

/// What a solution is like. Collective.
fn state(discrete: &Discrete, problem: &TornProblem, solution: &Solution, contact: &[ContactState]) -> State {
    let reactions = problem.reactions(&solution.u, &solution.lambda, discrete.supports.len());
    let contact_forces = contact_forces(problem, discrete, contact);
    let names = discrete.supports.iter().map(|s| s.name.clone());
    let maximum = |x: f64| problem.space.maximum(x);
    State {
        plastic_elements: Some(solution.plastic_elements as u64),
        active_contacts: Some(problem.active_contacts(&solution.lambda) as u64),
        contact_force: Some(std::array::from_fn(|axis| {
            contact_forces.iter().fold(0.0, |sum, force| sum + force[axis])
        })),
        contact_forces: discrete.contacts.iter().cloned().zip(contact_forces).collect(),
        reactions: names.zip(reactions).collect(),
        external_work: Some(solution.external_work),
        internal_energy: Some(solution.internal_energy),
        energy: Some(solution.energy),
        max_displacement: Some(maximum(newton::residuals::largest_displacement(&solution.u))),
        max_von_mises: Some(maximum(fields::largest_von_mises(problem, &solution.u))),
        residuals: Residuals {
            equilibrium: Some(solution.residuals.equilibrium),
            gluing: Some(solution.residuals.gluing),
            gap: Some(solution.residuals.gap),
            complementarity: Some(solution.residuals.complementarity),
        },
    }
}

/// The solver of the quadratic programs, by its name in scene files.
fn qp_name(scene: &Scene, has_inequalities: bool) -> &'static str {
    match scene.solver.qp {
        _ if !has_inequalities => "pcpg",
        scene::Qp::SmalseM => "smalse-m",
        scene::Qp::ActiveSet => "active-set",
    }
}

/// Force that the other side exerts on the slave surface of each contact.
fn contact_forces(problem: &TornProblem, discrete: &Discrete, contact: &[ContactState]) -> Vec<[f64; 3]> {
    let Discrete { contacts, pairs, .. } = discrete;
    let mut of_pair = vec![None; pairs.len()];
    contact.iter().for_each(|state| of_pair[state.pair] = Some(state.force));
    let mut partial = Vec::new();
    for rows in problem.space.owned() {
        let mut sums = vec![[0.0; 3]; contacts.len()];
        for &row in rows {
            if let Kind::Contact { pair } = problem.constraints.rows[row as usize].kind {
                let force = pairs[pair].force(of_pair[pair].unwrap_or_default());
                sums[pairs[pair].contact].iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
            }
        }
        partial.extend_from_slice(sums.as_flattened());
    }
    let sum = problem.space.sum(&partial, 3 * contacts.len());
    sum.as_chunks::<3>().0.to_vec()
}
