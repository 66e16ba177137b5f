//! A communicator that remembers the longest message that all ranks get alike: what is replicated.

use std::cell::Cell;

use super::{Comm, RawMpi, Reduction};

/// Watches another communicator.
pub struct Watched<'a> {
    inner: &'a dyn Comm,
    longest: Cell<usize>,
}

impl<'a> Watched<'a> {
    /// Has seen nothing yet.
    pub fn new(inner: &'a dyn Comm) -> Self {
        Self { inner, longest: Cell::new(0) }
    }

    /// Most numbers that a call has given to all ranks alike.
    pub fn longest(&self) -> usize {
        self.longest.get()
    }

    fn see(&self, length: usize) {
        self.longest.set(self.longest.get().max(length));
    }
}

impl Comm for Watched<'_> {
    fn rank(&self) -> usize {
        self.inner.rank()
    }

    fn size(&self) -> usize {
        self.inner.size()
    }

    fn exchange(&self, neighbours: &[usize], outgoing: &[Vec<f64>], incoming: &mut [Vec<f64>]) {
        self.inner.exchange(neighbours, outgoing, incoming);
    }

    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        self.see(counts.iter().sum());
        self.inner.all_gather(mine, counts)
    }

    fn reduce(&self, how: Reduction, numbers: &mut [i64]) {
        self.see(numbers.len());
        self.inner.reduce(how, numbers);
    }

    fn broadcast(&self, data: &mut [f64]) {
        self.see(data.len());
        self.inner.broadcast(data);
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        // The same for everybody, of every rank that says anything.
        if outgoing.iter().all(|message| *message == outgoing[0]) {
            self.see(outgoing[0].len() * self.size());
        }
        self.inner.all_to_all(outgoing)
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        self.inner.raw_mpi()
    }
}
