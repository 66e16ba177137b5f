//! The command line: arguments, what each command does, exit codes.
//!
//! Every rank runs the same command. What one rank finds out, rank 0 above all, is shared before anybody acts on it, so
//! all ranks end with the same code and one message.

mod check;
mod conduct;
pub mod keeper;
mod levels;
mod plan;
mod refined;
mod resume;
mod room;
mod solve;
mod values;
mod verify;

use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use self::check::{Check, check};
use self::keeper::Signals;
pub use self::resume::{Resume, resume};
pub use self::solve::{Cascade, Solve, solve};
pub use self::verify::{Verify, verify};
use crate::comm::agree::root_texts;
use crate::comm::{Comm, decide, exact, maximum};
use crate::heap::EXIT_MEMORY;
use crate::model::ModelError;
use crate::model::meshes::MeshError;
use crate::monitor::stdout;
use crate::monitor::timing::{peak_private_mb, peak_rss_mb};
use crate::record::summary::Summary;
use crate::restart::state::NoStart;
use crate::results::OutputError;
use crate::scene::{self, Scene, SceneError, library};
use crate::study::StudyError;

/// Contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
#[derive(Debug, Parser)]
#[command(name = "fetiplast", version, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do; without a command the paper's benchmark is solved.
    #[command(subcommand)]
    pub command: Option<Command>,
}

const EXIT_CODES: &str = "Exit codes: 0 converged; 1 finished without convergence, results written; 64 usage; \
                          65 bad scene or mesh; 70 bug; 71 not enough memory; 74 input or output failed; 75 stopped by a signal or before \
                          the time limit, `fetiplast resume` goes on.";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solve a scene and write its results.
    Solve(Solve),
    /// Go on where a run stopped.
    Resume(Resume),
    /// Report sizes and warnings of a scene; solves nothing.
    Check(Check),
    /// Compare the program with closed forms, on meshes that get finer.
    Verify(Verify),
    /// List the built-in scenes.
    Scenes,
    /// Print a built-in scene as TOML, to start from.
    Show {
        /// Its name.
        name: String,
    },
}

/// Which scene.
#[derive(Clone, Debug, Args, Serialize, Deserialize)]
pub struct Source {
    /// A built-in scene (see `fetiplast scenes`) or a TOML file.
    #[arg(default_value = "two-blocks")]
    pub scene: String,
    /// Refinement: this many times the cells along each edge of every body that is not from a mesh file.
    #[arg(long, default_value_t = 1, value_parser = values::level, allow_negative_numbers = true)]
    pub level: usize,
    /// Change a key of the scene, for example decomposition.subdomains=48; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = values::change)]
    pub sets: Vec<String>,
    /// Write a summary of the run as JSON.
    #[arg(long, value_name = "FILE")]
    pub summary: Option<PathBuf>,
}

/// Why a command gave up; the same on every rank.
#[derive(Debug, Error)]
pub enum Failure {
    /// The scene is not usable.
    #[error("{0}")]
    Scene(String),
    /// The scene has no discrete problem.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The state to start from is none.
    #[error(transparent)]
    NoStart(#[from] NoStart),
    /// The scene has no solution.
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
    /// The machine has not enough memory.
    #[error("{0}")]
    Memory(String),
    /// Standard output cannot be written; [`stdout::failure`] of rank 0 has the reason.
    #[error("cannot write to standard output{}", path.as_ref().map_or(String::new(), |path| resumable(path)))]
    Mute {
        /// The checkpoint, if there was something to keep.
        path: Option<PathBuf>,
    },
    /// Somebody, or the clock, asked to stop.
    #[error("{reason}{}", resumable(path))]
    Stopped {
        /// Who.
        reason: String,
        /// The checkpoint.
        path: PathBuf,
    },
}

fn resumable(path: &Path) -> String {
    format!("; go on with: fetiplast resume {}", path.display())
}

impl Failure {
    /// Exit code (sysexits).
    pub fn code(&self) -> i32 {
        match self {
            Self::Model(ModelError::Mesh(MeshError::Unreadable(_))) | Self::NoStart(NoStart::Missing { .. }) => 74,
            Self::Scene(_) | Self::Model(_) | Self::NoStart(_) | Self::Study(_) => 65,
            Self::Input(_) | Self::Place(_) | Self::Output(_) | Self::Mute { .. } => 74,
            Self::Memory(_) => EXIT_MEMORY,
            Self::Stopped { .. } => 75,
        }
    }
}

/// Runs a command that needs communication; returns the exit code. What it solves stops when one of `signals` comes.
/// Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written, or rank 0's standard output: on every rank.
pub fn run(command: Command, comm: &dyn Comm, signals: Signals) -> Result<i32, Failure> {
    let code = match command {
        Command::Solve(arguments) => solve(arguments, comm, signals),
        Command::Resume(arguments) => resume(arguments, comm, signals),
        Command::Check(arguments) => check(&arguments, comm),
        Command::Verify(arguments) => verify(&arguments, comm),
        Command::Scenes | Command::Show { .. } => Ok(0),
    }?;
    if is_mute(comm) { Err(Failure::Mute { path: None }) } else { Ok(code) }
}

/// Whether rank 0 can tell nothing any more. Collective.
fn is_mute(comm: &dyn Comm) -> bool {
    decide(comm, stdout::failure().is_some())
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
            Self::Verify(arguments) => arguments.refusal().map(Err),
            Self::Solve(_) | Self::Resume(_) | Self::Check(_) => None,
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

/// Whether the user changed the element of a body.
fn is_chosen(source: &Source, body: &str) -> bool {
    source.sets.iter().any(|set| scene::concerns(set, &format!("body.{body}.element")))
}

/// How results of a scene are called: its name, or the stem of its file, and the level if there is one.
fn run_name(source: &Source) -> String {
    let stem =
        Path::new(&source.scene).file_stem().map_or_else(|| source.scene.clone(), |s| s.to_string_lossy().into());
    if source.level == 1 { stem } else { format!("{stem}-level{}", source.level) }
}

/// What the user should know before the run starts.
fn warnings(scene: &Scene, of_meshes: &[String], subdomains: u64, comm: &dyn Comm) -> Vec<String> {
    let mut warnings = scene.warnings();
    warnings.extend(of_meshes.iter().cloned());
    let ranks = comm.size() as u64;
    if subdomains < ranks {
        let idle = ranks - subdomains;
        warnings.push(format!("{idle} of {ranks} ranks stay idle: there are only {subdomains} subdomains"));
    }
    warnings
}

/// Fills in what belongs to the run as a whole. Collective.
fn describe_run(summary: &mut Summary, source: &Source, comm: &dyn Comm) {
    summary.scene = source.scene.clone();
    summary.level = source.level;
    summary.ranks = comm.size();
    let [mine, private] = [peak_rss_mb(), peak_private_mb()].map(|peak| peak.unwrap_or(f64::NAN));
    let sums = exact::sum(comm, &[mine, private], 2);
    summary.peak_rss_mb = Some(sums[0]);
    summary.peak_private_mb = Some(sums[1]);
    summary.peak_rss_mb_max = Some(maximum(comm, &[mine])[0]);
}
