//! Partition of each body's dual graph by METIS (Karypis and Kumar 1998), on rank 0; the others receive the numbers of
//! their own elements. Bodies are cut one by one: a part never spans two bodies.

use std::sync::{Mutex, MutexGuard, PoisonError};

use metis::Graph;
use metis::option::{Contig, Seed};

use super::connectivity::split_into_pieces;
use super::shares::{by_cost, interleave};
use super::{BodyMesh, ElementList};
use crate::comm::{Comm, Shares};

/// Cuts all bodies into about `parts` parts (more where a part had to be split to be face-connected). Returns the
/// shares and this rank's element lists.
pub(crate) fn own_elements(bodies: &[BodyMesh], parts: usize, comm: &dyn Comm) -> (Shares, Vec<ElementList>) {
    let mut outgoing = vec![Vec::new(); comm.size()];
    if comm.rank() == 0 {
        let sizes: Vec<u64> = bodies.iter().map(|body| body.brick.element_count()).collect();
        let mut lists: Vec<Vec<Vec<u64>>> = Vec::new();
        for (body, wanted) in bodies.iter().zip(spread(parts, &sizes)) {
            let (part, count) = partition(body, wanted);
            let mut of_parts = vec![Vec::new(); count];
            part.iter().enumerate().for_each(|(element, &p)| of_parts[p as usize].push(element as u64));
            lists.push(of_parts);
        }
        let order = interleave(&lists.iter().map(Vec::len).collect::<Vec<_>>());
        let costs: Vec<u64> = order.iter().map(|&(body, part)| lists[body][part].len() as u64).collect();
        let shares = by_cost(&costs, comm.size());
        let mut order = order.into_iter();
        for (message, &count) in outgoing.iter_mut().zip(&shares.0) {
            for (body, part) in order.by_ref().take(count) {
                message.extend([body as u64, lists[body][part].len() as u64]);
                message.extend(&lists[body][part]);
            }
        }
    }
    let mut message = comm.all_to_all(outgoing).swap_remove(0).into_iter();
    let mut lists = Vec::new();
    while let (Some(body), Some(length)) = (message.next(), message.next()) {
        lists.push((body as usize, message.by_ref().take(length as usize).collect()));
    }
    let counts = comm.all_gather(&[lists.len() as f64], &vec![1; comm.size()]);
    (Shares(counts.into_iter().map(|n| n as usize).collect()), lists)
}

/// Lets one thread at a time into METIS, which draws from the C library's one generator: without it, results would depend
/// on what other threads do.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    static LOCK: Mutex<()> = Mutex::new(());
    LOCK.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Shares `parts` out over bodies: one each, the others one by one to the body that is farthest below its quota.
fn spread(parts: usize, sizes: &[u64]) -> Vec<usize> {
    let total: u64 = sizes.iter().sum();
    let quota: Vec<f64> = sizes.iter().map(|&n| parts as f64 * n as f64 / total as f64).collect();
    let mut result = vec![1; sizes.len()];
    while result.iter().sum::<usize>() < parts {
        let missing = |k: &usize| quota[*k] - result[*k] as f64;
        let next = (0..sizes.len()).max_by(|a, b| missing(a).total_cmp(&missing(b)).then(b.cmp(a)));
        result[next.expect("a scene has bodies")] += 1;
    }
    result
}

/// Part of each element of a body, and the number of parts; each part is face-connected.
fn partition(body: &BodyMesh, wanted: usize) -> (Vec<i32>, usize) {
    let elements = body.brick.element_count();
    let mut nodes = Vec::with_capacity(4 * elements as usize);
    nodes.extend((0..elements).flat_map(|e| body.element(e)).map(|node| node as i32));
    let begins: Vec<i32> = (0..=elements as i32).map(|e| 4 * e).collect();
    let dual = metis::mesh_to_dual(&begins, &nodes, 3).expect("a brick's mesh has a dual graph");
    let (begin, neighbours) = (dual.xadj(), dual.adjncy());
    let mut parts = vec![0; elements as usize];
    if wanted > 1 {
        let _alone = alone();
        Graph::new(1, wanted as i32, begin, neighbours)
            .expect("METIS made this graph itself")
            .set_option(Contig(true))
            .set_option(Seed(1))
            .part_kway(&mut parts)
            .expect("the dual graph of a brick is connected");
    }
    let count = split_into_pieces(&mut parts, begin, neighbours);
    (parts, count)
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn parts_are_spread_by_size_and_every_body_gets_one() {
        assert_eq!(spread(10, &[600, 300, 100]), [6, 3, 1]);
        assert_eq!(spread(3, &[1000, 1, 1]), [1, 1, 1]);
        assert_eq!(spread(7, &[1, 1]), [4, 3]);
    }
}
