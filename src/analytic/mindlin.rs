//! A cylinder that is pressed on a half space and then pushed along it, with friction, in plane strain: Cattaneo and Mindlin (Johnson,
//! Contact Mechanics, 1985, 7.2).
//!
//! ```text
//! a^2 = 4 P R / (pi E*),   p(x) = p0 sqrt(1 - x^2/a^2),   p0 = 2 P / (pi a),   c/a = sqrt(1 - Q / (mu P))
//! q(x) = mu p0 (sqrt(1 - x^2/a^2) - c/a sqrt(1 - x^2/c^2))
//! ```
//!
//! It sticks within `c`. `1/E*` is the sum of `(1 - nu^2) / E` of both bodies; pressures must not move surfaces along each other,
//! which holds for equal materials, and for a rigid body on one that keeps its volume. `P` and `Q` are forces on a unit of length.

use std::f64::consts::PI;

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
}
