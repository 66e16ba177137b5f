//! Von Mises plasticity with linear isotropic and kinematic hardening, one implicit Euler step from a committed state.
//!
//! With the back stress alpha = 2/3 C plastic_strain (Prager), the trial stress of the elastic strain
//! `strain - plastic_strain`, the equivalent stress q of xi = dev sigma_trial - alpha and the excess
//! f = (q - sigma_y - H kappa)+, the step is (de Souza Neto, Peric, Owen, Computational Methods for Plasticity, 7.3-7.6)
//!
//! ```text
//! dkappa = f / (3 mu + H + C),   dev sigma = alpha + (1 - 3 mu dkappa / q) xi,   tr sigma = tr sigma_trial
//! tangent = K 1x1 + 2 mu (1 - 3 mu dkappa / q) I_dev + 6 mu^2 (dkappa / q - 1 / (3 mu + H + C)) NxN,   N = xi / |xi|
//! Psi = 1/2 strain_e : C_e : strain_e - f^2 / (2 (3 mu + H + C)),   D Psi = sigma
//! ```
//!
//! Between two strains of one step from one state, with D = Psi(a) - Psi(b) - sigma(b) : (a - b) >= 0,
//!
//! ```text
//! D >= r/2 (a - b) : C_e : (a - b),   r = (H + C) / (3 mu + H + C),   D >= 1/2 (sigma(a) - sigma(b)) : C_e^-1 : (sigma(a) - sigma(b))
//! ```
//!
//! since the tangents are between r C_e and C_e (Nesterov, Introductory Lectures on Convex Optimization, 2.1.5 and 2.1.10).
//!
//! Psi is, but for a constant, the least over dkappa >= 0 of elastic energy + sigma_y dkappa + what isotropic and
//! kinematic hardening store, hence convex and once differentiable: it counts what is stored elastically and what *this*
//! step dissipates or stores by hardening, not what former steps did. The step is exact for radial paths from the
//! committed state. No rate dependence, no plane stress.

use serde::{Deserialize, Serialize};

use super::Hooke;
use super::law::{BadParameter, Law, Response, Variables};
use crate::tensor::{Tangent, Voigt, contract, deviator, stress_norm, trace};

/// Parameters, as a scene has them; stresses and moduli in one unit.
///
/// The yield condition is `sigma_eq <= yield_stress + hardening * kappa` with the equivalent plastic strain `kappa`
/// (de Souza Neto, Peric and Owen 2008), where `sigma_eq` is of the stress less the back stress, and the back stress is
/// `2/3 kinematic_hardening` times the plastic strain (Prager). So the sum of both hardenings is the slope of stress over
/// *plastic* strain in a uniaxial test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VonMises {
    /// Young's modulus E > 0.
    pub young: f64,
    /// Poisson's ratio, -1 < nu < 1/2.
    pub poisson: f64,
    /// Initial yield stress in uniaxial tension, > 0; `None` is elastic for ever.
    pub yield_stress: Option<f64>,
    /// Slope H >= 0 of yield stress over accumulated plastic strain; 0 is perfect plasticity.
    #[serde(default)]
    pub hardening: f64,
    /// Slope C >= 0 of the back stress over plastic strain, both uniaxial (Prager's rule).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub kinematic_hardening: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// What a point remembers; zero is the virgin state. The back stress follows from the plastic strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlasticState {
    /// Plastic strain, engineering shears, traceless.
    pub plastic_strain: Voigt,
    /// Accumulated plastic strain, the integral of sqrt(2/3) |d plastic_strain|.
    pub kappa: f64,
}

impl Variables for PlasticState {
    const VIRGIN: Self = Self { plastic_strain: [0.0; 6], kappa: 0.0 };

    fn variables(&mut self) -> impl Iterator<Item = (&'static str, &mut [f64])> {
        let Self { plastic_strain, kappa } = self;
        [("plastic_strain", &mut plastic_strain[..]), ("kappa", std::slice::from_mut(kappa))].into_iter()
    }
}

/// An excess below this share of the yield stress is round-off: the tangent of a point that flowed before and is not
/// strained further is elastic, whichever side of the yield surface rounding puts it on. On fine meshes strains are
/// differences of large displacements, so the share is well above that of one operation.
const ROUNDING: f64 = 1e-9;

/// The elastic predictor and how far it is beyond the yield surface.
struct Trial {
    pressure: f64,
    /// Back stress alpha.
    back: Voigt,
    /// Deviator of the stress less the back stress, xi.
    relative: Voigt,
    /// Equivalent stress of `relative`.
    equivalent: f64,
    energy: f64,
    yield_stress: f64,
    excess: f64,
    /// Increment of accumulated plastic strain.
    step: f64,
    /// Factor 1 - 3 mu dkappa / q of `relative`; 1 in an elastic step.
    shrink: f64,
}

/// Equivalent stress of a deviator.
fn equivalent(deviator: &Voigt) -> f64 {
    1.5f64.sqrt() * stress_norm(deviator)
}

impl Trial {
    fn new(material: &VonMises, strain: &Voigt, committed: &PlasticState) -> Self {
        let elastic = material.hooke();
        let (bulk, mu) = (elastic.bulk_modulus(), elastic.shear_modulus());
        let strain: Voigt = std::array::from_fn(|i| strain[i] - committed.plastic_strain[i]);
        let volume = trace(&strain);
        let s = material.deviatoric_stress(&strain);
        let back = material.back_stress(committed);
        let relative: Voigt = std::array::from_fn(|i| s[i] - back[i]);
        let q = equivalent(&relative);
        let of_stress = if material.kinematic_hardening == 0.0 { q } else { equivalent(&s) };
        let mut trial = Self {
            pressure: bulk * volume,
            back,
            relative,
            equivalent: q,
            energy: 0.5 * bulk * volume * volume + of_stress * of_stress / (6.0 * mu),
            yield_stress: material.present_yield_stress(committed),
            excess: 0.0,
            step: 0.0,
            shrink: 1.0,
        };
        if q > trial.yield_stress {
            trial.excess = q - trial.yield_stress;
            trial.step = trial.excess / material.plastic_modulus();
            // Equals 1 - 3 mu step / q, without its cancellation.
            let hardening = material.hardening + material.kinematic_hardening;
            trial.shrink = (trial.yield_stress + hardening * trial.step) / q;
        }
        trial
    }

    fn plastic(&self) -> bool {
        self.excess > ROUNDING * self.yield_stress
    }
}

/// The double contraction of two stress-like tensors: shears count twice.
fn contract_stresses(a: &Voigt, b: &Voigt) -> f64 {
    contract(a, b) + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

impl VonMises {
    /// A material that never yields.
    pub const fn elastic(young: f64, poisson: f64) -> Self {
        Self { young, poisson, yield_stress: None, hardening: 0.0, kinematic_hardening: 0.0 }
    }

    /// Where what was committed flows on; infinite if nothing yields.
    fn present_yield_stress(&self, committed: &PlasticState) -> f64 {
        self.yield_stress.map_or(f64::INFINITY, |initial| initial + self.hardening * committed.kappa)
    }

    /// 3 mu + H + C: what the equivalent stress falls by, beyond the yield surface, for a unit of plastic strain.
    fn plastic_modulus(&self) -> f64 {
        3.0 * self.hooke().shear_modulus() + self.hardening + self.kinematic_hardening
    }

    /// 2 mu dev strain, the deviator of the stress of an elastic strain.
    #[inline]
    fn deviatoric_stress(&self, strain: &Voigt) -> Voigt {
        let (mu, d) = (self.hooke().shear_modulus(), deviator(strain));
        [2.0 * mu * d[0], 2.0 * mu * d[1], 2.0 * mu * d[2], mu * d[3], mu * d[4], mu * d[5]]
    }

    /// The back stress 2/3 C plastic_strain, a deviator.
    pub fn back_stress(&self, committed: &PlasticState) -> Voigt {
        let (normal, shear) = (2.0 / 3.0 * self.kinematic_hardening, 1.0 / 3.0 * self.kinematic_hardening);
        let [xx, yy, zz, xy, yz, zx] = committed.plastic_strain;
        [normal * xx, normal * yy, normal * zz, shear * xy, shear * yz, shear * zx]
    }
}

impl Law for VonMises {
    type State = PlasticState;

    fn check(&self) -> Result<(), BadParameter> {
        let Self { young, poisson, yield_stress, hardening, kinematic_hardening } = *self;
        let require =
            |holds: bool, name, value, rule| if holds { Ok(()) } else { Err(BadParameter { name, value, rule }) };
        let positive = |value: f64| value.is_finite() && value > 0.0;
        require(positive(young), "young", young, "must be positive and finite")?;
        let rule = "must be above -1 and below 0.5, where the material would be incompressible";
        require(poisson > -1.0 && poisson < 0.5, "poisson", poisson, rule)?;
        if let Some(stress) = yield_stress {
            let rule = "must be positive and finite; leave it out for an elastic material";
            require(positive(stress), "yield_stress", stress, rule)?;
        }
        let rule = "must be finite and not negative (0 is perfect plasticity): softening has no unique solution";
        let allowed = |slope: f64| slope.is_finite() && slope >= 0.0;
        require(allowed(hardening), "hardening", hardening, rule)?;
        let rule = "must be finite and not negative";
        require(allowed(kinematic_hardening), "kinematic_hardening", kinematic_hardening, rule)?;
        for (name, slope) in [("hardening", hardening), ("kinematic_hardening", kinematic_hardening)] {
            let rule = "nothing hardens that does not yield: add yield_stress, or remove it";
            require(yield_stress.is_some() || slope == 0.0, name, slope, rule)?;
        }
        Ok(())
    }

    #[inline]
    fn hooke(&self) -> Hooke {
        Hooke { young: self.young, poisson: self.poisson }
    }

    fn yields(&self) -> bool {
        self.yield_stress.is_some()
    }

    fn has_limit(&self) -> bool {
        self.yields() && self.hardening + self.kinematic_hardening == 0.0
    }

    fn respond(&self, strain: &Voigt, committed: &PlasticState) -> Response {
        let trial = Trial::new(self, strain, committed);
        let mut stress: Voigt = std::array::from_fn(|i| trial.shrink * trial.relative[i] + trial.back[i]);
        stress[..3].iter_mut().for_each(|s| *s += trial.pressure);
        Response {
            stress,
            energy: trial.energy - 0.5 * trial.excess * trial.step,
            plastic: trial.plastic(),
            equivalent_plastic_strain: committed.kappa + trial.step,
        }
    }

    /// At least (H + C) / (3 mu + H + C) C_e. With a direction W in the unit ball of deviators, the symmetric part of W x N stands
    /// in place of N x N; the tangent is at most 2 C_e then, and C_e where W : N = |W|.
    fn stiffness(&self, strain: &Voigt, committed: &PlasticState, flow: Option<&Voigt>) -> Tangent {
        let trial = Trial::new(self, strain, committed);
        if !trial.plastic() {
            return self.hooke().tangent();
        }
        let (bulk, mu) = (self.hooke().bulk_modulus(), self.hooke().shear_modulus());
        let shear = mu * trial.shrink;
        let q = trial.equivalent;
        let normal = trial.relative.map(|s| 1.5f64.sqrt() * s / q);
        let flow = flow.unwrap_or(&normal);
        let along = 3.0 * mu * mu * (trial.step / q - 1.0 / self.plastic_modulus());
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            c[i][..3].fill(bulk - 2.0 / 3.0 * shear);
            c[i][i] += 2.0 * shear;
            c[i + 3][i + 3] = shear;
        }
        for i in 0..6 {
            for j in 0..6 {
                c[i][j] += along * (flow[i] * normal[j] + normal[i] * flow[j]);
            }
        }
        c
    }

    /// The direction that the equation `|xi| W = xi`, linear around `strain` and `flow`, gives after the change, moved into the unit
    /// ball. Where `strain` is elastic it is N after the change.
    fn flow(
        &self,
        strain: &Voigt,
        committed: &PlasticState,
        flow: Option<&Voigt>,
        (change, length): (&Voigt, f64),
    ) -> Voigt {
        let trial = Trial::new(self, strain, committed);
        let change = self.deviatoric_stress(change);
        if !trial.plastic() {
            let moved: Voigt = std::array::from_fn(|i| trial.relative[i] + change[i]);
            let norm = stress_norm(&moved);
            return if norm > 0.0 { moved.map(|s| s / norm) } else { moved };
        }
        let norm = stress_norm(&trial.relative);
        let normal = trial.relative.map(|s| s / norm);
        let flow = flow.unwrap_or(&normal);
        let along = contract_stresses(&normal, &change);
        let next: Voigt =
            std::array::from_fn(|i| flow[i] + length * (normal[i] - flow[i]) + (change[i] - along * flow[i]) / norm);
        let size = stress_norm(&next).max(1.0);
        next.map(|w| w / size)
    }

    fn divergence(&self, strain: &Voigt, change: &Voigt, committed: &PlasticState) -> f64 {
        let trial = Trial::new(self, strain, committed);
        let (mu, volume, s) = (self.hooke().shear_modulus(), trace(change), self.deviatoric_stress(change));
        let square = equivalent(&s).powi(2);
        let elastic = 0.5 * self.hooke().bulk_modulus() * volume * volume + square / (6.0 * mu);
        let moved: Voigt = std::array::from_fn(|i| trial.relative[i] + s[i]);
        let (before, after) = (trial.equivalent, equivalent(&moved));
        let excess = (after - trial.yield_stress).max(0.0);
        if excess == 0.0 && trial.excess == 0.0 {
            return elastic;
        }
        // The equivalent stress q grows by (2 along + square) / (after + before); to first order by along / before.
        let along = 1.5 * contract_stresses(&trial.relative, &s);
        let growth = (2.0 * along + square) / (after + before);
        let (of_excess, beyond) = match (trial.excess > 0.0, excess > 0.0) {
            (true, true) => (growth, 0.0),
            _ => (excess - trial.excess, excess - trial.excess - growth),
        };
        let curved = if before > 0.0 { (square * before - along * growth) / (before * (after + before)) } else { 0.0 };
        let softer = of_excess * of_excess + 2.0 * trial.excess * (beyond + curved);
        (elastic - softer / (2.0 * self.plastic_modulus())).max(0.0)
    }

    fn strain(&self, stress: &Voigt, committed: &PlasticState) -> Voigt {
        let (bulk, mu) = (self.hooke().bulk_modulus(), self.hooke().shear_modulus());
        let (volume, s, back) = (trace(stress) / (9.0 * bulk), deviator(stress), self.back_stress(committed));
        let relative: Voigt = std::array::from_fn(|i| s[i] - back[i]);
        let q = equivalent(&relative);
        let strength = self.present_yield_stress(committed);
        let (kept, flow) = match self.hardening + self.kinematic_hardening {
            _ if q <= strength => (1.0, 0.0),
            0.0 => (strength / q, 0.0),
            slope => (1.0, 1.5 * (q - strength) / (slope * q)),
        };
        let change = |i: usize| (kept * relative[i] + back[i]) / (2.0 * mu) + flow * relative[i];
        // Engineering shears are twice those of the tensor.
        let strain = |i: usize| if i < 3 { volume + change(i) } else { 2.0 * change(i) };
        std::array::from_fn(|i| strain(i) + committed.plastic_strain[i])
    }

    /// (H + C) / (3 mu + H + C).
    fn least_tangent(&self) -> f64 {
        match self.yield_stress {
            Some(_) => (self.hardening + self.kinematic_hardening) / self.plastic_modulus(),
            None => 1.0,
        }
    }

    fn firmer(&self, least_tangent: f64) -> Self {
        let least = least_tangent / (1.0 - least_tangent) * 3.0 * self.hooke().shear_modulus();
        let missing = (least - self.hardening - self.kinematic_hardening).max(0.0);
        Self { hardening: self.hardening + if self.yields() { missing } else { 0.0 }, ..*self }
    }

    /// sqrt(2/3) sigma_y |dev rate|.
    fn dissipation(&self, rate: &Voigt) -> Option<f64> {
        let s = self.deviatoric_stress(rate);
        self.yield_stress
            .filter(|_| self.has_limit())
            .map(|stress| stress * equivalent(&s) / (3.0 * self.hooke().shear_modulus()))
    }

    fn commit(&self, strain: &Voigt, committed: &PlasticState) -> PlasticState {
        let trial = Trial::new(self, strain, committed);
        if trial.step == 0.0 {
            return *committed;
        }
        let flow = 1.5 * trial.step / trial.equivalent;
        let factor = [flow, flow, flow, 2.0 * flow, 2.0 * flow, 2.0 * flow];
        PlasticState {
            plastic_strain: std::array::from_fn(|i| committed.plastic_strain[i] + factor[i] * trial.relative[i]),
            kappa: committed.kappa + trial.step,
        }
    }
}

#[cfg(test)]
mod tests;
