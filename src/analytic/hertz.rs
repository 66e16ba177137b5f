//! A rigid ball on an elastic half space: Hertz (Johnson, Contact Mechanics, 1985, 4.2).
//!
//! ```text
//! a^3 = 3 P R / (4 E*),   p(r) = p0 sqrt(1 - r^2/a^2),   p0 = 3 P / (2 pi a^2),   approach = a^2 / R,   E* = E / (1 - nu^2)
//! ```

use std::f64::consts::PI;

use crate::material::VonMises;

/// The contact of a ball under a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hertz {
    /// Radius a of the circle of contact.
    pub radius: f64,
    /// Pressure p0 in its middle.
    pub peak: f64,
    /// How far the ball comes down.
    pub approach: f64,
}

impl Hertz {
    /// Of a ball of radius `ball` that is pressed on by `force`.
    pub fn new(material: &VonMises, ball: f64, force: f64) -> Self {
        let modulus = material.young / (1.0 - material.poisson * material.poisson);
        let radius = (0.75 * force * ball / modulus).cbrt();
        Self { radius, peak: 1.5 * force / (PI * radius * radius), approach: radius * radius / ball }
    }

    /// Pressure at a distance from the middle.
    pub fn pressure(&self, r: f64) -> f64 {
        self.peak * (1.0 - (r / self.radius).powi(2)).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pressure adds up to the force, and by Boussinesq's solution it presses the middle down by the approach.
    #[test]
    fn the_pressure_carries_the_force_and_makes_the_approach() {
        let material = VonMises::elastic(210_000.0, 0.3);
        let (ball, force) = (100.0, 1500.0);
        let state = Hertz::new(&material, ball, force);
        // Over r = a sin t, where the integrands are smooth.
        let steps = 2000;
        let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
            let at = |k: usize| (k as f64 + 0.5) / steps as f64 * 0.5 * PI;
            let term = |t: f64| f(state.radius * t.sin()) * state.radius * t.cos();
            (0..steps).map(|k| term(at(k))).sum::<f64>() * 0.5 * PI / steps as f64
        };
        let total = integral(&|r| 2.0 * PI * r * state.pressure(r));
        assert!((total / force - 1.0).abs() < 1e-6, "{total}");
        let modulus = material.young / (1.0 - 0.09);
        let middle = integral(&|r| 2.0 * state.pressure(r) / modulus);
        assert!((middle / state.approach - 1.0).abs() < 1e-6, "{middle}");
    }
}
