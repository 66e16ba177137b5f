//! One rank, no launcher.

use super::{Comm, RawMpi, Reduction};

/// The communicator of a run with a single rank.
pub struct Solo;

impl Comm for Solo {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn exchange(&self, neighbours: &[usize], _: &[Vec<f64>], _: &mut [Vec<f64>]) {
        assert!(neighbours.is_empty(), "a single rank has no neighbours");
    }

    fn all_gather(&self, mine: &[f64], _: &[usize]) -> Vec<f64> {
        mine.to_vec()
    }

    fn reduce(&self, _: Reduction, _: &mut [i64]) {}

    fn broadcast(&self, _: &mut [f64]) {}

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        outgoing
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        None
    }
}
