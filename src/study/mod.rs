//! The pipeline from a discrete problem to results: it joins the stages, and computes nothing itself.
//!
//! [`solve`] sets FETI up for the scene (`solver`), steps `Newton` through the history of loads, and keeps what is to be
//! written of each increment (`recorder`): `fields`, [`contact`], rows of the log and the summary (`report`) with the
//! `limits` of the theory. [`cascade`] makes a start on a finer mesh of a solution.

pub mod adaptive;
pub mod cascade;
pub mod contact;
mod fields;
mod goal;
mod limit;
mod limits;
mod named;
mod recorder;
mod report;
pub(crate) mod solver;
#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::time::SystemTime;

use thiserror::Error;

use self::recorder::Recorder;
use self::report::{convergence, loss_of_accuracy, newton_row, place, summarise};
use crate::comm::Comm;
use crate::decomposition::sums::NodeSums;
use crate::feti::Torn;
use crate::feti::dual::Interconnection;
use crate::material::History;
use crate::model::{self, Discrete, ModelError};
use crate::monitor::events::Event;
use crate::monitor::timing::Timer;
use crate::newton::control::Reach;
use crate::newton::{self, Newton, Next, Outcome, TornProblem};
use crate::record::rows::LimitLoad;
use crate::record::summary::Summary;
use crate::restart::state::Earlier;
use crate::restart::{self, Standing};
use crate::results::piece::Piece;
use crate::results::provenance;
use crate::results::vtkhdf::Records;
use crate::scene::{Moved, Scene};

/// Why a scene has no solution; the same on every rank.
#[derive(Debug, Error)]
pub enum StudyError {
    /// It has no discrete problem.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The number whose error is asked for does not exist.
    #[error(transparent)]
    Goal(#[from] goal::GoalError),
    /// The watcher asked to stop between two Newton steps.
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
    /// Near a solution without history of which a displacement is known, and where the limit load is on another mesh.
    Around(Torn, Option<LimitLoad>),
    /// From the state that an earlier run left, without its loads.
    After(Earlier),
    /// Where another one stood.
    At(Box<Standing>),
}

impl Begin {
    /// Where supports and obstacles are then.
    fn moved(&self) -> Moved {
        match self {
            Self::Rest | Self::Near(_) | Self::Around(..) => Moved::default(),
            Self::After(earlier) => earlier.moved.clone(),
            Self::At(standing) => standing.moved.clone(),
        }
    }
}

/// Who watches a solution come about; `()` does not care.
pub trait Watcher {
    /// Is told what happens.
    fn tell(&mut self, event: Event);

    /// Is asked between two Newton steps whether to stop there, and handed what it takes to go on. Collective.
    fn stops(&mut self, _standing: &dyn Fn() -> Standing) -> bool {
        false
    }
}

impl Watcher for () {
    fn tell(&mut self, _event: Event) {}
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

/// Solves a discretised scene. Collective.
///
/// # Errors
/// If the constraints leave a rigid motion free, or the watcher stops it.
pub fn solve(
    scene: &Scene,
    discrete: &Discrete,
    comm: &dyn Comm,
    begin: Begin,
    timer: &Timer,
    watcher: &mut dyn Watcher,
) -> Result<Solved, StudyError> {
    let started = SystemTime::now();
    let Discrete { decomposition, constraints, .. } = discrete;
    let connection = timer.time("interfaces", || Interconnection::new(comm, decomposition, constraints));
    let sums = timer.time("interfaces", || NodeSums::new(comm, decomposition));
    let (mut conditions, stages) = model::history::stages(scene, discrete, &|| connection.gather.zeros());
    let moved = begin.moved();
    if moved != Moved::default() {
        conditions.rhs = model::conditions::right_hand_sides(scene, discrete, &moved);
    }
    let solver = solver::step_solver(scene, discrete, comm, &connection, &stages, timer)?;
    let mut problem = TornProblem::new(discrete, &connection, &sums, conditions);
    let goal = goal::Goal::new(scene, discrete, comm, &|| connection.gather.zeros())?;
    let mut recorder = Recorder::new(scene, discrete, comm, goal, moved);
    let begin = enter(begin, &mut problem, &mut recorder);
    let settings = solver::settings(scene);
    let growing = model::history::growing(scene, discrete, &|| connection.gather.zeros());
    let mut newton = Newton::new(problem, solver, settings, (stages, growing), begin, timer);

    let (failure, limit_load) = match &scene.limit {
        None => (follow(scene, &mut newton, &mut recorder, timer, watcher)?, None),
        Some(limit) => limit::seek(limit, &mut newton, &mut recorder, timer, watcher)?,
    };
    let rows = std::mem::take(&mut recorder.rows);
    let summary = Summary { limit_load, ..summarise(scene, discrete, newton.steps(), &failure, rows, comm) };
    let (problem, u) = newton.finish();
    let Recorder { piece, closed, moved, .. } = recorder;
    let meshes = restart::meshes::meshes(comm, scene, discrete);
    let mesh_names = serde_json::to_string(&meshes).expect("names and numbers can be written");
    let records = Records {
        provenance: provenance::collect(comm, &scene.to_toml(), &mesh_names, &decomposition.shares, started),
        convergence: convergence(&summary.newton),
        state: restart::state::pack(
            &problem,
            meshes,
            moved.until(scene, piece.times.last().copied().unwrap_or_default()),
        ),
        mesh: named::arrays(comm, scene, discrete),
    };
    Ok(Solved { summary, piece, records, u, closed, histories: problem.committed.histories })
}

/// What Newton begins with; the problem takes what an earlier run committed, the recorder what was recorded before.
fn enter(begin: Begin, problem: &mut TornProblem, recorder: &mut Recorder) -> newton::Begin {
    match begin {
        Begin::Rest => newton::Begin::Rest,
        Begin::Near(mut start) => {
            // Without a history the right-hand sides at its beginning are those of its end.
            problem.make_admissible(&mut start.u);
            newton::Begin::Near(start)
        }
        Begin::Around(mut u, limit) => {
            problem.make_admissible(&mut u);
            let largest = problem.space.maximum(newton::residuals::largest_displacement(&u));
            let kept = problem.laws().kept_at(&problem.slack(&u), ROUNDING * largest);
            let reach = limit.map(|limit| Reach::at(Some(limit.work), limit.rest, limit.factor));
            newton::Begin::Near(newton::Start { u, kept, is_origin: false, reach })
        }
        Begin::After(Earlier { committed, u, .. }) => {
            let closed = ROUNDING * committed.sizes.displacement;
            let kept = problem.laws().kept_at(&problem.slack(&u), closed);
            problem.committed = committed;
            problem.commit_slips(&problem.slack(&u));
            newton::Begin::Near(newton::Start { u, kept, is_origin: true, reach: None })
        }
        Begin::At(standing) => {
            let Standing { newton, rows, recorded, .. } = *standing;
            recorder.resume(rows, recorded);
            newton::Begin::At(Box::new(newton))
        }
    }
}

/// Where and how a history was given up.
type Failure = (newton::path::At, Outcome);

/// Steps Newton from increment to increment until the history is over; returns where and how it was given up.
fn follow(
    scene: &Scene,
    newton: &mut Newton,
    recorder: &mut Recorder,
    timer: &Timer,
    watcher: &mut dyn Watcher,
) -> Result<Option<Failure>, StudyError> {
    loop {
        let at = newton.at();
        place(scene, at).into_iter().for_each(|place| watcher.tell(Event::Increment(place)));
        let outcome = iterate(newton, recorder, timer, watcher)?;
        match newton.advance(timer) {
            Next::Increment => {}
            Next::Half(at, outcome) => {
                let place = place(scene, at).unwrap_or_else(|| "the whole load".into());
                let reason = outcome.message().unwrap_or_default();
                watcher.tell(Event::Warning(format!("{place}: {reason}; the increment is halved")));
            }
            Next::End => {
                let failure = Some(outcome).filter(|outcome| *outcome != Outcome::Converged);
                if failure.is_some() && newton.reached().is_none() {
                    // Nothing ever converged: what there is is better than nothing.
                    recorder.record(newton, timer);
                }
                return Ok(failure.map(|outcome| (at, outcome)));
            }
        }
    }
}

/// Steps Newton until it is known how the present attempt ends, and records what it reached.
fn iterate(
    newton: &mut Newton,
    recorder: &mut Recorder,
    timer: &Timer,
    watcher: &mut dyn Watcher,
) -> Result<Outcome, StudyError> {
    let number = newton.at().number;
    let watcher = RefCell::new(watcher);
    let tell = |event: Event| watcher.borrow_mut().tell(event);
    let alive = |step: usize, applications: usize| {
        tell(Event::Inner { step: step as u64, hessian_multiplications: applications as u64 });
    };
    let mut is_told = false;
    let outcome = loop {
        if let Some(outcome) = newton.outcome() {
            break outcome.clone();
        }
        let standing = || recorder.standing(newton.snapshot());
        if watcher.borrow_mut().stops(&standing) {
            return Err(StudyError::Stopped);
        }
        if let Some(record) = newton.step(timer, &alive) {
            tell(Event::NewtonStep(newton_row(number, record)));
            if record.is_spoiled() && !is_told {
                tell(Event::Warning(loss_of_accuracy(record)));
                is_told = true;
            }
        }
    };
    if outcome == Outcome::Converged {
        recorder.record(newton, timer);
    }
    Ok(outcome)
}
