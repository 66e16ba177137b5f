use super::*;
use crate::comm::threads;

#[test]
fn the_lowest_rank_that_knows_a_key_answers() {
    for ranks in [1, 2, 5] {
        threads::run(ranks, |comm| {
            let rank = comm.rank() as u64;
            // Rank r knows the keys up to r, as r + 1 numbers: the lowest that knows one is of its number.
            let known = (0..=rank).map(|key| ([key, 7], vec![rank; rank as usize + 1]));
            let last = ranks as u64 - 1;
            let found = look_up(comm, known, [[last, 7], [0, 7], [9, 7]]);
            assert_eq!(found[&[last, 7]], vec![last; ranks]);
            assert_eq!(found[&[0, 7]], [0]);
            assert!(!found.contains_key(&[9, 7]));
        });
    }
}

#[test]
fn every_key_is_counted_over_all_ranks() {
    for ranks in [1, 3, 4] {
        threads::run(ranks, |comm| {
            let mine: Vec<[u64; 1]> = (0..=comm.rank() as u64).flat_map(|key| [[key], [key]]).collect();
            let found = count(comm, &mine);
            for key in 0..=comm.rank() as u64 {
                assert_eq!(found[&[key]], 2 * (ranks as u64 - key));
            }
            assert_eq!(found.len(), comm.rank() + 1);
        });
    }
}

#[test]
fn keys_with_a_stride_are_spread_over_the_ranks() {
    for stride in [1, 64, 4096] {
        let mut loads = [0; 16];
        (0..1600).for_each(|k| loads[home(&[stride * k], 16)] += 1);
        assert!(loads.iter().all(|load| (40..200).contains(load)), "{stride}: {loads:?}");
    }
}

#[test]
fn questions_are_answered_in_their_order_by_those_who_have_heard_all() {
    for ranks in [1, 2, 5] {
        let found = threads::run(ranks, |comm| {
            let mine: Vec<[u64; 2]> = (0..9).map(|k| [7 * k % 9, comm.rank() as u64]).collect();
            let whom = |question: &[u64; 2]| question[0] as usize % ranks;
            ask(comm, &mine, whom, |all| {
                let sum: u64 = all.iter().copied().flatten().map(|question| question[1]).sum();
                move |[key, rank]| 10_000 * sum + 100 * key + rank
            })
        });
        for (rank, answers) in found.into_iter().enumerate() {
            for (k, answer) in answers.into_iter().enumerate() {
                let key = 7 * k % 9;
                let here = (0..9).filter(|other| other % ranks == key % ranks).count();
                let sum = here * ranks * (ranks - 1) / 2;
                assert_eq!(answer as usize, 10_000 * sum + 100 * key + rank);
            }
        }
    }
}
