//! Homogeneous states of von Mises material with linear isotropic hardening, loaded once from the virgin state.
//!
//! With q the equivalent stress and kappa = (q - sigma_y)+ / H, the strain is Hooke's plus kappa times 3/2 dev / q.
//! Beyond yield the first three need H > 0: with perfect plasticity no stress above sigma_y exists.

use super::bisect;
use crate::material::{Law, VonMises};
use crate::tensor::Voigt;

/// Accumulated plastic strain under the equivalent stress `q`.
fn kappa(material: &VonMises, q: f64) -> f64 {
    match material.yield_stress {
        Some(limit) if q > limit => (q - limit) / material.hardening,
        _ => 0.0,
    }
}

/// Strain under the uniaxial stress `stress` along x.
pub fn uniaxial(material: &VonMises, stress: f64) -> Voigt {
    let plastic = kappa(material, stress.abs()).copysign(stress);
    let lateral = -material.poisson * stress / material.young - plastic / 2.0;
    [stress / material.young + plastic, lateral, lateral, 0.0, 0.0, 0.0]
}

/// Strain under equal stresses along x and y, none along z.
pub fn equibiaxial(material: &VonMises, stress: f64) -> Voigt {
    let plastic = kappa(material, stress.abs()).copysign(stress);
    let (nu, elastic) = (material.poisson, stress / material.young);
    let plane = (1.0 - nu) * elastic + plastic / 2.0;
    [plane, plane, -2.0 * nu * elastic - plastic, 0.0, 0.0, 0.0]
}

/// Strain (engineering shear) under the shear stress `stress` in the xy plane.
pub fn pure_shear(material: &VonMises, stress: f64) -> Voigt {
    let root = 3f64.sqrt();
    let plastic = root * kappa(material, root * stress.abs()).copysign(stress);
    [0.0, 0.0, 0.0, stress / material.hooke().shear_modulus() + plastic, 0.0, 0.0]
}

/// A state of plane strain, free along x, pressed along y, held along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneStrain {
    pub strain: Voigt,
    pub stress: Voigt,
    /// Accumulated plastic strain.
    pub kappa: f64,
}

/// The state at strain `pressed` along y, reached in one implicit step. The deviatoric path is not proportional: flow
/// theory in many steps differs.
///
/// One step is Hencky's material: Hooke's law with the shear modulus `share` mu, where the share in (0, 1] of the
/// elastic deviator that remains is the root of a scalar equation.
pub fn plane_strain(material: &VonMises, pressed: f64) -> PlaneStrain {
    let (bulk, mu) = (material.hooke().bulk_modulus(), material.hooke().shear_modulus());
    let free = |share: f64| -pressed * (bulk - 2.0 / 3.0 * share * mu) / (bulk + 4.0 / 3.0 * share * mu);
    let kappa = |share: f64| {
        let (x, y) = (free(share), pressed);
        let q = 2.0 * mu * (x * x + y * y - x * y).sqrt();
        let excess = material.yield_stress.map_or(0.0, |limit| (q - limit).max(0.0));
        (excess / (3.0 * mu + material.hardening), q)
    };
    let share = bisect(0.0, 1.0, |share| {
        let (kappa, q) = kappa(share);
        share * q < q - 3.0 * mu * kappa
    });
    let x = free(share);
    let mean = bulk * (x + pressed);
    let third = (x + pressed) / 3.0;
    let [sx, sy, sz] = [x, pressed, 0.0].map(|strain| mean + 2.0 * share * mu * (strain - third));
    let strain = [x, pressed, 0.0, 0.0, 0.0, 0.0];
    PlaneStrain { strain, stress: [sx, sy, sz, 0.0, 0.0, 0.0], kappa: kappa(share).0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::samples::STEEL;
    use crate::material::von_mises::PlasticState;
    use crate::material::{Law, Variables};

    fn close(value: f64, expected: f64, digits: f64) {
        assert!((value - expected).abs() <= digits * expected.abs(), "{value} is not {expected}");
    }

    /// The material itself gives back the stress that the closed form started from.
    fn respond(material: &VonMises, strain: Voigt, stress: Voigt) {
        let response = material.respond(&strain, &PlasticState::VIRGIN);
        for (a, b) in response.stress.iter().zip(stress) {
            assert!((a - b).abs() < 1e-9, "{:?} is not {stress:?}", response.stress);
        }
    }

    #[test]
    fn published_numbers() {
        close(uniaxial(&STEEL, 500.0)[0], 7.380952380952e-3, 1e-12);
        close(uniaxial(&STEEL, 500.0)[1], -3.190476190476e-3, 1e-12);
        close(uniaxial(&STEEL, 600.0)[0], 1.785714285714e-2, 1e-12);
        close(uniaxial(&STEEL, 600.0)[2], -8.328571428571e-3, 1e-12);
        close(equibiaxial(&STEEL, 500.0)[1], 4.190476190476e-3, 1e-12);
        close(equibiaxial(&STEEL, 500.0)[2], -6.380952380952e-3, 1e-12);
        close(pure_shear(&STEEL, 300.0)[3], 1.574342794511e-2, 1e-12);
        let light = plane_strain(&STEEL, -0.003);
        close(light.stress[1], -521.0219850755, 1e-12);
        close(light.stress[2], -180.9355848486, 1e-12);
        close(light.strain[0], 1.5960848602e-3, 1e-10);
        close(light.kappa, 8.181380250e-4, 1e-9);
        let heavy = plane_strain(&STEEL, -0.01);
        close(heavy.stress[1], -615.0331028446, 1e-12);
        close(heavy.stress[2], -277.3841778765, 1e-12);
        close(heavy.strain[0], 8.2151654386e-3, 1e-10);
        close(heavy.kappa, 8.348593996e-3, 1e-9);
    }

    #[test]
    fn the_material_returns_the_stress() {
        for s in [-700.0, -200.0, 300.0, 449.0, 451.0, 600.0] {
            respond(&STEEL, uniaxial(&STEEL, s), [s, 0.0, 0.0, 0.0, 0.0, 0.0]);
            respond(&STEEL, equibiaxial(&STEEL, s), [s, s, 0.0, 0.0, 0.0, 0.0]);
            respond(&STEEL, pure_shear(&STEEL, s), [0.0, 0.0, 0.0, s, 0.0, 0.0]);
        }
        for hardening in [0.0, 10000.0] {
            let material = VonMises { hardening, ..STEEL };
            for pressed in [-0.02, -0.003, -0.001, 0.001, 0.01] {
                let state = plane_strain(&material, pressed);
                assert!(state.stress[0].abs() < 1e-9);
                respond(&material, state.strain, state.stress);
            }
        }
    }
}
