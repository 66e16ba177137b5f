//! Material parameters: isotropic elasticity, von Mises plasticity with linear isotropic and kinematic hardening.

use serde::{Deserialize, Serialize};

/// Parameters of one material; stresses in the units of the scene.
///
/// The yield condition is `sigma_eq <= yield_stress + hardening * kappa` with the equivalent plastic strain `kappa`
/// (de Souza Neto, Peric and Owen 2008), where `sigma_eq` is of the stress less the back stress, and the back stress is
/// `2/3 kinematic_hardening` times the plastic strain (Prager). So the sum of both hardenings is the slope of stress over
/// *plastic* strain in a uniaxial test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, positive.
    pub young: f64,
    /// Poisson's ratio, above -1 and below 0.5.
    pub poisson: f64,
    /// Uniaxial stress of first yield, positive; `None` for a material that stays elastic.
    pub yield_stress: Option<f64>,
    /// Linear isotropic hardening modulus, not negative; 0 is perfect plasticity.
    #[serde(default)]
    pub hardening: f64,
    /// Linear kinematic hardening modulus, not negative.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub kinematic_hardening: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Material {
    /// Whether this material can yield.
    pub fn is_plastic(&self) -> bool {
        self.yield_stress.is_some()
    }
}
