//! The pipeline from a scene to results: the only file that sees every stage.

pub mod contact;
mod fields;
mod limits;
mod report;
#[cfg(test)]
mod tests;

use std::cell::{Cell, RefCell};
use std::time::SystemTime;

use thiserror::Error;

use self::report::{contact_states, convergence, loss_of_accuracy, newton_row, place, step_row, summarise};
use crate::cascade;
use crate::comm::Comm;
use crate::constraint::Kind;
use crate::decomposition::sums::NodeSums;
use crate::decomposition::twins::{alike, twins};
use crate::decomposition::{Cut, Subdomain};
use crate::feti::Torn;
use crate::feti::coarse::Coarse;
use crate::feti::coarse::projector::Projector;
use crate::feti::dual::coupling::Coupling;
use crate::feti::dual::gather::Gather;
use crate::feti::dual::operator::DualOperator;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::Inverse;
use crate::feti::inverse::factor::analyse;
use crate::feti::inverse::hybrid::Hybrid;
use crate::feti::inverse::kernel;
use crate::feti::inverse::pinnable;
use crate::feti::inverse::schur::Schur;
use crate::feti::preconditioner::Preconditioner;
use crate::material::History;
use crate::model::{self, Discrete, ModelError, bodies};
use crate::monitor::events::Event;
use crate::monitor::timing::Timer;
use crate::newton::loading::{self, Entry, Observer, Progress};
use crate::newton::{self, Committed, Method, ProgramSettings, Settings, StepRecord, StepSolver, TornProblem, Watch};
use crate::qp::mprgp::Expansion;
use crate::record::rows::StepRow;
use crate::record::summary::Summary;
use crate::restart::state::Earlier;
use crate::restart::{self, Standing};
use crate::results::piece::Piece;
use crate::results::provenance;
use crate::results::vtkhdf::Records;
use crate::scene::{self, Scene};
use crate::sparse::cholesky::Precision;

/// Why a scene has no solution; the same on every rank.
#[derive(Debug, Error)]
pub enum StudyError {
    /// It has no discrete problem.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Whoever watches asked to stop between two Newton steps.
    #[error("stopped on request")]
    Stopped,
}

/// Gaps below this share of the largest displacement are closed.
const ROUNDING: f64 = 1e-9;

/// How the solution of a scene begins.
pub enum Begin {
    /// From rest.
    Rest,
    /// Near its solution, which has no history.
    Near(newton::Start),
    /// From the state that an earlier run left, without its loads.
    After(Earlier),
    /// Where another one stood.
    At(Box<Standing>),
}

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
    /// What the integration points of each of this rank's subdomains remember; none where nothing ever yielded.
    pub histories: Vec<Vec<History>>,
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

/// Which boxes of a finer mesh are likely to yield, from where a solved scene does; see [`discretise_expecting`]. `None` if
/// the mesh is not cut into boxes. Collective.
pub fn expected_yielding(comm: &dyn Comm, coarse: (&Discrete, &Solved), fine: &Scene) -> Option<Vec<Vec<bool>>> {
    let bodies = bodies::bricks(fine)?;
    let Cut::Bricks(cells) = model::discrete::cut(&fine.decomposition.method, &bodies) else { return None };
    let (coarse, solved) = coarse;
    let material = |s: &Subdomain| &coarse.materials[s.material];
    let coarse = (&coarse.bodies[..], &coarse.decomposition.subdomains[..], &solved.u);
    Some(cascade::yielding(comm, coarse, material, (&bodies, cells)))
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
    let begin = start.map_or(Begin::Rest, Begin::Near);
    solve_from(scene, discrete, comm, begin, timer, report, &|_| false)
}

/// As [`solve`]. Between two Newton steps `pause` is asked whether to stop there, and handed what it takes to go on; it is
/// collective, too.
///
/// # Errors
/// As there, and [`StudyError::Stopped`].
pub fn solve_from(
    scene: &Scene,
    discrete: &Discrete,
    comm: &dyn Comm,
    begin: Begin,
    timer: &Timer,
    report: &mut dyn FnMut(Event),
    pause: &dyn Fn(&dyn Fn() -> Standing) -> bool,
) -> Result<Solved, StudyError> {
    let started = SystemTime::now();
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains[..]);
    let gather = Gather::new(comm, shares, constraints, subdomains.iter().map(|s| s.dofs()).collect());
    let space = RowSpace::new(comm, shares, constraints);
    let sums = NodeSums::new(comm, decomposition);
    let modes = kernel::of_clusters(decomposition.clusters.of_rank(comm.rank()), subdomains);
    let mut coarse = timer
        .time("coarse set-up", || Coarse::new(comm, &decomposition.clusters, subdomains, &modes, constraints, &gather));
    let symbolic = timer.time("symbolic analysis", || analyse(subdomains));
    let precision = match scene.solver.precision {
        scene::Precision::Mixed => Precision::Single,
        scene::Precision::Double => Precision::Double,
    };
    let schur = |precision| {
        let boundaries = gather.boundaries();
        let alike = alike(comm, subdomains, &boundaries);
        timer.time("symbolic analysis", || Schur::new(&symbolic, boundaries, &alike, precision))
    };
    let schur = match scene.solver.preconditioner {
        scene::Preconditioner::None => None,
        scene::Preconditioner::Lumped => Some(schur(None)),
        scene::Preconditioner::Dirichlet => Some(schur(Some(precision))),
    };
    let preconditioner = schur.map(|schur| Preconditioner::new(comm, shares, constraints, &gather, schur));
    let (loading::Conditions { loads, rhs }, stages) = model::conditions::stages(scene, discrete, &|| gather.zeros());
    let mut problem = TornProblem {
        subdomains,
        materials: subdomains.iter().map(|s| discrete.materials[s.material]).collect(),
        modes: &modes,
        loads,
        rhs,
        committed: Committed::default(),
        constraints,
        gather: &gather,
        coupling: RefCell::new(Coupling::new(constraints)),
        space: &space,
        sums: &sums,
        yields: discrete
            .bodies
            .iter()
            .flat_map(|b| &b.materials)
            .any(|&m| discrete.materials[m].yield_stress.is_some()),
    };
    timer
        .time("coarse set-up", || model::held::at_all_stages(scene, discrete, &mut coarse, &space, &modes, &stages))?;
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
        accuracy: solver.accuracy,
    };
    let clusters = &decomposition.clusters;
    let hybrid = (!clusters.are_single())
        .then(|| timer.time("clusters", || Hybrid::new(clusters.of_rank(comm.rank()), subdomains)));
    let pinnable = pinnable::unknowns(constraints, subdomains, &modes);
    let inverse = Inverse::new(symbolic, precision, hybrid, twins(comm, subdomains), pinnable);
    let operator = DualOperator::new(inverse, &gather);
    let mut steps = StepSolver::new(operator, Projector::new(coarse), preconditioner, programs);
    let report = RefCell::new(report);
    let alive = |step, applications| {
        report.borrow_mut()(Event::Inner { step: step as u64, hessian_multiplications: applications as u64 });
    };
    let number = Cell::new(1);
    let step = |record: &StepRecord| {
        report.borrow_mut()(Event::NewtonStep(newton_row(number.get(), record)));
        loss_of_accuracy(record).into_iter().for_each(|text| report.borrow_mut()(Event::Warning(text)));
    };
    let watch = Watch { timer, alive: &alive, step: &step };
    let mut piece = fields::mesh(subdomains, comm.rank());
    let fixed = [piece.point_data.len(), piece.cell_data.len()];
    let (mut rows, mut closed): (Vec<StepRow>, Vec<u64>) = Default::default();
    let entry = match begin {
        Begin::Rest => Entry::Rest,
        Begin::Near(mut start) => {
            // Without a history the right-hand sides at its beginning are those of its end.
            problem.make_admissible(&mut start.u);
            Entry::Near(start)
        }
        Begin::After(Earlier { committed, u }) => {
            let closed = ROUNDING * committed.sizes.displacement;
            let rows = constraints.rows.iter().zip(problem.slack(&u));
            let held = rows.map(|(row, slack)| !row.is_inequality() || slack <= closed).collect();
            problem.committed = committed;
            Entry::Near(newton::Start { u, held })
        }
        Begin::At(standing) => {
            let Standing { halt, rows: reached, recorded: Piece { times, point_data, cell_data, .. } } = *standing;
            (rows, piece.times) = (reached, times);
            piece.point_data.extend(point_data);
            piece.cell_data.extend(cell_data);
            Entry::At(Box::new(halt))
        }
    };
    let reached = RefCell::new((piece, rows));
    let mut tell = |problem: &TornProblem, progress: Progress| match progress {
        Progress::Attempt(at) => {
            number.set(at.number);
            place(scene, at).into_iter().for_each(|place| report.borrow_mut()(Event::Increment(place)));
        }
        Progress::Halved(at, outcome) => {
            let place = place(scene, at).unwrap_or_else(|| "the whole load".into());
            let reason = outcome.message().unwrap_or_default();
            report.borrow_mut()(Event::Warning(format!("{place}: {reason}; the increment is halved")));
        }
        Progress::Solution(at, solution) => {
            let contact = contact_states(problem, solution);
            let (piece, rows) = &mut *reached.borrow_mut();
            let von_mises = fields::record(piece, at.time(), problem, solution, discrete.touching(), &contact);
            rows.push(step_row(comm, scene, discrete, problem, (at, solution), &contact, von_mises));
            closed = contact.iter().filter(|state| state.force > 0.0).map(|state| state.pair as u64).collect();
        }
    };
    let pause = |halt: &dyn Fn() -> loading::Halt| {
        pause(&|| {
            let (Piece { times, point_data, cell_data, .. }, rows) = &*reached.borrow();
            let (point_data, cell_data) = (point_data[fixed[0]..].to_vec(), cell_data[fixed[1]..].to_vec());
            let times = times.clone();
            let recorded = Piece { times, point_data, cell_data, ..Piece::default() };
            Standing { halt: halt(), rows: rows.clone(), recorded }
        })
    };
    let observer = Observer { tell: &mut tell, pause: &pause };
    let followed = loading::follow(&mut problem, &mut steps, &settings, entry, &stages, &watch, observer);
    if followed.failure.as_ref().is_some_and(|(_, outcome)| *outcome == newton::Outcome::Stopped) {
        return Err(StudyError::Stopped);
    }
    let (piece, rows) = reached.into_inner();

    if followed.failure.is_none() {
        problem.commit(&followed.solution.u, &followed.solution.lambda);
    }
    let meshes = restart::meshes::meshes(comm, scene, discrete);
    let mesh_names = serde_json::to_string(&meshes).expect("names and numbers can be written");
    let state = restart::state::pack(&problem, meshes);
    let summary = summarise(scene, discrete, &followed, rows, comm);
    let records = Records {
        provenance: provenance::collect(comm, &scene.to_toml(), &mesh_names, shares, started),
        convergence: convergence(&summary.newton),
        state,
    };
    let histories = problem.committed.histories;
    Ok(Solved { summary, piece, records, u: followed.solution.u, closed, histories })
}
