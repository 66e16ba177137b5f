//! Material parameters: isotropic elasticity, von Mises plasticity with linear isotropic hardening.

use serde::{Deserialize, Serialize};

/// Parameters of one material; stresses in the units of the scene.
///
/// The yield condition is `sigma_eq <= yield_stress + hardening * kappa` with the equivalent plastic strain `kappa`
/// (de Souza Neto, Peric and Owen 2008), so `hardening` is the slope of stress over *plastic* strain in a uniaxial test.
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
}

impl Material {
    /// Whether this material can yield.
    pub fn is_plastic(&self) -> bool {
        self.yield_stress.is_some()
    }
}
