//! Cycles of one stress: loading, unloading, reloading along one direction of stress space.
//!
//! With the equivalent stress s (signed) and the equivalent plastic strain p along that direction, the rate equations of
//! von Mises material with linear hardening are those of one bar: |s - C p| <= sigma_y + H kappa, kappa grows with |p|.
//! Along a monotone part of the path they integrate to a straight line.

use crate::material::{Law, VonMises};

/// A bar of von Mises material at some point of its path.
///
/// Uniaxial: s is the stress, p the axial plastic strain. Shear: s is sqrt(3) times the stress, p the engineering plastic
/// shear over sqrt(3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    material: VonMises,
    /// Signed equivalent stress.
    pub stress: f64,
    /// Signed equivalent plastic strain.
    pub plastic: f64,
    /// Accumulated plastic strain.
    pub kappa: f64,
}

impl Cycle {
    /// The virgin state.
    pub fn new(material: VonMises) -> Self {
        Self { material, stress: 0.0, plastic: 0.0, kappa: 0.0 }
    }

    /// Goes on to another stress. Beyond yield H + C > 0 is needed: with perfect plasticity no such stress exists.
    pub fn load(&mut self, stress: f64) {
        let VonMises { yield_stress, hardening, kinematic_hardening, .. } = self.material;
        self.stress = stress;
        let Some(initial) = yield_stress else { return };
        let relative = stress - kinematic_hardening * self.plastic;
        let excess = relative.abs() - (initial + hardening * self.kappa);
        if excess > 0.0 {
            let flow = excess / (hardening + kinematic_hardening);
            self.plastic += flow.copysign(relative);
            self.kappa += flow;
        }
    }

    /// Goes on to another strain along the same uniaxial stress.
    pub fn stretch(&mut self, strain: f64) {
        let VonMises { young, yield_stress, hardening, kinematic_hardening, .. } = self.material;
        let trial = young * (strain - self.plastic);
        let relative = trial - kinematic_hardening * self.plastic;
        let excess = yield_stress.map_or(0.0, |initial| relative.abs() - (initial + hardening * self.kappa));
        let flow = excess.max(0.0) / (young + hardening + kinematic_hardening);
        self.plastic += flow.copysign(relative);
        self.kappa += flow;
        self.stress = young * (strain - self.plastic);
    }

    /// Total strain along a uniaxial stress, and across it.
    pub fn uniaxial(&self) -> [f64; 2] {
        let elastic = self.stress / self.material.young;
        [elastic + self.plastic, -self.material.poisson * elastic - self.plastic / 2.0]
    }

    /// Total engineering shear, where the shear stress is the equivalent stress over sqrt(3).
    pub fn shear(&self) -> f64 {
        let root = 3f64.sqrt();
        self.stress / root / self.material.hooke().shear_modulus() + root * self.plastic
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::homogeneous;
    use crate::material::samples::STEEL;

    fn close(value: f64, expected: f64) {
        assert!((value - expected).abs() <= 1e-14 * expected.abs(), "{value} is not {expected}");
    }

    #[test]
    fn the_first_load_is_the_homogeneous_state() {
        for stress in [-600.0, 200.0, 500.0] {
            let mut bar = Cycle::new(STEEL);
            bar.load(stress);
            let strain = homogeneous::uniaxial(&STEEL, stress);
            close(bar.uniaxial()[0], strain[0]);
            close(bar.uniaxial()[1], strain[1]);
            bar = Cycle::new(STEEL);
            bar.load(3f64.sqrt() * stress);
            close(bar.shear(), homogeneous::pure_shear(&STEEL, stress)[3]);
        }
    }

    /// By hand, H = 10000, sigma_y = 450: loaded to 500 the bar has flowed by 0.005 and yields again at -500 if it hardens
    /// isotropically, at -400 if kinematically.
    #[test]
    fn reversed_yield_tells_the_hardenings_apart() {
        let kinematic = VonMises { hardening: 0.0, kinematic_hardening: 10000.0, ..STEEL };
        for (material, limit) in [(STEEL, -500.0), (kinematic, -400.0)] {
            let mut bar = Cycle::new(material);
            for (stress, plastic, kappa) in
                [(500.0, 0.005, 0.005), (0.0, 0.005, 0.005), (limit, 0.005, 0.005), (limit - 100.0, -0.005, 0.015)]
            {
                bar.load(stress);
                close(bar.plastic, plastic);
                close(bar.kappa, kappa);
            }
        }
    }

    /// Driven by the strain of each state, or by its stress in any number of parts, the bar takes the same path.
    #[test]
    fn strain_and_stress_drive_alike() {
        let material = VonMises { hardening: 4000.0, kinematic_hardening: 7000.0, ..STEEL };
        let [mut by_stress, mut by_strain, mut in_parts] = [Cycle::new(material); 3];
        for stress in [480.0, 700.0, -300.0, -800.0, 0.0] {
            let from = in_parts.stress;
            (1..=10).for_each(|k| in_parts.load(from + f64::from(k) / 10.0 * (stress - from)));
            by_stress.load(stress);
            by_strain.stretch(by_stress.uniaxial()[0]);
            for other in [by_strain, in_parts] {
                assert!((other.stress - stress).abs() < 1e-9);
                assert!((other.plastic - by_stress.plastic).abs() < 1e-14);
                assert!((other.kappa - by_stress.kappa).abs() < 1e-14);
            }
        }
    }
}
