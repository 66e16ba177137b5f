//! Carries a plan out: solves level after level, keeps checkpoints on the way, and writes the results of the last.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::conduct::Conduct;
use super::keeper::{Keeper, Signals};
use super::plan::{Files, Plan};
use super::room::make_room;
use super::{Failure, Found, describe_run, warnings};
use crate::comm::Comm;
use crate::model::{self, Discrete};
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::metered::Metered;
use crate::monitor::table::{Phase, PhaseTable};
use crate::monitor::timing::Timer;
use crate::monitor::trace;
use crate::record::counts::CommunicationRow;
use crate::record::rows::CascadeRow;
use crate::record::summary::Summary;
use crate::restart::checkpoint::{Unfit, pack, unpack};
use crate::restart::{self, Standing};
use crate::results;
use crate::results::checkpoint::{self, Checkpoint};
use crate::results::piece::Field;
use crate::results::vtkhdf;
use crate::scene::Scene;
use crate::sizing;
use crate::sizing::counts::Counted;
use crate::study::cascade::{expected_yielding, refine};
use crate::study::{self, Begin, Solved, StudyError, Watcher};

/// Tolerance of coarser levels: well below what halving the cells changes.
const ENOUGH_TO_START: f64 = 5e-2;

/// What to tell of a run that goes on on other subdomains.
const RECUT: &str = "subdomains are others than when the checkpoint was written: the result is the same to the tolerances of \
                     the scene, not bit by bit";

/// How and where a plan is carried out.
pub(super) struct Setting {
    /// Runs since the program does.
    pub timer: Timer,
    pub out: PathBuf,
    pub conduct: Conduct,
    pub signals: Signals,
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
    let mut monitor = Monitor::of_rank(comm.rank(), conduct.progress);
    // Refined meshes are looked at when they are there.
    let tight = match Counted::new(scene).filter(|_| scene.solver.error.is_none()) {
        Some(counted) => make_room(comm, &counted, conduct.ignore_memory)?,
        None => None,
    };
    tight.iter().for_each(|text| monitor.event(&Event::Warning(text.clone())));
    if conduct.trace.is_some() {
        timer.keep_spans();
    }
    let (timer, comm) = (&timer, &Metered::new(comm, &timer));
    let Files { result, summary, checkpoint: kept, log } = Files::find(comm, &plan, out, &conduct)?;
    log.into_iter().for_each(|log| monitor.add(log));
    let keeper = Keeper::new(comm, timer, conduct.checkpoints, signals, kept);
    let run = Run { comm, timer, keeper: &keeper, scene: scene.to_toml(), ignore_memory: conduct.ignore_memory };

    let (discrete, mut solved) = if scene.solver.error.is_some() {
        run.refined(&mut plan, scene, checkpoint, &mut monitor)?
    } else {
        let coarser = run.coarser_levels(&mut plan, found, &mut checkpoint, &mut monitor)?;
        run.level(&mut plan, scene, coarser, checkpoint, &mut monitor)?
    };
    timer.time("output", || vtkhdf::write(comm, &result, &solved.piece, &solved.records))?;
    // What is left is little, or waits for who reads it.
    keeper.end_at_once();

    let table = PhaseTable::gather(comm, timer);
    describe_run(&mut solved.summary, &plan.source, comm);
    // Measured once, for memory grows by the messages that tell of it.
    solved.summary.peak_rss_mb_max = Some(table.memory_mb.max);
    let told = warnings(scene, &discrete.warnings, solved.summary.sizes.subdomains, comm);
    let told = tight.into_iter().chain(told).collect();
    solved.summary.mesh_reading_mb = discrete.reading_mb;
    solved.summary.cascade = plan.rows;
    solved.summary.refinements = plan.refinements;
    let of_solution = complete(&mut solved, told, &table);
    results::write_json(comm, &summary, &solved.summary)?;
    if let Some(directory) = &conduct.trace {
        trace::write(comm, directory, timer)?;
    }
    tell_end(&mut monitor, &solved.summary, table, of_solution, &result);
    Ok(i32::from(solved.summary.converged != Some(true)))
}

/// Completes the summary by what belongs to the run; warnings `told` before it go before those of the solution, which are
/// returned.
fn complete(solved: &mut Solved, mut told: Vec<String>, table: &PhaseTable) -> Vec<String> {
    let Solved { summary, records, .. } = solved;
    let of_solution = std::mem::take(&mut summary.warnings);
    told.extend(of_solution.iter().cloned());
    summary.warnings = told;
    summary.provenance = records.provenance.iter().filter(|(name, _)| name != "scene").cloned().collect();
    summary.imbalance = table.busy.ratio();
    summary.time = table.max_seconds();
    summary.work = table.work();
    summary.counted = table.counted.clone();
    summary.communication = communication(table);
    summary.time_total = Some(table.total_seconds);
    of_solution
}

/// The end of the log.
fn tell_end(monitor: &mut Monitor, summary: &Summary, table: PhaseTable, warnings: Vec<String>, result: &Path) {
    let seconds = table.total_seconds;
    monitor.event(&Event::Phases(table));
    monitor.event(&Event::Residuals(summary.state.residuals));
    monitor.event(&Event::Errors(summary.state.errors));
    warnings.into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
    monitor.event(&Event::Outcome {
        converged: summary.converged == Some(true),
        newton_iterations: summary.newton_iterations.unwrap_or_default(),
        seconds,
        note: summary.error.clone().unwrap_or_else(|| format!("Results are in {}", result.display())),
    });
}

/// What all levels of a run share.
pub(super) struct Run<'a> {
    pub comm: &'a dyn Comm,
    pub timer: &'a Timer,
    keeper: &'a Keeper<'a>,
    /// The scene at its level.
    scene: String,
    /// Whether to begin without enough memory.
    pub ignore_memory: bool,
}

impl Run<'_> {
    /// Solves all levels of a plan but the last, coarsest first; a checkpoint is of the first of them. Returns the solution of
    /// the last of these if it converged. Collective.
    fn coarser_levels(
        &self,
        plan: &mut Plan,
        found: &Found,
        checkpoint: &mut Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<Option<(Discrete, Solved)>, Failure> {
        let mut coarser = None;
        while let [level, _, ..] = plan.levels[..] {
            let began = self.timer.total_seconds();
            let solved = match found.at_level(level, &plan.source.sets) {
                Ok(mut scene) => {
                    for tolerance in [&mut scene.solver.newton_tolerance, &mut scene.solver.residual_tolerance] {
                        *tolerance = tolerance.max(ENOUGH_TO_START);
                    }
                    self.level(plan, &scene, coarser.take(), checkpoint.take(), monitor).map(Some)
                }
                // The user has cut bodies otherwise, and this level is too coarse for that.
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
                seconds: self.timer.total_seconds() - began,
            });
            coarser = (*converged == Some(true)).then_some((discrete, solved));
        }
        Ok(coarser)
    }

    /// Discretises and solves the first level of a plan, from a checkpoint or the solution of a coarser level if there is
    /// one. Collective.
    fn level(
        &self,
        plan: &mut Plan,
        scene: &Scene,
        coarser: Option<(Discrete, Solved)>,
        checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<(Discrete, Solved), Failure> {
        let Self { comm, timer, .. } = *self;
        if let Some((coarse, solved)) = &coarser {
            plan.yielding = timer.time("interpolation", || expected_yielding(comm, (coarse, solved), scene));
        }
        let yielding = plan.yielding.as_deref();
        let mut discrete = timer.time("discretisation", || model::discretise_expecting(scene, yielding, comm))?;
        if let Some(counted) = Counted::of_read(scene, &discrete.bodies) {
            discrete.warnings.extend(make_room(comm, &counted, self.ignore_memory)?);
        }
        let begin = self.begin(scene, &discrete, coarser, checkpoint, monitor)?;
        self.solve_problem(plan, scene, (discrete, Vec::new()), begin, monitor)
    }

    /// Solves a discrete problem, with arrays of checkpoints that say what its meshes are. Collective.
    pub(super) fn solve_problem(
        &self,
        plan: &Plan,
        scene: &Scene,
        (discrete, of_meshes): (Discrete, Vec<Field>),
        begin: Begin,
        monitor: &mut Monitor,
    ) -> Result<(Discrete, Solved), Failure> {
        let Self { comm, timer, keeper, .. } = *self;
        self.tell_sizes(plan, scene, &discrete, monitor);
        let mut watch = Watch { run: self, plan, discrete: &discrete, of_meshes: &of_meshes, monitor };
        let solved = study::solve(scene, &discrete, comm, begin, timer, &mut watch);
        match (solved, keeper.end()) {
            (Err(StudyError::Stopped), Some(end)) => Err(end),
            (solved, _) => Ok((discrete, solved?)),
        }
    }

    /// Tells how large a level is; of the last one, what the user should know before it is solved. Collective.
    fn tell_sizes(&self, plan: &Plan, scene: &Scene, discrete: &Discrete, monitor: &mut Monitor) {
        let sizes = sizing::sizes(discrete, self.comm);
        let subdomains = sizes.subdomains;
        let (name, level) = (plan.source.scene.clone(), plan.levels[0]);
        monitor.event(&Event::Sizes { scene: name, level, ranks: self.comm.size(), sizes });
        discrete.contacts.rows.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
        discrete.reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
        if plan.levels.len() == 1 && plan.refinements.is_empty() {
            let warnings = warnings(scene, &discrete.warnings, subdomains, self.comm);
            warnings.into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
        }
    }

    /// Where a level begins: at a checkpoint, after an earlier run, near the solution of a coarser level, or from rest.
    /// Collective.
    fn begin(
        &self,
        scene: &Scene,
        discrete: &Discrete,
        coarser: Option<(Discrete, Solved)>,
        checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<Begin, Failure> {
        let Self { comm, timer, .. } = *self;
        let start =
            coarser.map(|(coarse, solved)| timer.time("interpolation", || refine(comm, (&coarse, &solved), discrete)));
        if let Some(file) = checkpoint {
            return self.at(discrete, file, monitor);
        }
        if let Some(initial) = &scene.initial {
            let earlier = timer.time("initial state", || restart::state::earlier(comm, scene, discrete, initial));
            return Ok(Begin::After(earlier?));
        }
        Ok(start.map_or(Begin::Rest, Begin::Near))
    }

    /// Where a checkpoint stands. Collective.
    pub(super) fn at(&self, discrete: &Discrete, file: Checkpoint, monitor: &mut Monitor) -> Result<Begin, Failure> {
        let standing = self.timer.time("checkpoints", || unpack(self.comm, discrete, &file));
        let standing = standing.and_then(|standing| file.close().map(|()| standing).map_err(Unfit::from));
        let (standing, is_recut) = standing.map_err(unfit)?;
        if is_recut {
            monitor.event(&Event::Warning(RECUT.into()));
        }
        Ok(Begin::At(Box::new(standing)))
    }
}

/// Why a checkpoint is of no use for the scene.
pub(super) fn unfit(unfit: Unfit) -> Failure {
    match unfit {
        Unfit::Mesh => Failure::Scene(unfit.to_string()),
        Unfit::Unreadable(reason) => Failure::Input(format!("the checkpoint cannot be read: {reason}")),
    }
}

/// Hands events to the monitor and lets the keeper write checkpoints.
struct Watch<'a> {
    run: &'a Run<'a>,
    plan: &'a Plan,
    discrete: &'a Discrete,
    of_meshes: &'a [Field],
    monitor: &'a mut Monitor,
}

impl Watcher for Watch<'_> {
    fn tell(&mut self, event: Event) {
        self.monitor.event(&event);
    }

    fn stops(&mut self, standing: &dyn Fn() -> Standing) -> bool {
        let Run { comm, keeper, scene, .. } = self.run;
        let write = |path: &Path| {
            let (mut texts, mut arrays) = pack(*comm, self.discrete, standing());
            arrays.extend_from_slice(self.of_meshes);
            texts.extend(self.plan.labels(scene));
            checkpoint::write(*comm, path, &texts, &arrays)
        };
        keeper.pause(write, |text| self.monitor.event(&Event::Warning(text)))
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
