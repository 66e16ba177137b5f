//! MPI processes, through rsmpi.

use std::io::Write;

use mpi::collective::{CommunicatorCollectives, Root, SystemOperation};
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::Universe;
use mpi::point_to_point::{Destination, Source};
use mpi::raw::AsRaw;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::{Comm, RawMpi, Reduction};

/// All processes that the MPI launcher started. MPI is finalised when this is dropped.
pub struct World {
    // Declared first, dropped first: the communicator must not outlive MPI.
    world: SimpleCommunicator,
    _universe: Universe,
}

/// Exit code of a run ended by a panic (sysexits: internal software error).
pub const EXIT_BUG: i32 = 70;

impl World {
    /// Starts MPI, and makes a panic on any rank end all ranks with [`EXIT_BUG`]: unwinding into `MPI_Finalize` would
    /// leave the others waiting for ever. `None` if MPI was already started in this process.
    pub fn start() -> Option<Self> {
        let (universe, _) = mpi::initialize_with_threading(mpi::Threading::Funneled)?;
        let world = universe.world();
        let rank = world.rank();
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            // A closed stream leaves nobody to tell.
            let message = format!("fetiplast: internal error on rank {rank}; please report it\n");
            let _ = std::io::stderr().write_all(message.as_bytes());
            report(info);
            // Safety: MPI is up; aborting from any thread is what MPI_Abort is for.
            unsafe { mpi::ffi::MPI_Abort(mpi::ffi::RSMPI_COMM_WORLD, EXIT_BUG) };
        }));
        Some(Self { world, _universe: universe })
    }

    /// Waits for the other ranks, shuts MPI down and ends this process with an exit code.
    pub fn finish(self, code: i32) -> ! {
        self.world.barrier();
        drop(self);
        std::process::exit(code)
    }

    /// Waits for the other ranks and ends all of them at once with an exit code, without shutting MPI down.
    pub fn abort(&self, code: i32) -> ! {
        self.world.barrier();
        self.world.abort(code)
    }
}

/// Name and version of the MPI library.
pub fn library() -> String {
    mpi::environment::library_version().unwrap_or_default().lines().next().unwrap_or_default().trim().to_owned()
}

/// Blocks laid one behind the other, in the C ints that MPI counts in.
struct Blocks {
    lengths: Vec<i32>,
    begins: Vec<i32>,
    total: usize,
}

impl Blocks {
    /// Blocks of these lengths of `what`.
    ///
    /// # Panics
    /// If there are 2^31 numbers or more in all: MPI cannot count them.
    fn new(what: &str, lengths: &[usize]) -> Self {
        let total: usize = lengths.iter().sum();
        assert!(
            i32::try_from(total).is_ok(),
            "{what}: {total} numbers in one message, and MPI counts to {}; take fewer subdomains or a coarser mesh",
            i32::MAX
        );
        // None is longer than all together.
        let lengths: Vec<i32> = lengths.iter().map(|&length| length as i32).collect();
        let mut begins = Vec::with_capacity(lengths.len());
        let mut end = 0;
        for &length in &lengths {
            begins.push(end);
            end += length;
        }
        Self { lengths, begins, total }
    }
}

impl Comm for World {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn size(&self) -> usize {
        self.world.size() as usize
    }

    fn exchange(&self, neighbours: &[usize], outgoing: &[Vec<f64>], incoming: &mut [Vec<f64>]) {
        mpi::request::multiple_scope(2 * neighbours.len(), |scope, requests| {
            for (&from, buffer) in neighbours.iter().zip(incoming) {
                let process = self.world.process_at_rank(from as i32);
                requests.add(process.immediate_receive_into(scope, &mut buffer[..]));
            }
            for (&to, data) in neighbours.iter().zip(outgoing) {
                let process = self.world.process_at_rank(to as i32);
                requests.add(process.immediate_send(scope, &data[..]));
            }
            requests.wait_all(&mut Vec::new());
        });
    }

    fn all_gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        let Blocks { lengths, begins, total } = Blocks::new("numbers of all ranks, on all", counts);
        let mut all = vec![0.0; total];
        self.world.all_gather_varcount_into(mine, &mut PartitionMut::new(&mut all[..], &lengths[..], &begins[..]));
        all
    }

    fn reduce(&self, how: Reduction, numbers: &mut [i64]) {
        let mine = numbers.to_vec();
        let operation = match how {
            Reduction::Sum => SystemOperation::sum(),
            Reduction::Largest => SystemOperation::max(),
        };
        self.world.all_reduce_into(&mine[..], numbers, operation);
    }

    fn broadcast(&self, data: &mut [f64]) {
        self.world.process_at_rank(0).broadcast_into(data);
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        let sent = Blocks::new("what a rank sends", &outgoing.iter().map(Vec::len).collect::<Vec<_>>());
        let mut lengths = vec![0_i32; self.size()];
        self.world.all_to_all_into(&sent.lengths[..], &mut lengths[..]);
        let lengths: Vec<usize> = lengths.into_iter().map(|length| length as usize).collect();
        let received = Blocks::new("what a rank receives", &lengths);
        let data = outgoing.concat();
        let mut all = vec![0_u64; received.total];
        self.world.all_to_all_varcount_into(
            &Partition::new(&data[..], &sent.lengths[..], &sent.begins[..]),
            &mut PartitionMut::new(&mut all[..], &received.lengths[..], &received.begins[..]),
        );
        let mut all = &all[..];
        lengths.iter().map(|&length| all.split_off(..length).expect("every block is counted").to_vec()).collect()
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        Some(self.world.as_raw())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_lie_one_behind_the_other() {
        let Blocks { lengths, begins, total } = Blocks::new("numbers", &[2, 0, 3]);
        assert_eq!((lengths, begins, total), (vec![2, 0, 3], vec![0, 2, 2], 5));
        assert_eq!(Blocks::new("numbers", &[i32::MAX as usize, 0]).total, i32::MAX as usize);
    }

    #[test]
    #[should_panic(expected = "numbers: 2147483648 numbers in one message")]
    fn more_than_mpi_can_count_is_refused() {
        Blocks::new("numbers", &[1 << 30, 1 << 30]);
    }
}
