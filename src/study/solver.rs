//! The solver of a scene's Newton steps: FETI set up on the subdomains of a rank, as the scene's settings want it.

use crate::comm::Comm;
use crate::decomposition::twins::{alike, twins};
use crate::feti::coarse::Coarse;
use crate::feti::dual::Interconnection;
use crate::feti::dual::hybrid::Hybrid;
use crate::feti::dual::operator::DualOperator;
use crate::feti::inverse::Inverse;
use crate::feti::inverse::factor::analyse;
use crate::feti::inverse::pins::Pins;
use crate::feti::inverse::schur::Schur;
use crate::feti::preconditioner::Preconditioner;
use crate::model::history::Stage;
use crate::model::{self, Discrete, ModelError};
use crate::monitor::timing::Timer;
use crate::newton::{ProgramSettings, Settings, StepSolver};
use crate::scene::{self, Scene};
use crate::sparse::cholesky::Precision;
#[cfg(test)]
use crate::{
    decomposition::sums::NodeSums,
    newton::{Begin, Newton, TornProblem},
};

/// The solver, before anything is factorised but the coarse problem. Collective.
///
/// # Errors
/// If supports, contacts and loads do not hold all bodies.
pub(super) fn step_solver<'a>(
    scene: &Scene,
    discrete: &'a Discrete,
    comm: &'a dyn Comm,
    connection: &'a Interconnection<'a>,
    stages: &[Stage],
    timer: &Timer,
) -> Result<StepSolver<'a>, ModelError> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let Interconnection { gather, space, .. } = connection;
    let modes = connection.modes();
    let subdomains = &decomposition.subdomains[..];
    let mut coarse = timer.time("coarse set-up", || Coarse::new(comm, decomposition, constraints, connection));
    let symbolic = timer.time("symbolic analysis", || analyse(subdomains));
    let precision = match scene.solver.precision {
        scene::Precision::Mixed => Precision::Single,
        scene::Precision::Double => Precision::Double,
    };
    let schur = |precision| {
        let boundaries = gather.boundaries();
        let alike = timer.time("symbolic analysis", || alike(comm, subdomains, &boundaries));
        timer.time("symbolic analysis", || Schur::new(&symbolic, boundaries, &alike, precision))
    };
    let schur = match scene.solver.preconditioner {
        scene::Preconditioner::None => None,
        scene::Preconditioner::Lumped => Some(schur(None)),
        scene::Preconditioner::Dirichlet => Some(schur(Some(precision))),
    };
    let preconditioner =
        schur.map(|schur| timer.time("interfaces", || Preconditioner::new(connection, constraints, schur)));
    timer.time("coarse set-up", || model::held::at_all_stages(scene, discrete, &mut coarse, space, modes, stages))?;
    let hybrid = timer.time("clusters", || Hybrid::of_clusters(connection, decomposition, constraints))?;
    let pins = timer.time("symbolic analysis", || Pins::of_supports(constraints, subdomains));
    let has_pins = space.counts([pins.iter().filter(|pins| !pins.unknowns.is_empty()).count() as u64]) != [0];
    let pins = has_pins.then_some(pins);
    let twins = timer.time("symbolic analysis", || twins(comm, subdomains));
    let inverse = Inverse::new(symbolic, precision, twins, pins);
    let operator = DualOperator::new(inverse, hybrid, gather);
    Ok(StepSolver::new(operator, coarse, preconditioner, programs(scene)))
}

/// How the quadratic programs are solved.
fn programs(scene: &Scene) -> ProgramSettings {
    let solver = &scene.solver;
    ProgramSettings { method: solver.qp, tolerance: solver.qp_tolerance, products: solver.qp_limit }
}

/// Residuals at a limit load are at most this share of the wanted distance of its bounds: they were seen to change the factor by up to
/// five times as much.
const BALANCED: f64 = 0.03;

/// When Newton's method stops.
pub(super) fn settings(scene: &Scene) -> Settings {
    let solver = &scene.solver;
    // An equilibrium is a lower bound of a limit load if it is one, wherever another one is that does the same work.
    let (tolerance, residual) = match &scene.limit {
        None => (solver.newton_tolerance, solver.residual_tolerance),
        Some(limit) => (f64::INFINITY, solver.residual_tolerance.max(BALANCED * limit.tolerance)),
    };
    Settings {
        tolerance,
        residual,
        limit: solver.newton_limit,
        accuracy: solver.accuracy.filter(|_| scene.limit.is_none()),
    }
}

/// What is made of Newton's method at the beginning of a scene's only increment, for the tests of all rooms. Collective.
#[cfg(test)]
pub(crate) fn with_newton<T>(
    scene: &Scene,
    comm: &dyn Comm,
    then: impl FnOnce(&mut Newton, &Discrete, &Timer) -> T,
) -> T {
    let timer = &Timer::start();
    let discrete = &model::discretise(scene, comm).expect("the scene has a discrete problem");
    let connection = Interconnection::new(comm, &discrete.decomposition, &discrete.constraints);
    let sums = NodeSums::new(comm, &discrete.decomposition);
    let (conditions, stages) = model::history::stages(scene, discrete, &|| connection.gather.zeros());
    let solver = step_solver(scene, discrete, comm, &connection, &stages, timer).expect("the bodies are held");
    let problem = TornProblem::new(discrete, &connection, &sums, conditions);
    then(&mut Newton::new(problem, solver, settings(scene), (stages, None), Begin::Rest, timer), discrete, timer)
}
