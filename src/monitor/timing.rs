//! How long the phases of a run take, how evenly over the ranks, and how much work they do; how much memory a rank took.
//!
//! Wall time. Phases do not nest, so that their sum is at most the total; communication is part of them.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::Instant;

use crate::comm::metered::{KINDS, Traffic};
use crate::comm::{Comm, Shares, all_gather_text, maximum, ordered_sum};
use crate::results::summary::Work;

/// Collects the seconds that one rank spends in named phases.
#[derive(Clone, Debug)]
pub struct Timer {
    started: Instant,
    phases: RefCell<Vec<(&'static str, Spent)>>,
}

/// What one rank spent in a phase.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    calls: u64,
    seconds: f64,
    work: Work,
}

impl Default for Timer {
    fn default() -> Self {
        Self::start()
    }
}

impl Timer {
    /// Starts the clock of the whole run.
    pub fn start() -> Self {
        Self { started: Instant::now(), phases: RefCell::default() }
    }

    /// Runs `work` and counts its time as one call of a phase.
    pub fn time<T>(&self, phase: &'static str, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        self.add(phase, begin.elapsed().as_secs_f64());
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

    fn book(&self, phase: &'static str, add: impl FnOnce(&mut Spent)) {
        let mut phases = self.phases.borrow_mut();
        let at = phases.iter().position(|(name, _)| *name == phase).unwrap_or_else(|| {
            phases.push((phase, Spent::default()));
            phases.len() - 1
        });
        add(&mut phases[at].1);
    }

    /// Seconds since the start.
    pub fn total_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// What was spent in a phase; nothing if it never ran here.
    fn spent(&self, phase: &str) -> Spent {
        let phases = self.phases.borrow();
        phases.iter().find(|(name, _)| *name == phase).map(|(_, spent)| *spent).unwrap_or_default()
    }
}

/// The phases of all ranks.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseTable {
    /// In order of first use: rank 0's, then what only others have.
    pub phases: Vec<Phase>,
    /// Messages of each kind; their seconds are part of the phases'. None of a kind that was not used.
    pub communication: Vec<Phase>,
    /// Wall time of the slowest rank since its timer was started.
    pub total_seconds: f64,
}

/// One phase over all ranks.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Its name.
    pub name: String,
    /// Calls on the rank that called it most.
    pub calls: u64,
    /// Seconds on the slowest rank.
    pub max_seconds: f64,
    /// Seconds on the fastest rank.
    pub min_seconds: f64,
    /// Of all ranks together. Of messages: bytes handed in.
    pub work: Work,
}

impl Phase {
    /// Slowest over fastest rank; `None` if some rank spent no time in it.
    pub fn ratio(&self) -> Option<f64> {
        (self.min_seconds > 0.0).then(|| self.max_seconds / self.min_seconds)
    }
}

impl PhaseTable {
    /// Compares the timers and messages of all ranks. Collective.
    pub fn gather(comm: &dyn Comm, timer: &Timer, traffic: [Traffic; 3]) -> Self {
        let mine: Vec<&str> = timer.phases.borrow().iter().map(|&(name, ..)| name).collect();
        let mut names: Vec<String> = Vec::new();
        for list in all_gather_text(comm, &mine.join("\n")) {
            for name in list.lines() {
                if !names.iter().any(|known| known == name) {
                    names.push(name.to_owned());
                }
            }
        }
        let messages = traffic.map(|Traffic { calls, seconds, bytes }| {
            let work = Work { flops: 0.0, bytes: bytes as f64 };
            Spent { calls, seconds, work }
        });
        let spent: Vec<Spent> = names.iter().map(|name| timer.spent(name)).chain(messages).collect();
        // One collective for all: the smallest is the largest of the negatives.
        let mut values = vec![timer.total_seconds()];
        values.extend(spent.iter().flat_map(|s| [s.calls as f64, s.seconds, -s.seconds]));
        let largest = maximum(comm, &values);
        let work: Vec<f64> = spent.iter().flat_map(|s| [s.work.flops, s.work.bytes]).collect();
        let work = ordered_sum(comm, &Shares(vec![1; comm.size()]), &work, work.len());
        let count = names.len();
        let names = names.into_iter().chain(KINDS.map(str::to_owned));
        let rows = largest[1..].chunks_exact(3).zip(work.chunks_exact(2));
        let mut phases: Vec<Phase> = names
            .zip(rows)
            .map(|(name, (row, work))| Phase {
                name,
                calls: row[0] as u64,
                max_seconds: row[1],
                min_seconds: -row[2],
                work: Work { flops: work[0], bytes: work[1] },
            })
            .collect();
        let mut communication = phases.split_off(count);
        communication.retain(|kind| kind.calls > 0);
        Self { phases, communication, total_seconds: largest[0] }
    }

    /// Seconds of each phase on the slowest rank, by name.
    pub fn max_seconds(&self) -> BTreeMap<String, f64> {
        self.phases.iter().map(|phase| (phase.name.clone(), phase.max_seconds)).collect()
    }

    /// Work of each phase where it is known, by name.
    pub fn work(&self) -> BTreeMap<String, Work> {
        let known = self.phases.iter().filter(|phase| phase.work != Work::default());
        known.map(|phase| (phase.name.clone(), phase.work)).collect()
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
    use super::*;
    use crate::comm::threads;

    #[test]
    fn phases_are_compared_over_the_ranks() {
        let tables = threads::run(3, |comm| {
            let timer = Timer::start();
            timer.add("factorisation", 1.0 + comm.rank() as f64);
            timer.add("factorisation", 0.5);
            if comm.rank() == 1 {
                timer.add("contact", 2.0);
            }
            assert_eq!(timer.time("assembly", || 7), 7);
            timer.count("assembly", 10.0, comm.rank() as f64);
            let sent = Traffic { calls: 2, seconds: 0.5, bytes: 8 };
            PhaseTable::gather(comm, &timer, [sent, Traffic::default(), Traffic::default()])
        });
        assert!(tables.iter().all(|t| *t == tables[0]));
        let names: Vec<&str> = tables[0].phases.iter().map(|p| &p.name[..]).collect();
        assert_eq!(names, ["factorisation", "assembly", "contact"]);
        let [factorisation, assembly, contact] = &tables[0].phases[..] else { panic!("three phases") };
        assert_eq!((factorisation.calls, factorisation.max_seconds, factorisation.min_seconds), (2, 3.5, 1.5));
        assert_eq!((contact.calls, contact.max_seconds, contact.ratio()), (1, 2.0, None));
        assert_eq!(tables[0].max_seconds()["factorisation"], 3.5);
        assert_eq!(assembly.work, Work { flops: 30.0, bytes: 3.0 });
        assert_eq!(tables[0].work().into_keys().collect::<Vec<_>>(), ["assembly"]);
        let [exchange] = &tables[0].communication[..] else { panic!("one kind of messages") };
        assert_eq!((exchange.calls, exchange.work.bytes, exchange.ratio()), (2, 24.0, Some(1.0)));
    }

    #[test]
    fn this_process_takes_memory() {
        assert!(peak_rss_mb().is_some_and(|size| size > 0.5));
    }
}
