//! Nonnegative least squares, small and dense: min |A x - b| over { x >= 0 }.
//!
//! The active set method of Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23: one column at a time
//! joins, columns that would turn negative leave. At the end the residual r = b - A x has A'r <= 0 and x'A'r = 0. So if r is
//! not zero no nonnegative x reaches b, and r shows why: b'r = |r|^2 > 0, but no column goes along r (Farkas).

use crate::vector::{axpy, dot, length};

/// Share of |b| that a unit column must have along the residual to join, and share of a column that must be new.
const ROUNDING: f64 = 1e-12;

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Shares {
    /// The unknowns, not negative.
    pub x: Vec<f64>,
    /// `b - A x`.
    pub residual: Vec<f64>,
}

/// Solves the problem for the columns of A, each as long as b.
pub fn solve(columns: &[Vec<f64>], b: &[f64]) -> Shares {
    let norms: Vec<f64> = columns.iter().map(length).collect();
    let threshold = ROUNDING * length(b);
    let mut x = vec![0.0; columns.len()];
    // Columns with a positive share, and those that rounding keeps from joining at the present residual.
    let (mut joined, mut barred) = (Vec::new(), vec![false; columns.len()]);
    let mut residual = b.to_vec();
    // In exact arithmetic the residual shrinks with every set; rounding must not go on for ever.
    for _ in 0..3 * (columns.len() + b.len()) {
        let free = (0..columns.len()).filter(|k| !barred[*k] && !joined.contains(k) && norms[*k] > 0.0);
        let steepness = free.map(|k| (k, dot(&columns[k], &residual) / norms[k]));
        let steepest = steepness.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let Some((new, _)) = steepest.filter(|(_, along)| *along > threshold) else { break };
        if join(columns, b, new, &mut joined, &mut x) {
            barred.fill(false);
            residual.copy_from_slice(b);
            joined.iter().for_each(|&k| axpy(-x[k], &columns[k], &mut residual));
        } else {
            barred[new] = true;
        }
    }
    Shares { x, residual }
}

/// The `y` of the smallest norm with `row . y <= bound` for all rows, or `None` if there is none.
///
/// Least distance programming by nonnegative least squares (Lawson and Hanson, 23.4).
pub fn least_distance(rows: &[Vec<f64>], bounds: &[f64]) -> Option<Vec<f64>> {
    let scale = bounds.iter().fold(0.0_f64, |scale, bound| scale.max(bound.abs()));
    let n = rows.first()?.len();
    if scale == 0.0 {
        return Some(vec![0.0; n]);
    }
    let column = |(row, bound): (&Vec<f64>, &f64)| row.iter().chain([&(bound / scale)]).map(|x| -x).collect();
    let columns: Vec<Vec<f64>> = rows.iter().zip(bounds).map(column).collect();
    let mut target = vec![0.0; n + 1];
    target[n] = 1.0;
    let Shares { residual, .. } = solve(&columns, &target);
    let last = residual[n];
    (length(&residual) > FEASIBLE).then(|| residual[..n].iter().map(|r| -scale * r / last).collect())
}

/// A smaller residual means that the constraints contradict each other.
const FEASIBLE: f64 = 1e-9;

/// Lets a column join, and others leave; false if it is nothing new or would get no positive share.
fn join(columns: &[Vec<f64>], b: &[f64], new: usize, joined: &mut Vec<usize>, x: &mut [f64]) -> bool {
    joined.push(new);
    let shares = least_squares(columns, joined, b).filter(|shares| shares[joined.len() - 1] > 0.0);
    let Some(mut shares) = shares else {
        joined.pop();
        return false;
    };
    loop {
        let step = |(&k, &share): (&usize, &f64)| if share > 0.0 { f64::INFINITY } else { x[k] / (x[k] - share) };
        let steps: Vec<f64> = joined.iter().zip(&shares).map(step).collect();
        let shortest = steps.iter().copied().fold(1.0, f64::min);
        for ((&k, share), step) in joined.iter().zip(&shares).zip(&steps) {
            x[k] = if *step <= shortest { 0.0 } else { x[k] + shortest * (share - x[k]) };
        }
        if shortest == 1.0 {
            return true;
        }
        joined.retain(|&k| x[k] > 0.0);
        match least_squares(columns, joined, b) {
            Some(fewer) => shares = fewer,
            None => return true,
        }
    }
}

/// The shares of some columns that come nearest to b; `None` if the last column depends on the others to rounding.
fn least_squares(columns: &[Vec<f64>], chosen: &[usize], b: &[f64]) -> Option<Vec<f64>> {
    let (mut directions, mut triangle): (Vec<Vec<f64>>, Vec<Vec<f64>>) = Default::default();
    for &k in chosen {
        let (mut rest, mut shares) = (columns[k].clone(), vec![0.0; directions.len()]);
        // Twice is enough (Kahan and Parlett).
        for _ in 0..2 {
            for (direction, share) in directions.iter().zip(&mut shares) {
                let along = dot(direction, &rest);
                axpy(-along, direction, &mut rest);
                *share += along;
            }
        }
        let left = length(&rest);
        if left <= ROUNDING * length(&columns[k]) {
            return None;
        }
        rest.iter_mut().for_each(|x| *x /= left);
        shares.push(left);
        directions.push(rest);
        triangle.push(shares);
    }
    let mut x: Vec<f64> = directions.iter().map(|direction| dot(direction, b)).collect();
    for k in (0..x.len()).rev() {
        x[k] /= triangle[k][k];
        for row in 0..k {
            x[row] -= triangle[k][row] * x[k];
        }
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn random(rows: usize, columns: usize, seed: u64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut random = Random::new(seed);
        let mut vector = || (0..rows).map(|_| random.number()).collect::<Vec<f64>>();
        ((0..columns).map(|_| vector()).collect(), vector())
    }

    /// The smallest residual over all sets of columns whose least squares are not negative.
    fn enumerated(columns: &[Vec<f64>], b: &[f64]) -> f64 {
        let mut best = length(b);
        for set in 1..1_usize << columns.len() {
            let chosen: Vec<usize> = (0..columns.len()).filter(|k| set >> k & 1 == 1).collect();
            let Some(x) = least_squares(columns, &chosen, b).filter(|x| x.iter().all(|x| *x >= 0.0)) else { continue };
            let mut residual = b.to_vec();
            chosen.iter().zip(x).for_each(|(&k, x)| axpy(-x, &columns[k], &mut residual));
            best = best.min(length(&residual));
        }
        best
    }

    #[test]
    fn equals_enumeration_and_its_residual_is_a_certificate() {
        let (mut reached, mut missed) = (0, 0);
        for seed in 0..200 {
            let (mut columns, b) = random(4, 8, seed);
            // One column is twofold, one is nothing, one depends on two others.
            columns[5] = columns[2].clone();
            columns[6] = vec![0.0; 4];
            columns[7] = columns[0].iter().zip(&columns[1]).map(|(a, b)| a + b).collect();
            let Shares { x, residual } = solve(&columns, &b);
            assert!((length(&residual) - enumerated(&columns, &b)).abs() < 1e-9, "{seed}");
            for (x, column) in x.iter().zip(&columns) {
                let along = dot(column, &residual);
                assert!(*x >= 0.0 && along < 1e-9 && (x * along).abs() < 1e-9);
            }
            if length(&residual) > 1e-9 { missed += 1 } else { reached += 1 }
        }
        assert!(reached > 20 && missed > 20, "{reached} {missed}");
    }

    #[test]
    fn scales_do_not_matter() {
        let (columns, b) = random(6, 30, 3);
        let scaled: Vec<Vec<f64>> =
            (0..).zip(&columns).map(|(k, c)| c.iter().map(|x| x * 10_f64.powi(k - 15)).collect()).collect();
        let [plain, scaled] = [solve(&columns, &b), solve(&scaled, &b)].map(|s| length(&s.residual));
        assert!((plain - scaled).abs() < 1e-9, "{plain} {scaled}");
    }

    #[test]
    fn the_least_distance_is_that_of_the_nearest_point() {
        let (rows, bounds) = ([vec![1.0, 0.0], vec![-1.0, -1.0]], [5.0, -2.0]);
        let nearest = least_distance(&rows, &bounds).expect("there are such points");
        assert!(nearest.iter().all(|y| (y - 1.0).abs() < 1e-12), "{nearest:?}");
        assert_eq!(least_distance(&rows, &[5.0, 0.0]).map(|y| length(&y)), Some(0.0));
        assert_eq!(least_distance(&[vec![1.0], vec![-1.0]], &[-1.0, -1.0]), None);
        let mut found_any = 0;
        for seed in 0..50 {
            let (rows, bounds) = random(3, 6, seed);
            let bounds: Vec<f64> = bounds.iter().chain(&rows[0]).map(|b| b - 0.3).collect();
            let fits = |y: &[f64]| rows.iter().zip(&bounds).all(|(row, bound)| dot(row, y) <= bound + 1e-9);
            let found = least_distance(&rows, &bounds);
            assert!(found.as_ref().is_none_or(|found| fits(found)), "{seed}");
            found_any += usize::from(found.as_ref().is_some_and(|found| length(found) > 0.0));
            // No point of a cloud is nearer, or fits at all where there is no solution.
            let distance = found.map_or(f64::INFINITY, |found| length(&found));
            let mut random = Random::new(seed);
            for _ in 0..2000 {
                let y: [f64; 3] = random.vector(3.0);
                assert!(!fits(&y) || length(y) >= distance - 1e-9, "{seed}");
            }
        }
        assert!(found_any > 10, "{found_any}");
    }
}
