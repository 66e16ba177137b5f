//! What a run tells while it runs: typed events on one side, sinks that show them on the other.
//!
//! The stages send [`events::Event`]s to a [`Monitor`]; only rank 0's shows anything. Log lines go through `tracing`, so
//! the program decides where they end up, as a rule on [`stdout`]. [`timing`] measures phases and messages, [`table`] compares them over the ranks, `counted` what has no noise,
//! [`trace`] keeps every call.
//! Nothing here is read back by the numerics.

mod counted;
pub mod events;
pub mod json;
pub mod machine;
pub mod metered;
pub mod plain;
pub mod progress;
pub mod stdout;
pub mod table;
pub mod timing;
pub mod trace;

use events::{Event, Sink};
use plain::Plain;
use progress::{Mode, Progress};

/// Sends every event to all sinks in turn.
#[derive(Default)]
pub struct Monitor {
    sinks: Vec<Box<dyn Sink>>,
}

impl Monitor {
    /// The monitor of one rank: log lines and progress on rank 0, nothing elsewhere.
    pub fn of_rank(rank: usize, mode: Mode) -> Self {
        if rank > 0 {
            return Self::default();
        }
        // Progress comes first: it clears its line before the log continues.
        Self { sinks: vec![Box::new(Progress::on_stderr(mode)), Box::new(Plain::default())] }
    }

    /// Another sink, told last.
    pub fn add(&mut self, sink: impl Sink + 'static) {
        self.sinks.push(Box::new(sink));
    }
}

impl Sink for Monitor {
    fn event(&mut self, event: &Event) {
        for sink in &mut self.sinks {
            sink.event(event);
        }
    }
}
