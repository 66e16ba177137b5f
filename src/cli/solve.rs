//! `fetiplast solve`: a scene, coarser levels first where that pays, to files of results.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::conduct::Conduct;
use super::keeper::{Keeper, Signals};
use super::resume::{labels, unfit};
use super::room::Room;
use super::{Failure, Found, Source, describe_run, find, run_name, values, warnings};
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::model;
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::json::JsonLines;
use crate::monitor::metered::Metered;
use crate::monitor::table::{Phase, PhaseTable};
use crate::monitor::timing::Timer;
use crate::monitor::trace;
use crate::record::counts::CommunicationRow;
use crate::record::rows::CascadeRow;
use crate::record::summary::Summary;
use crate::restart;
use crate::restart::checkpoint::{Unfit, pack, unpack};
use crate::results::checkpoint::{self, Checkpoint};
use crate::results::replace::{self, Form};
use crate::results::vtkhdf;
use crate::results::{self, OutputError};
use crate::scene::{Preconditioner, Qp, Scene};
use crate::sizing;
use crate::sizing::counts::Counted;
use crate::study::{self, Begin, StudyError};

/// Arguments of `solve`.
#[derive(Debug, Args)]
pub struct Solve {
    #[command(flatten)]
    source: Source,
    /// Where results go: SCENE.vtkhdf for ParaView, and SCENE.json unless --summary says otherwise.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Solver of the quadratic programs: smalse-m or active-set. Short for --set solver.qp=...
    #[arg(long, value_name = "NAME", value_parser = values::name::<Qp>)]
    qp: Option<String>,
    /// none, lumped or dirichlet. Short for --set solver.preconditioner=...
    #[arg(long, value_name = "NAME", value_parser = values::name::<Preconditioner>)]
    preconditioner: Option<String>,
    /// Stop when the algebraic error is at most this share of the discretisation error. Short for --set solver.accuracy=...
    #[arg(long, value_name = "X", value_parser = values::accuracy, allow_negative_numbers = true)]
    accuracy: Option<String>,
    /// Solve half the level first, and so on, and start from there: auto (where it pays), on or off.
    #[arg(long, value_name = "WHEN", default_value = "auto", num_args = 0..=1, default_missing_value = "on")]
    cascade: Cascade,
    #[command(flatten)]
    conduct: Conduct,
}

/// Tolerance of coarser levels: well below what halving the cells changes.
const ENOUGH_TO_START: f64 = 5e-2;

/// What to tell of a run that goes on on other subdomains.
const RECUT: &str = "subdomains are others than when the checkpoint was written: the result is the same to the tolerances of \
                     the scene, not bit by bit";

/// When coarser levels are solved first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Cascade {
    /// Where the problem is not linear.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl Cascade {
    /// The levels to solve before `level`, coarsest first. None where there is a history, of which a coarser
    /// level knows the end, or an earlier state, which is of one mesh, or a body that is no brick.
    fn before(self, level: usize, scene: &Scene) -> Vec<usize> {
        let linear = scene.contact.is_empty() && scene.material.values().all(|m| m.yield_stress.is_none());
        let possible = scene.step.is_empty() && scene.initial.is_none() && scene.is_of_bricks();
        if self == Self::Off || !possible || (self == Self::Auto && linear) {
            return Vec::new();
        }
        let half = |l: &usize| (*l > 1).then(|| l.div_ceil(2));
        let mut levels: Vec<usize> = std::iter::successors(half(&level), half).collect();
        levels.reverse();
        levels
    }
}

/// What a run has to do; a checkpoint says what is left.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Plan {
    /// The scene by name or path, its level, what is changed in it, and where the summary goes.
    #[serde(flatten)]
    pub source: Source,
    /// Levels to solve, coarsest first; the last is that of the scene.
    pub levels: Vec<usize>,
    /// Which boxes of each body of the first of them are expected to yield.
    pub yielding: Option<Vec<Vec<bool>>>,
    /// What the levels before took.
    pub rows: Vec<CascadeRow>,
}

/// How and where a plan is carried out.
pub(super) struct Setting {
    /// Runs since the program does.
    pub timer: Timer,
    pub out: PathBuf,
    pub conduct: Conduct,
    pub signals: Signals,
}

/// Solves a scene and writes its results. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written.
pub fn solve(arguments: Solve, comm: &dyn Comm, signals: Signals) -> Result<i32, Failure> {
    let timer = Timer::start();
    let Solve { mut source, out, qp, preconditioner, accuracy, cascade, conduct } = arguments;
    let shorthand = |key: &str, value: Option<String>| value.map(|v| format!("solver.{key}={v}"));
    source.sets.extend(shorthand("qp", qp));
    source.sets.extend(shorthand("preconditioner", preconditioner));
    source.sets.extend(shorthand("accuracy", accuracy));
    let found = find(&source, comm)?;
    let scene = found.at_level(source.level, &source.sets)?;
    let mut levels = cascade.before(source.level, &scene);
    levels.push(source.level);
    let plan = Plan { source, levels, yielding: None, rows: Vec::new() };
    carry_out(plan, &found, &scene, None, Setting { timer, out, conduct, signals }, comm)
}

/// Solves level after level and writes results, from where a checkpoint of the first level stands if there is one. `found`
/// is the scene of the plan, `scene` the same at its level. Collective.
pub(super) fn carry_out(
    mut plan: Plan,
    found: &Found,
    scene: &Scene,
    mut checkpoint: Option<Checkpoint>,
    setting: Setting,
    comm: &dyn Comm,
) -> Result<i32, Failure> {
    let Setting { mut timer, out, conduct, signals } = setting;
    let Conduct { progress, ignore_memory, checkpoints, trace, log_json } = conduct;
    let mut monitor = Monitor::of_rank(comm.rank(), progress);
    let tight = match Counted::new(scene) {
        Some(counted) => make_room(comm, &counted, ignore_memory)?,
        None => None,
    };
    tight.iter().for_each(|text| monitor.event(&Event::Warning(text.clone())));
    if trace.is_some() {
        timer.keep_spans();
    }
    let (timer, comm) = (&timer, &Metered::new(comm, &timer));
    let name = run_name(&plan.source);
    let result = out.join(format!("{name}.vtkhdf"));
    let summary_file = plan.source.summary.clone().unwrap_or_else(|| out.join(format!("{name}.json")));
    let kept = out.join(format!("{name}.checkpoint.h5"));
    let traced = trace.as_deref().map(|directory| trace::file(directory, 0));
    let before = checkpoint::previous(&kept);
    let fields = [&result, &kept, &before].map(|file| (file, Form::Hdf5));
    let texts = [&summary_file].into_iter().chain(&traced).map(|file| (file, Form::Text));
    for (file, form) in fields.into_iter().chain(texts) {
        replace::probe(comm, file, form).map_err(Failure::Place)?;
    }
    if let Some(file) = &log_json {
        let refused = |reason: String| Failure::Place(OutputError::Write { path: file.clone(), reason });
        let log = if comm.rank() == 0 { JsonLines::create(file).map(Some) } else { Ok(None) };
        let log = agree(comm, "creating the log", log).map_err(refused)?;
        log.into_iter().for_each(|log| monitor.add(log));
    }
    let keeper = Keeper::new(comm, timer, checkpoints, signals, kept);
    let run = Run { comm, timer, keeper: &keeper, scene: scene.to_toml(), ignore_memory };

    let mut coarser: Option<(model::Discrete, study::Solved)> = None;
    while let [level, _, ..] = plan.levels[..] {
        let watch = timer.total_seconds();
        let solved = match found.at_level(level, &plan.source.sets) {
            Ok(mut scene) => {
                for tolerance in [&mut scene.solver.newton_tolerance, &mut scene.solver.residual_tolerance] {
                    *tolerance = tolerance.max(ENOUGH_TO_START);
                }
                run.level(&mut plan, &scene, coarser.take(), checkpoint.take(), &mut monitor).map(Some)
            }
            // Bodies that are cut otherwise from here on may be too coarse for that here.
            Err(error) if checkpoint.is_some() => return Err(error),
            Err(_) => Ok(None),
        };
        plan.levels.remove(0);
        plan.yielding = None;
        let (discrete, solved) = match solved {
            Ok(Some(solved)) => solved,
            // A level that is too coarse for the scene is left out.
            Ok(None) | Err(Failure::Model(_) | Failure::Study(_)) => continue,
            Err(end) => return Err(end),
        };
        let Summary { newton_iterations, counters, sizes, converged, .. } = &solved.summary;
        plan.rows.push(CascadeRow {
            level,
            subdomains: sizes.subdomains,
            newton_iterations: *newton_iterations,
            hessian_multiplications: counters.hessian_multiplications,
            factorisations: counters.factorisations,
            seconds: timer.total_seconds() - watch,
        });
        coarser = (*converged == Some(true)).then_some((discrete, solved));
    }
    let (discrete, mut solved) = run.level(&mut plan, scene, coarser, checkpoint, &mut monitor)?;
    timer.time("output", || vtkhdf::write(comm, &result, &solved.piece, &solved.records))?;
    // What is left is little, or waits for who reads it.
    keeper.end_at_once();

    let table = PhaseTable::gather(comm, timer);
    let summary = &mut solved.summary;
    describe_run(summary, &plan.source, comm);
    let of_solution = std::mem::take(&mut summary.warnings);
    let before = warnings(scene, &discrete.warnings, summary.sizes.subdomains, comm);
    summary.warnings = tight.into_iter().chain(before).chain(of_solution.iter().cloned()).collect();
    summary.mesh_reading_mb = discrete.reading_mb;
    summary.provenance = solved.records.provenance.into_iter().filter(|(name, _)| name != "scene").collect();
    summary.cascade = plan.rows;
    summary.imbalance = table.busy.ratio();
    summary.time = table.max_seconds();
    summary.work = table.work();
    summary.communication = communication(&table);
    summary.time_total = Some(table.total_seconds);
    results::write_json(comm, &summary_file, summary)?;
    if let Some(directory) = &trace {
        trace::write(comm, directory, timer)?;
    }

    let converged = summary.converged == Some(true);
    monitor.event(&Event::Phases(table.clone()));
    monitor.event(&Event::Residuals(summary.state.residuals));
    monitor.event(&Event::Errors(summary.state.errors));
    of_solution.into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
    monitor.event(&Event::Outcome {
        converged,
        newton_iterations: summary.newton_iterations.unwrap_or_default(),
        seconds: table.total_seconds,
        note: summary.error.clone().unwrap_or_else(|| format!("Results are in {}", result.display())),
    });
    Ok(i32::from(!converged))
}

/// What all levels of a run share.
struct Run<'a> {
    comm: &'a dyn Comm,
    timer: &'a Timer,
    keeper: &'a Keeper<'a>,
    /// The scene at its level.
    scene: String,
    /// Whether to begin without enough memory.
    ignore_memory: bool,
}

/// Refuses a run that cannot fit, unless told to begin; what to tell where it hardly does. Collective.
fn make_room(comm: &dyn Comm, counted: &Counted, ignore: bool) -> Result<Option<String>, Failure> {
    let Some(room) = Room::find(comm, &counted.memory()) else { return Ok(None) };
    if !ignore {
        room.refuse()?;
    }
    Ok(room.warning())
}

impl Run<'_> {
    /// Discretises and solves the first level of a plan, from a checkpoint or the solution of a coarser level if there is
    /// one. Collective.
    fn level(
        &self,
        plan: &mut Plan,
        scene: &Scene,
        coarser: Option<(model::Discrete, study::Solved)>,
        checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<(model::Discrete, study::Solved), Failure> {
        let Self { comm, timer, keeper, .. } = *self;
        if let Some((coarse, solved)) = &coarser {
            plan.yielding = timer.time("interpolation", || study::expected_yielding(comm, (coarse, solved), scene));
        }
        let yielding = plan.yielding.as_deref();
        let mut discrete = timer.time("discretisation", || model::discretise_expecting(scene, yielding, comm))?;
        if let Some(counted) = Counted::of_read(scene, &discrete.bodies) {
            discrete.warnings.extend(make_room(comm, &counted, self.ignore_memory)?);
        }
        let sizes = sizing::sizes(&discrete, comm);
        let subdomains = sizes.subdomains;
        let (name, level) = (plan.source.scene.clone(), plan.levels[0]);
        monitor.event(&Event::Sizes { scene: name, level, ranks: comm.size(), sizes });
        discrete.contact_rows.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
        discrete.reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
        if let [_] = plan.levels[..] {
            let warnings = warnings(scene, &discrete.warnings, subdomains, comm);
            warnings.into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
        }
        let refined = coarser
            .map(|(coarse, solved)| timer.time("interpolation", || study::refine(comm, (&coarse, &solved), &discrete)));
        let mut begin = refined.map_or(Begin::Rest, Begin::Near);
        if let Some(file) = checkpoint {
            let standing = timer.time("checkpoints", || unpack(comm, &discrete, &file));
            let standing = standing.and_then(|standing| file.close().map(|()| standing).map_err(Unfit::from));
            let (standing, is_recut) = standing.map_err(unfit)?;
            if is_recut {
                monitor.event(&Event::Warning(RECUT.into()));
            }
            begin = Begin::At(Box::new(standing));
        } else if let Some(initial) = &scene.initial {
            let earlier = timer.time("initial state", || restart::state::earlier(comm, scene, &discrete, initial));
            begin = Begin::After(earlier?);
        }
        let monitor = RefCell::new(monitor);
        let tell = |event: Event| monitor.borrow_mut().event(&event);
        let pause = |standing: &dyn Fn() -> restart::Standing| {
            let write = |path: &Path| {
                let (mut texts, arrays) = pack(comm, &discrete, standing());
                texts.extend(labels(plan, &self.scene));
                checkpoint::write(comm, path, &texts, &arrays)
            };
            keeper.pause(write, |text| tell(Event::Warning(text)))
        };
        let solved = study::solve_from(scene, &discrete, comm, begin, timer, &mut |event| tell(event), &pause);
        match (solved, keeper.end()) {
            (Err(StudyError::Stopped), Some(end)) => Err(end.into()),
            (solved, _) => Ok((discrete, solved?)),
        }
    }
}

/// Messages as rows of the summary.
fn communication(table: &PhaseTable) -> BTreeMap<String, CommunicationRow> {
    let row = |kind: &Phase| CommunicationRow {
        calls: kind.calls,
        seconds: kind.seconds.max,
        megabytes: kind.work.bytes / f64::from(1 << 20),
    };
    table.communication.iter().map(|kind| (kind.name.clone(), row(kind))).collect()
}
