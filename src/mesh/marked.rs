//! Faces with marks, as the surfaces that they are on, on their way to the ranks that have their nodes; edges and elements, too.

use std::collections::HashMap;

use crate::comm::Comm;
use crate::comm::words::sum;

/// The marks of faces, by their nodes within the body, ascending.
pub type Marked = HashMap<Vec<u32>, Vec<usize>>;

/// Sends marked faces, all of so many nodes, to every rank that has the least of them among its own `nodes`. They meet where
/// the number of the node points to. Collective.
pub fn forward(comm: &dyn Comm, nodes: &[u32], width: usize, faces: &[(Vec<u32>, usize)]) -> Marked {
    let mut marked = Marked::new();
    if sum(comm, vec![faces.len() as u64]) == [0] {
        return marked;
    }
    let ranks = comm.size();
    let meeting = |node: u32| node as usize % ranks;
    let (mut asking, mut outgoing) = (vec![Vec::new(); ranks], vec![Vec::new(); ranks]);
    nodes.iter().for_each(|&node| asking[meeting(node)].push(u64::from(node)));
    for (face, mark) in faces {
        outgoing[meeting(face[0])].push(*mark as u64);
        outgoing[meeting(face[0])].extend(face.iter().map(|&node| u64::from(node)));
    }
    let mut askers: Vec<(u32, u32)> = Vec::new();
    for (rank, theirs) in (0..).zip(comm.all_to_all(asking)) {
        askers.extend(theirs.into_iter().map(|node| (node as u32, rank)));
    }
    askers.sort_unstable();
    let mut answers = vec![Vec::new(); ranks];
    for face in comm.all_to_all(outgoing).iter().flat_map(|theirs| theirs.chunks_exact(width + 1)) {
        let first = askers.partition_point(|asker| u64::from(asker.0) < face[1]);
        let has_it = askers[first..].iter().take_while(|asker| u64::from(asker.0) == face[1]);
        has_it.for_each(|(_, rank)| answers[*rank as usize].extend(face));
    }
    for face in comm.all_to_all(answers).iter().flat_map(|theirs| theirs.chunks_exact(width + 1)) {
        let marks = marked.entry(face[1..].iter().map(|&node| node as u32).collect()).or_default();
        if let Err(at) = marks.binary_search(&(face[0] as usize)) {
            marks.insert(at, face[0] as usize);
        }
    }
    marked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn faces_come_to_all_ranks_that_have_their_least_node() {
        // Rank r has the multiples of r + 1; each rank knows two faces, one of them twice.
        for ranks in [1, 3] {
            let found = threads::run(ranks, |comm| {
                let rank = comm.rank() as u32;
                let nodes: Vec<u32> = (0..20_u32).filter(|node| node.is_multiple_of(rank + 1)).collect();
                let faces = [(vec![4, 7, 9], 5), (vec![4, 7, 9], 5), (vec![6 + rank, 18, 19], 2)];
                forward(comm, &nodes, 3, &faces)
            });
            for (rank, marked) in (0..).zip(found) {
                let has = |node: u32| node.is_multiple_of(rank + 1);
                let mut expected = Marked::new();
                expected.extend(has(4).then(|| (vec![4, 7, 9], vec![5])));
                expected.extend((6..6 + ranks as u32).filter(|&k| has(k)).map(|k| (vec![k, 18, 19], vec![2])));
                assert_eq!(marked, expected);
            }
        }
    }
}
