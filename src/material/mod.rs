//! Constitutive models: what stress a strain gives, given the history of the point.
//!
//! A law is one file that answers [`Law`], plus a line in the list of [`laws`]. [`elastic`] is Hooke's law, the part that all
//! have; [`von_mises`] adds J2 plasticity with linear isotropic and kinematic hardening in one implicit step from a committed
//! state. Small strains, rate independent, isotropic; no element and no mesh.

pub mod elastic;
pub mod history;
pub mod law;
pub mod laws;
pub mod von_mises;

pub use elastic::Hooke;
pub use law::{BadParameter, Law, Response, Variables};
pub use laws::{History, Material};
pub use von_mises::VonMises;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The law that a section of a scene means. Its keys are those of the law's parameters.
impl<'de> Deserialize<'de> for Material {
    fn deserialize<D: Deserializer<'de>>(section: D) -> Result<Self, D::Error> {
        VonMises::deserialize(section).map(Self::from)
    }
}

impl Serialize for Material {
    fn serialize<S: Serializer>(&self, section: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::VonMises(law) => law.serialize(section),
        }
    }
}

#[cfg(test)]
pub(crate) mod samples {
    use super::{Material, VonMises};

    /// The paper's steel, in MPa.
    pub const STEEL: VonMises = VonMises {
        young: 210000.0,
        poisson: 0.29,
        yield_stress: Some(450.0),
        hardening: 10000.0,
        kinematic_hardening: 0.0,
    };

    /// The same as one of the laws.
    pub const MATERIAL: Material = Material::VonMises(STEEL);
}
