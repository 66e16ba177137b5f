//! What a run has to do, as a checkpoint keeps it, and the files that it writes.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::conduct::Conduct;
use super::{Failure, Source, run_name};
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::monitor::json::JsonLines;
use crate::monitor::trace;
use crate::record::rows::{CascadeRow, RefinementRow};
use crate::results::OutputError;
use crate::results::checkpoint;
use crate::results::provenance::{COMMIT, VERSION};
use crate::results::replace::{self, Form};

/// What checkpoints are written by; others are not understood.
pub(super) const FORMAT: &str = "fetiplast checkpoint 6";

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
    /// Meshes that were solved on before, where the scene asks for an error.
    #[serde(default)]
    pub refinements: Vec<RefinementRow>,
    /// Whether the present mesh is solved on again, as it is the last one: bounds of a limit load have to be near only there.
    pub again: bool,
}

impl Plan {
    /// What a checkpoint says of its run, whose scene is given as text.
    pub fn labels(&self, scene: &str) -> [(&'static str, String); 4] {
        let plan = serde_json::to_string(self).expect("a plan can be written as JSON");
        let scene = scene.to_owned();
        [("run/format", FORMAT.into()), ("run/program", program()), ("run/plan", plan), ("run/scene", scene)]
    }
}

/// This program's version and commit.
pub(super) fn program() -> String {
    format!("{VERSION} ({COMMIT})")
}

/// The files of a run.
pub(super) struct Files {
    /// Fields.
    pub result: PathBuf,
    pub summary: PathBuf,
    pub checkpoint: PathBuf,
    /// The log as JSON, on rank 0.
    pub log: Option<JsonLines>,
}

impl Files {
    /// Makes sure, before anything is computed, that all of them can be written. Collective.
    ///
    /// # Errors
    /// If one cannot.
    pub fn find(comm: &dyn Comm, plan: &Plan, out: PathBuf, conduct: &Conduct) -> Result<Self, Failure> {
        let name = run_name(&plan.source);
        let result = out.join(format!("{name}.vtkhdf"));
        let summary = plan.source.summary.clone().unwrap_or_else(|| out.join(format!("{name}.json")));
        let checkpoint = out.join(format!("{name}.checkpoint.h5"));
        let traced = conduct.trace.as_deref().map(|directory| trace::file(directory, 0));
        let before = checkpoint::previous(&checkpoint);
        let fields = [&result, &checkpoint, &before].map(|file| (file, Form::Hdf5));
        let texts = [&summary].into_iter().chain(&traced).map(|file| (file, Form::Text));
        for (file, form) in fields.into_iter().chain(texts) {
            replace::probe(comm, file, form).map_err(Failure::Place)?;
        }
        let log = match &conduct.log_json {
            Some(file) => {
                let refused = |reason: String| Failure::Place(OutputError::Write { path: file.clone(), reason });
                let log = if comm.rank() == 0 { JsonLines::create(file).map(Some) } else { Ok(None) };
                agree(comm, "creating the log", log).map_err(refused)?
            }
            None => None,
        };
        Ok(Self { result, summary, checkpoint, log })
    }
}
