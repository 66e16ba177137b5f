//! A ring that is pressed into another: Lame's cylinders in plane stress (Timoshenko and Goodier, Theory of Elasticity, 1951, 26).

use std::f64::consts::PI;

/// Two rings of one material with an interference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressFit {
    /// Young's modulus.
    pub young: f64,
    /// Radii: the bore of the inner ring, where they meet, the outside of the outer one.
    pub radii: [f64; 3],
    /// By how much the radius of the inner ring is too large.
    pub interference: f64,
    /// Along the axis.
    pub length: f64,
}

impl PressFit {
    /// Pressure between them: `d E / b` over `(c^2 + b^2) / (c^2 - b^2) + (b^2 + a^2) / (b^2 - a^2)`. Poisson's ratio drops out.
    pub fn pressure(&self) -> f64 {
        let [a, b, c] = self.radii.map(|radius| radius * radius);
        self.interference * self.young / self.radii[1] / ((c + b) / (c - b) + (b + a) / (b - a))
    }

    /// Force that the rings press each other with.
    pub fn force(&self) -> f64 {
        self.pressure() * 2.0 * PI * self.radii[1] * self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each ring moves by its own share, and both together by the interference; by displacements with a Poisson's ratio.
    #[test]
    fn both_rings_together_give_way_by_the_interference() {
        let fit = PressFit { young: 196_000.0, radii: [10.0, 20.0, 30.0], interference: 0.0025, length: 19.0 };
        let (p, [a, b, c], nu) = (fit.pressure(), fit.radii, 0.3);
        // u = ((1 - nu) A r + (1 + nu) B / r) / E with the stresses A -+ B / r^2.
        let moved = |mean: f64, swing: f64| ((1.0 - nu) * mean * b + (1.0 + nu) * swing / b) / fit.young;
        let hub = moved(p * b * b / (c * c - b * b), p * b * b * c * c / (c * c - b * b));
        let shaft = moved(-p * b * b / (b * b - a * a), -p * a * a * b * b / (b * b - a * a));
        assert!((hub - shaft - fit.interference).abs() < 1e-15, "{hub} {shaft}");
        assert!((p - 5.742).abs() < 1e-3 && (0.1 * fit.force() - 1371.0).abs() < 1.0, "{p} {}", fit.force());
    }
}
