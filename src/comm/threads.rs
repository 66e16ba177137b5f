//! Ranks as threads of one process: the same numerical code as under MPI, in plain `cargo test`.

use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex};

use super::{Comm, RawMpi, Reduction};

/// One rank's end of a group of threads.
pub struct Thread {
    rank: usize,
    size: usize,
    post: Arc<Post>,
}

/// Mailbox of the whole group: messages by (sender, receiver, sequence number of that pair).
#[derive(Default)]
struct Post {
    state: Mutex<State>,
    arrived: Condvar,
}

#[derive(Default)]
struct State {
    mail: HashMap<(usize, usize, u64), Box<dyn Any + Send>>,
    sent: HashMap<(usize, usize), u64>,
    received: HashMap<(usize, usize), u64>,
    failed: bool,
}

/// Runs `body` on `size` ranks and returns their results in rank order.
///
/// # Panics
/// With the first panic of any rank; the other ranks are woken and end too, so nothing hangs.
pub fn run<T: Send>(size: usize, body: impl Fn(&dyn Comm) -> T + Sync) -> Vec<T> {
    let results: Vec<_> = (0..size).map(|_| Mutex::new(None)).collect();
    start(size, &|comm| *results[comm.rank()].lock().unwrap_or_else(|e| e.into_inner()) = Some(body(comm)));
    let result = |slot: Mutex<Option<T>>| slot.into_inner().unwrap_or_else(|e| e.into_inner());
    results.into_iter().map(|slot| result(slot).expect("a rank that does not panic has a result")).collect()
}

/// As [`run`], compiled once for all bodies.
fn start(size: usize, body: &(dyn Fn(&dyn Comm) + Sync)) {
    let post = Arc::new(Post::default());
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..size)
            .map(|rank| {
                let comm = Thread { rank, size, post: Arc::clone(&post) };
                scope.spawn(move || {
                    let outcome = catch_unwind(AssertUnwindSafe(|| body(&comm)));
                    if outcome.is_err() {
                        comm.post.state.lock().unwrap_or_else(|e| e.into_inner()).failed = true;
                        comm.post.arrived.notify_all();
                    }
                    outcome
                })
            })
            .collect();
        handles.into_iter().map(|h| h.join().unwrap_or_else(Err)).collect()
    });
    // A rank that only followed another's failure says nothing of the cause.
    if let Some(panic) = outcomes.into_iter().filter_map(Result::err).min_by_key(|p| p.is::<Woken>()) {
        resume_unwind(panic);
    }
}

/// Panic payload of a rank that was waiting when another one failed.
struct Woken;

impl Thread {
    fn send<T: Send + 'static>(&self, to: usize, data: T) {
        let mut state = self.post.state.lock().unwrap_or_else(|e| e.into_inner());
        let number = state.sent.entry((self.rank, to)).or_default();
        let key = (self.rank, to, *number);
        *number += 1;
        state.mail.insert(key, Box::new(data));
        self.post.arrived.notify_all();
    }

    fn receive<T: 'static>(&self, from: usize) -> T {
        let mut state = self.post.state.lock().unwrap_or_else(|e| e.into_inner());
        let number = state.received.entry((from, self.rank)).or_default();
        let key = (from, self.rank, *number);
        *number += 1;
        loop {
            if let Some(data) = state.mail.remove(&key) {
                return *data.downcast().expect("ranks call the same operations in the same order");
            }
            if state.failed {
                drop(state);
                resume_unwind(Box::new(Woken));
            }
            state = self.post.arrived.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }
}

impl Comm for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn exchange(&self, neighbours: &[usize], outgoing: &[Vec<f64>], incoming: &mut [Vec<f64>]) {
        for (&to, data) in neighbours.iter().zip(outgoing) {
            self.send(to, data.clone());
        }
        for (&from, buffer) in neighbours.iter().zip(incoming) {
            let data: Vec<f64> = self.receive(from);
            buffer.copy_from_slice(&data);
        }
    }

    fn all_gather(&self, mine: &[f64], _: &[usize]) -> Vec<f64> {
        for to in 0..self.size {
            self.send(to, mine.to_vec());
        }
        (0..self.size).flat_map(|from| self.receive::<Vec<f64>>(from)).collect()
    }

    fn reduce(&self, how: Reduction, numbers: &mut [i64]) {
        (0..self.size).for_each(|to| self.send(to, numbers.to_vec()));
        let mut all = (0..self.size).map(|from| self.receive::<Vec<i64>>(from));
        numbers.copy_from_slice(&all.next().unwrap_or_default());
        for theirs in all {
            for (mine, other) in numbers.iter_mut().zip(theirs) {
                *mine = match how {
                    Reduction::Sum => mine.wrapping_add(other),
                    Reduction::Largest => (*mine).max(other),
                };
            }
        }
    }

    fn broadcast(&self, data: &mut [f64]) {
        if self.rank == 0 {
            for to in 1..self.size {
                self.send(to, data.to_vec());
            }
        } else {
            data.copy_from_slice(&self.receive::<Vec<f64>>(0));
        }
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
        for (to, data) in outgoing.into_iter().enumerate() {
            self.send(to, data);
        }
        (0..self.size).map(|from| self.receive(from)).collect()
    }

    fn raw_mpi(&self) -> Option<RawMpi> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::{all_gather_text, decide, from_root, maximum, of_largest, range, sums};

    #[test]
    fn collectives_deliver_in_rank_order() {
        for size in [1, 2, 3, 5] {
            let results = run(size, |comm| {
                let rank = comm.rank() as f64;
                // Unequal lengths: rank r contributes r values.
                let gathered = comm.all_gather(&vec![rank; comm.rank()], &(0..size).collect::<Vec<_>>());
                let expected: Vec<f64> = (0..size).flat_map(|r| vec![r as f64; r]).collect();
                assert_eq!(gathered, expected);
                assert_eq!(maximum(comm, &[rank, -rank, rank - 9.0]), [size as f64 - 1.0, -0.0, size as f64 - 10.0]);
                let fault = maximum(comm, &[if comm.rank() == 0 { -f64::NAN } else { f64::INFINITY }]);
                assert!(fault[0].is_nan());
                assert_eq!(maximum(comm, &[f64::NEG_INFINITY]), [f64::NEG_INFINITY]);
                // The lowest rank has none.
                let ends = range(comm, (0..comm.rank()).map(|r| r as f64 - 1.0));
                let expected = if size > 1 { [-1.0, size as f64 - 3.0] } else { [f64::INFINITY, f64::NEG_INFINITY] };
                assert_eq!(ends, expected);
                assert_eq!(
                    of_largest(comm, (rank - 1.0).abs(), [rank, f64::NAN])[0],
                    if size > 3 { size as f64 - 1.0 } else { 0.0 }
                );
                assert_eq!(of_largest(comm, f64::NAN, [rank]), [0.0]);
                assert_eq!(from_root(comm, [u64::MAX, 7].repeat(1 + comm.rank())), [u64::MAX, 7]);
                assert!(decide(comm, comm.rank() == 0));
                let swapped = comm.all_to_all((0..size).map(|to| vec![comm.rank() as u64, to as u64]).collect());
                for (from, pair) in swapped.iter().enumerate() {
                    assert_eq!(*pair, [from as u64, comm.rank() as u64]);
                }
                let texts = all_gather_text(comm, &"é".repeat(comm.rank()));
                assert!(texts.into_iter().eq((0..size).map(|rank| "é".repeat(rank))));
                sums(comm, [comm.rank() as u64, 1])
            });
            assert!(results.iter().all(|r| *r == [size as u64 * (size as u64 - 1) / 2, size as u64]));
        }
    }

    #[test]
    fn neighbours_exchange_both_ways() {
        run(3, |comm| {
            let neighbours: Vec<usize> = (0..3).filter(|&r| r != comm.rank()).collect();
            let outgoing: Vec<_> = neighbours.iter().map(|&to| vec![(10 * comm.rank() + to) as f64]).collect();
            let mut incoming = vec![vec![0.0]; 2];
            comm.exchange(&neighbours, &outgoing, &mut incoming);
            for (from, data) in neighbours.iter().zip(&incoming) {
                assert_eq!(data[0], (10 * from + comm.rank()) as f64);
            }
        });
    }

    #[test]
    #[should_panic(expected = "rank 1 fails")]
    fn a_panic_ends_the_waiting_ranks_and_is_the_one_reported() {
        run(3, |comm| {
            assert!(comm.rank() != 1, "rank 1 fails");
            comm.all_gather(&[0.0], &[1; 3]);
        });
    }
}
