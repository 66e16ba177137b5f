//! `fetiplast solve`: a scene, coarser levels first where that pays, to files of results.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{Failure, Source, describe_run, find, run_name, warnings};
use crate::comm::Comm;
use crate::comm::metered::Metered;
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::progress::Mode;
use crate::monitor::timing::{Phase, PhaseTable, Timer};
use crate::results::replace;
use crate::results::summary::{CascadeRow, CommunicationRow, Summary};
use crate::results::vtkhdf;
use crate::scene::Scene;
use crate::study::{self, StudyError};

/// Arguments of `solve`.
#[derive(Debug, Args)]
pub struct Solve {
    #[command(flatten)]
    source: Source,
    /// Where results go: SCENE.vtkhdf for ParaView, and SCENE.json unless --summary says otherwise.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Solver of the quadratic programs: smalse-m or active-set. Short for --set solver.qp=...
    #[arg(long, value_name = "NAME")]
    qp: Option<String>,
    /// none, lumped or dirichlet. Short for --set solver.preconditioner=...
    #[arg(long, value_name = "NAME")]
    preconditioner: Option<String>,
    /// Stop when the algebraic error is at most this share of the discretisation error. Short for --set solver.accuracy=...
    #[arg(long, value_name = "X")]
    accuracy: Option<String>,
    /// Solve half the level first, and so on, and start from there: auto (where it pays), on or off.
    #[arg(long, value_name = "WHEN", default_value = "auto", num_args = 0..=1, default_missing_value = "on")]
    cascade: Cascade,
    /// Life signs inside a Newton step: auto, plain or off.
    #[arg(long, value_name = "MODE", default_value = "auto", value_parser = progress)]
    progress: Mode,
}

/// Tolerance of coarser levels: well below what halving the cells changes.
const ENOUGH_TO_START: f64 = 5e-2;

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
    /// The levels to solve before `level`, coarsest first. None where there is a history: a coarser level knows its end.
    fn before(self, level: usize, scene: &Scene) -> Vec<usize> {
        let linear = scene.contact.is_empty() && scene.material.values().all(|m| m.yield_stress.is_none());
        if self == Self::Off || !scene.step.is_empty() || (self == Self::Auto && linear) {
            return Vec::new();
        }
        let half = |l: &usize| (*l > 1).then(|| l.div_ceil(2));
        let mut levels: Vec<usize> = std::iter::successors(half(&level), half).collect();
        levels.reverse();
        levels
    }
}

fn progress(text: &str) -> Result<Mode, String> {
    match text {
        "auto" => Ok(Mode::Auto),
        "plain" => Ok(Mode::Plain),
        "off" => Ok(Mode::Off),
        _ => Err("it is auto, plain or off".into()),
    }
}

/// Solves a scene and writes its results. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written.
pub fn solve(arguments: Solve, comm: &dyn Comm) -> Result<i32, Failure> {
    let comm = &Metered::new(comm);
    let timer = Timer::start();
    let mut monitor = Monitor::of_rank(comm.rank(), arguments.progress);
    let Solve { source, out, qp, preconditioner, accuracy, cascade, .. } = arguments;
    let shorthand = |key: &str, value: Option<String>| value.map(|v| format!("solver.{key}={v}"));
    let mut sets = source.sets.clone();
    sets.extend(shorthand("qp", qp));
    sets.extend(shorthand("preconditioner", preconditioner));
    sets.extend(shorthand("accuracy", accuracy));
    let found = find(&source, comm)?;
    let scene = found.at_level(source.level, &sets)?;
    let result = out.join(format!("{}.vtkhdf", run_name(&source)));
    let summary_file = source.summary.clone().unwrap_or_else(|| out.join(format!("{}.json", run_name(&source))));
    for file in [&result, &summary_file] {
        replace::probe(comm, file).map_err(Failure::Place)?;
    }

    let mut coarser: Option<(study::Discrete, study::Solved)> = None;
    let mut rows = Vec::new();
    for level in cascade.before(source.level, &scene) {
        let watch = timer.total_seconds();
        // A level that is too coarse for the scene is left out.
        let Ok(mut scene) = found.at_level(level, &sets) else { continue };
        for tolerance in [&mut scene.solver.newton_tolerance, &mut scene.solver.residual_tolerance] {
            *tolerance = tolerance.max(ENOUGH_TO_START);
        }
        let solved = solve_level(&source, level, &scene, coarser.take(), comm, &timer, &mut monitor);
        let Ok((discrete, solved)) = solved else { continue };
        let Summary { newton_iterations, counters, sizes, converged, .. } = &solved.summary;
        rows.push(CascadeRow {
            level,
            subdomains: sizes.subdomains,
            newton_iterations: *newton_iterations,
            hessian_multiplications: counters.hessian_multiplications,
            factorisations: counters.factorisations,
            seconds: timer.total_seconds() - watch,
        });
        coarser = (*converged == Some(true)).then_some((discrete, solved));
    }
    let (discrete, mut solved) = solve_level(&source, source.level, &scene, coarser, comm, &timer, &mut monitor)?;
    timer.time("output", || vtkhdf::write(comm, &result, &solved.piece, &solved.records))?;

    let table = PhaseTable::gather(comm, &timer, comm.traffic());
    let summary = &mut solved.summary;
    describe_run(summary, &source, comm);
    summary.warnings = warnings(&scene, &discrete, comm);
    summary.mesh_reading_mb = discrete.reading_mb;
    summary.provenance = solved.records.provenance.into_iter().filter(|(name, _)| name != "scene").collect();
    summary.cascade = rows;
    summary.time = table.max_seconds();
    summary.work = table.work();
    summary.communication = communication(&table);
    summary.time_total = Some(table.total_seconds);
    summary.write(comm, &summary_file)?;

    let converged = summary.converged == Some(true);
    monitor.event(&Event::Phases(table.clone()));
    monitor.event(&Event::Residuals(summary.state.residuals));
    monitor.event(&Event::Errors(summary.state.errors));
    monitor.event(&Event::Outcome {
        converged,
        newton_iterations: summary.newton_iterations.unwrap_or_default(),
        seconds: table.total_seconds,
        note: summary.error.clone().unwrap_or_else(|| format!("Results are in {}", result.display())),
    });
    Ok(i32::from(!converged))
}

/// Discretises and solves one level, from the solution of a coarser one if there is one. Collective.
fn solve_level(
    source: &Source,
    level: usize,
    scene: &Scene,
    coarser: Option<(study::Discrete, study::Solved)>,
    comm: &dyn Comm,
    timer: &Timer,
    monitor: &mut Monitor,
) -> Result<(study::Discrete, study::Solved), StudyError> {
    let costs = coarser.as_ref().and_then(|(coarse, solved)| {
        timer.time("interpolation", || study::expected_costs(comm, (coarse, solved), scene))
    });
    let discrete = timer.time("discretisation", || study::discretise_by_cost(scene, costs.as_deref(), comm))?;
    let sizes = study::sizes(&discrete, comm);
    monitor.event(&Event::Sizes { scene: source.scene.clone(), level, ranks: comm.size(), sizes });
    discrete.contact_rows.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
    discrete.reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
    if level == source.level {
        warnings(scene, &discrete, comm).into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
    }
    let start = coarser
        .map(|(coarse, solved)| timer.time("interpolation", || study::refine(comm, (&coarse, &solved), &discrete)));
    let solved = study::solve(scene, &discrete, comm, start, timer, &mut |event| monitor.event(&event))?;
    Ok((discrete, solved))
}

/// Messages as rows of the summary.
fn communication(table: &PhaseTable) -> BTreeMap<String, CommunicationRow> {
    let row = |kind: &Phase| CommunicationRow {
        calls: kind.calls,
        seconds: kind.max_seconds,
        megabytes: kind.work.bytes / f64::from(1 << 20),
    };
    table.communication.iter().map(|kind| (kind.name.clone(), row(kind))).collect()
}
