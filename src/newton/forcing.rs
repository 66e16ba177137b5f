//! How exactly the next quadratic program is solved.
//!
//! Far from the solution a step need not be more exact than the model it minimises: the gradient is reduced by a factor
//! that follows a power of the residual's last decrease, r^1.618 (Eisenstat and Walker, SIAM J. Sci. Comput. 17 (1996), choice 2, with
//! the power that they found best). The square solves programs more exactly than steps deserve where elements begin to yield and nodes to
//! slip. The tolerance of the scene is the floor, lowered where the true residual shows that it is not enough.

use serde::{Deserialize, Serialize};

/// Reduction of the gradient in the first step, ...
const FIRST: f64 = 0.1;
/// ... and where it may be the last: an accuracy ends the iteration as soon as the estimate of the error allows.
const ONLY: f64 = 0.01;
/// The least reduction in later steps.
pub const LOOSEST: f64 = 0.03;
/// The strongest reduction: more would not speed Newton's method up, and factors in single precision allow this one.
pub const TIGHTEST: f64 = 1e-4;
/// Factor on a power of the decrease of the residual ...
const SHARE: f64 = 0.9;
/// ... and the power, the golden ratio.
const POWER: f64 = 1.618;
/// Changes of a tangent's entries over the rate of Newton's method with the old one: a rate of 0.12 was seen where they were below 0.03.
const STALE: f64 = 0.3;
/// How much more exactly a step is solved again.
const AGAIN: f64 = 0.01;
/// The floor in the beginning: at the scene's tolerance itself the last true residual is just above the one that is enough, more
/// often than not.
const FLOOR: f64 = 0.5;
/// What the floor is lowered by beyond the ratio of wanted to true residual.
const MARGIN: f64 = 0.3;
/// How many times the error of the subdomains' own problems may be of what it is estimated to be.
const LOCAL: f64 = 10.0;

/// Accuracy of a quadratic program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forcing {
    /// Reduce the first gradient of the program by this factor ...
    pub drop: f64,
    /// ... but not below the scene's tolerance times this.
    pub floor: f64,
    /// A tangent whose entries have changed by less, relative to its diagonal, is not renewed: Newton's method with the old one
    /// reduces the residual by what is still needed.
    pub left: f64,
}

impl Forcing {
    /// For the first step, which an `accuracy` may end the iteration after.
    pub fn first(accuracy: Option<f64>) -> Self {
        Self { drop: if accuracy.is_some() { ONLY } else { FIRST }, floor: FLOOR, left: 0.0 }
    }

    /// For the step after one that brought the true residual from `before` to `after`, where `wanted` is enough in the
    /// end. `at_floor` says that the program was solved to the floor; the subdomains' own problems were solved up to `local`,
    /// relative, which is not for a program to mend.
    pub fn update(&mut self, (before, after): (f64, f64), wanted: f64, (at_floor, local): (bool, f64)) {
        let ratio = after / before;
        self.left = STALE * (wanted / after).min(LOOSEST);
        self.drop = (SHARE * ratio.powf(POWER)).clamp(TIGHTEST, LOOSEST);
        if at_floor && after > wanted.max(LOCAL * local * before) {
            self.floor *= (MARGIN * wanted / after).max(TIGHTEST);
        }
    }

    /// For another attempt at a step that did not lower the energy.
    pub fn tighten(&mut self) {
        self.drop *= AGAIN;
        self.floor *= AGAIN;
        self.left = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_follows_the_residual() {
        let mut forcing = Forcing::first(None);
        forcing.update((1.0, 0.5), 1e-6, (false, 0.0));
        assert_eq!(forcing, Forcing { drop: LOOSEST, floor: FLOOR, left: STALE * 2e-6 });
        forcing.update((0.5, 0.05), 1e-6, (false, 0.0));
        assert!((forcing.drop - SHARE * 0.1_f64.powf(POWER)).abs() < 1e-15);
        forcing.update((0.05, 1e-5), 1e-6, (true, 0.0));
        assert_eq!((forcing.drop, forcing.left), (TIGHTEST, STALE * LOOSEST));
        assert!((forcing.floor - FLOOR * 0.1 * MARGIN).abs() < 1e-15);
    }

    #[test]
    fn what_the_subdomains_left_does_not_lower_the_floor() {
        let mut forcing = Forcing::first(None);
        forcing.update((1e-4, 1e-9), 1e-11, (true, 1e-6));
        assert_eq!(forcing.floor, FLOOR);
        forcing.update((1e-4, 1e-8), 1e-11, (true, 1e-6));
        assert!(forcing.floor < FLOOR);
    }
}
