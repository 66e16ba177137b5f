//! Compact parts of equal size: a balanced centroidal power diagram of elements' centres.
//!
//! An element at x belongs to the part with the least |x - c|² - w. Centres c move to the means of their elements (Du, Faber
//! and Gunzburger 1999); weights w grow where a part is too small and shrink where it is too large (as influences do in von
//! Looz, Tzovas and Meyerhenke 2018). Cells of such a diagram are convex, and as large as so many elements need: parts follow
//! the sizes of a graded mesh.
//!
//! Sums are of integers, points being those of a grid, so that the order of elements does not matter. Nothing is known of
//! the body's boundary: a part may reach across a gap, and what it has there is another's to take ([`super::pieces`]).

/// Cells of the grid along the body's longest side.
const GRID: f64 = (1 << 24) as f64;
/// Parts that an element may move to: the nearest ones of its own, with itself.
const NEAREST: usize = 24;
/// How often centres move.
const ROUNDS: usize = 12;
/// How often weights are adapted between.
const ADAPTIONS: usize = 6;
/// Sizes this much off the mean are equal enough.
const TOLERANCE: f64 = 0.05;

/// Makes `parts` parts of elements with these centres compact and equally large, from the parts they are in.
pub fn compact(centres: &[[f64; 3]], part: &mut [i32], parts: usize) {
    let points = on_grid(centres);
    let wanted = points.len() as f64 / parts as f64;
    let mut cells = vec![Cell::default(); parts];
    move_centres(&mut cells, &points, part);
    cells.iter_mut().for_each(|cell| cell.weight = cell.spread);
    for _ in 0..ROUNDS {
        let near = nearest(&cells);
        for _ in 0..ADAPTIONS {
            let sizes = assign(&cells, &near, &points, part);
            let off = |size: &u64| *size as f64 / wanted - 1.0;
            if sizes.iter().all(|size| off(size).abs() < TOLERANCE) {
                break;
            }
            for (cell, size) in cells.iter_mut().zip(&sizes) {
                cell.weight -= 0.5 * cell.spread * off(size).clamp(-0.6, 0.6);
            }
        }
        move_centres(&mut cells, &points, part);
    }
}

/// What elements of a part have in common.
#[derive(Clone, Default)]
struct Cell {
    centre: [f64; 3],
    /// Mean square of distances from the centre, the last that was not zero.
    spread: f64,
    weight: f64,
}

/// Points in cells of a grid over all of them.
fn on_grid(points: &[[f64; 3]]) -> Vec<[i32; 3]> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for (point, axis) in points.iter().flat_map(|point| (0..3).map(move |axis| (point, axis))) {
        low[axis] = low[axis].min(point[axis]);
        high[axis] = high[axis].max(point[axis]);
    }
    let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(f64::MIN_POSITIVE, f64::max);
    let place = |point: &[f64; 3]| std::array::from_fn(|axis| ((point[axis] - low[axis]) / longest * GRID) as i32);
    points.iter().map(place).collect()
}

/// Moves centres to the means of their elements; those of empty parts stay.
fn move_centres(cells: &mut [Cell], points: &[[i32; 3]], part: &[i32]) {
    let mut sums = vec![(0_u64, [0_i64; 3], 0_u128); cells.len()];
    for (point, &part) in points.iter().zip(part) {
        let (count, sum, squares) = &mut sums[part as usize];
        *count += 1;
        (0..3).for_each(|axis| sum[axis] += i64::from(point[axis]));
        *squares += point.iter().map(|&x| i64::from(x).pow(2) as u128).sum::<u128>();
    }
    for (cell, &(count, sum, squares)) in cells.iter_mut().zip(&sums).filter(|(_, sums)| sums.0 > 0) {
        cell.centre = sum.map(|sum| sum as f64 / count as f64);
        // count * squares - sum² is an integer, and no difference of large numbers is rounded.
        let around =
            u128::from(count) * squares - sum.iter().map(|&s| s.unsigned_abs() as u128).map(|s| s * s).sum::<u128>();
        if around > 0 {
            cell.spread = around as f64 / (count as f64).powi(2);
        }
    }
}

/// The nearest parts of each, itself first, and how far away they are.
fn nearest(cells: &[Cell]) -> Vec<Vec<(f64, u32)>> {
    let of = |cell: &Cell| {
        let mut others: Vec<(f64, u32)> =
            (0..).zip(cells).map(|(k, other)| (squared(cell.centre, other.centre), k)).collect();
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if others.len() > NEAREST {
            others.select_nth_unstable_by(NEAREST, order);
            others.truncate(NEAREST);
        }
        others.sort_unstable_by(order);
        others.iter_mut().for_each(|other| other.0 = other.0.sqrt());
        others
    };
    cells.iter().map(of).collect()
}

/// Puts every element into its part. Returns the sizes of the parts.
fn assign(cells: &[Cell], near: &[Vec<(f64, u32)>], points: &[[i32; 3]], part: &mut [i32]) -> Vec<u64> {
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
        *part = best.1 as i32;
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
    use crate::random::Random;

    /// Points in a cube, four times as dense at one end.
    fn graded() -> Vec<[f64; 3]> {
        let mut random = Random::new(7);
        let point = |_| {
            let [x, y, z] = random.vector::<3>(1.0);
            [((x + 1.0) * 0.5).powi(4), y, z]
        };
        (0..4000).map(point).collect()
    }

    /// Sum of squared distances from the means of the parts.
    fn inertia(points: &[[f64; 3]], part: &[i32], parts: usize) -> f64 {
        let of_part = |k: i32| -> Vec<[f64; 3]> {
            points.iter().zip(part).filter(|(_, part)| **part == k).map(|(point, _)| *point).collect()
        };
        let around_mean = |points: Vec<[f64; 3]>| -> f64 {
            let mean = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64);
            points.iter().map(|&point| squared(point, mean)).sum()
        };
        (0..parts as i32).map(|k| around_mean(of_part(k))).sum()
    }

    #[test]
    fn parts_get_compact_and_equally_large_from_slices_of_a_graded_cloud() {
        let points = graded();
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|&a, &b| points[a][1].total_cmp(&points[b][1]));
        let mut part = vec![0; points.len()];
        order.iter().enumerate().for_each(|(at, &k)| part[k] = (at / 250) as i32);
        let before = inertia(&points, &part, 16);
        compact(&points, &mut part, 16);
        let sizes: Vec<usize> = (0..16).map(|k| part.iter().filter(|&&part| part == k).count()).collect();
        assert!(sizes.iter().all(|&size| size.abs_diff(250) <= 25), "{sizes:?}");
        let after = inertia(&points, &part, 16);
        assert!(after < 0.5 * before, "{after} of {before}");
    }

    #[test]
    fn the_order_of_elements_does_not_matter() {
        let points = graded();
        let mut part: Vec<i32> = (0..points.len() as i32).map(|k| k / 400).collect();
        let mut reversed: Vec<i32> = part.iter().rev().copied().collect();
        compact(&points, &mut part, 10);
        compact(&points.iter().rev().copied().collect::<Vec<_>>(), &mut reversed, 10);
        reversed.reverse();
        assert_eq!(part, reversed);
    }

    #[test]
    fn fewer_elements_than_parts_and_elements_in_one_place_stay_in_some_part() {
        for points in [vec![[0.0; 3]], vec![[1.0; 3]; 5], vec![[0.0; 3], [1.0, 0.0, 0.0]]] {
            let mut part: Vec<i32> = (0..points.len() as i32).collect();
            compact(&points, &mut part, 7);
            assert!(part.iter().all(|part| (0..7).contains(part)), "{part:?}");
        }
    }
}
