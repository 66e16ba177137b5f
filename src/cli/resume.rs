//! `fetiplast resume`: goes on where a checkpoint stands.
//!
//! The scene is read again, from where it was, and has to be the same: a checkpoint knows what was solved, not what for. Only
//! its bodies may be cut otherwise.

use std::path::{Path, PathBuf};

use clap::Args;

use super::conduct::Conduct;
use super::keeper::Signals;
use super::levels::{Setting, carry_out};
use super::plan::{FORMAT, Plan, program};
use super::{Failure, find, values};
use crate::comm::Comm;
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::monitor::progress::Mode;
use crate::monitor::timing::Timer;
use crate::results::checkpoint::{self, Checkpoint};
use crate::scene;

/// Arguments of `resume`.
#[derive(Debug, Args)]
pub struct Resume {
    /// The checkpoint, OUT/SCENE.checkpoint.h5. If it is damaged the one before is taken.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Cut bodies otherwise from here on, for example decomposition.subdomains=96; may be repeated. Other keys of the scene
    /// stay.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = values::change)]
    sets: Vec<String>,
    /// Where results go, if not beside the checkpoint.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Where the summary goes, if not to where it was to go.
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
    #[command(flatten)]
    conduct: Conduct,
}

/// Goes on with a run. Collective.
///
/// # Errors
/// If the scene has changed, the checkpoint is of no use, or files cannot be read or written.
pub fn resume(arguments: Resume, comm: &dyn Comm, signals: Signals) -> Result<i32, Failure> {
    let timer = Timer::start();
    let Resume { file, sets, out, summary, conduct } = arguments;
    let mut monitor = Monitor::of_rank(comm.rank(), Mode::Off);
    let (path, checkpoint) = open(comm, &file, &mut monitor)?;
    let unreadable = |reason: String| Failure::Input(format!("cannot go on from {}: {reason}", path.display()));
    let text = |name: &str| checkpoint.text(name).map_err(unreadable);
    if text("run/format")? != FORMAT {
        return Err(unreadable(format!("it is no `{FORMAT}`, but of another version of this program")));
    }
    let (written_by, now) = (text("run/program")?, program());
    if written_by != now {
        monitor.event(&Event::Warning(format!(
            "the checkpoint was written by fetiplast {written_by}, this is {now}: the last digits may differ"
        )));
    }
    let mut plan: Plan = serde_json::from_str(&text("run/plan")?)
        .map_err(|error| unreadable(format!("its plan is not understood: {error}")))?;
    scene::recut(&mut plan.source.sets, sets).map_err(|error| Failure::Scene(error.to_string()))?;
    let found = find(&plan.source, comm)?;
    let scene = found.at_level(plan.source.level, &plan.source.sets)?;
    let mut changes = scene::changes(&text("run/scene")?, &scene.to_toml());
    if changes.extract_if(.., |change| change.starts_with("decomposition")).count() > 0 {
        // It was told in boxes that are no more.
        plan.yielding = None;
    }
    if !changes.is_empty() {
        return Err(Failure::Scene(format!(
            "the scene has changed since the checkpoint was written: {}; undo that, or solve it from the beginning",
            changes.join(", ")
        )));
    }
    plan.source.summary = summary.or(plan.source.summary);
    let out = out.unwrap_or_else(|| file.parent().map(Path::to_owned).unwrap_or_default());
    carry_out(plan, &found, &scene, Some(checkpoint), Setting { timer, out, conduct, signals }, comm)
}

/// Opens a checkpoint, or the one before.
fn open<'a>(comm: &'a dyn Comm, file: &Path, monitor: &mut Monitor) -> Result<(PathBuf, Checkpoint<'a>), Failure> {
    let reason = match Checkpoint::open(comm, file) {
        Ok(checkpoint) => return Ok((file.to_owned(), checkpoint)),
        Err(reason) => reason,
    };
    let before = checkpoint::previous(file);
    match Checkpoint::open(comm, &before) {
        Ok(checkpoint) => {
            monitor.event(&Event::Warning(format!(
                "cannot go on from {}: {reason}; going on from the one before, {}",
                file.display(),
                before.display()
            )));
            Ok((before, checkpoint))
        }
        Err(_) => Err(Failure::Input(format!(
            "cannot go on from {}: {reason}; nor is there a usable one before it, {}",
            file.display(),
            before.display()
        ))),
    }
}
