//! Smooth faces between parts: diffusion of the parts' indicators, and the largest wins.
//!
//! The indicator of every part spreads over elements that share nodes, a few steps, and each element goes to the part that
//! has most there, times a price. Merriman, Bence and Osher (1992) found this to be motion by mean curvature: faces become
//! flat, tongues vanish, and faces meet the boundary of the body at right angles, as nothing spreads across a gap. Prices keep
//! the sizes (Jacobs, Merkurjev and Esedoglu 2018).
//!
//! Indicators are integers, so that the order of elements does not matter.

use crate::mesh::Elements;

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
type Mixture = Lists<(i32, u32)>;

/// Smooths the faces between `parts` parts of a piece of a body: `part` is that of each of the elements `piece`.
pub fn smooth(elements: &Elements, piece: &[u32], part: &mut [i32], parts: usize) {
    let (corners, around) = incidence(elements, piece);
    let mut prices = vec![1.0; parts];
    for _ in 0..SWEEPS {
        let pure = part.iter().map(|&part| (part, ONE)).collect();
        let mut mixture = Mixture { begin: (0..=part.len() as u32).collect(), items: pure };
        for _ in 0..STEPS {
            mixture = mean(&mean(&mixture, &around), &corners);
        }
        assign(&mixture, &mut prices, part);
    }
}

/// Corners of the elements of a piece, and the elements around each.
fn incidence(elements: &Elements, piece: &[u32]) -> (Lists<u32>, Lists<u32>) {
    let count = elements.kind().cell().corners();
    let corners = || piece.iter().flat_map(|&element| &elements.get(element as usize)[..count]);
    let mut nodes: Vec<u32> = corners().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let local = |node: &u32| nodes.binary_search(node).expect("it is one of them") as u32;
    let corners: Vec<u32> = corners().map(local).collect();
    let mut begin = vec![0; nodes.len() + 1];
    corners.iter().for_each(|&node| begin[node as usize + 1] += 1);
    (0..nodes.len()).for_each(|node| begin[node + 1] += begin[node]);
    let mut next = begin.clone();
    let mut items = vec![0; corners.len()];
    for (at, &node) in corners.iter().enumerate() {
        items[next[node as usize] as usize] = (at / count) as u32;
        next[node as usize] += 1;
    }
    let whole = (0..=piece.len() as u32).map(|k| k * count as u32).collect();
    (Lists { begin: whole, items: corners }, Lists { begin, items })
}

/// The mean of the mixtures of each group.
fn mean(mixture: &Mixture, groups: &Lists<u32>) -> Mixture {
    let mut result = Mixture { begin: vec![0], items: Vec::with_capacity(groups.len() * 2) };
    let mut sums: Vec<(i32, u64)> = Vec::new();
    for group in 0..groups.len() {
        sums.clear();
        let members = groups.of(group);
        for &(part, value) in members.iter().flat_map(|&member| mixture.of(member as usize)) {
            match sums.iter_mut().find(|sum| sum.0 == part) {
                Some(sum) => sum.1 += u64::from(value),
                None => sums.push((part, u64::from(value))),
            }
        }
        sums.sort_unstable_by_key(|sum| sum.0);
        let count = members.len() as u64;
        let kept = sums.iter().map(|&(part, sum)| (part, sum / count)).filter(|&(_, value)| value >= LEAST);
        result.items.extend(kept.map(|(part, value)| (part, value as u32)));
        result.begin.push(result.items.len() as u32);
    }
    result
}

/// Puts every element into the part that has most of it, at prices that keep the parts equally large.
fn assign(mixture: &Mixture, prices: &mut [f64], part: &mut [i32]) {
    let wanted = part.len() as f64 / prices.len() as f64;
    for _ in 0..ADAPTIONS {
        let mut sizes = vec![0_u32; prices.len()];
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
        let off = |size: u32| wanted / f64::from(size.max(1));
        if sizes.iter().all(|&size| (off(size) - 1.0).abs() < TOLERANCE) {
            break;
        }
        prices.iter_mut().zip(&sizes).for_each(|(price, &size)| *price *= off(size).clamp(0.5, 2.0).sqrt().sqrt());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Kind;
    use crate::mesh::{Brick, brick};

    /// A brick of cells, and its halves along x with a tongue of one into the other, one cell thick.
    fn halves_with_a_tongue(kind: Kind) -> (Elements, Vec<i32>) {
        let body = Brick { origin: [0.0; 3], size: [1.0; 3], cells: [12, 5, 5] };
        let (mut nodes, mut part) = (Vec::new(), Vec::new());
        for at in brick::indices(&body.all_cells()) {
            let tongue = at[1] == 2 && at[2] == 2 && at[0] < 9;
            let half = i32::from(at[0] >= 6 && !tongue);
            match kind {
                Kind::Tet4 => {
                    nodes.extend(body.tets(at).as_flattened().iter().map(|&n| n as u32));
                    part.extend([half; 6]);
                }
                _ => {
                    nodes.extend(body.hexahedron(body.cell(at)).map(|n| n as u32));
                    part.push(half);
                }
            }
        }
        (Elements::new(kind, nodes), part)
    }

    #[test]
    fn tongues_vanish_and_sizes_stay() {
        for kind in [Kind::Tet4, Kind::Hex8] {
            let (elements, mut part) = halves_with_a_tongue(kind);
            let all: Vec<u32> = (0..elements.len() as u32).collect();
            smooth(&elements, &all, &mut part, 2);
            let per_cell = elements.len() / 300;
            let cell = |x: usize, y: usize, z: usize| part[((z * 5 + y) * 12 + x) * per_cell];
            assert_eq!([cell(0, 2, 2), cell(8, 2, 2), cell(11, 0, 4)], [0, 1, 1], "{kind:?}");
            let first = part.iter().filter(|&&part| part == 0).count();
            assert!((2 * first).abs_diff(part.len()) * 10 <= part.len(), "{first} of {}", part.len());
        }
    }

    #[test]
    fn the_order_of_elements_does_not_matter() {
        let (elements, mut part) = halves_with_a_tongue(Kind::Tet4);
        let all: Vec<u32> = (0..elements.len() as u32).collect();
        let reversed: Vec<u32> = all.iter().rev().copied().collect();
        let mut other: Vec<i32> = part.iter().rev().copied().collect();
        smooth(&elements, &all, &mut part, 2);
        smooth(&elements, &reversed, &mut other, 2);
        other.reverse();
        assert_eq!(part, other);
    }
}
