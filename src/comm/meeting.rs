//! Ranks meet by keys: what one knows and another asks for comes together on the rank that the key points to.
//!
//! No rank learns more than it asks for, and none has to know who knows what. Each function is a round or two of all-to-all.

use std::collections::HashMap;
use std::hash::Hash;

use super::Comm;

/// The rank that a key points to.
pub fn home(key: &[u64], ranks: usize) -> usize {
    // Fibonacci hashing of the words one behind the other: keys with a stride are spread, too.
    let mixed =
        key.iter().fold(0_u64, |mixed, word| (mixed.rotate_left(29) ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    ((u128::from(mixed) * ranks as u128) >> 64) as usize
}

/// What is known of the wanted keys. Of several who know one the lowest rank counts, and of several reports of a rank the first;
/// a key that nobody knows has no answer. Collective.
pub fn look_up<const N: usize>(
    comm: &dyn Comm,
    known: impl IntoIterator<Item = ([u64; N], Vec<u64>)>,
    wanted: impl IntoIterator<Item = [u64; N]>,
) -> HashMap<[u64; N], Vec<u64>> {
    let ranks = comm.size();
    let mut outgoing = vec![Vec::new(); ranks];
    for (key, value) in known {
        pack(key, &value, &mut outgoing[home(&key, ranks)]);
    }
    let mut directory: HashMap<[u64; N], Vec<u64>> = HashMap::new();
    for report in comm.all_to_all(outgoing) {
        each_packed(&report, |key, value| {
            directory.entry(key).or_insert_with(|| value.to_vec());
        });
    }
    let mut wishes = vec![Vec::new(); ranks];
    wanted.into_iter().for_each(|key| wishes[home(&key, ranks)].extend(key));
    let answer = |wish: Vec<u64>| {
        let mut message = Vec::new();
        for key in wish.as_chunks::<N>().0 {
            if let Some(value) = directory.get(key) {
                pack(*key, value, &mut message);
            }
        }
        message
    };
    let answers = comm.all_to_all(wishes).into_iter().map(answer).collect();
    let mut found = HashMap::new();
    for answer in comm.all_to_all(answers) {
        each_packed(&answer, |key, value| {
            found.insert(key, value.to_vec());
        });
    }
    found
}

/// A word for each question, from the rank that it is for: there `hear` is given the questions of all ranks, by rank, and returns what
/// answers each. Collective.
pub fn ask<const N: usize, A: Fn(&[u64; N]) -> u64>(
    comm: &dyn Comm,
    questions: &[[u64; N]],
    whom: impl Fn(&[u64; N]) -> usize,
    hear: impl FnOnce(&[&[[u64; N]]]) -> A,
) -> Vec<u64> {
    let mut outgoing = vec![Vec::new(); comm.size()];
    questions.iter().for_each(|question| outgoing[whom(question)].extend(question));
    let incoming = comm.all_to_all(outgoing);
    let incoming: Vec<&[[u64; N]]> = incoming.iter().map(|message| message.as_chunks().0).collect();
    let answer = hear(&incoming);
    let answers = incoming.iter().map(|theirs| theirs.iter().map(&answer).collect()).collect();
    let mut answers: Vec<_> = comm.all_to_all(answers).into_iter().map(Vec::into_iter).collect();
    let next = |question| answers[whom(question)].next().expect("every question is answered");
    questions.iter().map(next).collect()
}

/// How often all ranks together name each of this rank's keys. Collective.
pub fn count<const N: usize>(comm: &dyn Comm, mine: &[[u64; N]]) -> HashMap<[u64; N], u64> {
    let ranks = comm.size();
    // Each rank names a key once, with its count.
    let own = tally(mine.iter().map(|key| (*key, 1)));
    let mut keys = vec![Vec::new(); ranks];
    let mut outgoing = vec![Vec::new(); ranks];
    for (key, count) in &own {
        let home = home(key, ranks);
        keys[home].push(*key);
        outgoing[home].extend(key);
        outgoing[home].push(*count);
    }
    let reports: Vec<Vec<([u64; N], u64)>> = comm
        .all_to_all(outgoing)
        .iter()
        .map(|report| report.chunks_exact(N + 1).map(|r| (std::array::from_fn(|k| r[k]), r[N])).collect())
        .collect();
    let all = tally(reports.iter().flatten().copied());
    let answers = reports.iter().map(|report| report.iter().map(|(key, _)| all[key]).collect()).collect();
    keys.into_iter().zip(comm.all_to_all(answers)).flat_map(|(keys, counts)| keys.into_iter().zip(counts)).collect()
}

fn tally<K: Hash + Eq>(counts: impl Iterator<Item = (K, u64)>) -> HashMap<K, u64> {
    let mut sums = HashMap::new();
    counts.for_each(|(key, count)| *sums.entry(key).or_default() += count);
    sums
}

/// Adds a key with its values to a message.
pub fn pack<const N: usize>(key: [u64; N], values: &[u64], message: &mut Vec<u64>) {
    message.extend(key);
    message.push(values.len() as u64);
    message.extend(values);
}

/// Goes through keys with their values, packed one behind the other.
pub fn each_packed<const N: usize>(message: &[u64], mut tell: impl FnMut([u64; N], &[u64])) {
    let mut rest = message;
    while let Some((key, behind)) = rest.split_first_chunk::<N>() {
        let (count, behind) = behind.split_first().expect("messages are whole");
        let (value, behind) = behind.split_at(*count as usize);
        tell(*key, value);
        rest = behind;
    }
}

#[cfg(test)]
mod tests;
