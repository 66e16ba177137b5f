//! A thick sphere under pressure: von Mises with linear isotropic hardening, spherically symmetric.
//!
//! The stress deviator keeps its direction, so flow theory and one implicit step agree. With the plastic front c between
//! the radii a and b and h = 2 (1 - nu) (H / E) / (1 + 2 (1 - nu) H / E), the net pressure inside is
//!
//! ```text
//! p(c) = 2 sigma_y ((1 - h) ln(c/a) + (h/3) (c^3/a^3 - 1)) + (2 sigma_y / 3) (1 - c^3/b^3)
//! ```
//!
//! (Hill, The Mathematical Theory of Plasticity, V.2, for H = 0; integrating equilibrium with the hardening term adds
//! the rest.) At every radius sigma_t - sigma_r + E kappa / (2 (1 - nu)) = S / r^3 with S = sigma_y c^3; while all is
//! elastic, S follows from the pressure. A pressure outside superposes a hydrostatic state. Unloading is elastic, or not
//! covered.

use super::bisect;
use crate::material::VonMises;

/// Geometry and material of the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HollowSphere {
    /// Inner radius a > 0.
    pub inner: f64,
    /// Outer radius b > a.
    pub outer: f64,
    pub material: VonMises,
}

/// The sphere under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereState {
    sphere: HollowSphere,
    outside: f64,
    /// S = r^3 (sigma_t - sigma_r) where it is elastic.
    intensity: f64,
    front: f64,
}

impl HollowSphere {
    /// Net inside pressure that brings the plastic front to the radius `front` in [a, b]; infinite without yielding.
    pub fn pressure_of_front(&self, front: f64) -> f64 {
        let Some(limit) = self.material.yield_stress else { return f64::INFINITY };
        let (h, inside) = (self.hardening_share(), cube(front / self.inner));
        2.0 * limit * ((1.0 - h) * (front / self.inner).ln() + h / 3.0 * (inside - 1.0))
            + 2.0 / 3.0 * limit * (1.0 - cube(front / self.outer))
    }

    /// The state under an inside pressure not below the outside one; `None` beyond full plasticity.
    pub fn loaded(&self, inside: f64, outside: f64) -> Option<SphereState> {
        let net = inside - outside;
        let state = |intensity, front| SphereState { sphere: *self, outside, intensity, front };
        if net <= self.pressure_of_front(self.inner) {
            let intensity = 1.5 * net / (1.0 / cube(self.inner) - 1.0 / cube(self.outer));
            return Some(state(intensity, self.inner));
        }
        let limit = self.material.yield_stress.filter(|_| net <= self.pressure_of_front(self.outer))?;
        let front = bisect(self.inner, self.outer, |front| self.pressure_of_front(front) < net);
        Some(state(limit * cube(front), front))
    }

    /// h of the module's formula.
    fn hardening_share(&self) -> f64 {
        let ratio = 2.0 * (1.0 - self.material.poisson) * self.material.hardening / self.material.young;
        ratio / (1.0 + ratio)
    }
}

impl SphereState {
    /// Radius of the plastic front c; the inner radius if nothing has yielded.
    pub fn front(&self) -> f64 {
        self.front
    }

    /// Accumulated plastic strain at radius `r`.
    pub fn kappa(&self, r: f64) -> f64 {
        let m = &self.sphere.material;
        match m.yield_stress {
            Some(limit) if r < self.front => {
                let compliance = 2.0 * (1.0 - m.poisson) / m.young;
                compliance * limit * (cube(self.front / r) - 1.0) / (1.0 + compliance * m.hardening)
            }
            _ => 0.0,
        }
    }

    /// Radial stress at radius `r`.
    pub fn radial_stress(&self, r: f64) -> f64 {
        let from = r.max(self.front);
        let elastic = -2.0 / 3.0 * self.intensity * (1.0 / cube(from) - 1.0 / cube(self.sphere.outer));
        let plastic = match self.sphere.material.yield_stress {
            Some(limit) if r < self.front => {
                let (h, ratio) = (self.sphere.hardening_share(), self.front / r);
                2.0 * limit * ((1.0 - h) * ratio.ln() + h / 3.0 * (cube(ratio) - 1.0))
            }
            _ => 0.0,
        };
        elastic - plastic - self.outside
    }

    /// Hoop stress at radius `r`, the same in both directions.
    pub fn hoop_stress(&self, r: f64) -> f64 {
        self.radial_stress(r) + self.von_mises(r)
    }

    /// Von Mises stress at radius `r`.
    pub fn von_mises(&self, r: f64) -> f64 {
        match self.sphere.material.yield_stress {
            Some(limit) if r < self.front => limit + self.sphere.material.hardening * self.kappa(r),
            _ => self.intensity / cube(r),
        }
    }

    /// Radial displacement at radius `r`, outwards.
    pub fn displacement(&self, r: f64) -> f64 {
        r * self.strains(r)[1]
    }

    /// Strains at radius `r`: radial, and in both directions around.
    pub fn strains(&self, r: f64) -> [f64; 2] {
        let m = &self.sphere.material;
        let shape = (1.0 - m.poisson) * self.intensity / cube(r);
        let (radial, excess) = (self.radial_stress(r), self.von_mises(r));
        // The first is (r times the second)', where r sigma_r' is twice the excess by equilibrium.
        let along = (1.0 - 2.0 * m.poisson) * (radial + 2.0 * excess) - 2.0 * shape;
        [along / m.young, ((1.0 - 2.0 * m.poisson) * radial + shape) / m.young]
    }

    /// What is left when the pressures are taken away, as long as nothing yields on the way back: the difference from the
    /// elastic state under the same pressures. `None` if something does.
    pub fn unloaded(&self) -> Option<Unloaded> {
        let HollowSphere { inner, outer, material } = self.sphere;
        let elastic = VonMises::elastic(material.young, material.poisson);
        let net = -self.radial_stress(inner) - self.outside;
        let back = HollowSphere { inner, outer, material: elastic }.loaded(self.outside + net, self.outside)?;
        // The excess of the elastic state is largest inside, where the yield stress has grown most too.
        let reversed = back.von_mises(inner) - self.von_mises(inner);
        (reversed <= self.von_mises(inner)).then_some(Unloaded { loaded: *self, back })
    }
}

/// A sphere that was loaded and is free again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unloaded {
    loaded: SphereState,
    /// Elastic, under the pressures that are gone.
    back: SphereState,
}

impl Unloaded {
    /// Radial displacement at radius `r`, outwards.
    pub fn displacement(&self, r: f64) -> f64 {
        self.loaded.displacement(r) - self.back.displacement(r)
    }

    /// Strains at radius `r`: radial, and in both directions around.
    pub fn strains(&self, r: f64) -> [f64; 2] {
        let (loaded, back) = (self.loaded.strains(r), self.back.strains(r));
        [loaded[0] - back[0], loaded[1] - back[1]]
    }

    /// Radial stress at radius `r`, and that in both directions around.
    pub fn stresses(&self, r: f64) -> [f64; 2] {
        let radial = self.loaded.radial_stress(r) - self.back.radial_stress(r);
        [radial, self.loaded.hoop_stress(r) - self.back.hoop_stress(r)]
    }
}

fn cube(x: f64) -> f64 {
    x * x * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::samples::STEEL;
    use crate::material::von_mises::PlasticState;
    use crate::material::{Law, Variables};

    const SPHERE: HollowSphere = HollowSphere { inner: 100.0, outer: 200.0, material: STEEL };

    fn close(value: f64, expected: f64, digits: f64) {
        assert!((value - expected).abs() <= digits * expected.abs(), "{value} is not {expected}");
    }

    #[test]
    fn published_numbers() {
        close(SPHERE.pressure_of_front(100.0), 262.5, 1e-14);
        close(SPHERE.pressure_of_front(200.0), 717.327462649, 1e-12);
        for (p, c, ua, ub, kappa) in [
            (300.0, 104.903778, 0.115640618, 0.043910154, 4.401899884e-4),
            (400.0, 119.562732, 0.180039340, 0.065009835, 2.021254364e-3),
            (500.0, 137.231948, 0.293203389, 0.098300847, 4.515852958e-3),
            (600.0, 159.627070, 0.498829762, 0.154707441, 8.742573599e-3),
        ] {
            let state = SPHERE.loaded(p, 0.0).expect("below full plasticity");
            close(state.front(), c, 1e-8);
            assert!((state.displacement(100.0) - ua).abs() < 1e-9);
            assert!((state.displacement(200.0) - ub).abs() < 1e-9);
            close(state.kappa(100.0), kappa, 1e-9);
        }
        assert_eq!(SPHERE.loaded(718.0, 0.0), None);
    }

    #[test]
    fn perfect_plasticity_of_de_souza_neto() {
        let material = VonMises { yield_stress: Some(0.24), ..VonMises::elastic(210.0, 0.3) };
        let sphere = HollowSphere { material, ..SPHERE };
        close(sphere.pressure_of_front(200.0), 0.33271, 1e-5);
        for (p, c, ub) in [(0.15, 102.42240, 0.02148893), (0.3, 157.56236, 0.07823254)] {
            let state = sphere.loaded(p, 0.0).expect("below the limit pressure");
            close(state.front(), c, 1e-7);
            close(state.displacement(200.0), ub, 1e-6);
        }
    }

    /// Equilibrium, and stresses that the material itself gives to the strains of the displacement, by differences.
    #[test]
    fn balanced_and_compatible_everywhere() {
        let h = 1e-3;
        for (inside, outside) in [(200.0, 0.0), (300.0, 0.0), (600.0, 0.0), (700.0, 150.0), (50.0, 40.0)] {
            let state = SPHERE.loaded(inside, outside).expect("below full plasticity");
            close(-state.radial_stress(100.0), inside, 1e-11);
            close(-state.radial_stress(200.0) + 1.0, outside + 1.0, 1e-11);
            for r in (0..99).map(|k| 100.5 + k as f64) {
                if (r - state.front()).abs() < 2.0 * h {
                    continue;
                }
                let (radial, hoop) = (state.radial_stress(r), state.hoop_stress(r));
                let slope = (state.radial_stress(r + h) - state.radial_stress(r - h)) / (2.0 * h);
                assert!((slope + 2.0 * (radial - hoop) / r).abs() < 1e-6);
                let stretch = (state.displacement(r + h) - state.displacement(r - h)) / (2.0 * h);
                let around = state.displacement(r) / r;
                let strains = state.strains(r);
                assert!((strains[0] - stretch).abs() < 1e-9 && (strains[1] - around).abs() < 1e-16);
                let response = STEEL.respond(&[stretch, around, around, 0.0, 0.0, 0.0], &PlasticState::VIRGIN);
                for (a, b) in response.stress.iter().zip([radial, hoop, hoop, 0.0, 0.0, 0.0]) {
                    assert!((a - b).abs() < 1e-4, "{:?} at {r}", response.stress);
                }
                assert!((response.equivalent_plastic_strain - state.kappa(r)).abs() < 1e-9);
                assert!((state.von_mises(r) - (hoop - radial)).abs() < 1e-9);
            }
        }
    }

    /// By the material itself, which remembers the loaded state; and balanced without pressures.
    #[test]
    fn what_is_left_after_unloading_is_balanced_and_the_materials_own() {
        let strain = |[radial, around]: [f64; 2]| [radial, around, around, 0.0, 0.0, 0.0];
        for inside in [200.0, 500.0, 600.0] {
            let loaded = SPHERE.loaded(inside, 0.0).expect("below full plasticity");
            let left = loaded.unloaded().expect("nothing yields on the way back");
            assert!(left.stresses(100.0)[0].abs() < 1e-10 && left.stresses(200.0)[0].abs() < 1e-10);
            for r in (0..99).map(|k| 100.5 + k as f64) {
                let history = STEEL.commit(&strain(loaded.strains(r)), &PlasticState::VIRGIN);
                let response = STEEL.respond(&strain(left.strains(r)), &history);
                let [radial, hoop] = left.stresses(r);
                for (a, b) in response.stress.iter().zip([radial, hoop, hoop, 0.0, 0.0, 0.0]) {
                    assert!((a - b).abs() < 1e-8, "{:?} at {r}", response.stress);
                }
                assert!((left.displacement(r) - r * left.strains(r)[1]).abs() < 1e-15);
                let h = 1e-3;
                if (r - loaded.front()).abs() > 2.0 * h {
                    let slope = (left.stresses(r + h)[0] - left.stresses(r - h)[0]) / (2.0 * h);
                    assert!((slope + 2.0 * (radial - hoop) / r).abs() < 1e-6);
                }
            }
        }
        // Perfectly plastic, the wall yields again where 3/2 p / (1 - a^3/b^3) is more than twice the yield stress.
        let thick = HollowSphere { outer: 300.0, material: VonMises { hardening: 0.0, ..STEEL }, ..SPHERE };
        let limit = 2.0 / 1.5 * 450.0 * (1.0 - 1.0 / 27.0);
        for (inside, is_elastic) in [(0.999 * limit, true), (1.001 * limit, false)] {
            let loaded = thick.loaded(inside, 0.0).expect("below full plasticity");
            assert_eq!(loaded.unloaded().is_some(), is_elastic);
        }
    }
}
