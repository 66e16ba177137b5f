//! Any communication, with its messages booked by a [`Timer`].

use super::timing::{Messages, Timer};
use crate::comm::{Comm, RawMpi};

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
        self.timer.messages(kind, (size_of::<f64>() * items) as u64, || call(self.inner))
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
    }

    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        self.meter(Messages::Collective, mine.len(), |comm| comm.all_gather(mine, counts))
    }

    fn gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        self.meter(Messages::Collective, mine.len(), |comm| comm.gather(mine, counts))
    }

    fn broadcast(&self, data: &mut [f64]) {
        let items = if self.rank() == 0 { data.len() } else { 0 };
        self.meter(Messages::Collective, items, |comm| comm.broadcast(data));
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        let items = outgoing.iter().map(Vec::len).sum();
        self.meter(Messages::SetUp, items, |comm| comm.all_to_all(outgoing))
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        self.inner.raw_mpi()
    }
}

#[cfg(test)]
mod tests {
    use super::super::timing::Traffic;
    use super::*;
    use crate::comm::{Shares, ordered_sum, threads};

    #[test]
    fn counts_calls_and_what_each_rank_hands_in() {
        threads::run(3, |comm| {
            let timer = Timer::start();
            let metered = Metered::new(comm, &timer);
            let rank = comm.rank();
            let sum = ordered_sum(&metered, &Shares::new(vec![1; 3]), &[rank as f64, 1.0], 2);
            assert_eq!(sum, [3.0, 3.0]);
            let mut incoming = vec![vec![0.0; 4]];
            if rank < 2 {
                metered.exchange(&[1 - rank], &[vec![rank as f64; 4]], &mut incoming);
                assert_eq!(incoming[0], [1.0 - rank as f64; 4]);
            }
            let [exchange, collectives, set_up] = Messages::ALL.map(|kind| timer.traffic(kind));
            assert_eq!((exchange.calls, exchange.bytes), if rank < 2 { (1, 32) } else { (0, 0) });
            assert_eq!((collectives.calls, collectives.bytes), (2, if rank == 0 { 32 } else { 16 }));
            assert!(collectives.seconds > 0.0);
            assert_eq!(set_up, Traffic::default());
        });
    }
}
