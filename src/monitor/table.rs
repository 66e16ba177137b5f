//! The closing table: phases, messages and memory, compared over the ranks.

use std::collections::BTreeMap;

use serde::Serialize;

use super::counted;
use super::timing::{Messages, OUTSIDE, Spent, Timer, peak_rss_mb};
use crate::comm::{Comm, all_gather_text, exact, maximum};
use crate::record::counts::{Counted, Work};

/// The phases of all ranks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhaseTable {
    /// In order of first use: rank 0's, then what only others have; last [`OUTSIDE`]. Without messages.
    pub phases: Vec<Phase>,
    /// What ranks did in each.
    #[serde(flatten)]
    pub counted: Counted,
    /// Messages of each kind, waiting for other ranks included. None of a kind that was not used.
    pub communication: Vec<Phase>,
    /// Seconds of a rank outside messages.
    pub busy: Spread,
    /// Largest resident memory of a rank, in MiB.
    pub memory_mb: Spread,
    /// Wall time of the slowest rank since its timer was started.
    pub total_seconds: f64,
}

/// One phase over all ranks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Phase {
    /// Its name.
    pub name: String,
    /// Calls on the rank that called it most.
    pub calls: u64,
    /// Seconds of a rank.
    pub seconds: Spread,
    /// Of all ranks together. Of messages: bytes handed in.
    pub work: Work,
}

/// A quantity over the ranks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Of the rank that has most.
    pub max: f64,
    /// Of the rank that has least.
    pub min: f64,
}

impl Spread {
    /// Most over least; `None` if some rank has nothing.
    pub fn ratio(&self) -> Option<f64> {
        (self.min > 0.0).then(|| self.max / self.min)
    }
}

impl PhaseTable {
    /// Compares the timers of all ranks. Collective.
    pub fn gather(comm: &dyn Comm, timer: &Timer) -> Self {
        // Before the messages of this table itself.
        let (of_phases, partners) = (timer.spent(), timer.partners());
        let mut names: Vec<String> = Vec::new();
        let messages = Messages::ALL.map(|kind| (kind.name(), timer.traffic(kind)));
        let total = timer.total_seconds();
        let mine: Vec<&str> = of_phases.iter().map(|(name, _)| *name).filter(|name| *name != OUTSIDE).collect();
        for list in all_gather_text(comm, &mine.join("\n")) {
            for name in list.lines() {
                if !names.iter().any(|known| known == name) {
                    names.push(name.to_owned());
                }
            }
        }
        names.push(OUTSIDE.to_owned());
        let waiting: f64 = messages.iter().map(|(_, traffic)| traffic.seconds).sum();
        let of = |name: &String| of_phases.iter().find(|(known, _)| known == name).map(|(_, spent)| *spent);
        let mut spent: Vec<Spent> = names.iter().map(|name| of(name).unwrap_or_default()).collect();
        let counted = counted::gather(comm, &names, &spent, partners);
        spent.extend(messages.map(|(_, traffic)| {
            let work = Work { flops: 0.0, bytes: traffic.bytes as f64 };
            Spent { calls: traffic.calls, seconds: traffic.seconds, work, ..Spent::default() }
        }));
        // One collective for all: the smallest is the largest of the negatives.
        let spreads = spent.iter().map(|s| s.seconds).chain([total - waiting, peak_rss_mb().unwrap_or(f64::NAN)]);
        let mut values: Vec<f64> = spreads.flat_map(|value| [value, -value]).collect();
        let count = values.len();
        values.push(total);
        values.extend(spent.iter().map(|s| s.calls as f64));
        let largest = maximum(comm, &values);
        let mut spreads = largest[..count].chunks_exact(2).map(|pair| Spread { max: pair[0], min: -pair[1] });
        let (total_seconds, calls) = (largest[count], &largest[count + 1..]);
        let work: Vec<f64> = spent.iter().flat_map(|s| [s.work.flops, s.work.bytes]).collect();
        let work = exact::sum(comm, &work, work.len());
        let phases = names.len();
        let names = names.into_iter().chain(messages.map(|(name, _)| name.to_owned()));
        let mut rows: Vec<Phase> = names
            .zip(calls)
            .zip(work.chunks_exact(2))
            .zip(&mut spreads)
            .map(|(((name, &calls), work), seconds)| Phase {
                name,
                calls: calls as u64,
                seconds,
                work: Work { flops: work[0], bytes: work[1] },
            })
            .collect();
        let mut communication = rows.split_off(phases);
        communication.retain(|kind| kind.calls > 0);
        let [busy, memory_mb] = [(); 2].map(|()| spreads.next().expect("two more were handed in"));
        Self { phases: rows, counted, communication, busy, memory_mb, total_seconds }
    }

    /// Seconds of each phase on the slowest rank, by name.
    pub fn max_seconds(&self) -> BTreeMap<String, f64> {
        self.phases.iter().map(|phase| (phase.name.clone(), phase.seconds.max)).collect()
    }

    /// Work of each phase where it is known, by name.
    pub fn work(&self) -> BTreeMap<String, Work> {
        let known = self.phases.iter().filter(|phase| phase.work != Work::default());
        known.map(|phase| (phase.name.clone(), phase.work)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::work;

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
            timer.time("assembly", || work::add(10, comm.rank()));
            timer.messages(Messages::Exchange, 8, || ());
            PhaseTable::gather(comm, &timer)
        });
        assert!(tables.iter().all(|t| *t == tables[0]));
        let names: Vec<&str> = tables[0].phases.iter().map(|p| &p.name[..]).collect();
        assert_eq!(names, ["factorisation", "assembly", "contact", OUTSIDE]);
        let [factorisation, assembly, contact, _] = &tables[0].phases[..] else { panic!("three phases, and the rest") };
        assert_eq!((factorisation.calls, factorisation.seconds), (2, Spread { max: 3.5, min: 1.5 }));
        assert_eq!((contact.calls, contact.seconds.max, contact.seconds.ratio()), (1, 2.0, None));
        assert_eq!(tables[0].max_seconds()["factorisation"], 3.5);
        assert_eq!(assembly.work, Work { flops: 30.0, bytes: 3.0 });
        assert_eq!(tables[0].work().into_keys().collect::<Vec<_>>(), ["assembly"]);
        let [exchange] = &tables[0].communication[..] else { panic!("one kind of messages") };
        assert_eq!((&exchange.name[..], exchange.calls, exchange.work.bytes), ("neighbour exchange", 1, 24.0));
        // Three threads of one process.
        assert_eq!(tables[0].memory_mb.ratio().map(f64::round), Some(1.0));
        assert!(tables[0].busy.max <= tables[0].total_seconds);
    }
}
