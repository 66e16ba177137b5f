//! Events as JSON, one object a line, for programs that watch a run: `{"seconds": ..., "event": ..., "data": ...}`.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::events::{Event, Sink};
use crate::results::target;

/// Writes every event but [`Event::Inner`] at once, so that whoever reads along is up to date.
pub struct JsonLines {
    started: Instant,
    /// None after it could not be written.
    file: Option<File>,
}

#[derive(Serialize)]
struct Line<'a> {
    /// Since the log was opened.
    seconds: f64,
    #[serde(flatten)]
    event: &'a Event,
}

impl JsonLines {
    /// A new log, in place of an earlier one, or into a device or pipe.
    ///
    /// # Errors
    /// If the file or its directory cannot be made.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { started: Instant::now(), file: Some(target::open(path)?) })
    }
}

impl Sink for JsonLines {
    fn event(&mut self, event: &Event) {
        let (Some(file), false) = (&mut self.file, matches!(event, Event::Inner { .. })) else { return };
        let line = Line { seconds: self.started.elapsed().as_secs_f64(), event };
        let text = serde_json::to_string(&line).expect("events can be written as JSON");
        if let Err(error) = writeln!(file, "{text}") {
            tracing::warn!("the log in JSON ends here, it cannot be written: {error}");
            self.file = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::record::rows::NewtonRow;
    use crate::record::state::Residuals;

    #[test]
    fn every_line_is_an_event() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("logs/run.jsonl");
        let mut log = JsonLines::create(&path).unwrap();
        log.event(&Event::NewtonStep(NewtonRow { step: 3, ..NewtonRow::default() }));
        log.event(&Event::Inner { step: 3, hessian_multiplications: 1 });
        log.event(&Event::Warning("careful".into()));
        log.event(&Event::Residuals(Residuals { gap: Some(f64::NAN), ..Residuals::default() }));
        let text = std::fs::read_to_string(path).unwrap();
        let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let names: Vec<&str> = lines.iter().map(|line| line["event"].as_str().unwrap()).collect();
        assert_eq!(names, ["newton_step", "warning", "residuals"]);
        assert_eq!((&lines[0]["data"]["step"], &lines[1]["data"]), (&3.into(), &"careful".into()));
        assert_eq!(lines[2]["data"]["residual_gap"], Value::Null);
        assert!(lines.iter().all(|line| line["seconds"].as_f64().is_some_and(|s| s >= 0.0)));
    }
}
