//! Compact parts of equal size: a balanced centroidal power diagram of elements' centres.
//!
//! An element at x belongs to the part with the least |x - c|² - w. Centres c move to the means of their elements (Du, Faber
//! and Gunzburger 1999); weights w grow where a part is too small and shrink where it is too large (as influences do in von
//! Looz, Tzovas and Meyerhenke 2018). Cells of such a diagram are convex, and as large as so many elements need: parts follow
//! the sizes of a graded mesh. Most rounds are of a sample of the elements.
//!
//! Each rank has some of the elements. Sums are of integers, points being those of a grid, so that it does not matter which,
//! nor in what order. Nothing is known of the body's boundary: a part may reach across a gap, and what it has there is
//! another's to take ([`super::pieces`]).

use crate::comm::Comm;
use crate::comm::words::sum;
use crate::mesh::wholes::Wholes;

/// Parts that an element may move to: the nearest ones of its own, with itself.
const NEAREST: usize = 24;
/// How often centres move with a sample of the elements, and with all of them.
const ROUNDS: [usize; 2] = [48, 4];
/// After so many rounds it is found anew which parts are near.
const RENEWAL: usize = 8;
/// How often weights are adapted between.
const ADAPTIONS: usize = 3;
/// Elements of a part that make up the sample.
const SAMPLE: u64 = 100;
/// Sizes this much off the mean are equal enough.
const TOLERANCE: f64 = 0.05;

/// Makes parts of elements with these points on the grid compact and equally large, from the parts they are in. Collective.
pub fn compact(comm: &dyn Comm, points: &[[i32; 3]], part: &mut [u32], wholes: &Wholes) {
    let mut cells = vec![Cell::default(); wholes.parts()];
    move_centres(comm, &mut cells, points, part);
    cells.iter_mut().for_each(|cell| cell.weight = cell.spread);
    let all: u64 = (0..wholes.count() as u32).map(|whole| wholes.size(whole)).sum();
    let stride = (all / (SAMPLE * wholes.parts() as u64)).max(1);
    let sample: Vec<usize> = (0..points.len()).filter(|&at| scattered(points[at]).is_multiple_of(stride)).collect();
    let of_sample: Vec<[i32; 3]> = sample.iter().map(|&at| points[at]).collect();
    let mut its_part: Vec<u32> = sample.iter().map(|&at| part[at]).collect();
    let mut near = Vec::new();
    for turn in 0..ROUNDS[0] {
        if turn % RENEWAL == 0 {
            near = nearest(&cells, wholes);
        }
        round(comm, (&mut cells, &near), &of_sample, &mut its_part, wholes);
    }
    near = nearest(&cells, wholes);
    (0..ROUNDS[1]).for_each(|_| round(comm, (&mut cells, &near), points, part, wholes));
}

/// A number that tells nothing of where the point is.
fn scattered(point: [i32; 3]) -> u64 {
    let mixed = point.iter().fold(0_u64, |mixed, &x| (mixed ^ x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    mixed >> 40
}

/// Adapts weights, then moves the centres.
fn round(comm: &dyn Comm, (cells, near): (&mut [Cell], &Near), points: &[[i32; 3]], part: &mut [u32], wholes: &Wholes) {
    for _ in 0..ADAPTIONS {
        let sizes = sum(comm, assign(cells, near, points, part));
        let mut of_wholes = vec![0; wholes.count()];
        (0..).zip(&sizes).for_each(|(part, size)| of_wholes[wholes.of_part(part) as usize] += size);
        let off = |(part, size): (u32, &u64)| {
            let whole = wholes.of_part(part);
            let wanted = of_wholes[whole as usize] as f64 / f64::from(wholes.parts_of(whole));
            if wanted > 0.0 { *size as f64 / wanted - 1.0 } else { 0.0 }
        };
        let off: Vec<f64> = (0..).zip(&sizes).map(off).collect();
        if off.iter().all(|off| off.abs() < TOLERANCE) {
            break;
        }
        for (cell, off) in cells.iter_mut().zip(&off) {
            cell.weight -= 0.5 * cell.spread * off.clamp(-0.6, 0.6);
        }
    }
    move_centres(comm, cells, points, part);
}

/// Of each part, the nearest ones of the same whole and how far away they are, itself first.
type Near = [Vec<(f64, u32)>];

/// What elements of a part have in common.
#[derive(Clone, Default)]
struct Cell {
    centre: [f64; 3],
    /// Mean square of distances from the centre, the last that was not zero.
    spread: f64,
    weight: f64,
}

/// Words a part of [`move_centres`].
const WORDS: usize = 6;

/// Moves centres to the means of their elements; those of empty parts stay.
fn move_centres(comm: &dyn Comm, cells: &mut [Cell], points: &[[i32; 3]], part: &[u32]) {
    let mut mine = vec![0_u64; WORDS * cells.len()];
    for (point, &part) in points.iter().zip(part) {
        let sums = &mut mine[WORDS * part as usize..][..WORDS];
        sums[0] += 1;
        let mut square = 0;
        for axis in 0..3 {
            let x = point[axis] as u64;
            sums[1 + axis] += x;
            square += x * x;
        }
        // In two words: squares have 50 bits.
        sums[4] += square >> 24;
        sums[5] += square & ((1 << 24) - 1);
    }
    let sums = sum(comm, mine);
    for (cell, sums) in cells.iter_mut().zip(sums.as_chunks::<WORDS>().0).filter(|(_, sums)| sums[0] > 0) {
        let (count, sum) = (sums[0], [sums[1], sums[2], sums[3]]);
        cell.centre = sum.map(|sum| sum as f64 / count as f64);
        // count * squares - sum² is an integer, and no difference of large numbers is rounded.
        let squares = (u128::from(sums[4]) << 24) + u128::from(sums[5]);
        let around = u128::from(count) * squares - sum.map(|sum| u128::from(sum).pow(2)).iter().sum::<u128>();
        if around > 0 {
            cell.spread = around as f64 / (count as f64).powi(2);
        }
    }
}

/// The nearest parts of each in the same whole, itself first, and how far away they are.
fn nearest(cells: &[Cell], wholes: &Wholes) -> Vec<Vec<(f64, u32)>> {
    let of = |(part, cell): (u32, &Cell)| {
        let whole = wholes.of_part(part);
        let others = wholes.first(whole)..wholes.first(whole) + wholes.parts_of(whole);
        let mut others: Vec<(f64, u32)> =
            others.map(|other| (squared(cell.centre, cells[other as usize].centre), other)).collect();
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if others.len() > NEAREST {
            others.select_nth_unstable_by(NEAREST, order);
            others.truncate(NEAREST);
        }
        others.sort_unstable_by(order);
        others.iter_mut().for_each(|other| other.0 = other.0.sqrt());
        others
    };
    (0..).zip(cells).map(of).collect()
}

/// Puts every element into its part. Returns how many are in each.
fn assign(cells: &[Cell], near: &Near, points: &[[i32; 3]], part: &mut [u32]) -> Vec<u64> {
    let most = |near: &Vec<(f64, u32)>| near.iter().map(|&(_, k)| cells[k as usize].weight).fold(f64::MIN, f64::max);
    let most: Vec<f64> = near.iter().map(most).collect();
    let mut sizes = vec![0; cells.len()];
    for (point, part) in points.iter().zip(part) {
        let own = *part as usize;
        let point = point.map(f64::from);
        let from_own = squared(point, cells[own].centre);
        let radius = from_own.sqrt();
        let mut best = (from_own - cells[own].weight, own as u32);
        for &(apart, other) in &near[own] {
            let least = (apart - radius).max(0.0);
            if least * least - most[own] > best.0 {
                break;
            }
            let value = squared(point, cells[other as usize].centre) - cells[other as usize].weight;
            if (value, other) < best {
                best = (value, other);
            }
        }
        *part = best.1;
        sizes[best.1 as usize] += 1;
    }
    sizes
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::comm::threads;
    use crate::mesh::curve::on_grid;
    use crate::random::Random;

    /// Points in a cube, four times as dense at one end.
    fn graded() -> Vec<[i32; 3]> {
        let mut random = Random::new(7);
        let point = |_| {
            let [x, y, z] = random.vector::<3>(1.0);
            [((x + 1.0) * 0.5).powi(4), y, z]
        };
        on_grid(&Solo, &(0..4000).map(point).collect::<Vec<_>>())
    }

    /// Sum of squared distances from the means of the parts.
    fn inertia(points: &[[i32; 3]], part: &[u32], parts: u32) -> f64 {
        let of_part = |k: u32| -> Vec<[f64; 3]> {
            points.iter().zip(part).filter(|(_, part)| **part == k).map(|(point, _)| point.map(f64::from)).collect()
        };
        let around_mean = |points: Vec<[f64; 3]>| -> f64 {
            let mean = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64);
            points.iter().map(|&point| squared(point, mean)).sum()
        };
        (0..parts).map(|k| around_mean(of_part(k))).sum()
    }

    /// Slices along y.
    fn slices(points: &[[i32; 3]], parts: usize) -> Vec<u32> {
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|&k| points[k][1]);
        let mut part = vec![0; points.len()];
        order.iter().enumerate().for_each(|(at, &k)| part[k] = (at * parts / points.len()) as u32);
        part
    }

    #[test]
    fn parts_get_compact_and_equally_large_from_slices_of_a_graded_cloud() {
        let points = graded();
        let mut part = slices(&points, 16);
        let before = inertia(&points, &part, 16);
        compact(&Solo, &points, &mut part, &Wholes::new(vec![4000], vec![16]));
        let sizes: Vec<usize> = (0..16).map(|k| part.iter().filter(|&&part| part == k).count()).collect();
        assert!(sizes.iter().all(|&size| size.abs_diff(250) <= 25), "{sizes:?}");
        let after = inertia(&points, &part, 16);
        assert!(after < 0.5 * before, "{after} of {before}");
    }

    #[test]
    fn neither_the_order_of_elements_nor_ranks_matter_and_parts_stay_in_their_whole() {
        let points = graded();
        let start = slices(&points, 8);
        // Two wholes of four slices each; a sample of every second point or fewer.
        let wholes = Wholes::new(vec![2000, 2000], vec![4, 4]);
        let cut = |ranks: usize| {
            let parts = threads::run(ranks, |comm| {
                let mine = 4000 * comm.rank() / ranks..4000 * (comm.rank() + 1) / ranks;
                let mut part = start[mine.clone()].to_vec();
                compact(comm, &points[mine], &mut part, &wholes);
                part
            });
            parts.concat()
        };
        let alone = cut(1);
        assert!(alone.iter().zip(&start).all(|(part, start)| part / 4 == start / 4));
        assert_ne!(alone, start);
        assert_eq!(cut(3), alone);
        let reversed: Vec<[i32; 3]> = points.iter().rev().copied().collect();
        let mut part: Vec<u32> = start.iter().rev().copied().collect();
        compact(&Solo, &reversed, &mut part, &wholes);
        part.reverse();
        assert_eq!(part, alone);
    }

    #[test]
    fn fewer_elements_than_parts_and_elements_in_one_place_stay_in_some_part() {
        for points in [vec![[0.0; 3]], vec![[1.0; 3]; 5], vec![[0.0; 3], [1.0, 0.0, 0.0]]] {
            let mut part: Vec<u32> = (0..points.len() as u32).collect();
            let wholes = Wholes::new(vec![points.len() as u64], vec![7]);
            compact(&Solo, &on_grid(&Solo, &points), &mut part, &wholes);
            assert!(part.iter().all(|part| (0..7).contains(part)), "{part:?}");
        }
    }
}
