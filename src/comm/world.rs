//! MPI processes, through rsmpi.

use std::io::Write;

use mpi::collective::{CommunicatorCollectives, Root};
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::Universe;
use mpi::point_to_point::{Destination, Source};
use mpi::raw::AsRaw;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::{Comm, RawMpi};

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

/// MPI counts lengths in C ints.
fn as_mpi(counts: &[usize]) -> Vec<i32> {
    counts.iter().map(|&n| i32::try_from(n).expect("a message holds fewer than 2^31 numbers")).collect()
}

/// Displacements of blocks of the given lengths laid one behind the other.
fn displacements(counts: &[i32]) -> Vec<i32> {
    counts
        .iter()
        .scan(0, |end, &count| {
            let begin = *end;
            *end += count;
            Some(begin)
        })
        .collect()
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
        let counts = as_mpi(counts);
        let mut all = vec![0.0; counts.iter().sum::<i32>() as usize];
        let begins = displacements(&counts);
        self.world.all_gather_varcount_into(mine, &mut PartitionMut::new(&mut all[..], &counts[..], &begins[..]));
        all
    }

    fn gather(&self, mine: &[f64], counts: &[usize]) -> Vec<f64> {
        let root = self.world.process_at_rank(0);
        if self.rank() > 0 {
            root.gather_varcount_into(mine);
            return Vec::new();
        }
        let counts = as_mpi(counts);
        let mut all = vec![0.0; counts.iter().sum::<i32>() as usize];
        let begins = displacements(&counts);
        root.gather_varcount_into_root(mine, &mut PartitionMut::new(&mut all[..], &counts[..], &begins[..]));
        all
    }

    fn broadcast(&self, data: &mut [f64]) {
        self.world.process_at_rank(0).broadcast_into(data);
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        let sent = as_mpi(&outgoing.iter().map(Vec::len).collect::<Vec<_>>());
        let mut received = vec![0; self.size()];
        self.world.all_to_all_into(&sent[..], &mut received[..]);
        let data = outgoing.concat();
        let mut all = vec![0_u64; received.iter().sum::<i32>() as usize];
        let (begins, ends) = (displacements(&sent), displacements(&received));
        self.world.all_to_all_varcount_into(
            &Partition::new(&data[..], &sent[..], &begins[..]),
            &mut PartitionMut::new(&mut all[..], &received[..], &ends[..]),
        );
        received.iter().zip(ends).map(|(&count, at)| all[at as usize..(at + count) as usize].to_vec()).collect()
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        Some(self.world.as_raw())
    }
}
