//! What every rank did when, in the format of Chrome's trace viewer, which `chrome://tracing` and Perfetto open.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use serde_json::json;

use super::timing::Timer;
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::results::OutputError;
use crate::results::target;

/// Where rank `rank` writes.
pub fn file(directory: &Path, rank: usize) -> PathBuf {
    directory.join(format!("rank-{rank}.json"))
}

/// Each rank writes the calls that its timer kept into a file of its own, times from the start of rank 0. Collective.
///
/// # Errors
/// [`OutputError::Write`] on every rank if one cannot write.
pub fn write(comm: &dyn Comm, directory: &Path, timer: &Timer) -> Result<(), OutputError> {
    let started = timer.started().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    let mut origin = [started];
    comm.broadcast(&mut origin);
    let outcome = write_own(&file(directory, comm.rank()), comm.rank(), timer, 1e6 * (started - origin[0]));
    agree(comm, "writing the trace", outcome)
        .map_err(|reason| OutputError::Write { path: directory.to_owned(), reason })
}

/// `offset` is added to all times, in microseconds.
fn write_own(path: &Path, rank: usize, timer: &Timer, offset: f64) -> io::Result<()> {
    let mut file = BufWriter::new(target::open(path)?);
    let name = json!({ "name": "process_name", "ph": "M", "pid": rank, "args": { "name": format!("rank {rank}") } });
    write!(file, "{{\"displayTimeUnit\": \"ms\", \"traceEvents\": [\n{name}")?;
    for span in timer.spans() {
        let [begin, length] = [span.begin, span.length].map(|time| 1e6 * time.as_secs_f64());
        let event = json!({
            "name": span.name, "ph": "X", "pid": rank, "tid": 0, "ts": (begin + offset).round(), "dur": length.round()
        });
        write!(file, ",\n{event}")?;
    }
    writeln!(file, "\n]}}")?;
    file.flush()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::comm::threads;
    use crate::monitor::timing::Messages;

    #[test]
    fn every_rank_tells_its_calls_in_microseconds() {
        let directory = tempfile::tempdir().unwrap();
        threads::run(2, |comm| {
            let mut timer = Timer::start();
            timer.keep_spans();
            timer.time("assembly", || timer.messages(Messages::Collective, 0, || ()));
            write(comm, directory.path(), &timer).unwrap();
        });
        for rank in [0, 1] {
            let text = std::fs::read_to_string(file(directory.path(), rank)).unwrap();
            let trace: Value = serde_json::from_str(&text).unwrap();
            let [name, message, phase] = &trace["traceEvents"].as_array().unwrap()[..] else { panic!("two calls") };
            assert_eq!(name["args"]["name"], format!("rank {rank}"));
            assert_eq!((&message["name"], &phase["name"]), (&"collectives".into(), &"assembly".into()));
            assert!(phase["ts"].as_f64() <= message["ts"].as_f64() && phase["pid"] == rank);
        }
    }

    #[test]
    fn a_place_that_takes_no_file_is_an_error_on_every_rank() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let outcomes = threads::run(2, |comm| write(comm, &file.path().join("under"), &Timer::start()));
        assert!(outcomes.iter().all(Result::is_err));
    }
}
