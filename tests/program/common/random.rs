//! Random numbers, the same at every run.

use fastrand::Rng;

/// A generator; equal seeds give equal sequences.
pub struct Random(Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Rng::with_seed(seed))
    }

    /// From zero to below a bound.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0.usize(..bound)
    }
}
