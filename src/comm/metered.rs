//! Counts what a rank sends and how long it waits for the others.
//!
//! Seconds are those inside the calls: waiting for slower ranks and the transfer itself, which cannot be told apart.

use std::cell::Cell;
use std::time::Instant;

use super::{Comm, RawMpi};

/// Communication of one kind on one rank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Calls.
    pub calls: u64,
    /// Time inside them.
    pub seconds: f64,
    /// Bytes that this rank handed in.
    pub bytes: u64,
}

/// Any communication, metered.
pub struct Metered<'a> {
    inner: &'a dyn Comm,
    meters: [Cell<Traffic>; 3],
}

/// What the meters are called, in their order.
pub const KINDS: [&str; 3] = ["neighbour exchange", "collectives", "set-up messages"];

impl<'a> Metered<'a> {
    /// Meters at zero.
    pub fn new(inner: &'a dyn Comm) -> Self {
        Self { inner, meters: Default::default() }
    }

    /// What went through so far, in the order of [`KINDS`].
    pub fn traffic(&self) -> [Traffic; 3] {
        self.meters.each_ref().map(Cell::get)
    }

    fn meter<T>(&self, kind: usize, items: usize, call: impl FnOnce(&dyn Comm) -> T) -> T {
        let begin = Instant::now();
        let result = call(self.inner);
        let Traffic { calls, seconds, bytes } = self.meters[kind].get();
        self.meters[kind].set(Traffic {
            calls: calls + 1,
            seconds: seconds + begin.elapsed().as_secs_f64(),
            bytes: bytes + (size_of::<f64>() * items) as u64,
        });
        result
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
        self.meter(0, items, |comm| comm.exchange(neighbours, outgoing, incoming));
    }

    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        self.meter(1, mine.len(), |comm| comm.all_gather(mine, counts))
    }

    fn gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        self.meter(1, mine.len(), |comm| comm.gather(mine, counts))
    }

    fn broadcast(&self, data: &mut [f64]) {
        let items = if self.rank() == 0 { data.len() } else { 0 };
        self.meter(1, items, |comm| comm.broadcast(data));
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        let items = outgoing.iter().map(Vec::len).sum();
        self.meter(2, items, |comm| comm.all_to_all(outgoing))
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        self.inner.raw_mpi()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ordered_sum, threads};
    use super::*;
    use crate::comm::Shares;

    #[test]
    fn counts_calls_and_what_each_rank_hands_in() {
        threads::run(3, |comm| {
            let metered = Metered::new(comm);
            let rank = comm.rank();
            let sum = ordered_sum(&metered, &Shares(vec![1; 3]), &[rank as f64, 1.0], 2);
            assert_eq!(sum, [3.0, 3.0]);
            let mut incoming = vec![vec![0.0; 4]];
            if rank < 2 {
                metered.exchange(&[1 - rank], &[vec![rank as f64; 4]], &mut incoming);
                assert_eq!(incoming[0], [1.0 - rank as f64; 4]);
            }
            let [exchange, collectives, set_up] = metered.traffic();
            assert_eq!((exchange.calls, exchange.bytes), if rank < 2 { (1, 32) } else { (0, 0) });
            assert_eq!((collectives.calls, collectives.bytes), (2, if rank == 0 { 32 } else { 16 }));
            assert!(collectives.seconds > 0.0);
            assert_eq!(set_up, Traffic::default());
        });
    }
}
