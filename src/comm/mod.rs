//! Communication between the ranks of one run: the only room that names MPI.
//!
//! Numerical code sees the trait [`Comm`] and nothing else. Three implementations: [`solo::Solo`] (one rank, no
//! launcher), [`threads`] (n ranks as threads of one process, for tests) and [`world::World`] (MPI).
//! [`Metered`](crate::monitor::metered::Metered) counts what goes through any of them.
//!
//! Results must be *bitwise* the same for every number of ranks. So the communication layer adds integers only: partial sums of
//! subdomains are added up as long integers ([`exact`]), in messages whose length depends neither on the scene nor on the ranks.

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

    /// Puts integers of all ranks together, entry by entry; equal lengths.
    fn reduce(&self, how: Reduction, numbers: &mut [i64]);

    /// Overwrites `data` on every rank by rank 0's; equal lengths.
    fn broadcast(&self, data: &mut [f64]);

    /// `outgoing[r]` goes to rank `r`; returns what each rank sent here, by rank. For set-up, lengths may differ.
    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>>;

    /// The MPI communicator behind this one, for parallel HDF5; `None` where ranks are not MPI processes.
    fn raw_mpi(&self) -> Option<RawMpi>;
}

/// How integers of several ranks are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// They are added up, modulo 2^64.
    Sum,
    /// The largest is taken.
    Largest,
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

/// The largest of all ranks' values, by column; NaN wins, so that a fault on one rank is seen by all.
pub fn maximum(comm: &dyn Comm, mine: &[f64]) -> Vec<f64> {
    // Bits of doubles ascend as integers, once those of negative ones are turned round; beyond infinity is NaN.
    let turned = |bits: i64| if bits < 0 { bits ^ i64::MAX } else { bits };
    let bits = |x: &f64| if x.is_nan() { f64::NAN.abs() } else { *x }.to_bits().cast_signed();
    let mut all: Vec<i64> = mine.iter().map(|x| turned(bits(x))).collect();
    comm.reduce(Reduction::Largest, &mut all);
    all.into_iter().map(|bits| f64::from_bits(turned(bits).cast_unsigned())).collect()
}

/// The least and the largest of all ranks' values; of none, the infinities the wrong way round. Collective.
pub fn range(comm: &dyn Comm, mine: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let ends = mine.into_iter().fold([f64::NEG_INFINITY; 2], |[least, most], x| [least.max(-x), most.max(x)]);
    let ends = maximum(comm, &ends);
    [-ends[0], ends[1]]
}

/// Some numbers of the rank whose `value` is largest, of the lowest one among equals; NaN is no value. Collective.
pub fn of_largest<const N: usize>(comm: &dyn Comm, value: f64, numbers: [f64; N]) -> [f64; N] {
    let value = if value.is_nan() { f64::NEG_INFINITY } else { value };
    let is_largest = maximum(comm, &[value])[0] == value;
    let rank = comm.rank() as i64;
    let mut first = [if is_largest { -rank } else { i64::MIN }];
    comm.reduce(Reduction::Largest, &mut first);
    let mut bits = numbers.map(|x| if first[0] == -rank { x.to_bits().cast_signed() } else { 0 });
    comm.reduce(Reduction::Sum, &mut bits);
    bits.map(|bits| f64::from_bits(bits.cast_unsigned()))
}

/// What rank 0 decides, on every rank.
pub fn decide(comm: &dyn Comm, choice: bool) -> bool {
    let mut flag = [f64::from(choice)];
    comm.broadcast(&mut flag);
    flag[0] != 0.0
}

/// Rank 0's integers, on every rank.
pub fn from_root(comm: &dyn Comm, mine: Vec<u64>) -> Vec<u64> {
    let mut length = [mine.len() as f64];
    comm.broadcast(&mut length);
    let mut data: Vec<f64> = mine.into_iter().map(f64::from_bits).collect();
    data.resize(length[0] as usize, 0.0);
    comm.broadcast(&mut data);
    data.into_iter().map(f64::to_bits).collect()
}

/// Integers of all ranks in rank order; lengths may differ.
pub fn all_gather_u64(comm: &dyn Comm, mine: &[u64]) -> Vec<u64> {
    of_ranks(comm, mine).concat()
}

/// Integers of all ranks, by rank. Messages are bits: doubles are not looked at on their way.
pub fn of_ranks(comm: &dyn Comm, mine: &[u64]) -> Vec<Vec<u64>> {
    let lengths = comm.all_gather(&[mine.len() as f64], &vec![1; comm.size()]);
    let lengths: Vec<usize> = lengths.into_iter().map(|length| length as usize).collect();
    let mine: Vec<f64> = mine.iter().map(|bits| f64::from_bits(*bits)).collect();
    let mut all = comm.all_gather(&mine, &lengths).into_iter().map(f64::to_bits);
    lengths.into_iter().map(|length| all.by_ref().take(length).collect()).collect()
}

/// Sums of counts over all ranks.
pub fn sums<const N: usize>(comm: &dyn Comm, mine: [u64; N]) -> [u64; N] {
    let mut sums = mine.map(u64::cast_signed);
    comm.reduce(Reduction::Sum, &mut sums);
    sums.map(i64::cast_unsigned)
}

/// Texts of all ranks in rank order.
pub fn all_gather_text(comm: &dyn Comm, mine: &str) -> Vec<String> {
    let packed: Vec<u64> = mine.bytes().map(u64::from).collect();
    let text = |bytes: Vec<u64>| -> Vec<u8> { bytes.into_iter().map(|byte| byte as u8).collect() };
    let texts = of_ranks(comm, &packed).into_iter().map(text);
    texts.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).collect()
}
