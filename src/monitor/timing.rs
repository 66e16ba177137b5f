//! How long the phases of a run take on one rank, how long its messages, and how much work is done.
//!
//! Wall time. Phases do not nest and leave out the messages inside them, so that all of them together and all messages
//! together make up the total, but for what belongs to no phase.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant, SystemTime};

use crate::record::counts::Work;

/// Collects the seconds that one rank spends in named phases and in messages.
#[derive(Clone, Debug)]
pub struct Timer {
    started: Instant,
    /// When that was by the clock on the wall, which ranks have in common.
    at: SystemTime,
    phases: RefCell<Vec<(&'static str, Spent)>>,
    traffic: Cell<[Traffic; 3]>,
    /// Every single call, if they are to be kept.
    spans: Option<RefCell<Vec<Span>>>,
}

/// What one rank spent in a phase.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spent {
    pub calls: u64,
    pub seconds: f64,
    pub work: Work,
}

/// Kinds of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Messages {
    /// Between neighbouring ranks.
    Exchange,
    /// Of all ranks.
    Collective,
    /// Of any lengths, while the problem is set up.
    SetUp,
}

impl Messages {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Exchange, Self::Collective, Self::SetUp];

    /// What the log calls them.
    pub fn name(self) -> &'static str {
        ["neighbour exchange", "collectives", "set-up messages"][self as usize]
    }
}

/// Messages of one kind on one rank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Calls.
    pub calls: u64,
    /// Time inside them: waiting for slower ranks and the transfer itself, which cannot be told apart.
    pub seconds: f64,
    /// Bytes that this rank handed in.
    pub bytes: u64,
}

/// One call of a phase, messages inside it included, or of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Of the phase or the kind of messages.
    pub name: &'static str,
    /// Since the timer was started.
    pub begin: Duration,
    /// How long it took.
    pub length: Duration,
}

impl Default for Timer {
    fn default() -> Self {
        Self::start()
    }
}

impl Timer {
    /// Starts the clock of the whole run.
    pub fn start() -> Self {
        let (started, at) = (Instant::now(), SystemTime::now());
        Self { started, at, phases: RefCell::default(), traffic: Cell::default(), spans: None }
    }

    /// Keeps every single call from now on.
    pub fn keep_spans(&mut self) {
        self.spans = Some(RefCell::default());
    }

    /// Runs `work` and counts its time, without that of messages inside it, as one call of a phase.
    pub fn time<T>(&self, phase: &'static str, work: impl FnOnce() -> T) -> T {
        let (begin, messages) = (Instant::now(), self.message_seconds());
        let result = work();
        let length = begin.elapsed();
        self.keep(phase, begin, length);
        self.add(phase, length.as_secs_f64() - (self.message_seconds() - messages));
        result
    }

    /// Counts seconds measured elsewhere as one call of a phase.
    pub fn add(&self, phase: &'static str, seconds: f64) {
        self.book(phase, |spent| {
            spent.calls += 1;
            spent.seconds += seconds;
        });
    }

    /// Counts work done in a phase.
    pub fn count(&self, phase: &'static str, flops: f64, bytes: f64) {
        self.book(phase, |spent| {
            spent.work.flops += flops;
            spent.work.bytes += bytes;
        });
    }

    /// Sends and receives messages of one kind, which hand in so many bytes here.
    pub fn messages<T>(&self, kind: Messages, bytes: u64, call: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = call();
        let length = begin.elapsed();
        self.keep(kind.name(), begin, length);
        let mut traffic = self.traffic.get();
        let of_kind = &mut traffic[kind as usize];
        of_kind.calls += 1;
        of_kind.seconds += length.as_secs_f64();
        of_kind.bytes += bytes;
        self.traffic.set(traffic);
        result
    }

    /// Messages so far.
    pub fn traffic(&self, kind: Messages) -> Traffic {
        self.traffic.get()[kind as usize]
    }

    /// Seconds since the start.
    pub fn total_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// When the clock was started.
    pub fn started(&self) -> SystemTime {
        self.at
    }

    /// The calls that were kept.
    pub fn spans(&self) -> Vec<Span> {
        self.spans.as_ref().map(|spans| spans.borrow().clone()).unwrap_or_default()
    }

    /// The phases in order of first use.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.phases.borrow().iter().map(|&(name, _)| name).collect()
    }

    /// What was spent in a phase; nothing if it never ran here.
    pub(super) fn spent(&self, phase: &str) -> Spent {
        let phases = self.phases.borrow();
        phases.iter().find(|(name, _)| *name == phase).map(|(_, spent)| *spent).unwrap_or_default()
    }

    fn book(&self, phase: &'static str, add: impl FnOnce(&mut Spent)) {
        let mut phases = self.phases.borrow_mut();
        let at = phases.iter().position(|(name, _)| *name == phase).unwrap_or_else(|| {
            phases.push((phase, Spent::default()));
            phases.len() - 1
        });
        add(&mut phases[at].1);
    }

    fn keep(&self, name: &'static str, begin: Instant, length: Duration) {
        if let Some(spans) = &self.spans {
            spans.borrow_mut().push(Span { name, begin: begin.duration_since(self.started), length });
        }
    }

    fn message_seconds(&self) -> f64 {
        self.traffic.get().iter().map(|traffic| traffic.seconds).sum()
    }
}

/// The largest resident memory of this process so far, in MiB; `None` where Linux's `/proc` is missing.
pub fn peak_rss_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}

#[cfg(test)]
mod tests {
    use std::thread::sleep;

    use super::*;

    #[test]
    fn phases_leave_out_messages_and_calls_are_kept_on_request() {
        let pause = Duration::from_millis(20);
        let mut timer = Timer::start();
        timer.keep_spans();
        let answer =
            timer.time("dual operator", || timer.messages(Messages::Exchange, 24, || [sleep(pause), ()].len()));
        assert_eq!(answer, 2);
        let Traffic { calls, seconds, bytes } = timer.traffic(Messages::Exchange);
        assert!((calls, bytes) == (1, 24) && seconds >= pause.as_secs_f64());
        let spent = timer.spent("dual operator");
        assert!(spent.calls == 1 && spent.seconds < pause.as_secs_f64(), "{}", spent.seconds);
        let [message, phase] = timer.spans()[..] else { panic!("two calls") };
        assert_eq!((message.name, phase.name), ("neighbour exchange", "dual operator"));
        assert!(phase.begin <= message.begin && message.begin + message.length <= phase.begin + phase.length);
        assert!(Timer::start().spans().is_empty());
    }

    #[test]
    fn this_process_takes_memory() {
        assert!(peak_rss_mb().is_some_and(|size| size > 0.5));
    }
}
