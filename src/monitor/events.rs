//! The events of a run.

use serde::Serialize;

use super::table::PhaseTable;
use crate::record::counts::{ContactRow, Sizes};
use crate::record::forecast::{Forecast, HeldRow};
use crate::record::rows::{LimitLoad, NewtonRow, RefinementRow};
use crate::record::state::{Errors, Residuals};

/// Something that happened and is worth telling; numbers are those of all ranks together.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "event", content = "data", rename_all = "snake_case")]
pub enum Event {
    /// The problem is set up.
    Sizes {
        /// Name or path of the scene, and its level.
        scene: String,
        /// Refinement level.
        level: usize,
        /// Number of ranks.
        ranks: usize,
        /// Sizes of the problem.
        sizes: Sizes,
    },
    /// A contact is paired.
    Contact(ContactRow),
    /// Mesh files are read and sent out.
    Reading {
        /// Largest resident memory of rank 0 until then, in MiB.
        megabytes: f64,
    },
    /// What a run would take, from `check`.
    Memory {
        /// All ranks together, in MiB.
        megabytes: f64,
        /// What their hosts have left, in MiB, where that is known.
        available_mb: Option<f64>,
    },
    /// What a rank would hold, from `check --ranks`.
    Held {
        /// Number of ranks.
        ranks: usize,
        /// Item by item.
        rows: Vec<HeldRow>,
    },
    /// How long a run would take, from `check --ranks`.
    Forecast(Forecast),
    /// An increment of the load is tried; where it leads to.
    Increment(String),
    /// The QP solver is at work; sent as often as it likes.
    Inner {
        /// Newton step, from 1.
        step: u64,
        /// Applications of F in this step.
        hessian_multiplications: u64,
    },
    /// What the program chose.
    Note(String),
    /// A mesh of a run that refines it was solved on.
    Refinement {
        /// What it took, and its error.
        row: RefinementRow,
        /// The error that is wanted.
        goal: f64,
    },
    /// What is known of the limit load.
    Limit(LimitLoad),
    /// A Newton step is done.
    NewtonStep(NewtonRow),
    /// Something the user should know.
    Warning(String),
    /// Where the time went.
    Phases(PhaseTable),
    /// How well the equations hold in the end.
    Residuals(Residuals),
    /// How exact the stress is.
    Errors(Errors),
    /// The run is over.
    Outcome {
        /// Whether Newton's method converged.
        converged: bool,
        /// Newton steps.
        newton_iterations: u64,
        /// Wall time in seconds.
        seconds: f64,
        /// Why it did not converge, or where the results are.
        note: String,
    },
}

/// Shows events.
pub trait Sink {
    /// Called for every event, in order.
    fn event(&mut self, event: &Event);
}
