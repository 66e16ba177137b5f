//! How long the phases of a run take, and how evenly over the ranks; how much memory a rank took.
//!
//! Wall time. Phases do not nest, so that their sum is at most the total.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::Instant;

use crate::comm::{Comm, all_gather_text, maximum};

/// Collects the seconds that one rank spends in named phases.
#[derive(Clone, Debug)]
pub struct Timer {
    started: Instant,
    phases: RefCell<Vec<(&'static str, u64, f64)>>,
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
        let mut phases = self.phases.borrow_mut();
        match phases.iter_mut().find(|(name, ..)| *name == phase) {
            Some((_, calls, sum)) => {
                *calls += 1;
                *sum += seconds;
            }
            None => phases.push((phase, 1, seconds)),
        }
    }

    /// Seconds since the start.
    pub fn total_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Calls and seconds of a phase; nothing if it never ran here.
    fn spent(&self, phase: &str) -> [f64; 2] {
        let phases = self.phases.borrow();
        let found = phases.iter().find(|(name, ..)| *name == phase);
        found.map_or([0.0; 2], |&(_, calls, seconds)| [calls as f64, seconds])
    }
}

/// The phases of all ranks.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseTable {
    /// In order of first use: rank 0's, then what only others have.
    pub phases: Vec<Phase>,
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
}

impl Phase {
    /// Slowest over fastest rank; `None` if some rank spent no time in it.
    pub fn ratio(&self) -> Option<f64> {
        (self.min_seconds > 0.0).then(|| self.max_seconds / self.min_seconds)
    }
}

impl PhaseTable {
    /// Compares the timers of all ranks. Collective.
    pub fn gather(comm: &dyn Comm, timer: &Timer) -> Self {
        let mine: Vec<&str> = timer.phases.borrow().iter().map(|&(name, ..)| name).collect();
        let mut names: Vec<String> = Vec::new();
        for list in all_gather_text(comm, &mine.join("\n")) {
            for name in list.lines() {
                if !names.iter().any(|known| known == name) {
                    names.push(name.to_owned());
                }
            }
        }
        // One collective for all: the smallest is the largest of the negatives.
        let mut values = vec![timer.total_seconds()];
        for [calls, seconds] in names.iter().map(|name| timer.spent(name)) {
            values.extend([calls, seconds, -seconds]);
        }
        let largest = maximum(comm, &values);
        let phases = names.into_iter().zip(largest[1..].chunks_exact(3)).map(|(name, row)| Phase {
            name,
            calls: row[0] as u64,
            max_seconds: row[1],
            min_seconds: -row[2],
        });
        Self { phases: phases.collect(), total_seconds: largest[0] }
    }

    /// Seconds of each phase on the slowest rank, by name.
    pub fn max_seconds(&self) -> BTreeMap<String, f64> {
        self.phases.iter().map(|phase| (phase.name.clone(), phase.max_seconds)).collect()
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
            PhaseTable::gather(comm, &timer)
        });
        assert!(tables.iter().all(|t| *t == tables[0]));
        let names: Vec<&str> = tables[0].phases.iter().map(|p| &p.name[..]).collect();
        assert_eq!(names, ["factorisation", "assembly", "contact"]);
        let [factorisation, _, contact] = &tables[0].phases[..] else { panic!("three phases") };
        assert_eq!((factorisation.calls, factorisation.max_seconds, factorisation.min_seconds), (2, 3.5, 1.5));
        assert_eq!((contact.calls, contact.max_seconds, contact.ratio()), (1, 2.0, None));
        assert_eq!(tables[0].max_seconds()["factorisation"], 3.5);
    }

    #[test]
    fn this_process_takes_memory() {
        assert!(peak_rss_mb().is_some_and(|size| size > 0.5));
    }
}
