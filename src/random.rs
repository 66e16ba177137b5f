//! Random numbers for tests, the same at every run.

use fastrand::Rng;

/// A generator; equal seeds give equal sequences.
pub struct Random(Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Rng::with_seed(seed))
    }

    /// Uniform in [-1, 1).
    pub fn number(&mut self) -> f64 {
        2.0 * self.0.f64() - 1.0
    }

    /// Independent components, uniform in [-size, size).
    pub fn vector<const N: usize>(&mut self, size: f64) -> [f64; N] {
        std::array::from_fn(|_| size * self.number())
    }

    /// As many independent numbers, uniform in [-1, 1).
    pub fn numbers(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.number()).collect()
    }
}
