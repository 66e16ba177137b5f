//! Von Mises plasticity with linear isotropic hardening, one implicit Euler step from a committed state.
//!
//! With the trial stress of the elastic strain `strain - plastic_strain`, its equivalent stress q and the excess
//! f = (q - sigma_y - H kappa)+, the step is (de Souza Neto, Peric, Owen, Computational Methods for Plasticity, 7.3-7.4)
//!
//! ```text
//! dkappa = f / (3 mu + H),   dev sigma = (1 - 3 mu dkappa / q) dev sigma_trial,   tr sigma = tr sigma_trial
//! tangent = K 1x1 + 2 mu (1 - 3 mu dkappa / q) I_dev + 6 mu^2 (dkappa / q - 1 / (3 mu + H)) NxN,   N = dev / |dev|
//! Psi = 1/2 strain_e : C : strain_e - f^2 / (2 (3 mu + H)),   D Psi = sigma
//! ```
//!
//! Psi is the least, over dkappa >= 0, of elastic energy + sigma_y dkappa + H/2 ((kappa + dkappa)^2 - kappa^2), hence
//! convex and once differentiable: it counts what is stored elastically and what *this* step dissipates or stores by
//! hardening, not what former steps did. No kinematic hardening, no rate dependence, no plane stress.

use super::Material;
use crate::tensor::{Tangent, Voigt, deviator, trace};

/// What a material point remembers between load steps; zero is the virgin state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct History {
    /// Plastic strain, engineering shears, traceless.
    pub plastic_strain: Voigt,
    /// Accumulated plastic strain, the integral of sqrt(2/3) |d plastic_strain|.
    pub kappa: f64,
}

/// What a material point answers to a strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Stress, the derivative of `energy` by the strain.
    pub stress: Voigt,
    /// One-step potential Psi, energy per volume.
    pub energy: f64,
    /// Whether the trial stress is outside the yield surface.
    pub plastic: bool,
    /// Accumulated plastic strain at the end of the step.
    pub kappa: f64,
}

/// The elastic predictor and how far it is beyond the yield surface.
struct Trial {
    pressure: f64,
    deviator: Voigt,
    equivalent: f64,
    energy: f64,
    excess: f64,
    /// Increment of accumulated plastic strain.
    step: f64,
    /// Factor 1 - 3 mu dkappa / q of the deviator; 1 in an elastic step.
    shrink: f64,
}

impl Trial {
    fn new(material: &Material, strain: &Voigt, committed: &History) -> Self {
        let (bulk, mu) = (material.bulk_modulus(), material.shear_modulus());
        let elastic: Voigt = std::array::from_fn(|i| strain[i] - committed.plastic_strain[i]);
        let volume = trace(&elastic);
        let d = deviator(&elastic);
        let s = [2.0 * mu * d[0], 2.0 * mu * d[1], 2.0 * mu * d[2], mu * d[3], mu * d[4], mu * d[5]];
        let equivalent = 1.5f64.sqrt() * crate::tensor::stress_norm(&s);
        let energy = 0.5 * bulk * volume * volume + equivalent * equivalent / (6.0 * mu);
        let mut trial =
            Self { pressure: bulk * volume, deviator: s, equivalent, energy, excess: 0.0, step: 0.0, shrink: 1.0 };
        if let Some(initial) = material.yield_stress {
            let yield_stress = initial + material.hardening * committed.kappa;
            if equivalent > yield_stress {
                trial.excess = equivalent - yield_stress;
                trial.step = trial.excess / (3.0 * mu + material.hardening);
                // Equals 1 - 3 mu step / q, without its cancellation.
                trial.shrink = (yield_stress + material.hardening * trial.step) / equivalent;
            }
        }
        trial
    }

    fn plastic(&self) -> bool {
        self.excess > 0.0
    }
}

impl Material {
    /// Stress, potential and plasticity at `strain`, one step away from `committed`.
    pub fn respond(&self, strain: &Voigt, committed: &History) -> Response {
        let trial = Trial::new(self, strain, committed);
        let mut stress = trial.deviator.map(|s| trial.shrink * s);
        stress[..3].iter_mut().for_each(|s| *s += trial.pressure);
        Response {
            stress,
            energy: trial.energy - 0.5 * trial.excess * trial.step,
            plastic: trial.plastic(),
            kappa: committed.kappa + trial.step,
        }
    }

    /// The consistent tangent d stress / d strain of the same step: symmetric, at most C, at least H / (3 mu + H) C.
    /// In an elastic step it is [`Material::elastic_tangent`] to the last bit.
    pub fn tangent(&self, strain: &Voigt, committed: &History) -> Tangent {
        let trial = Trial::new(self, strain, committed);
        if !trial.plastic() {
            return self.elastic_tangent();
        }
        let (bulk, mu) = (self.bulk_modulus(), self.shear_modulus());
        let shear = mu * trial.shrink;
        // N x N = 3/2 dev x dev / q^2.
        let q = trial.equivalent;
        let along = 9.0 * mu * mu * (trial.step / q - 1.0 / (3.0 * mu + self.hardening)) / (q * q);
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            c[i][..3].fill(bulk - 2.0 / 3.0 * shear);
            c[i][i] += 2.0 * shear;
            c[i + 3][i + 3] = shear;
        }
        for (row, si) in c.iter_mut().zip(trial.deviator) {
            for (entry, sj) in row.iter_mut().zip(trial.deviator) {
                *entry += along * (si * sj);
            }
        }
        c
    }

    /// The history at the end of the step, to be committed once the load step has converged.
    pub fn commit(&self, strain: &Voigt, committed: &History) -> History {
        let trial = Trial::new(self, strain, committed);
        if !trial.plastic() {
            return *committed;
        }
        let flow = 1.5 * trial.step / trial.equivalent;
        let factor = [flow, flow, flow, 2.0 * flow, 2.0 * flow, 2.0 * flow];
        History {
            plastic_strain: std::array::from_fn(|i| committed.plastic_strain[i] + factor[i] * trial.deviator[i]),
            kappa: committed.kappa + trial.step,
        }
    }
}

#[cfg(test)]
mod tests;
