//! Random numbers, the same at every run.

/// Marsaglia's xorshift.
pub struct Random(pub u64);

impl Random {
    /// From zero to below a bound.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}
