use super::*;
use crate::material::Law;

const CYLINDER: Cylinder = Cylinder {
    inner: 100.0,
    outer: 200.0,
    material: VonMises { yield_stress: Some(0.24), ..VonMises::elastic(210.0, 0.3) },
};

#[test]
fn published_numbers() {
    assert!((CYLINDER.pressure_of_front(100.0) - 0.103923).abs() < 1e-6);
    assert!((CYLINDER.limit_pressure() - 0.192091).abs() < 1e-6);
    for (p, c, u) in [
        (0.10, 100.0, 0.0577778),
        (0.14, 120.538801, 0.0872422),
        (0.18, 159.785289, 0.1533015),
        (0.19, 182.887937, 0.2008366),
    ] {
        let state = CYLINDER.loaded(p).expect("below collapse");
        assert!((state.front() - c).abs() < 1e-6);
        assert!((state.outer_displacement() - u).abs() < 1e-7);
    }
    assert_eq!(CYLINDER.loaded(0.1921), None);
}

#[test]
fn balanced_at_every_radius_and_loaded_inside_only() {
    let h = 1e-3;
    for p in [0.05, 0.14, 0.19] {
        let state = CYLINDER.loaded(p).expect("below collapse");
        assert!((state.radial_stress(100.0) + p).abs() < 1e-14 && state.radial_stress(200.0).abs() < 1e-16);
        for r in (0..99).map(|k| 100.5 + k as f64) {
            let slope = (state.radial_stress(r + h) - state.radial_stress(r - h)) / (2.0 * h);
            let difference = state.hoop_stress(r) - state.radial_stress(r);
            assert!((slope - difference / r).abs() < 1e-9);
            assert!(difference <= CYLINDER.strength() * (1.0 + 1e-12));
        }
    }
}

/// The first strain is the derivative of the second times the radius, and both add up to Hooke's law in plane strain.
#[test]
fn elastic_strains_are_compatible() {
    for p in [0.05, 0.14] {
        let state = CYLINDER.loaded(p).expect("below collapse");
        for r in (0..60).map(|k| 130.0 + f64::from(k)) {
            let displacement = |r: f64| r * state.strains(r)[1];
            let slope = (displacement(r + 1e-3) - displacement(r - 1e-3)) / 2e-3;
            let [radial, around] = state.strains(r);
            assert!((slope - radial).abs() < 1e-11, "{slope} {radial}");
            let m = CYLINDER.material;
            let stress = m.hooke().lambda() * (radial + around) + 2.0 * m.hooke().shear_modulus() * radial;
            assert!((stress - state.radial_stress(r)).abs() < 1e-14);
            assert!((m.hooke().lambda() * (radial + around) - state.axial_stress(r)).abs() < 1e-14);
        }
        assert!((200.0 * state.strains(200.0)[1] - state.outer_displacement()).abs() < 1e-14);
    }
}

/// Plane strain Hooke at the outer surface: u / b = (1 - nu^2) sigma_t / E where sigma_r vanishes.
#[test]
fn outer_displacement_is_the_hoop_strain() {
    for p in [0.05, 0.14, 0.19] {
        let state = CYLINDER.loaded(p).expect("below collapse");
        let hoop = 0.91 * state.hoop_stress(200.0) / 210.0;
        assert!((state.outer_displacement() / 200.0 - hoop).abs() < 1e-16);
    }
}
