//! What ranks did and said in each phase, free of noise: the busiest rank and the mean.

use super::timing::{Mail, Spent};
use crate::comm::{Comm, exact, maximum};
use crate::record::counts::{Counted, Counts, Load};

/// Numbers of a rank and phase.
const WIDTH: usize = 7;

/// Compares what was spent in phases of these names, the same on all ranks, and the numbers of partners. Collective.
pub(super) fn gather(comm: &dyn Comm, names: &[String], spent: &[Spent], partners: usize) -> Counted {
    let mut total = Spent::default();
    for Spent { work, mail, .. } in spent {
        total.work.flops += work.flops;
        total.work.bytes += work.bytes;
        total.mail += *mail;
    }
    let mut mine: Vec<f64> = spent.iter().chain([&total]).flat_map(numbers).collect();
    mine.push(partners as f64);
    let most = maximum(comm, &mine);
    let sums = exact::sum(comm, &mine, mine.len());
    let loads = most.iter().zip(sums).map(|(&busiest, sum)| Load { busiest, mean: sum / comm.size() as f64 });
    let loads: Vec<Load> = loads.collect();
    let mut counts = loads.as_chunks::<WIDTH>().0.iter().map(|loads| of(*loads));
    let by_phase = names.iter().cloned().zip(&mut counts).collect();
    Counted { counts: by_phase, counts_total: counts.next(), partners: loads.last().copied() }
}

fn numbers(Spent { work, mail, .. }: &Spent) -> [f64; WIDTH] {
    let Mail { messages, collectives, sent, received, largest } = *mail;
    let [a, b, c, d, e] = [messages, collectives, sent, received, largest].map(|count| count as f64);
    [work.flops, work.bytes, a, b, c, d, e]
}

fn of([flops, bytes, messages, collectives, bytes_sent, bytes_received, largest_message]: [Load; WIDTH]) -> Counts {
    Counts { flops, bytes, messages, collectives, bytes_sent, bytes_received, largest_message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::monitor::table::PhaseTable;
    use crate::monitor::timing::{OUTSIDE, Timer};
    use crate::work;

    #[test]
    fn the_busiest_rank_of_the_run_need_not_be_that_of_any_phase() {
        let found = threads::run(4, |comm| {
            let (timer, rank) = (Timer::start(), comm.rank());
            let amount = |of: usize, much: usize| if rank == of { much } else { 0 };
            timer.time("one", || work::add(3 + amount(0, 5), 1));
            timer.time("two", || {
                work::add(3 + amount(1, 4), 0);
                timer.post(Mail { messages: 2, sent: 100 * rank as u64, largest: 60 + rank as u64, ..Mail::default() });
            });
            work::add(amount(2, 1) + 1, 0);
            timer.meet(if rank == 3 { &[0, 1, 1] } else { &[3] });
            PhaseTable::gather(comm, &timer).counted
        });
        assert!(found.iter().all(|of| *of == found[0]));
        let Counted { counts, counts_total, partners } = &found[0];
        let total = counts_total.expect("there are phases");
        let load = |busiest, mean| Load { busiest, mean };
        assert_eq!(counts.keys().collect::<Vec<_>>(), ["one", OUTSIDE, "two"]);
        assert_eq!((counts["one"].flops, counts["one"].bytes), (load(8.0, 4.25), load(1.0, 1.0)));
        assert_eq!((counts["two"].flops, counts[OUTSIDE].flops), (load(7.0, 4.0), load(2.0, 1.25)));
        assert_eq!(counts["two"].bytes_sent, load(300.0, 150.0));
        // 12 on rank 0, 11 on rank 1, 8 and 7.
        assert_eq!((total.flops, total.messages), (load(12.0, 9.5), load(2.0, 2.0)));
        assert_eq!(total.largest_message, load(63.0, 61.5));
        assert_eq!(*partners, Some(load(2.0, 1.25)));
    }
}
