//! Constitutive models: what stress a strain gives, given the history of the point.
//!
//! [`elastic`] is Hooke's law, [`von_mises`] adds J2 plasticity with linear isotropic and kinematic hardening in one
//! implicit step from a committed [`History`]. Small strains, rate independent, isotropic; no element and no mesh.

pub mod elastic;
pub mod von_mises;

pub use von_mises::{History, Response};

/// Constants of an isotropic material; moduli and stresses in one unit of stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus E > 0.
    pub young: f64,
    /// Poisson's ratio, -1 < nu < 1/2.
    pub poisson: f64,
    /// Initial yield stress in uniaxial tension, >= 0; `None` is elastic for ever.
    pub yield_stress: Option<f64>,
    /// Slope H >= 0 of yield stress over accumulated plastic strain; 0 is perfect plasticity.
    pub hardening: f64,
    /// Slope C >= 0 of the back stress over plastic strain, both uniaxial (Prager's rule).
    pub kinematic_hardening: f64,
}

impl Material {
    /// An elastic material.
    pub const fn elastic(young: f64, poisson: f64) -> Self {
        Self { young, poisson, yield_stress: None, hardening: 0.0, kinematic_hardening: 0.0 }
    }

    /// Lame's second constant mu = E / (2 (1 + nu)), the shear modulus.
    pub fn shear_modulus(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Lame's first constant lambda = E nu / ((1 + nu) (1 - 2 nu)).
    pub fn lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// Bulk modulus E / (3 (1 - 2 nu)).
    pub fn bulk_modulus(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }
}

#[cfg(test)]
pub(crate) mod samples {
    use super::Material;

    /// The paper's steel, in MPa.
    pub const STEEL: Material = Material {
        young: 210000.0,
        poisson: 0.29,
        yield_stress: Some(450.0),
        hardening: 10000.0,
        kinematic_hardening: 0.0,
    };
}
