//! Parts along a Hilbert curve: elements are sorted by the place of their centres on the curve, and cut into pieces of equal
//! length (Skilling, Programming the Hilbert curve, 2004, for the places).
//!
//! Ranks need not sort among themselves: the ends of the parts are found by bisection, from counts of all ranks.

use super::wholes::Wholes;
use crate::comm::words::sum;
use crate::comm::{Comm, maximum};

/// Bits of each coordinate that places are made of.
const BITS: u32 = 20;
/// Cells of the grid along the longest side of all points.
const GRID: f64 = (1 << 24) as f64;

/// Points in cells of a grid over those of all ranks. Collective.
pub fn on_grid(comm: &dyn Comm, points: &[[f64; 3]]) -> Vec<[i32; 3]> {
    let mut extremes = vec![f64::NEG_INFINITY; 6];
    for (point, axis) in points.iter().flat_map(|point| (0..3).map(move |axis| (point, axis))) {
        extremes[axis] = extremes[axis].max(point[axis]);
        extremes[3 + axis] = extremes[3 + axis].max(-point[axis]);
    }
    let extremes = maximum(comm, &extremes);
    let longest = (0..3).map(|axis| extremes[axis] + extremes[3 + axis]).fold(f64::MIN_POSITIVE, f64::max);
    let last = GRID as i32 - 1;
    let place = |point: &[f64; 3]| {
        std::array::from_fn(|axis| (((point[axis] + extremes[3 + axis]) / longest * GRID) as i32).min(last))
    };
    points.iter().map(place).collect()
}

/// Puts all elements into parts, `wholes` being those of the elements and `points` on a grid of 24 bits. Collective.
pub fn start(comm: &dyn Comm, points: &[[i32; 3]], of_elements: &[u32], wholes: &Wholes) -> Vec<u32> {
    let key = |(point, &whole): (&[i32; 3], &u32)| (whole, place(point.map(|x| x as u32 >> 4)));
    let keys: Vec<(u32, u64)> = points.iter().zip(of_elements).map(key).collect();
    let mut sorted = keys.clone();
    sorted.sort_unstable();
    let count = |key: (u32, u64)| sorted.partition_point(|other| *other <= key) as u64;
    let first = |whole: u32| sorted.partition_point(|key| key.0 < whole) as u64;
    let before: Vec<u64> = (0..wholes.count() as u32).map(first).collect();
    // For each part the last place that is in it: the first one up to which there are enough elements.
    let mut ends = vec![[0_u64, (1 << (3 * BITS)) - 1]; wholes.parts()];
    for _ in 0..3 * BITS {
        let middle = |[low, high]: &[u64; 2]| low + (high - low) / 2;
        let mine = (0..).zip(&ends).map(|(part, end)| {
            let whole = wholes.of_part(part);
            count((whole, middle(end))) - before[whole as usize]
        });
        let counts = sum(comm, mine.collect());
        for ((part, end), count) in (0..).zip(&mut ends).zip(counts) {
            let whole = wholes.of_part(part);
            let (number, of) = (u64::from(part - wholes.first(whole)) + 1, wholes.parts_of(whole));
            let enough = u128::from(count) * u128::from(of) >= u128::from(wholes.size(whole)) * u128::from(number);
            let at = middle(end);
            *end = if enough { [end[0], at] } else { [(at + 1).min(end[1]), end[1]] };
        }
    }
    let part = |&(whole, place): &(u32, u64)| {
        let (first, parts) = (wholes.first(whole), wholes.parts_of(whole));
        let own = &ends[first as usize..(first + parts - 1) as usize];
        first + own.partition_point(|end| end[1] < place) as u32
    };
    keys.iter().map(part).collect()
}

/// The place of a point on the curve.
fn place(mut x: [u32; 3]) -> u64 {
    // Inverse undo of excess work, then Gray code.
    for bit in (1..BITS).rev() {
        let (q, p) = (1 << bit, (1 << bit) - 1);
        for axis in 0..3 {
            if x[axis] & q == 0 {
                let t = (x[0] ^ x[axis]) & p;
                x[0] ^= t;
                x[axis] ^= t;
            } else {
                x[0] ^= p;
            }
        }
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let flip = (1..BITS).filter(|bit| x[2] >> bit & 1 == 1).fold(0, |flip, bit| flip ^ ((1_u32 << bit) - 1));
    let interleaved = (0..BITS).rev().flat_map(|bit| x.map(|x| u64::from((x ^ flip) >> bit & 1)));
    interleaved.fold(0, |place, bit| place << 1 | bit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::random::Random;

    #[test]
    fn neighbours_on_the_curve_are_neighbours_in_space() {
        // The first cells of the curve fill a cube of 8 cells an edge.
        let mut cells: Vec<[u32; 3]> = (0..512).map(|k| [k % 8, k / 8 % 8, k / 64].map(|x| x << (BITS - 3))).collect();
        cells.sort_by_key(|cell| place(*cell));
        for pair in cells.windows(2) {
            let apart: u32 = (0..3).map(|axis| pair[0][axis].abs_diff(pair[1][axis]) >> (BITS - 3)).sum();
            assert_eq!(apart, 1, "{pair:?}");
        }
    }

    #[test]
    fn parts_of_each_whole_are_equal_on_any_ranks() {
        let mut random = Random::new(3);
        let points: Vec<[i32; 3]> =
            (0..1000).map(|_| random.vector::<3>(1.0).map(|x| ((x + 1.0) * f64::from(1 << 23)) as i32)).collect();
        let of: Vec<u32> = (0..1000).map(|k| u32::from(k % 5 == 0)).collect();
        let cut = |ranks: usize| {
            let parts = threads::run(ranks, |comm| {
                let mine = 1000 * comm.rank() / ranks..1000 * (comm.rank() + 1) / ranks;
                start(comm, &points[mine.clone()], &of[mine], &Wholes::new(vec![800, 200], vec![5, 3]))
            });
            parts.concat()
        };
        let parts = cut(1);
        let sizes: Vec<usize> = (0..8).map(|k| parts.iter().filter(|&&part| part == k).count()).collect();
        assert_eq!(sizes, [160, 160, 160, 160, 160, 67, 67, 66]);
        assert!(parts.iter().zip(&of).all(|(&part, &whole)| (part >= 5) == (whole == 1)));
        assert_eq!(cut(3), parts);
    }
}
