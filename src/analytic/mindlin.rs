//! A cylinder, or a ball, that is pressed on a half space and then pushed along it, with friction: Cattaneo and Mindlin (Johnson,
//! Contact Mechanics, 1985, 7.2). The cylinder is in plane strain:
//!
//! ```text
//! a^2 = 4 P R / (pi E*),   p(x) = p0 sqrt(1 - x^2/a^2),   p0 = 2 P / (pi a),   c/a = sqrt(1 - Q / (mu P))
//! q(x) = mu p0 (sqrt(1 - x^2/a^2) - c/a sqrt(1 - x^2/c^2))
//! ```
//!
//! It sticks within `c`. `1/E*` is the sum of `(1 - nu^2) / E` of both bodies; pressures must not move surfaces along each other,
//! which holds for equal materials, and for a rigid body on one that keeps its volume. `P` and `Q` are forces on a unit of length.

use std::f64::consts::PI;

use super::bisect;
use crate::material::VonMises;

/// The contact under both forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Half of the width `a` of the contact.
    pub half: f64,
    /// Pressure in its middle.
    pub peak: f64,
    /// Half of the width `c` that sticks.
    pub sticking: f64,
    friction: f64,
}

impl Line {
    /// Of a cylinder of this radius, pressed on by one force and pushed by the other, which is below what makes all of it slip.
    pub fn new(modulus: f64, radius: f64, friction: f64, [pressed, pushed]: [f64; 2]) -> Self {
        let half = (4.0 * pressed * radius / (PI * modulus)).sqrt();
        let sticking = half * (1.0 - pushed / (friction * pressed)).sqrt();
        Self { half, peak: 2.0 * pressed / (PI * half), sticking, friction }
    }

    /// Pressure at a distance from the middle.
    pub fn pressure(&self, x: f64) -> f64 {
        self.peak * arch(x / self.half)
    }

    /// Friction stress at a distance from the middle.
    pub fn traction(&self, x: f64) -> f64 {
        let held = self.sticking / self.half * arch(x / self.sticking);
        self.friction * self.peak * (arch(x / self.half) - held)
    }

    /// The half width that sticks, from that of the contact and the mean square `m` of the distance under the friction stress: these
    /// have `4 m = a^2 + c^2`.
    pub fn sticking_of(half: f64, mean_square: f64) -> f64 {
        (4.0 * mean_square - half * half).max(0.0).sqrt()
    }
}

/// A rigid ball on a half space that is pressed and pushed. Friction acts along the push, and the surface does not move across it:
/// so it is without Poisson's ratio, and nearly so with one.
///
/// ```text
/// c/a = (1 - Q / (mu P))^(1/3),   moves by 3 mu P / (16 a) (2 - nu) / G (1 - c^2/a^2)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Radius `c` of what sticks.
    pub sticking: f64,
    /// How far the half space is moved along, far from the ball.
    pub moved: f64,
}

impl Ball {
    /// Of a contact of radius `a`, with the forces `P` and `Q`.
    pub fn new(material: &VonMises, radius: f64, friction: f64, [pressed, pushed]: [f64; 2]) -> Self {
        let share = (1.0 - pushed / (friction * pressed)).cbrt();
        let compliance = 2.0 * (1.0 + material.poisson) * (2.0 - material.poisson) / material.young;
        let moved = 3.0 * friction * pressed / (16.0 * radius) * compliance * (1.0 - share * share);
        Self { sticking: share * radius, moved }
    }

    /// The radius that sticks, from that of the contact and the mean square of the distance under the friction stress, which is
    /// `2/5 (a^5 - c^5) / (a^3 - c^3)`.
    pub fn sticking_of(radius: f64, mean_square: f64) -> f64 {
        let square = |c: f64| 0.4 * (radius.powi(5) - c.powi(5)) / (radius.powi(3) - c.powi(3));
        bisect(0.0, radius, |c| square(c) < mean_square)
    }
}

fn arch(x: f64) -> f64 {
    (1.0 - x * x).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two bodies of steel, and a radius of 50; the numbers are those of an independent program.
    fn line() -> Line {
        Line::new(210_000.0 / (2.0 * 0.91), 50.0, 0.3, [1000.0, 150.0])
    }

    #[test]
    fn steel_on_steel() {
        let Line { half, peak, sticking, .. } = line();
        for (found, known) in [(half, 0.742790102285), (peak, 857.065502636), (sticking, 0.525231918324)] {
            assert!((found / known - 1.0).abs() < 1e-10, "{found} {known}");
        }
        assert!((line().traction(0.0) / 75.308602140 - 1.0).abs() < 1e-10);
    }

    #[test]
    fn stresses_add_up_to_the_forces_and_the_mean_square_gives_the_width_that_sticks() {
        let line = line();
        // Over x = a sin t.
        let count = 40_000;
        let integral = |of: &dyn Fn(f64) -> f64| -> f64 {
            let at = |k: usize| ((k as f64 + 0.5) / count as f64 - 0.5) * PI;
            (0..count).map(|k| of(line.half * at(k).sin()) * line.half * at(k).cos()).sum::<f64>() * PI / count as f64
        };
        let [pressed, pushed] = [integral(&|x| line.pressure(x)), integral(&|x| line.traction(x))];
        assert!((pressed / 1000.0 - 1.0).abs() < 1e-6 && (pushed / 150.0 - 1.0).abs() < 1e-6, "{pressed} {pushed}");
        let square = integral(&|x| x * x * line.traction(x)) / pushed;
        assert!((Line::sticking_of(line.half, square) / line.sticking - 1.0).abs() < 1e-5, "{square}");
    }

    /// Two equal balls move by twice as much as each; the numbers are those of an independent program.
    #[test]
    fn a_ball_sticks_within_a_circle() {
        let Ball { sticking, moved } =
            Ball::new(&VonMises::elastic(210_000.0, 0.3), 0.687534433537, 0.3, [1000.0, 150.0]);
        assert!((sticking / 0.545696441531 - 1.0).abs() < 1e-10, "{sticking}");
        assert!((2.0 * moved / 1.274409792e-3 - 1.0).abs() < 1e-9, "{moved}");
        // Over r = a sin t.
        let (a, c, count) = (1.0, 0.7, 40_000);
        let stress = |r: f64| arch(r / a) - c / a * arch(r / c);
        let integral = |power: i32| -> f64 {
            let at = |k: usize| (k as f64 + 0.5) / count as f64 * 0.5 * PI;
            (0..count).map(|k| at(k).sin().powi(power) * stress(at(k).sin()) * at(k).cos()).sum()
        };
        let found = Ball::sticking_of(a, integral(3) / integral(1));
        assert!((found / c - 1.0).abs() < 1e-5, "{found}");
    }
}
