//! The command line: arguments, what each command does, exit codes.
//!
//! Every rank runs the same command. What one rank finds out, rank 0 above all, is shared before anybody acts on it, so
//! all ranks end with the same code and one message.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use thiserror::Error;

use crate::bodies::MeshError;
use crate::comm::metered::Metered;
use crate::comm::{Comm, Shares, ordered_sum};
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::progress::Mode;
use crate::monitor::timing::{Phase, PhaseTable, Timer, peak_rss_mb};
use crate::results::OutputError;
use crate::results::agree::root_texts;
use crate::results::replace;
use crate::results::summary::{CascadeRow, CommunicationRow, Summary};
use crate::results::vtkhdf;
use crate::scene::{Scene, SceneError, library};
use crate::study::{self, StudyError};

/// Contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
#[derive(Debug, Parser)]
#[command(name = "fetiplast", version, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do; without a command the paper's benchmark is solved.
    #[command(subcommand)]
    pub command: Option<Command>,
}

const EXIT_CODES: &str = "Exit codes: 0 converged; 1 finished without convergence, results written; 64 usage; \
                          65 bad scene or mesh; 70 bug; 74 input or output failed.";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solve a scene and write its results.
    Solve(Solve),
    /// Report sizes and warnings of a scene; solves nothing.
    Check(Check),
    /// List the built-in scenes.
    Scenes,
    /// Print a built-in scene as TOML, to start from.
    Show {
        /// Its name.
        name: String,
    },
}

/// Which scene.
#[derive(Debug, Args)]
pub struct Source {
    /// A built-in scene (see `fetiplast scenes`) or a TOML file.
    #[arg(default_value = "two-blocks")]
    pub scene: String,
    /// Refinement: this many times the cells along each edge of every brick.
    #[arg(long, default_value_t = 1)]
    pub level: usize,
    /// Change a key of the scene, for example decomposition.subdomains=48; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Write a summary of the run as JSON.
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
}

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
    /// Solve half the level first, and so on, and start from there: auto (where it pays), on or off.
    #[arg(long, value_name = "WHEN", default_value = "auto", num_args = 0..=1, default_missing_value = "on")]
    cascade: Cascade,
    /// Life signs inside a Newton step: auto, plain or off.
    #[arg(long, value_name = "MODE", default_value = "auto", value_parser = progress)]
    progress: Mode,
}

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

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    source: Source,
}

fn progress(text: &str) -> Result<Mode, String> {
    match text {
        "auto" => Ok(Mode::Auto),
        "plain" => Ok(Mode::Plain),
        "off" => Ok(Mode::Off),
        _ => Err("it is auto, plain or off".into()),
    }
}

/// Why a command gave up; the same on every rank.
#[derive(Debug, Error)]
pub enum Failure {
    /// The scene is not usable.
    #[error("{0}")]
    Scene(String),
    /// The scene has no discrete problem.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The scene file cannot be read.
    #[error("{0}")]
    Input(String),
    /// The place for results is refused before anything is computed.
    #[error("{0}")]
    Place(OutputError),
    /// Results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl Failure {
    /// Exit code (sysexits).
    pub fn code(&self) -> i32 {
        match self {
            Self::Study(StudyError::Mesh(MeshError::Unreadable(_))) => 74,
            Self::Scene(_) | Self::Study(_) => 65,
            Self::Input(_) | Self::Place(_) | Self::Output(_) => 74,
        }
    }
}

/// Runs a command that needs communication; returns the exit code. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written: on every rank.
pub fn run(command: Command, comm: &dyn Comm) -> Result<i32, Failure> {
    match command {
        Command::Solve(arguments) => solve(arguments, comm),
        Command::Check(arguments) => check(&arguments.source, comm),
        Command::Scenes | Command::Show { .. } => Ok(0),
    }
}

impl Command {
    /// Answers a command that needs no communication, `None` for the others.
    pub fn answer(&self) -> Option<Result<String, String>> {
        match self {
            Self::Scenes => Some(Ok(library::names().collect::<Vec<_>>().join("\n"))),
            Self::Show { name } => Some(library::text(name).map(|text| text.trim_end().to_owned()).ok_or_else(|| {
                let known = library::names().collect::<Vec<_>>().join(", ");
                format!("there is no built-in scene `{name}`: known are {known}")
            })),
            Self::Solve(_) | Self::Check(_) => None,
        }
    }

    /// `solve two-blocks`.
    pub fn benchmark() -> Self {
        Cli::parse_from(["fetiplast", "solve"]).command.expect("a command is given")
    }
}

/// A scene as it was found.
struct Found {
    text: String,
    origin: String,
}

impl Found {
    fn at_level(&self, level: usize, sets: &[String]) -> Result<Scene, Failure> {
        Scene::from_text(&self.text, &self.origin, level, sets).map_err(|error| Failure::Scene(error.to_string()))
    }
}

/// Rank 0 finds the scene's text; everybody gets it.
fn find(source: &Source, comm: &dyn Comm) -> Result<Found, Failure> {
    let found = if comm.rank() == 0 { Scene::find(&source.scene) } else { Ok(Default::default()) };
    let texts = match &found {
        Ok((text, origin)) => root_texts(comm, ["", "", text, origin]),
        Err(error @ SceneError::Read { .. }) => root_texts(comm, ["input", &error.to_string(), "", ""]),
        Err(error) => root_texts(comm, ["scene", &error.to_string(), "", ""]),
    };
    match &texts[0][..] {
        "input" => return Err(Failure::Input(texts[1].clone())),
        "scene" => return Err(Failure::Scene(texts[1].clone())),
        _ => {}
    }
    Ok(Found { text: texts[2].clone(), origin: texts[3].clone() })
}

/// How results of a scene are called: its name, or the stem of its file, and the level if there is one.
fn run_name(source: &Source) -> String {
    let stem =
        Path::new(&source.scene).file_stem().map_or_else(|| source.scene.clone(), |s| s.to_string_lossy().into());
    if source.level == 1 { stem } else { format!("{stem}-level{}", source.level) }
}

fn solve(arguments: Solve, comm: &dyn Comm) -> Result<i32, Failure> {
    let comm = &Metered::new(comm);
    let timer = Timer::start();
    let mut monitor = Monitor::of_rank(comm.rank(), arguments.progress);
    let Solve { source, out, qp, preconditioner, cascade, .. } = arguments;
    let shorthand = |key: &str, value: Option<String>| value.map(|v| format!("solver.{key}={v}"));
    let mut sets = source.sets.clone();
    sets.extend(shorthand("qp", qp));
    sets.extend(shorthand("preconditioner", preconditioner));
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
        let Ok(scene) = found.at_level(level, &sets) else { continue };
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
    summary.cascade = rows;
    summary.time = table.max_seconds();
    summary.work = table.work();
    summary.communication = communication(&table);
    summary.time_total = Some(table.total_seconds);
    summary.write(comm, &summary_file)?;

    let converged = summary.converged == Some(true);
    monitor.event(&Event::Phases(table.clone()));
    monitor.event(&Event::Residuals(summary.state.residuals));
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

fn check(source: &Source, comm: &dyn Comm) -> Result<i32, Failure> {
    let mut monitor = Monitor::of_rank(comm.rank(), Mode::Off);
    let scene = find(source, comm)?.at_level(source.level, &source.sets)?;
    if let Some(file) = &source.summary {
        replace::probe(comm, file).map_err(Failure::Place)?;
    }
    let discrete = study::discretise(&scene, comm)?;
    let sizes = study::sizes(&discrete, comm);
    let memory = study::memory_estimate_mb(&scene, &discrete, comm);
    let warnings = warnings(&scene, &discrete, comm);
    monitor.event(&Event::Sizes {
        scene: source.scene.clone(),
        level: source.level,
        ranks: comm.size(),
        sizes: sizes.clone(),
    });
    discrete.contact_rows.iter().for_each(|row| monitor.event(&Event::Contact(row.clone())));
    discrete.reading_mb.into_iter().for_each(|megabytes| monitor.event(&Event::Reading { megabytes }));
    monitor.event(&Event::Memory { megabytes: memory });
    warnings.iter().for_each(|text| monitor.event(&Event::Warning(text.clone())));
    if let Some(file) = &source.summary {
        let mut summary = Summary { sizes, warnings, title: scene.title.clone(), ..Summary::default() };
        summary.contacts = discrete.contact_rows.clone();
        summary.memory_estimate_mb = Some(memory);
        summary.mesh_reading_mb = discrete.reading_mb;
        describe_run(&mut summary, source, comm);
        summary.write(comm, file)?;
    }
    Ok(0)
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

/// What the user should know before the run starts.
fn warnings(scene: &Scene, discrete: &study::Discrete, comm: &dyn Comm) -> Vec<String> {
    let mut warnings = scene.warnings();
    warnings.extend(discrete.warnings.iter().cloned());
    let subdomains = discrete.decomposition.shares.total();
    if subdomains < comm.size() {
        warnings.push(format!(
            "{} of {} ranks stay idle: there are only {subdomains} subdomains",
            comm.size() - subdomains,
            comm.size()
        ));
    }
    warnings
}

/// Fills in what belongs to the run as a whole. Collective.
fn describe_run(summary: &mut Summary, source: &Source, comm: &dyn Comm) {
    summary.scene = source.scene.clone();
    summary.level = source.level;
    summary.ranks = comm.size();
    let mine = peak_rss_mb().unwrap_or(f64::NAN);
    summary.peak_rss_mb = Some(ordered_sum(comm, &Shares(vec![1; comm.size()]), &[mine], 1)[0]);
}
