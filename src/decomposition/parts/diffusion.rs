//! Smooth faces between parts: diffusion of the parts' indicators, and the largest wins.
//!
//! The indicator of every part spreads over elements that share nodes, a few steps, and each element goes to the part that
//! has most there, times a price. Merriman, Bence and Osher (1992) found this to be motion by mean curvature: faces become
//! flat, tongues vanish, and faces meet the boundary of the body at right angles, as nothing spreads across a gap. Prices keep
//! the sizes (Jacobs, Merkurjev and Esedoglu 2018).
//!
//! Each rank has some of the elements and exchanges sums at common nodes. Indicators are integers, so that it does not matter
//! which elements these are, nor in what order.

use crate::comm::Comm;
use crate::comm::common::common;
use crate::comm::words::sum;
use crate::mesh::Portion;
use crate::mesh::wholes::Wholes;

/// An indicator's value inside its part.
const ONE: u32 = 1 << 16;
/// Less than this is dropped.
const LEAST: u64 = (ONE / 128) as u64;
/// How often indicators are made anew. Six times two steps take fewest multiplications by F on a graded part and on bricks of
/// 200 to 1,000 nodes a subdomain, of 1 to 12 times 2 to 8.
const SWEEPS: usize = 6;
/// Steps of diffusion between.
const STEPS: usize = 2;
/// How often prices are adapted after a diffusion.
const ADAPTIONS: usize = 10;
/// Sizes this much off the mean are equal enough.
const TOLERANCE: f64 = 0.05;

/// Lists one behind the other.
struct Lists<T> {
    begin: Vec<u32>,
    items: Vec<T>,
}

impl<T> Lists<T> {
    fn of(&self, k: usize) -> &[T] {
        &self.items[self.begin[k] as usize..self.begin[k + 1] as usize]
    }

    fn len(&self) -> usize {
        self.begin.len() - 1
    }
}

/// Parts and how much of them there is.
type Mixture = Lists<(u32, u32)>;

/// The same before it is divided by the number of elements.
type Sums = Vec<(u32, u64)>;

/// Elements and the nodes that they share. A node that is in several wholes is one in each.
pub struct Ground<'a> {
    comm: &'a dyn Comm,
    /// Corners of each element.
    corners: Lists<u32>,
    /// Own elements around each node.
    around: Lists<u32>,
    /// Number of all ranks' elements around each node.
    counts: Vec<u64>,
    /// Nodes that each rank has too, in the same order there.
    common: Vec<Vec<u32>>,
}

impl<'a> Ground<'a> {
    /// Of a body's elements. Collective.
    pub fn new(comm: &'a dyn Comm, portion: &Portion) -> Self {
        let count = portion.elements.kind().cell().corners();
        let each = portion.elements.iter().zip(&portion.wholes);
        let key = |whole: u32, node: u32| u64::from(whole) << 32 | u64::from(portion.nodes[node as usize]);
        let keys: Vec<u64> =
            each.flat_map(|(nodes, &whole)| nodes[..count].iter().map(move |&node| key(whole, node))).collect();
        let mut nodes = keys.clone();
        nodes.sort_unstable();
        nodes.dedup();
        // Numbered in the order of the elements, which keeps neighbours together.
        let (mut number, mut last) = (vec![u32::MAX; nodes.len()], 0);
        let mut numbered = |key: &u64| {
            let number = &mut number[nodes.binary_search(key).expect("every node is listed")];
            if *number == u32::MAX {
                *number = last;
                last += 1;
            }
            *number
        };
        let corners: Vec<u32> = keys.iter().map(&mut numbered).collect();
        drop(keys);
        let mut begin = vec![0; nodes.len() + 1];
        corners.iter().for_each(|&node| begin[node as usize + 1] += 1);
        (0..nodes.len()).for_each(|node| begin[node + 1] += begin[node]);
        let mut next = begin.clone();
        let mut items = vec![0; corners.len()];
        for (at, &node) in corners.iter().enumerate() {
            items[next[node as usize] as usize] = (at / count) as u32;
            next[node as usize] += 1;
        }
        let whole = (0..=portion.len() as u32).map(|k| k * count as u32).collect();
        let around = Lists { begin, items };
        let mut counts: Vec<u64> = (0..nodes.len()).map(|node| around.of(node).len() as u64).collect();
        let common: Vec<Vec<u32>> = common(comm, &nodes.iter().map(|&node| [node]).collect::<Vec<_>>())
            .into_iter()
            .map(|theirs| theirs.into_iter().map(|node| number[node as usize]).collect())
            .collect();
        let outgoing = common.iter().map(|nodes| nodes.iter().map(|&node| counts[node as usize]).collect()).collect();
        for (theirs, nodes) in comm.all_to_all(outgoing).into_iter().zip(&common) {
            nodes.iter().zip(theirs).for_each(|(&node, count)| counts[node as usize] += count);
        }
        Self { comm, corners: Lists { begin: whole, items: corners }, around, counts, common }
    }

    /// Smooths the faces between parts. Collective.
    pub fn smooth(&self, part: &mut [u32], wholes: &Wholes) {
        let mut prices = vec![1.0; wholes.parts()];
        for _ in 0..SWEEPS {
            let pure = part.iter().map(|&part| (part, ONE)).collect();
            let mut mixture = Mixture { begin: (0..=part.len() as u32).collect(), items: pure };
            for _ in 0..STEPS {
                mixture = self.at_elements(&self.at_nodes(&mixture));
            }
            self.assign(&mixture, &mut prices, part, wholes);
        }
    }

    /// The mean at each node of what is in the elements around it.
    fn at_nodes(&self, mixture: &Mixture) -> Mixture {
        let mut shared: Vec<Option<Sums>> = vec![None; if self.comm.size() > 1 { self.around.len() } else { 0 }];
        let of = |node: u32| {
            let mut sums = Vec::new();
            add(mixture, self.around.of(node as usize), &mut sums);
            sums
        };
        let outgoing = self.common.iter().map(|nodes| nodes.iter().flat_map(|&node| packed(of(node))).collect());
        for (theirs, nodes) in self.comm.all_to_all(outgoing.collect()).into_iter().zip(&self.common) {
            let mut theirs = theirs.into_iter();
            for &node in nodes {
                let sums = shared[node as usize].get_or_insert_with(|| of(node));
                let count = theirs.next().expect("every node has its sums");
                for _ in 0..count {
                    let [part, value] = [(); 2].map(|()| theirs.next().expect("sums are whole"));
                    add_one((part as u32, value), sums);
                }
            }
        }
        let mut result = Mixture { begin: vec![0], items: Vec::with_capacity(self.around.len() * 2) };
        let mut sums = Vec::new();
        for (node, &count) in self.counts.iter().enumerate() {
            sums.clear();
            match shared.get_mut(node).and_then(Option::take) {
                Some(of_all) => sums = of_all,
                None => add(mixture, self.around.of(node), &mut sums),
            }
            push_mean(&mut sums, count, &mut result);
        }
        result
    }

    /// The mean in each element of what is at its corners.
    fn at_elements(&self, mixture: &Mixture) -> Mixture {
        let mut result = Mixture { begin: vec![0], items: Vec::with_capacity(self.corners.len() * 2) };
        let mut sums = Vec::new();
        for element in 0..self.corners.len() {
            let corners = self.corners.of(element);
            sums.clear();
            add(mixture, corners, &mut sums);
            push_mean(&mut sums, corners.len() as u64, &mut result);
        }
        result
    }

    /// Puts every element into the part that has most of it, at prices that keep the parts equally large.
    fn assign(&self, mixture: &Mixture, prices: &mut [f64], part: &mut [u32], wholes: &Wholes) {
        for _ in 0..ADAPTIONS {
            let mut sizes = vec![0; prices.len()];
            for (element, part) in part.iter_mut().enumerate() {
                let mut best = (0.0, *part);
                for &(other, value) in mixture.of(element) {
                    let value = f64::from(value) * prices[other as usize];
                    if value > best.0 {
                        best = (value, other);
                    }
                }
                *part = best.1;
                sizes[best.1 as usize] += 1;
            }
            let sizes = sum(self.comm, sizes);
            let off = |(part, &size): (u32, &u64)| wholes.mean(wholes.of_part(part)) / size.max(1) as f64;
            let off: Vec<f64> = (0..).zip(&sizes).map(off).collect();
            if off.iter().all(|off| (off - 1.0).abs() < TOLERANCE) {
                break;
            }
            prices.iter_mut().zip(&off).for_each(|(price, off)| *price *= off.clamp(0.5, 2.0).sqrt().sqrt());
        }
    }
}

/// Adds up what some members have.
fn add(mixture: &Mixture, members: &[u32], sums: &mut Sums) {
    for &(part, value) in members.iter().flat_map(|&member| mixture.of(member as usize)) {
        add_one((part, u64::from(value)), sums);
    }
}

fn add_one((part, value): (u32, u64), sums: &mut Sums) {
    match sums.iter_mut().find(|sum| sum.0 == part) {
        Some(sum) => sum.1 += value,
        None => sums.push((part, value)),
    }
}

fn packed(sums: Sums) -> impl Iterator<Item = u64> {
    std::iter::once(sums.len() as u64).chain(sums.into_iter().flat_map(|(part, value)| [u64::from(part), value]))
}

fn push_mean(sums: &mut Sums, count: u64, result: &mut Mixture) {
    sums.sort_unstable_by_key(|sum| sum.0);
    let kept = sums.iter().map(|&(part, sum)| (part, sum / count)).filter(|&(_, value)| value >= LEAST);
    result.items.extend(kept.map(|(part, value)| (part, value as u32)));
    result.begin.push(result.items.len() as u32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::comm::threads;
    use crate::decomposition::parts::of_brick;
    use crate::decomposition::{BodyMesh, Shape, number_bodies};
    use crate::element::Kind;
    use crate::mesh::Brick;

    const CELLS: [usize; 3] = [12, 5, 5];

    fn body(kind: Kind) -> BodyMesh {
        let brick = Brick { origin: [0.0; 3], size: [1.0; 3], cells: CELLS };
        number_bodies([(kind, Shape::Brick(brick), vec![0])]).swap_remove(0)
    }

    /// Halves of the brick along x with a tongue of one into the other, one cell thick.
    fn halves_with_a_tongue(body: &BodyMesh, number: u32) -> u32 {
        let cell = number as usize / body.kind.cell().per_hexahedron() as usize;
        let at = [cell % CELLS[0], cell / CELLS[0] % CELLS[1], cell / (CELLS[0] * CELLS[1])];
        u32::from(at[0] >= 6 && !(at[1] == 2 && at[2] == 2 && at[0] < 9))
    }

    fn smoothed(body: &BodyMesh, comm: &dyn Comm) -> Vec<u32> {
        let portion = of_brick(body, comm);
        let mut part: Vec<u32> = portion.numbers.iter().map(|&number| halves_with_a_tongue(body, number)).collect();
        Ground::new(comm, &portion).smooth(&mut part, &Wholes::new(vec![body.counts().elements], vec![2]));
        part
    }

    #[test]
    fn tongues_vanish_and_sizes_stay() {
        for kind in [Kind::Tet4, Kind::Hex8] {
            let part = smoothed(&body(kind), &Solo);
            let cell = |x: usize, y: usize, z: usize| part[((z * 5 + y) * 12 + x) * part.len() / 300];
            assert_eq!([cell(0, 2, 2), cell(8, 2, 2), cell(11, 0, 4)], [0, 1, 1], "{kind:?}");
            let first = part.iter().filter(|&&part| part == 0).count();
            assert!((2 * first).abs_diff(part.len()) * 10 <= part.len(), "{first} of {}", part.len());
        }
    }

    #[test]
    fn ranks_do_not_matter() {
        let body = body(Kind::Tet4);
        let alone = smoothed(&body, &Solo);
        for ranks in [2, 5] {
            assert_eq!(threads::run(ranks, |comm| smoothed(&body, comm)).concat(), alone, "{ranks} ranks");
        }
    }
}
