//! Numbers for what all ranks make together: in the order of keys, the same on any ranks.

use std::collections::HashMap;

use crate::comm::Comm;
use crate::comm::meeting::ask;
use crate::comm::words::{before, holder};

/// The numbers given so far to keys that a rank looks after.
pub struct Register {
    /// Ranks look after equal parts of the first words of keys up to here; the last one also after those beyond.
    first_words: u64,
    known: HashMap<[u64; 2], u64>,
    next: u64,
}

impl Register {
    /// Numbers go on from so many.
    pub fn new(count: u64) -> Self {
        Self { first_words: count.max(1), known: HashMap::new(), next: count }
    }

    /// How many numbers are taken.
    pub fn count(&self) -> u64 {
        self.next
    }

    /// The number of each key; of new ones in their order. Collective.
    ///
    /// # Panics
    /// If there are more than 32 bits can count.
    pub fn numbers(&mut self, comm: &dyn Comm, keys: &[[u64; 2]]) -> Vec<u32> {
        let first_words = self.first_words;
        let whom = |key: &[u64; 2]| holder(key[0].min(first_words - 1), first_words, comm);
        let numbers = ask(comm, keys, whom, |asked| {
            let mut new: Vec<[u64; 2]> = asked.iter().flat_map(|theirs| theirs.iter().copied()).collect();
            new.retain(|key| !self.known.contains_key(key));
            new.sort_unstable();
            new.dedup();
            let [mine, all] = before(comm, new.len() as u64);
            self.known.extend(new.into_iter().zip(self.next + mine..));
            self.next += all;
            |key: &[u64; 2]| self.known[key]
        });
        numbers.into_iter().map(|number| u32::try_from(number).expect("a mesh has fewer than 2^32 nodes")).collect()
    }
}
