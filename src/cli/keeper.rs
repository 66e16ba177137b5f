//! When a run writes checkpoints, and when it stops: on a signal, or before its time is over.
//!
//! From the first Newton step until results are written a signal only raises a flag, which is looked at between steps. The ranks
//! decide together: one that has seen a signal stops them all, rank 0 watches the clock and the log. Before and after that there
//! is nothing that a checkpoint could keep, and SIGTERM ends the process at once, as it does without us; the launcher ends the
//! other ranks.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use signal_hook::consts::{SIGTERM, SIGUSR1};
use signal_hook::flag;

use super::Failure;
use crate::comm::{Comm, maximum};
use crate::monitor::stdout;
use crate::monitor::timing::Timer;
use crate::results::OutputError;

/// Options on checkpoints.
#[derive(Clone, Debug, Default, Args)]
pub struct Checkpoints {
    /// Write a checkpoint whenever so much time has passed: 90 (seconds), 30m, 2h, 1:30:00.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub checkpoint_every: Option<Duration>,
    /// Write a checkpoint and stop, with exit code 75, before the run has taken so long; `fetiplast resume` goes on.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
}

/// Seconds, a number with a unit, or hours, minutes and seconds as SLURM has them, after days if there are any.
fn time(text: &str) -> Result<Duration, String> {
    let units = [("s", 1.0), ("m", 60.0), ("h", 3600.0), ("d", 86_400.0), ("", 1.0)];
    let (days, clock) = text.split_once('-').unwrap_or(("0", text));
    let seconds = if clock.contains(':') {
        let parts: Option<Vec<u64>> = clock.split(':').map(|part| part.parse().ok()).collect();
        let parts = parts.filter(|parts| parts.len() <= 3);
        let days = days.parse::<u64>().ok();
        parts.zip(days).map(|(parts, days)| {
            let seconds = parts.iter().fold(0.0, |sum, part| 60.0 * sum + *part as f64);
            seconds + 86_400.0 * days as f64
        })
    } else {
        let value = |(unit, factor): (&str, f64)| Some(factor * text.strip_suffix(unit)?.parse::<f64>().ok()?);
        units.into_iter().find_map(value)
    };
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).filter(|time| !time.is_zero());
    time.ok_or_else(|| "a time is a number of seconds, or like 30m, 2h, 1:30:00".into())
}

/// The signals that ask a run to stop.
#[derive(Clone, Debug, Default)]
pub struct Signals {
    /// Number of the last one, from 1; 0 if there was none.
    seen: Arc<AtomicUsize>,
    /// Whether SIGTERM ends the process at once.
    fatal: Arc<AtomicBool>,
}

const STOPPING: [(i32, &str); 2] = [(SIGUSR1, "SIGUSR1"), (SIGTERM, "SIGTERM")];

impl Signals {
    /// From now on such signals are remembered; but until a keeper says otherwise SIGTERM ends the process at once.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn catch() -> std::io::Result<Self> {
        let signals = Self::default();
        signals.end_at_once(true);
        for (index, (signal, _)) in STOPPING.iter().enumerate() {
            // Open MPI's launcher may hang where a rank dies of a signal that it passes on, as it does SIGUSR1.
            if *signal == SIGTERM {
                flag::register_conditional_default(*signal, Arc::clone(&signals.fatal))?;
            }
            flag::register_usize(*signal, Arc::clone(&signals.seen), index + 1)?;
        }
        Ok(signals)
    }

    fn end_at_once(&self, fatal: bool) {
        self.fatal.store(fatal, Ordering::Relaxed);
    }
}

/// What to do at a place where a run may be stopped.
#[derive(Clone, Debug, PartialEq)]
enum Due {
    Nothing,
    Checkpoint,
    /// A checkpoint, and then the end, for this reason.
    Stop(String),
    /// The same, because the log cannot be written.
    Mute,
}

/// Decides over checkpoints, and remembers what became of them.
pub struct Keeper<'a> {
    comm: &'a dyn Comm,
    timer: &'a Timer,
    options: Checkpoints,
    signals: Signals,
    path: PathBuf,
    /// When the last checkpoint was complete, or the run began.
    written: Cell<Instant>,
    /// When it was last asked, and the longest that it took from one time to the next.
    asked: Cell<Option<Instant>>,
    longest: Cell<Duration>,
    /// How long the longest checkpoint took.
    writing: Cell<Duration>,
    /// Why the run ends here.
    end: RefCell<Option<Failure>>,
}

impl<'a> Keeper<'a> {
    /// Keeps checkpoints under this name.
    pub fn new(comm: &'a dyn Comm, timer: &'a Timer, options: Checkpoints, signals: Signals, path: PathBuf) -> Self {
        Self {
            comm,
            timer,
            options,
            signals,
            path,
            written: Cell::new(Instant::now()),
            asked: Cell::default(),
            longest: Cell::default(),
            writing: Cell::default(),
            end: RefCell::default(),
        }
    }

    /// Lets `write` write a checkpoint if it is time; whether the run has to end here, which [`Keeper::end`] explains. Where it
    /// need not end, a checkpoint that cannot be written is told to `warn`. Collective.
    pub fn pause(&self, write: impl FnOnce(&Path) -> Result<(), OutputError>, warn: impl FnOnce(String)) -> bool {
        self.signals.end_at_once(false);
        let is_first = self.asked.get().is_none();
        let due = self.due();
        if due == Due::Nothing {
            return false;
        }
        if due == Due::Mute && is_first {
            self.end.replace(Some(Failure::Mute { path: None }));
            return true;
        }
        let begin = Instant::now();
        let outcome = self.timer.time("checkpoints", || write(&self.path));
        self.written.set(Instant::now());
        self.asked.set(Some(Instant::now()));
        self.writing.set(self.writing.get().max(begin.elapsed()));
        let end = match (outcome, due) {
            (Ok(()), Due::Stop(reason)) => Some(Failure::Stopped { reason, path: self.path.clone() }),
            (Ok(()), Due::Mute) => Some(Failure::Mute { path: Some(self.path.clone()) }),
            (Err(error), Due::Stop(_) | Due::Mute) => Some(Failure::Output(error)),
            (Err(error), _) => {
                warn(format!("going on without a new checkpoint: {error}"));
                None
            }
            (Ok(()), _) => None,
        };
        let ends = end.is_some();
        self.end.replace(end);
        ends
    }

    /// Takes the reason why the run ended before its time; `None` if it did not.
    pub fn end(&self) -> Option<Failure> {
        self.end.take()
    }

    /// Nothing is left that a checkpoint could keep.
    pub fn end_at_once(&self) {
        self.signals.end_at_once(true);
    }

    fn due(&self) -> Due {
        let now = Instant::now();
        let before = self.asked.replace(Some(now));
        if let Some(before) = before {
            self.longest.set(self.longest.get().max(now - before));
        }
        let Checkpoints { checkpoint_every, time_limit } = self.options;
        let first = self.comm.rank() == 0;
        let passed = Duration::from_secs_f64(self.timer.total_seconds());
        // Another step, and a checkpoint that takes as long as the longest yet, have to fit. One step is always done: who
        // goes on again and again must not stand still.
        let is_late = before.is_some()
            && time_limit.is_some_and(|limit| passed + self.longest.get() + 2 * self.writing.get() >= limit);
        let is_old = checkpoint_every.is_some_and(|pause| self.written.get().elapsed() >= pause);
        let is_mute = stdout::failure().is_some();
        let signal = self.signals.seen.load(Ordering::Relaxed) as f64;
        let mine = [signal, f64::from(first && is_mute), f64::from(first && is_late), f64::from(first && is_old)];
        match &maximum(self.comm, &mine)[..] {
            [_, mute, ..] if *mute > 0.0 => Due::Mute,
            [signal, ..] if *signal > 0.0 => Due::Stop(format!("stopped by {}", STOPPING[*signal as usize - 1].1)),
            [_, _, late, _] if *late > 0.0 => Due::Stop("stopped before the time limit".into()),
            [.., old] if *old > 0.0 => Due::Checkpoint,
            _ => Due::Nothing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::comm::threads;

    #[test]
    fn times_are_read_as_people_write_them() {
        let seconds = |text| time(text).map(|time| time.as_secs_f64()).ok();
        assert_eq!(seconds("90"), Some(90.0));
        assert_eq!(seconds("0.5"), Some(0.5));
        assert_eq!(seconds("1.5m"), Some(90.0));
        assert_eq!(seconds("2h"), Some(7200.0));
        assert_eq!(seconds("1d"), Some(86_400.0));
        assert_eq!(seconds("10:30"), Some(630.0));
        assert_eq!(seconds("1:00:01"), Some(3601.0));
        assert_eq!(seconds("2-00:00:00"), Some(172_800.0));
        for wrong in ["", "0", "-5", "1:2:3:4", "1.5:00", "soon", "nan", "inf", "1e300"] {
            assert_eq!(seconds(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_signal_on_one_rank_stops_all() {
        let ends = threads::run(3, |comm| {
            let (timer, signals) = (Timer::start(), Signals::default());
            let keeper = Keeper::new(comm, &timer, Checkpoints::default(), signals.clone(), "there".into());
            assert!(!keeper.pause(|_| panic!("nothing is due"), |_| ()));
            if comm.rank() == 1 {
                signals.seen.store(2, Ordering::Relaxed);
            }
            assert!(keeper.pause(|_| Ok(()), |_| ()));
            keeper.end().map(|end| end.to_string())
        });
        let expected = "stopped by SIGTERM; go on with: fetiplast resume there";
        assert!(ends.into_iter().all(|end| end.as_deref() == Some(expected)));
    }

    #[test]
    fn the_clock_decides_over_checkpoints_and_the_end() {
        let timer = Timer::start();
        let options = |every: u64, limit: u64| Checkpoints {
            checkpoint_every: Some(Duration::from_millis(every)),
            time_limit: Some(Duration::from_millis(limit)),
        };
        let keeper = |options| Keeper::new(&Solo, &timer, options, Signals::default(), "there".into());
        let written = Cell::new(0);
        let write = |_: &Path| {
            written.set(written.get() + 1);
            Ok(())
        };
        let often = keeper(options(1, 3_600_000));
        let warn = |text| panic!("all is well, but {text}");
        assert!(!often.pause(write, warn) || written.get() == 1);
        std::thread::sleep(Duration::from_millis(2));
        assert!(!often.pause(write, warn) && written.get() > 0 && often.end().is_none());
        let late = keeper(options(3_600_000, 1));
        assert!(!late.pause(write, warn), "one step is done however little time there is");
        assert!(late.pause(write, warn));
        let end = late.end().expect("it has ended").to_string();
        assert_eq!(end, "stopped before the time limit; go on with: fetiplast resume there");
    }

    #[test]
    fn a_checkpoint_that_cannot_be_written_ends_only_a_run_that_ends_here() {
        let (timer, signals, told) = (Timer::start(), Signals::default(), RefCell::new(String::new()));
        let options = Checkpoints { checkpoint_every: Some(Duration::from_millis(1)), time_limit: None };
        let keeper = Keeper::new(&Solo, &timer, options, signals.clone(), "there".into());
        std::thread::sleep(Duration::from_millis(2));
        let error = OutputError::Write { path: "there".into(), reason: "full".into() };
        let pause = || keeper.pause(|_| Err(error.clone()), |text| *told.borrow_mut() = text);
        assert!(!pause() && keeper.end().is_none());
        assert!(told.take().starts_with("going on without a new checkpoint: cannot write there: full"));
        signals.seen.store(1, Ordering::Relaxed);
        assert!(pause() && told.take().is_empty());
        assert!(matches!(keeper.end(), Some(Failure::Output(lost)) if lost == error));
    }
}
