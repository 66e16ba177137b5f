//! What several ranks have, as the nodes and faces on the borders of their portions of a mesh.

use super::Comm;

/// For each rank the places of the keys that it has too, in the order of the keys: the same order there. A rank has a key once.
/// Collective.
pub fn common<const N: usize>(comm: &dyn Comm, keys: &[[u64; N]]) -> Vec<Vec<u32>> {
    let ranks = comm.size();
    let mut common = vec![Vec::new(); ranks];
    if ranks == 1 {
        return common;
    }
    // They meet on the rank that the key points to.
    let mut outgoing = vec![Vec::new(); ranks];
    for key in keys {
        let meeting = key.iter().fold(0, |mixed, word| mixed ^ word) as u32 as usize % ranks;
        outgoing[meeting].extend(key);
    }
    let mut reports: Vec<([u64; N], usize)> = Vec::new();
    for (rank, theirs) in comm.all_to_all(outgoing).iter().enumerate() {
        reports.extend(theirs.as_chunks().0.iter().map(|key| (*key, rank)));
    }
    reports.sort_unstable();
    // Each hears of the other ranks, key by key.
    let mut answers = vec![Vec::new(); ranks];
    for same in reports.chunk_by(|a, b| a.0 == b.0) {
        for (key, rank) in same {
            for (_, other) in same.iter().filter(|(_, other)| other != rank) {
                answers[*rank].push(*other as u64);
                answers[*rank].extend(key);
            }
        }
    }
    let mut places: Vec<u32> = (0..keys.len() as u32).collect();
    places.sort_unstable_by_key(|&place| keys[place as usize]);
    for answer in comm.all_to_all(answers).iter().flat_map(|theirs| theirs.chunks_exact(N + 1)) {
        let at = places.binary_search_by_key(&&answer[1..], |&place| &keys[place as usize]);
        common[answer[0] as usize].push(at.expect("it was reported here") as u32);
    }
    for ordered in &mut common {
        ordered.sort_unstable();
        ordered.iter_mut().for_each(|at| *at = places[*at as usize]);
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn every_pair_of_ranks_has_its_common_keys_in_one_order() {
        // Rank r has the multiples of r + 2 up to 60, backwards.
        let keys = |rank: u64| -> Vec<[u64; 2]> {
            (0..=60).rev().filter(|n| n % (rank + 2) == 0).map(|n| [n << 32 | 7, 60 - n]).collect()
        };
        for ranks in [1, 2, 5] {
            let found = threads::run(ranks, |comm| common(comm, &keys(comm.rank() as u64)));
            for (a, b) in (0..ranks).flat_map(|a| (0..ranks).map(move |b| (a, b))) {
                let (of_a, of_b) = (keys(a as u64), keys(b as u64));
                let mut expected: Vec<[u64; 2]> =
                    of_a.iter().copied().filter(|key| a != b && of_b.contains(key)).collect();
                expected.sort_unstable();
                let named: Vec<[u64; 2]> = found[a][b].iter().map(|&place| of_a[place as usize]).collect();
                assert_eq!(named, expected, "{a} and {b} of {ranks}");
            }
        }
    }
}
