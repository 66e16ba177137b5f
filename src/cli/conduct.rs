//! How a run goes, whatever it solves: the arguments that `solve` and `resume` have in common.

use std::path::PathBuf;

use clap::Args;

use super::keeper::Checkpoints;
use crate::monitor::progress::Mode;

/// What a run tells on the way and what it keeps.
#[derive(Debug, Args)]
pub struct Conduct {
    /// Life signs inside a Newton step: auto, plain or off.
    #[arg(long, value_name = "MODE", default_value = "auto", value_parser = progress)]
    pub(super) progress: Mode,
    /// Begin even if the machine has too little memory for the run.
    #[arg(long)]
    pub(super) ignore_memory: bool,
    #[command(flatten)]
    pub(super) checkpoints: Checkpoints,
    /// Write what every rank did when into this directory, one file a rank, for Chrome's trace viewer or Perfetto.
    #[arg(long, value_name = "DIR")]
    pub(super) trace: Option<PathBuf>,
    /// Write the events of the run as JSON, one object a line.
    #[arg(long, value_name = "FILE")]
    pub(super) log_json: Option<PathBuf>,
}

fn progress(text: &str) -> Result<Mode, String> {
    match text {
        "auto" => Ok(Mode::Auto),
        "plain" => Ok(Mode::Plain),
        "off" => Ok(Mode::Off),
        _ => Err("it is auto, plain or off".into()),
    }
}
