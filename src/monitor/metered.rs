//! Any communication, with its messages booked by a [`Timer`].
//!
//! What a rank hands to itself is no message: on one rank nothing is sent. A collective call counts what each rank hands in and what
//! comes to it, not how the library passes it on.

use super::timing::{Mail, Messages, Timer};
use crate::comm::{Comm, RawMpi, Reduction};

/// Bytes of a number, whatever it is.
const NUMBER: u64 = 8;
/// Bytes of a length, as MPI takes it.
const LENGTH: u64 = 4;

/// Any communication, metered.
pub struct Metered<'a> {
    inner: &'a dyn Comm,
    timer: &'a Timer,
}

impl<'a> Metered<'a> {
    /// Books what goes through `inner` from now on.
    pub fn new(inner: &'a dyn Comm, timer: &'a Timer) -> Self {
        Self { inner, timer }
    }

    fn meter<T>(&self, kind: Messages, items: usize, call: impl FnOnce(&dyn Comm) -> T) -> T {
        self.timer.messages(kind, NUMBER * items as u64, || call(self.inner))
    }

    /// Books a collective call to which this rank hands in so many numbers for others, and gets so many of them.
    fn collective(&self, sent: usize, received: usize) {
        let [sent, received] = [sent, received].map(|items| if self.size() > 1 { NUMBER * items as u64 } else { 0 });
        self.timer.post(Mail { collectives: 1, sent, received, largest: sent.max(received), messages: 0 });
    }
}

impl Comm for Metered<'_> {
    fn rank(&self) -> usize {
        self.inner.rank()
    }

    fn size(&self) -> usize {
        self.inner.size()
    }

    fn exchange(&self, neighbours: &[usize], outgoing: &[Vec<f64>], incoming: &mut [Vec<f64>]) {
        let items = outgoing.iter().map(Vec::len).sum();
        self.meter(Messages::Exchange, items, |comm| comm.exchange(neighbours, outgoing, incoming));
        self.timer.meet(neighbours);
        self.timer.post(Mail {
            messages: neighbours.len() as u64,
            collectives: 0,
            sent: NUMBER * items as u64,
            received: NUMBER * incoming.iter().map(|data| data.len() as u64).sum::<u64>(),
            largest: NUMBER * outgoing.iter().map(|data| data.len() as u64).max().unwrap_or(0),
        });
    }

    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        let all = self.meter(Messages::Collective, mine.len(), |comm| comm.all_gather(mine, counts));
        self.collective(mine.len(), all.len() - mine.len());
        all
    }

    fn reduce(&self, how: Reduction, numbers: &mut [i64]) {
        self.meter(Messages::Collective, numbers.len(), |comm| comm.reduce(how, numbers));
        self.collective(numbers.len(), numbers.len());
    }

    fn broadcast(&self, data: &mut [f64]) {
        let items = if self.rank() == 0 { data.len() } else { 0 };
        self.meter(Messages::Collective, items, |comm| comm.broadcast(data));
        self.collective(items, data.len() - items);
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        let lengths: Vec<u64> = outgoing.iter().map(|data| data.len() as u64).collect();
        let items = lengths.iter().sum::<u64>() as usize;
        let all = self.meter(Messages::SetUp, items, |comm| comm.all_to_all(outgoing));
        let others = |rank: &usize| *rank != self.rank();
        let sent: Vec<u64> = (0..lengths.len()).filter(others).map(|rank| NUMBER * lengths[rank]).collect();
        let received: u64 = (0..all.len()).filter(others).map(|rank| NUMBER * all[rank].len() as u64).sum();
        // Before the data every rank tells every other how much there is.
        let told = LENGTH * sent.len() as u64;
        self.timer.post(Mail {
            messages: sent.iter().filter(|bytes| **bytes > 0).count() as u64,
            collectives: 1,
            sent: sent.iter().sum::<u64>() + told,
            received: received + told,
            largest: sent.iter().copied().max().unwrap_or(0).max(told),
        });
        all
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        self.inner.raw_mpi()
    }
}

#[cfg(test)]
mod tests {
    use super::super::timing::{OUTSIDE, Traffic};
    use super::*;
    use crate::comm::threads;

    #[test]
    fn counts_calls_and_what_each_rank_hands_in() {
        threads::run(3, |comm| {
            let timer = Timer::start();
            let metered = Metered::new(comm, &timer);
            let rank = comm.rank();
            let mut sum = [rank as i64, 1];
            metered.reduce(Reduction::Sum, &mut sum);
            assert_eq!(sum, [3, 3]);
            let mut incoming = vec![vec![0.0; 4]];
            if rank < 2 {
                metered.exchange(&[1 - rank], &[vec![rank as f64; 4]], &mut incoming);
                assert_eq!(incoming[0], [1.0 - rank as f64; 4]);
            }
            let [exchange, collectives, set_up] = Messages::ALL.map(|kind| timer.traffic(kind));
            assert_eq!((exchange.calls, exchange.bytes), if rank < 2 { (1, 32) } else { (0, 0) });
            assert_eq!((collectives.calls, collectives.bytes), (1, 16));
            assert!(collectives.seconds > 0.0);
            assert_eq!(set_up, Traffic::default());
            assert_eq!(timer.partners(), usize::from(rank < 2));
        });
    }

    /// What goes through in each phase, against numbers found by hand.
    #[test]
    fn mail_is_that_of_the_phase_and_leaves_out_what_stays_on_the_rank() {
        threads::run(3, |comm| {
            let timer = Timer::start();
            let (metered, rank) = (Metered::new(comm, &timer), comm.rank());
            timer.time("all-gather", || metered.all_gather(&vec![0.0; rank + 1], &[1, 2, 3]));
            timer.time("reduction", || metered.reduce(Reduction::Largest, &mut [0; 5]));
            timer.time("broadcast", || metered.broadcast(&mut [0.0; 7]));
            // Rank 0 has ten numbers for rank 2, everybody four for itself.
            let mut outgoing = vec![Vec::new(); 3];
            outgoing[rank] = vec![1; 4];
            if rank == 0 {
                outgoing[2] = vec![2; 10];
            }
            metered.all_to_all(outgoing);
            let mail = |name: &str| {
                let spent = timer.spent();
                let Mail { messages, collectives, sent, received, largest } =
                    spent.iter().find(|(known, _)| *known == name).expect("the phase ran").1.mail;
                [messages, collectives, sent, received, largest]
            };
            let of_rank = |values: [[u64; 5]; 3]| values[rank];
            let all_gather = [[0, 1, 8, 40, 40], [0, 1, 16, 32, 32], [0, 1, 24, 24, 24]];
            assert_eq!(mail("all-gather"), of_rank(all_gather));
            assert_eq!(mail("reduction"), [0, 1, 40, 40, 40]);
            assert_eq!(mail("broadcast"), of_rank([[0, 1, 56, 0, 56], [0, 1, 0, 56, 56], [0, 1, 0, 56, 56]]));
            assert_eq!(mail(OUTSIDE), of_rank([[1, 1, 88, 8, 80], [0, 1, 8, 8, 8], [0, 1, 8, 88, 8]]));
        });
        let timer = Timer::start();
        let metered = Metered::new(&crate::comm::solo::Solo, &timer);
        metered.all_gather(&[1.0; 3], &[3]);
        metered.broadcast(&mut [1.0; 3]);
        metered.all_to_all(vec![vec![1; 3]]);
        let [(OUTSIDE, spent)] = timer.spent()[..] else { panic!("no phase") };
        assert_eq!(spent.mail, Mail { collectives: 3, ..Mail::default() });
    }
}
