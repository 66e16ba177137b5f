//! How much of the error the next mesh is to leave.
//!
//! A mesh aims at the wanted error, a little less. What bisections leave is foretold ([`super::marking`]) as if the solution was singular in
//! part. Where it is smooth they leave less, at edges more. The refinement before tells how much:
//!
//! ```text
//! left = marked^p,   so   marked = share^(1/p)
//! ```
//!
//! Far from the goal elements are marked for `LEAST`, or a share of which edges leave `LEAST`. Measured: `p` was 0.7 to 0.85 where most of
//! the error is at edges, 1.4 to 1.9 where solutions are smooth. It is 1 for the first refinement.

use super::error::is_known;
use crate::record::rows::RefinementRow;
use crate::scene::ErrorOf;

/// Further off neither the estimate nor the marks are to be trusted.
const LEAST: f64 = 0.4;
/// This share of the wanted error: less is left than was foretold.
const AIM: f64 = 0.85;
/// Where that is too large a mesh, these shares are tried.
const SMALLER: [f64; 3] = [0.6, 0.75, 0.9];
/// The range of `p`: meshes that resolve nothing yet tell less. Not all that is told above 1 is believed, for a mesh that just misses the goal
/// costs another one.
const POWERS: [f64; 2] = [0.8, 1.3];

/// The shares of the sum of all parts that elements can be marked for, the best one first; the mesh of each is smaller than that of
/// the one before. At least one mesh was solved on.
pub fn shares(of: &ErrorOf, goal: f64, meshes: &[RefinementRow]) -> Vec<f64> {
    let power = power(of, goal, meshes);
    let best = marked(of, goal, meshes, power);
    let smaller = SMALLER.map(|share| share.powf(1.0 / power)).into_iter().filter(|&smaller| smaller > best);
    std::iter::once(best).chain(smaller).collect()
}

/// The share that elements are marked for after the last of these meshes.
fn marked(of: &ErrorOf, goal: f64, meshes: &[RefinementRow], power: f64) -> f64 {
    let found = meshes.last().map_or(f64::MAX, |row| row.error);
    let share = (AIM * goal / found).min(SMALLER[2]);
    let share = match of {
        // Nearly the same mesh would not tell more.
        ErrorOf::Goal(_) if !is_known(of, meshes) => 0.0,
        ErrorOf::Energy | ErrorOf::Goal(_) => share,
        // Its parts are squares.
        ErrorOf::Stress => share.powi(2),
    };
    share.powf(1.0 / power).max(LEAST.powf((1.0 / power).max(1.0)))
}

/// `p`, of the last refinement.
fn power(of: &ErrorOf, goal: f64, meshes: &[RefinementRow]) -> f64 {
    (1..meshes.len()).fold(1.0, |power, mesh| {
        let left = parts(of, &meshes[mesh]) / parts(of, &meshes[mesh - 1]);
        let told = left.ln() / marked(of, goal, &meshes[..mesh], power).ln();
        if told.is_nan() { power } else { told.clamp(POWERS[0], POWERS[1]) }
    })
}

/// The sum of all parts.
fn parts(of: &ErrorOf, row: &RefinementRow) -> f64 {
    match of {
        ErrorOf::Energy => row.distance,
        ErrorOf::Goal(_) => row.goal.map_or(0.0, |goal| goal.distance),
        ErrorOf::Stress => row.stress.powi(2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOAL: f64 = 0.01;

    /// Errors are the distances over 100.
    fn mesh(distance: f64) -> RefinementRow {
        RefinementRow { distance, error: distance / 100.0, stress: distance.sqrt(), ..RefinementRow::default() }
    }

    fn of(meshes: &[RefinementRow]) -> Vec<f64> {
        shares(&ErrorOf::Energy, GOAL, meshes)
    }

    #[test]
    fn a_refinement_leaves_what_is_wanted_when_the_one_before_told_what_is_left() {
        for power in [0.85, 1.0, 1.25] {
            let mut meshes = vec![mesh(20.0)];
            while meshes.last().unwrap().error > GOAL {
                let marked = of(&meshes)[0];
                meshes.push(mesh(meshes.last().unwrap().distance * marked.powf(power)));
            }
            let left = |mesh: usize| meshes[mesh].distance / meshes[mesh - 1].distance;
            assert!((left(1) - LEAST.powf(power)).abs() < 1e-12, "nothing is known at first");
            assert!((left(2) - LEAST.powf(power.max(1.0))).abs() < 1e-12, "{power}: {}", left(2));
            let last = meshes.last().unwrap().error;
            assert!((last - AIM * GOAL).abs() < 1e-12, "{power}: {last}");
        }
    }

    #[test]
    fn shares_are_those_of_smaller_and_smaller_meshes() {
        assert_eq!(of(&[mesh(20.0)]), [0.4, 0.6, 0.75, 0.9]);
        assert_eq!(of(&[mesh(1.7)]), [0.5, 0.6, 0.75, 0.9]);
        assert_eq!(of(&[mesh(0.5)]), [0.9], "near the goal already: a mesh to compare with");
        let unresolved = of(&[mesh(20.0), mesh(30.0)]);
        assert_eq!(unresolved, [LEAST, 0.6, 0.75, 0.9].map(|share| share.powf(1.0 / POWERS[0])));
        assert_eq!(of(&[mesh(2.0), mesh(0.0)]), [0.9_f64.powf(1.0 / POWERS[1])], "nothing was left");
        let squares = shares(&ErrorOf::Stress, GOAL, &[mesh(20.0)]);
        assert!((squares[0] - 0.4).abs() < 1e-15 && squares.len() == 4);
    }
}
