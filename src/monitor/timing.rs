//! How long the phases of a run take on one rank, how long its messages, and how much work is done.
//!
//! Wall time. Phases do not nest and leave out the messages inside them, so that all of them together and all messages
//! together make up the total, but for what belongs to no phase. Work (`src/work.rs`) and counts of messages belong to the phase
//! that they happen in, or to [`OUTSIDE`].

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::time::{Duration, Instant, SystemTime};

use crate::work::{self, Work};

/// What is in no phase.
pub const OUTSIDE: &str = "outside phases";

/// Collects the seconds that one rank spends in named phases and in messages.
#[derive(Clone, Debug)]
pub struct Timer {
    started: Instant,
    /// When that was by the clock on the wall, which ranks have in common.
    at: SystemTime,
    phases: RefCell<Vec<(&'static str, Spent)>>,
    /// The phase that runs.
    phase: Cell<&'static str>,
    /// Work of this thread that is booked.
    booked: Cell<Work>,
    /// Ranks that messages were exchanged with.
    partners: RefCell<BTreeSet<usize>>,
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
    pub mail: Mail,
}

/// What one rank tells others, and hears of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mail {
    /// Messages to single ranks.
    pub messages: u64,
    /// Calls that all ranks take part in.
    pub collectives: u64,
    /// Bytes handed in for others.
    pub sent: u64,
    /// Bytes that came from others.
    pub received: u64,
    /// Bytes of the longest single message, or of the longest result of a collective call.
    pub largest: u64,
}

impl std::ops::AddAssign for Mail {
    fn add_assign(&mut self, other: Self) {
        self.messages += other.messages;
        self.collectives += other.collectives;
        self.sent += other.sent;
        self.received += other.received;
        self.largest = self.largest.max(other.largest);
    }
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
        Self {
            started,
            at,
            phases: RefCell::default(),
            phase: Cell::new(OUTSIDE),
            booked: Cell::new(work::done()),
            partners: RefCell::default(),
            traffic: Cell::default(),
            spans: None,
        }
    }

    /// Keeps every single call from now on.
    pub fn keep_spans(&mut self) {
        self.spans = Some(RefCell::default());
    }

    /// Runs `work` and counts its time, without that of messages inside it, as one call of a phase.
    pub fn time<T>(&self, phase: &'static str, work: impl FnOnce() -> T) -> T {
        self.settle();
        let outer = self.phase.replace(phase);
        let (begin, messages) = (Instant::now(), self.message_seconds());
        let result = work();
        let length = begin.elapsed();
        self.settle();
        self.phase.set(outer);
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

    /// Books what was told in the phase that runs.
    pub fn post(&self, mail: Mail) {
        self.book(self.phase.get(), |spent| spent.mail += mail);
    }

    /// Remembers ranks that messages are exchanged with.
    pub fn meet(&self, partners: &[usize]) {
        self.partners.borrow_mut().extend(partners);
    }

    /// How many these are.
    pub fn partners(&self) -> usize {
        self.partners.borrow().len()
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

    /// What was spent in the phases, in order of first use, and last outside of them.
    pub(super) fn spent(&self) -> Vec<(&'static str, Spent)> {
        self.settle();
        let (outside, mut phases): (Vec<_>, Vec<_>) =
            self.phases.borrow().iter().copied().partition(|&(name, _)| name == OUTSIDE);
        let inside: f64 = phases.iter().map(|(_, spent)| spent.seconds).sum();
        let outside = outside.first().map_or_else(Spent::default, |&(_, spent)| spent);
        let seconds = (self.total_seconds() - self.message_seconds() - inside).max(0.0);
        phases.push((OUTSIDE, Spent { seconds, ..outside }));
        phases
    }

    /// Books work since the last time on the phase that runs.
    fn settle(&self) {
        let done = work::done();
        let before = self.booked.replace(done);
        if done != before {
            self.book(self.phase.get(), |spent| {
                spent.work.flops += done.flops - before.flops;
                spent.work.bytes += done.bytes - before.bytes;
            });
        }
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
    of_status(["VmHWM:"]).map(|[peak]| peak)
}

/// The same without pages that processes of a host share: those of libraries and files, and of MPI for messages between them.
pub fn peak_private_mb() -> Option<f64> {
    of_status(["VmHWM:", "RssFile:", "RssShmem:"]).map(|[peak, files, shared]| peak - files - shared)
}

/// Lines of the process's status, in MiB.
fn of_status<const N: usize>(names: [&str; N]) -> Option<[f64; N]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        *value = line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1024.0;
    }
    Some(values)
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
        let [(name, spent), (OUTSIDE, outside)] = timer.spent()[..] else { panic!("one phase, and what is outside") };
        assert!(
            name == "dual operator" && spent.calls == 1 && spent.seconds < pause.as_secs_f64(),
            "{}",
            spent.seconds
        );
        assert!(outside.calls == 0 && outside.seconds < pause.as_secs_f64());
        let [message, phase] = timer.spans()[..] else { panic!("two calls") };
        assert_eq!((message.name, phase.name), ("neighbour exchange", "dual operator"));
        assert!(phase.begin <= message.begin && message.begin + message.length <= phase.begin + phase.length);
        assert!(Timer::start().spans().is_empty());
    }

    #[test]
    fn work_and_mail_belong_to_the_innermost_phase_that_runs() {
        work::add(1, 1);
        let timer = Timer::start();
        let mail = |bytes| Mail { messages: 1, sent: bytes, largest: bytes, ..Mail::default() };
        work::add(2, 3);
        timer.time("outer", || {
            work::add(10, 20);
            timer.post(mail(8));
            timer.time("inner", || work::add(100, 200));
            work::add(1000, 2000);
            timer.post(mail(4));
        });
        timer.post(mail(5));
        // The inner phase is the first that ends, the outer one the first that has work.
        let spent = timer.spent();
        assert_eq!(spent.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["outer", "inner", OUTSIDE]);
        let [outer, inner, outside] = [0, 1, 2].map(|k| spent[k].1);
        assert_eq!(outer.work, Work { flops: 1010.0, bytes: 2020.0 });
        assert_eq!(inner.work, Work { flops: 100.0, bytes: 200.0 });
        assert_eq!(outside.work, Work { flops: 2.0, bytes: 3.0 });
        assert_eq!(outer.mail, Mail { messages: 2, sent: 12, largest: 8, ..Mail::default() });
        assert_eq!((inner.mail, outside.mail), (Mail::default(), mail(5)));
        work::add(7, 0);
        assert_eq!(timer.spent()[2].1.work.flops, 9.0, "nothing is lost or counted twice");
    }

    #[test]
    fn this_process_takes_memory() {
        assert!(peak_rss_mb().is_some_and(|size| size > 0.5));
    }
}
