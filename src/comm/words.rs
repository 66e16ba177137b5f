//! Messages of integers: how items are spread over the ranks, what they send of them, and what all of them have together.
//!
//! Sums and least values of integers do not depend on the ranks.

use std::ops::Range;

use super::{Comm, Reduction, all_gather_u64};

/// This rank's share in some items: consecutive ones, as many as others have, give or take one.
pub fn share(items: u64, comm: &dyn Comm) -> Range<u64> {
    share_of(comm.rank(), items, comm)
}

/// The [`share`] of any rank.
pub fn share_of(rank: usize, items: u64, comm: &dyn Comm) -> Range<u64> {
    let end = |rank: usize| (u128::from(items) * rank as u128 / comm.size() as u128) as u64;
    end(rank)..end(rank + 1)
}

/// The rank in whose [`share`] an item is.
pub fn holder(item: u64, items: u64, comm: &dyn Comm) -> usize {
    ((u128::from(item) + 1) * comm.size() as u128).div_ceil(u128::from(items)) as usize - 1
}

/// Sums over all ranks, entry by entry. Collective.
pub fn sum(comm: &dyn Comm, mine: Vec<u64>) -> Vec<u64> {
    let mut sums: Vec<i64> = mine.into_iter().map(u64::cast_signed).collect();
    comm.reduce(Reduction::Sum, &mut sums);
    sums.into_iter().map(i64::cast_unsigned).collect()
}

/// Sum of the ranks before this one, and of all. Collective.
pub fn before(comm: &dyn Comm, mine: u64) -> [u64; 2] {
    let all = all_gather_u64(comm, &[mine]);
    [all[..comm.rank()].iter().sum(), all.iter().sum()]
}

/// The least that a rank has, in lexicographic order; on every rank. Collective.
pub fn least<const N: usize>(comm: &dyn Comm, mine: Option<[u64; N]>) -> Option<[u64; N]> {
    let all = all_gather_u64(comm, mine.as_ref().map_or(&[], |mine| &mine[..]));
    all.as_chunks::<N>().0.iter().min().copied()
}

/// Packs small numbers, two to a word.
pub fn pack_pairs(numbers: &[u32], message: &mut Vec<u64>) {
    let pair = |pair: &[u32]| u64::from(pair.get(1).copied().unwrap_or_default()) << 32 | u64::from(pair[0]);
    message.extend(numbers.chunks(2).map(pair));
}

/// So many small numbers from the next words.
pub fn unpack_pairs(count: usize, next: &mut impl FnMut() -> u64) -> Vec<u32> {
    let words = (0..count.div_ceil(2)).map(|_| next());
    words.flat_map(|pair| [pair as u32, (pair >> 32) as u32]).take(count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn every_item_is_in_the_share_of_its_holder() {
        for (ranks, items) in [(1, 7), (3, 7), (5, 3), (4, 1000)] {
            let shares = threads::run(ranks, |comm| share(items, comm));
            let holders =
                &threads::run(ranks, |comm| (0..items).map(|k| holder(k, items, comm)).collect::<Vec<_>>())[0];
            assert!((0..items).all(|item| shares[holders[item as usize]].contains(&item)), "{ranks} {items}");
        }
    }

    #[test]
    fn what_all_ranks_have_is_the_same_on_each() {
        let found = threads::run(3, |comm| {
            let rank = comm.rank() as u64;
            let mine = (rank > 0).then_some([7 - rank, rank]);
            (before(comm, rank + 1), sum(comm, vec![rank, 1]), least(comm, mine), least::<1>(comm, None))
        });
        for (rank, (before, sum, least, none)) in found.into_iter().enumerate() {
            assert_eq!((before, sum), ([[0, 1, 3][rank], 6], vec![3, 3]));
            assert_eq!((least, none), (Some([5, 2]), None));
        }
    }
}
