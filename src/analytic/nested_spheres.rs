//! Two concentric thick spheres with a gap, pressure in the inner one: contact and plasticity of two bodies at once.
//!
//! Both spheres are [`HollowSphere`]s and share the nominal radius b of the interface; the gap g enters the condition
//! u_inner(b) - u_outer(b) <= g only (small displacements). The contact pressure is the root of that condition.

use super::bisect;
use super::hollow_sphere::{HollowSphere, SphereState};
use crate::material::VonMises;

/// Geometry and materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NestedSpheres {
    /// The pressurised sphere; its outer radius is the interface.
    pub inner: HollowSphere,
    /// Outer radius of the enclosing sphere.
    pub outer_radius: f64,
    /// Material of the enclosing sphere.
    pub outer_material: VonMises,
    /// Initial radial gap, >= 0.
    pub gap: f64,
}

/// Both spheres under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NestedState {
    /// Pressure at the interface; zero if the gap stays open.
    pub contact_pressure: f64,
    pub inner: SphereState,
    pub outer: SphereState,
}

impl NestedSpheres {
    /// The state under `pressure` >= 0 in the inner sphere; `None` if a sphere would yield through its wall.
    pub fn loaded(&self, pressure: f64) -> Option<NestedState> {
        let interface = self.inner.outer;
        let enclosing = HollowSphere { inner: interface, outer: self.outer_radius, material: self.outer_material };
        let state = |contact_pressure: f64| {
            let inner = self.inner.loaded(pressure, contact_pressure);
            (inner, enclosing.loaded(contact_pressure, 0.0))
        };
        // Whether the spheres would overlap: the inner one needs more support. Yielding through is infinitely soft.
        let overlap = |contact_pressure: f64| match state(contact_pressure) {
            (Some(inner), Some(outer)) => inner.displacement(interface) - outer.displacement(interface) > self.gap,
            (None, _) => true,
            (_, None) => false,
        };
        let contact_pressure = if overlap(0.0) { bisect(0.0, pressure, overlap) } else { 0.0 };
        let (inner, outer) = state(contact_pressure);
        Some(NestedState { contact_pressure, inner: inner?, outer: outer? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::samples::STEEL;

    fn spheres(gap: f64) -> NestedSpheres {
        let inner = HollowSphere { inner: 100.0, outer: 200.0, material: STEEL };
        let outer_material = VonMises::elastic(STEEL.young, STEEL.poisson);
        NestedSpheres { inner, outer_radius: 300.0, outer_material, gap }
    }

    #[test]
    fn published_numbers() {
        for (pressure, gap, contact, front, displacement) in [
            (500.0, 0.0, 54.300465, 127.192298, 0.056545973),
            (500.0, 0.05, 26.309330, 132.220994, 0.027397310),
            (600.0, 0.05, 50.196756, 147.617879, 0.052272562),
            (700.0, 0.05, 82.398226, 164.322451, 0.085805671),
            (700.0, 0.10, 61.204641, 170.407807, 0.063735660),
        ] {
            let state = spheres(gap).loaded(pressure).expect("no wall yields through");
            assert!((state.contact_pressure - contact).abs() < 1e-6);
            assert!((state.inner.front() - front).abs() < 1e-6);
            assert!((state.outer.displacement(200.0) - displacement).abs() < 1e-9);
            assert!((state.inner.displacement(200.0) - state.outer.displacement(200.0) - gap).abs() < 1e-12);
            assert!((state.inner.radial_stress(200.0) + state.contact_pressure).abs() < 1e-9);
            assert!((state.outer.radial_stress(200.0) + state.contact_pressure).abs() < 1e-9);
            assert!(state.outer.von_mises(200.0) < 176.1);
        }
    }

    /// The enclosing sphere against its own closed form u = q b^4 / (E (d^3 - b^3)) ((1 - 2 nu) + (1 + nu) d^3 / (2 b^3)).
    #[test]
    fn enclosing_sphere_is_lames() {
        let state = spheres(0.0).loaded(500.0).expect("no wall yields through");
        let (b, d, nu) = (200f64, 300f64, STEEL.poisson);
        let shape = (1.0 - 2.0 * nu) + (1.0 + nu) * d.powi(3) / (2.0 * b.powi(3));
        let expected = state.contact_pressure * b.powi(4) / (STEEL.young * (d.powi(3) - b.powi(3))) * shape;
        assert!((state.outer.displacement(b) / expected - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_wide_gap_stays_open_and_too_much_pressure_is_refused() {
        let open = spheres(0.2).loaded(500.0).expect("no wall yields through");
        assert_eq!(open.contact_pressure, 0.0);
        assert_eq!(Some(open.inner), spheres(0.2).inner.loaded(500.0, 0.0));
        assert!(spheres(0.0).loaded(0.0).is_some_and(|state| state.contact_pressure == 0.0));
        let soft = NestedSpheres { outer_material: STEEL, ..spheres(0.0) };
        assert_eq!(soft.loaded(5000.0), None);
    }
}
