//! Communication between the ranks of one run: the only room that names MPI.
//!
//! Numerical code sees the trait [`Comm`] and nothing else. Three implementations: [`solo::Solo`] (one rank, no
//! launcher), [`threads`] (n ranks as threads of one process, for tests) and [`world::World`] (MPI).
//! [`Metered`](crate::monitor::metered::Metered) counts what goes through any of them.
//!
//! Results must be *bitwise* the same for every number of ranks. So no sum is ever left to the communication layer:
//! ranks hand over one partial value per subdomain, and [`ordered_sum`] adds them in subdomain order on rank 0.
//! It does not know subdomains beyond that: ranks own consecutive blocks of them, so rank order is subdomain order.

pub mod agree;
pub mod common;
pub mod exact;
pub mod meeting;
pub mod solo;
pub mod threads;
#[cfg(test)]
pub mod watched;
pub mod words;
pub mod world;

use crate::work;

/// Collective and neighbour communication of one rank. All methods but [`Comm::rank`] and [`Comm::size`] are
/// collective: every rank calls them in the same order.
pub trait Comm {
    /// This rank's number, `0..size`.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn size(&self) -> usize;

    /// Neighbour exchange: `outgoing[k]` goes to rank `neighbours[k]`, `incoming[k]` (already of the right length) is
    /// filled with what that rank sent here. Neighbourhood is mutual; a rank is never its own neighbour.
    fn exchange(&self, neighbours: &[usize], outgoing: &[Vec<f64>], incoming: &mut [Vec<f64>]);

    /// Every rank's `mine` concatenated in rank order, on every rank; `counts[r]` is the length that rank `r` hands in.
    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64>;

    /// As [`Comm::all_gather`], but on rank 0 only; empty elsewhere.
    fn gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64>;

    /// Overwrites `data` on every rank by rank 0's; equal lengths.
    fn broadcast(&self, data: &mut [f64]);

    /// `outgoing[r]` goes to rank `r`; returns what each rank sent here, by rank. For set-up, lengths may differ.
    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>>;

    /// The MPI communicator behind this one, for parallel HDF5; `None` where ranks are not MPI processes.
    fn raw_mpi(&self) -> Option<RawMpi>;
}

/// MPI's own handle of a communicator.
pub type RawMpi = mpi::ffi::MPI_Comm;

/// How many items (subdomains) each rank owns: consecutive blocks, in rank order; then the first item of each, and the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shares(pub Vec<usize>, Vec<usize>);

impl Shares {
    /// Of so many items each.
    pub fn new(counts: Vec<usize>) -> Self {
        let mut begins = vec![0];
        counts.iter().for_each(|count| begins.push(begins[begins.len() - 1] + count));
        Self(counts, begins)
    }

    /// First item of a rank.
    pub fn begin(&self, rank: usize) -> usize {
        self.1[rank]
    }

    /// Number of items of all ranks.
    pub fn total(&self) -> usize {
        self.1[self.0.len()]
    }

    /// The rank that owns an item.
    ///
    /// # Panics
    /// If there is no such item.
    pub fn owner(&self, item: usize) -> usize {
        assert!(item < self.total(), "item below the total");
        self.1.partition_point(|&begin| begin <= item) - 1
    }

    /// Lengths of the ranks' blocks where every item takes `width` numbers.
    pub fn counts(&self, width: usize) -> Vec<usize> {
        self.0.iter().map(|n| n * width).collect()
    }
}

/// Sums columns over all items: `mine` holds `width` partial values per item that this rank owns, item by item.
/// Rank 0 adds in item order and everybody gets its result: ranks cannot disagree, and the bits do not depend on how
/// the items are spread over the ranks.
pub fn ordered_sum(comm: &dyn Comm, shares: &Shares, mine: &[f64], width: usize) -> Vec<f64> {
    let rows = comm.gather(mine, &shares.counts(width));
    work::each(rows.len(), 1, size_of::<f64>());
    let mut sum = vec![0.0; width];
    // Nothing is summed where the width is zero.
    for row in rows.chunks_exact(width.max(1)) {
        for (s, value) in sum.iter_mut().zip(row) {
            *s += value;
        }
    }
    comm.broadcast(&mut sum);
    sum
}

/// The largest of all ranks' values, by column; NaN wins, so that a fault on one rank is seen by all.
pub fn maximum(comm: &dyn Comm, mine: &[f64]) -> Vec<f64> {
    let all = comm.all_gather(mine, &vec![mine.len(); comm.size()]);
    let mut result = mine.to_vec();
    for row in all.chunks_exact(mine.len()) {
        for (r, &value) in result.iter_mut().zip(row) {
            if value.is_nan() || value > *r {
                *r = value;
            }
        }
    }
    result
}

/// What rank 0 decides, on every rank.
pub fn decide(comm: &dyn Comm, choice: bool) -> bool {
    let mut flag = [f64::from(choice)];
    comm.broadcast(&mut flag);
    flag[0] != 0.0
}

/// Rank 0's integers, on every rank.
pub fn from_root(comm: &dyn Comm, mine: Vec<u64>) -> Vec<u64> {
    let outgoing = if comm.rank() == 0 { vec![mine; comm.size()] } else { vec![Vec::new(); comm.size()] };
    comm.all_to_all(outgoing).swap_remove(0)
}

/// Integers of all ranks in rank order; lengths may differ.
pub fn all_gather_u64(comm: &dyn Comm, mine: &[u64]) -> Vec<u64> {
    comm.all_to_all(vec![mine.to_vec(); comm.size()]).concat()
}

/// Sums of counts over all ranks.
pub fn sums<const N: usize>(comm: &dyn Comm, mine: [u64; N]) -> [u64; N] {
    let all = all_gather_u64(comm, &mine);
    std::array::from_fn(|k| all.iter().skip(k).step_by(N).sum())
}

/// Texts of all ranks in rank order.
pub fn all_gather_text(comm: &dyn Comm, mine: &str) -> Vec<String> {
    let packed: Vec<u64> = mine.bytes().map(u64::from).collect();
    comm.all_to_all(vec![packed; comm.size()])
        .into_iter()
        .map(|bytes| String::from_utf8_lossy(&bytes.into_iter().map(|b| b as u8).collect::<Vec<_>>()).into_owned())
        .collect()
}
