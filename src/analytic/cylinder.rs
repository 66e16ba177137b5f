//! A thick cylinder in plane strain under inside pressure, perfectly plastic: Hill's solution for Tresca's criterion with
//! von Mises' shear yield stress, Y = 2 sigma_y / sqrt 3 (de Souza Neto, Peric, Owen, 7.5.1).
//!
//! ```text
//! p(c) = Y ln(c/a) + (Y/2) (1 - c^2/b^2),   u(b) = Y c^2 (1 - nu^2) / (E b)
//! ```
//!
//! The stress path is not proportional and von Mises differs from Tresca along z: compare with many load steps and allow
//! about one percent. Hardening is ignored; with it no closed form exists.

use super::bisect;
use crate::material::VonMises;

/// Geometry and material; the hardening is not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Inner radius a > 0.
    pub inner: f64,
    /// Outer radius b > a.
    pub outer: f64,
    pub material: VonMises,
}

/// The cylinder under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderState {
    cylinder: Cylinder,
    /// S = r^2 (sigma_t - sigma_r) where it is elastic, Y c^2 once it yields.
    intensity: f64,
    front: f64,
}

impl Cylinder {
    /// Largest difference Y of hoop and radial stress; infinite without yielding.
    fn strength(&self) -> f64 {
        self.material.yield_stress.map_or(f64::INFINITY, |limit| 2.0 * limit / 3f64.sqrt())
    }

    /// Inside pressure that brings the plastic front to the radius `front` in [a, b]; infinite without yielding.
    pub fn pressure_of_front(&self, front: f64) -> f64 {
        let shape = (front / self.inner).ln() + 0.5 * (1.0 - (front / self.outer).powi(2));
        self.strength() * shape
    }

    /// Collapse pressure Y ln(b/a).
    pub fn limit_pressure(&self) -> f64 {
        self.strength() * (self.outer / self.inner).ln()
    }

    /// The state under an inside pressure >= 0; `None` beyond the collapse pressure.
    pub fn loaded(&self, pressure: f64) -> Option<CylinderState> {
        if pressure > self.limit_pressure() {
            return None;
        }
        let state = |intensity, front| CylinderState { cylinder: *self, intensity, front };
        if pressure <= self.pressure_of_front(self.inner) {
            let intensity = 2.0 * pressure / (self.inner.powi(-2) - self.outer.powi(-2));
            return Some(state(intensity, self.inner));
        }
        let front = bisect(self.inner, self.outer, |front| self.pressure_of_front(front) < pressure);
        Some(state(self.strength() * front * front, front))
    }
}

impl CylinderState {
    /// Radius of the plastic front c; the inner radius if nothing has yielded.
    pub fn front(&self) -> f64 {
        self.front
    }

    /// Radial stress at radius `r`.
    pub fn radial_stress(&self, r: f64) -> f64 {
        let from = r.max(self.front);
        let elastic = -0.5 * self.intensity * (from.powi(-2) - self.cylinder.outer.powi(-2));
        elastic - self.intensity / (self.front * self.front) * (from / r).ln()
    }

    /// Hoop stress at radius `r`.
    pub fn hoop_stress(&self, r: f64) -> f64 {
        self.radial_stress(r) + self.intensity / r.max(self.front).powi(2)
    }

    /// Stress along the axis at a radius `r` outside the plastic front: Tresca's would not do inside.
    pub fn axial_stress(&self, r: f64) -> f64 {
        self.cylinder.material.poisson * (self.radial_stress(r) + self.hoop_stress(r))
    }

    /// Strains at a radius `r` outside the plastic front: along the radius, and around.
    pub fn strains(&self, r: f64) -> [f64; 2] {
        let VonMises { young, poisson, .. } = self.cylinder.material;
        let (radial, hoop) = (self.radial_stress(r), self.hoop_stress(r));
        let plane = |along: f64, across: f64| (1.0 + poisson) / young * ((1.0 - poisson) * along - poisson * across);
        [plane(radial, hoop), plane(hoop, radial)]
    }

    /// Radial displacement of the outer surface, outwards.
    pub fn outer_displacement(&self) -> f64 {
        let m = &self.cylinder.material;
        self.intensity * (1.0 - m.poisson * m.poisson) / (m.young * self.cylinder.outer)
    }
}

#[cfg(test)]
mod tests;
