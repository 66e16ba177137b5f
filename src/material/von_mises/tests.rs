use super::*;
use crate::analytic::cycle::Cycle;
use crate::material::samples::STEEL;
use crate::random::Random;
use crate::tensor::{apply, contract, deviator, stress_norm, von_mises};
use crate::vector::difference;

mod flow;

/// Strains of the paper's steel, with and without either hardening, that are elastic, just plastic and deeply plastic,
/// each from a virgin and a worn state.
fn states() -> impl Iterator<Item = (VonMises, Voigt, PlasticState)> {
    let mut random = Random::new(7);
    (0..400).map(move |k| {
        let hardening = [0.0, 10.0, 10000.0, 1e6][k % 4];
        let kinematic_hardening = [0.0, 20000.0, 0.0, 3e5, 7.0][k % 5];
        let material = VonMises { hardening, kinematic_hardening, ..STEEL };
        let mut history = PlasticState::VIRGIN;
        if k % 3 > 0 {
            history = material.commit(&random.vector(0.01), &history);
        }
        let size = [1e-3, 4e-3, 2e-2][k % 5 % 3];
        let start = history.plastic_strain;
        let step: Voigt = random.vector(size);
        (material, std::array::from_fn(|i| start[i] + step[i]), history)
    })
}

fn moved(strain: &Voigt, direction: &Voigt, by: f64) -> Voigt {
    std::array::from_fn(|i| strain[i] + by * direction[i])
}

/// x with matrix x = right, by Gaussian elimination without pivoting (the matrices are positive definite).
fn solve(mut matrix: Tangent, mut right: Voigt) -> Voigt {
    for k in 0..6 {
        let pivot = matrix[k];
        for i in 0..6 {
            if i != k {
                let factor = matrix[i][k] / pivot[k];
                for (entry, p) in matrix[i].iter_mut().zip(pivot) {
                    *entry -= factor * p;
                }
                right[i] -= factor * right[k];
            }
        }
    }
    std::array::from_fn(|i| right[i] / matrix[i][i])
}

/// The strain under a stress given in all components, except that the ones in `held` are given as strains.
fn strain_under(material: &VonMises, given: Voigt, held: &[usize]) -> (Voigt, Response) {
    strain_after(material, &PlasticState::VIRGIN, given, held)
}

/// The same from a committed state.
fn strain_after(material: &VonMises, committed: &PlasticState, given: Voigt, held: &[usize]) -> (Voigt, Response) {
    let mut strain = committed.plastic_strain;
    held.iter().for_each(|&i| strain[i] = given[i]);
    for _ in 0..50 {
        let stress = material.respond(&strain, committed).stress;
        let mut tangent = material.stiffness(&strain, committed, None);
        let mut rest: Voigt = std::array::from_fn(|i| given[i] - stress[i]);
        for &i in held {
            tangent[i] = [0.0; 6];
            tangent[i][i] = 1.0;
            rest[i] = 0.0;
        }
        if rest.iter().all(|r| r.abs() < 1e-10) {
            return (strain, material.respond(&strain, committed));
        }
        strain = moved(&strain, &solve(tangent, rest), 1.0);
    }
    panic!("the test's Newton method did not converge");
}

fn close(value: f64, expected: f64, digits: f64) {
    assert!((value - expected).abs() <= digits * expected.abs(), "{value} is not {expected}");
}

#[test]
fn uniaxial_tension() {
    for (stress, axial, lateral) in
        [(500.0, 7.380952380952e-3, -3.190476190476e-3), (600.0, 1.785714285714e-2, -8.328571428571e-3)]
    {
        let (strain, response) = strain_under(&STEEL, [stress, 0.0, 0.0, 0.0, 0.0, 0.0], &[]);
        close(strain[0], axial, 1e-12);
        close(strain[1], lateral, 1e-12);
        close(strain[2], lateral, 1e-12);
        close(response.equivalent_plastic_strain, (stress - 450.0) / 10000.0, 1e-12);
        assert!(response.plastic);
    }
}

#[test]
fn equibiaxial_tension_and_pure_shear() {
    let (strain, _) = strain_under(&STEEL, [500.0, 500.0, 0.0, 0.0, 0.0, 0.0], &[]);
    close(strain[0], 4.190476190476e-3, 1e-12);
    close(strain[1], 4.190476190476e-3, 1e-12);
    close(strain[2], -6.380952380952e-3, 1e-12);
    for shear in 3..6 {
        let mut stress = [0.0; 6];
        stress[shear] = 300.0;
        close(strain_under(&STEEL, stress, &[]).0[shear], 1.574342794511e-2, 1e-12);
    }
}

#[test]
fn plane_strain_compression() {
    for (pressed, sy, sz, ex, kappa) in [
        (-0.003, -521.0219850755, -180.9355848486, 1.5960848602e-3, 8.181380250e-4),
        (-0.01, -615.0331028446, -277.3841778765, 8.2151654386e-3, 8.348593996e-3),
    ] {
        let (strain, response) = strain_under(&STEEL, [0.0, pressed, 0.0, 0.0, 0.0, 0.0], &[1, 2]);
        close(response.stress[1], sy, 1e-11);
        close(response.stress[2], sz, 1e-11);
        close(strain[0], ex, 1e-10);
        close(response.equivalent_plastic_strain, kappa, 1e-9);
    }
}

/// Equivalent stress of the stress less the back stress of `history`.
fn distance(response: &Response, material: &VonMises, history: &PlasticState) -> f64 {
    let back = material.back_stress(history);
    von_mises(&std::array::from_fn(|i| response.stress[i] - back[i]))
}

#[test]
fn a_plastic_stress_is_on_the_yield_surface_and_an_elastic_one_inside() {
    let mut plastic = 0;
    for (material, strain, history) in states() {
        let response = material.respond(&strain, &history);
        let limit = 450.0 + material.hardening * response.equivalent_plastic_strain;
        if response.plastic {
            plastic += 1;
            close(distance(&response, &material, &material.commit(&strain, &history)), limit, 1e-12);
            assert!(response.equivalent_plastic_strain > history.kappa);
        } else {
            assert!(distance(&response, &material, &history) <= limit);
            assert_eq!(response.equivalent_plastic_strain, history.kappa);
        }
    }
    assert!((100..380).contains(&plastic), "both branches are tested: {plastic} of 400 are plastic");
}

#[test]
fn stress_is_the_derivative_of_the_potential_and_the_tangent_that_of_the_stress() {
    let mut random = Random::new(1);
    let h = 1e-8;
    for (material, strain, history) in states() {
        let tangent = material.stiffness(&strain, &history, None);
        let direction = random.vector(1.0);
        let at = |by| material.respond(&moved(&strain, &direction, by), &history);
        let (back, here, ahead) = (at(-h), at(0.0), at(h));
        close((ahead.energy - back.energy) / (2.0 * h), contract(&here.stress, &direction), 2e-6);
        if back.plastic == ahead.plastic {
            let along = apply(&tangent, &direction);
            let scale = along.iter().fold(1e3f64, |m, s| m.max(s.abs()));
            for (i, s) in along.iter().enumerate() {
                let difference = (ahead.stress[i] - back.stress[i]) / (2.0 * h);
                assert!((difference - s).abs() < 1e-6 * scale, "{difference} {s}");
            }
        }
    }
}

#[test]
fn tangent_is_symmetric_and_between_its_bounds() {
    let mut random = Random::new(2);
    for (material, strain, history) in states() {
        let (c, tangent) = (material.hooke().tangent(), material.stiffness(&strain, &history, None));
        assert!((0..36).all(|n| tangent[n / 6][n % 6] == tangent[n % 6][n / 6]));
        let hardening = material.hardening + material.kinematic_hardening;
        let least = hardening / (3.0 * material.hooke().shear_modulus() + hardening);
        // Only the part transversal to the flow is reduced further, to the ratio of yield stress and trial stress.
        let shrink = Trial::new(&material, &strain, &history).shrink;
        for _ in 0..20 {
            let direction = random.vector(1.0);
            let elastic = contract(&apply(&c, &direction), &direction);
            let form = contract(&apply(&tangent, &direction), &direction);
            assert!(form <= elastic * (1.0 + 1e-14));
            assert!(form >= elastic * least.min(shrink) - 1e-12 * elastic && form > 0.0);
        }
        if !material.respond(&strain, &history).plastic {
            assert_eq!(tangent, c);
        }
    }
}

#[test]
fn potential_is_convex() {
    let mut random = Random::new(3);
    for (material, strain, history) in states() {
        let direction = random.vector(0.01);
        let at = |by| material.respond(&moved(&strain, &direction, by), &history).energy;
        for t in [0.1, 0.5, 0.8] {
            let chord = (1.0 - t) * at(0.0) + t * at(1.0);
            assert!(at(t) <= chord * (1.0 + 1e-14));
        }
    }
}

/// The constant of Psi: after a commit it forgets exactly what the step dissipated and stored by hardening.
#[test]
fn potential_of_a_step_is_the_elastic_one_after_it_and_the_plastic_work_of_it() {
    for (material, strain, history) in states() {
        let after = material.commit(&strain, &history);
        let (step, next) = (material.respond(&strain, &history), material.respond(&strain, &after));
        let (old, new) = (history.kappa, after.kappa);
        let work = 450.0 * (new - old) + 0.5 * material.hardening * (new * new - old * old);
        let stored = |h: &PlasticState| 0.5 * contract(&material.back_stress(h), &h.plastic_strain);
        close(step.energy, next.energy + work + stored(&after) - stored(&history), 1e-12);
        assert!(!next.plastic, "a committed point answers elastically");
        let rounding = 1e-12 * von_mises(&step.stress);
        assert!(step.stress.iter().zip(next.stress).all(|(a, b)| (a - b).abs() < rounding));
        assert!(trace(&after.plastic_strain).abs() < 1e-16);
    }
}

/// A point that is not strained further, or back a little, is elastic and keeps its stress; the commit of it is no news.
#[test]
fn a_committed_point_waits() {
    for (material, strain, history) in states() {
        let after = material.commit(&strain, &history);
        close(material.commit(&strain, &after).kappa, after.kappa, 1e-12);
        assert_eq!(material.stiffness(&strain, &after, None), material.hooke().tangent());
    }
}

/// Cycles of stress along one axis, against the rate equations integrated by hand: uniaxial and shear, both hardenings.
#[test]
fn cycles_of_stress_follow_the_closed_form() {
    let path = [500.0, 0.0, -620.0, 300.0, 700.0, -100.0, -900.0, 0.0];
    for (hardening, kinematic_hardening) in [(10000.0, 0.0), (0.0, 10000.0), (6000.0, 15000.0)] {
        let material = VonMises { hardening, kinematic_hardening, ..STEEL };
        for (component, root) in [(0, 1.0), (1, 1.0), (3, 3f64.sqrt()), (4, 3f64.sqrt())] {
            let (mut exact, mut history) = (Cycle::new(material), PlasticState::VIRGIN);
            for stress in path {
                let mut given = [0.0; 6];
                given[component] = stress / root;
                exact.load(stress);
                let (strain, response) = strain_after(&material, &history, given, &[]);
                let elastic =
                    if root == 1.0 { stress / 210000.0 } else { given[component] / material.hooke().shear_modulus() };
                close(strain[component] - elastic, root * exact.plastic, 1e-11);
                close(response.equivalent_plastic_strain, exact.kappa, 1e-11);
                history = material.commit(&strain, &history);
            }
        }
    }
}

#[test]
fn without_a_yield_stress_nothing_yields() {
    let elastic = VonMises::elastic(210000.0, 0.29);
    let strain = [0.1, 0.2, -0.3, 0.4, 0.5, 0.6];
    let response = elastic.respond(&strain, &PlasticState::VIRGIN);
    assert!(!response.plastic);
    let expected = apply(&elastic.hooke().tangent(), &strain);
    response.stress.iter().zip(expected).for_each(|(s, e)| close(*s, e, 1e-14));
    close(response.energy, 0.5 * contract(&expected, &strain), 1e-14);
    assert_eq!(elastic.commit(&strain, &PlasticState::VIRGIN), PlasticState::VIRGIN);
}

#[test]
fn the_divergence_is_the_potential_above_its_tangent_and_within_its_bounds() {
    let mut random = Random::new(11);
    for (material, strain, history) in states() {
        let step: Voigt = random.vector(1.0);
        let c = material.hooke().tangent();
        for size in [1e-2, 1e-4, 1e-9] {
            let change: Voigt = step.map(|x| size * x);
            let (at, to) = (material.respond(&strain, &history), moved(&strain, &step, size));
            let there = material.respond(&to, &history);
            let found = material.divergence(&strain, &change, &history);
            let elastic = 0.5 * contract(&apply(&c, &change), &change);
            let terms = at.energy.abs() + there.energy.abs() + elastic;
            let expected = there.energy - at.energy - contract(&at.stress, &change);
            assert!((found - expected).abs() <= 1e-11 * elastic + 1e-13 * terms, "{size}: {found} {expected}");
            assert!(found <= (1.0 + 1e-12) * elastic);
            assert!(found >= (material.least_tangent() - 1e-12) * elastic, "{size}: {found} {elastic}");
            let difference: Voigt = std::array::from_fn(|i| there.stress[i] - at.stress[i]);
            let of_stress = 0.5 * material.hooke().complementary_square(&difference);
            let rounding = 1e-12 * (elastic * terms).sqrt();
            assert!(found >= of_stress - 1e-12 * elastic - rounding, "{size}: {found} {of_stress}");
        }
    }
}

/// Where no yield surface is near, a small change sees half the tangent.
#[test]
fn for_small_changes_the_divergence_is_half_the_tangent() {
    let mut random = Random::new(12);
    let mut tested = 0;
    for (material, strain, history) in states() {
        let change: Voigt = random.vector(1e-10);
        let (at, there) =
            (material.respond(&strain, &history), material.respond(&moved(&strain, &change, 1e4), &history));
        if at.plastic != there.plastic || material.least_tangent() < 1e-2 {
            continue;
        }
        let half = 0.5 * contract(&apply(&material.stiffness(&strain, &history, None), &change), &change);
        close(material.divergence(&strain, &change, &history), half, 1e-6);
        tested += 1;
    }
    assert!(tested > 50);
}

#[test]
fn a_firmer_law_has_the_tangents_that_are_asked_for_and_the_same_strength() {
    for least in [1e-6, 1e-4, 0.5] {
        let soft = VonMises { hardening: 0.0, kinematic_hardening: 0.0, ..STEEL };
        let firm = soft.firmer(least);
        assert!((firm.least_tangent() / least - 1.0).abs() < 1e-12 && firm.yield_stress == soft.yield_stress);
        assert_eq!(firm.firmer(0.5 * least), firm);
        let elastic = VonMises { yield_stress: None, ..STEEL };
        assert_eq!(elastic.firmer(least), elastic);
    }
}

#[test]
fn no_stress_without_pressure_has_more_power_than_the_dissipation_and_that_of_flow_has_it() {
    let perfect = VonMises { hardening: 0.0, kinematic_hardening: 0.0, ..STEEL };
    let mut random = Random::new(11);
    for _ in 0..100 {
        let rate: Voigt = random.vector(1.0);
        let most = perfect.dissipation(&rate).expect("it has a limit");
        let power = |strain: &Voigt| contract(&deviator(&perfect.respond(strain, &PlasticState::VIRGIN).stress), &rate);
        assert!(power(&random.vector(0.1)) <= most * (1.0 + 1e-12));
        assert!((power(&rate) / most - 1.0).abs() < 1e-12);
    }
    let none = [VonMises { yield_stress: None, ..perfect }, VonMises { hardening: 1.0, ..perfect }];
    assert!(none.iter().all(|law| law.dissipation(&[1.0; 6]).is_none()));
}

/// A strain of a stress has this stress, and is the only one where the material hardens. Where it does not, stresses beyond the yield
/// surface become such on it.
#[test]
fn strains_of_stresses_have_these_stresses() {
    let near = |a: &Voigt, b: &Voigt| {
        let [difference, size] = [&difference(*a, *b), b].map(stress_norm);
        assert!(difference <= 1e-9 * size, "{a:?} is not {b:?}");
    };
    for (material, strain, history) in states() {
        let stress = material.respond(&strain, &history).stress;
        let found = material.strain(&stress, &history);
        near(&material.respond(&found, &history).stress, &stress);
        let slope = material.hardening + material.kinematic_hardening;
        if slope >= 10.0 {
            near(&found, &strain);
        }
        let beyond = stress.map(|s| 5.0 * s);
        let reached = material.respond(&material.strain(&beyond, &history), &history).stress;
        if slope > 0.0 {
            near(&reached, &beyond);
        } else {
            close(trace(&reached), trace(&beyond), 1e-9);
            let kept = von_mises(&reached) / von_mises(&beyond);
            near(&deviator(&reached), &deviator(&beyond).map(|s| kept * s));
            assert!(kept <= 1.0 && von_mises(&reached) <= STEEL.yield_stress.unwrap() * (1.0 + 1e-12));
        }
    }
}
