//! The tangent with a direction of flow of its own, see [`crate::assembly::flow`].

use super::*;

/// A deviator of a random direction, of a length in the unit ball or on its boundary.
fn direction(random: &mut Random, length: f64) -> Voigt {
    let d = deviator(&random.vector(1.0));
    let norm = stress_norm(&d);
    d.map(|d| length * d / norm)
}

/// N, from the stress alone.
fn normal(material: &VonMises, strain: &Voigt, history: &PlasticState) -> Voigt {
    let stress = deviator(&material.respond(strain, history).stress);
    let back = material.back_stress(history);
    let relative: Voigt = std::array::from_fn(|i| stress[i] - back[i]);
    let norm = stress_norm(&relative);
    relative.map(|s| s / norm)
}

/// The tangent with any direction of flow in the ball, and with the one that Newton's method has.
#[test]
fn any_direction_of_flow_gives_a_tangent_within_bounds() {
    let mut random = Random::new(11);
    for (k, (material, strain, history)) in states().enumerate() {
        let flow = direction(&mut random, [0.0, 0.3, 1.0][k % 3]);
        let found = material.stiffness(&strain, &history, Some(&flow));
        let (elastic, least) = (material.hooke().tangent(), material.least_tangent());
        let radial = material.stiffness(&strain, &history, Some(&normal(&material, &strain, &history)));
        let consistent = material.stiffness(&strain, &history, None);
        for _ in 0..20 {
            let x: Voigt = random.vector(1.0);
            let (value, full) = (quadratic(&found, &x), quadratic(&elastic, &x));
            assert!(value >= (least - 1e-9) * full && value <= 2.0 * full, "{value} of {full}");
            close(quadratic(&radial, &x), quadratic(&consistent, &x), 1e-9);
        }
        (0..6).for_each(|i| (0..6).for_each(|j| assert_eq!(found[i][j], found[j][i])));
    }
}

/// Where the direction is N, its linear equation is that of N itself; where it is not, a whole step without a change of strain
/// makes it N, and a step of no length leaves it.
#[test]
fn the_direction_of_flow_follows_the_linear_equation() {
    let mut random = Random::new(13);
    let mut plastic = 0;
    for (material, strain, history) in states() {
        if !material.respond(&strain, &history).plastic {
            let change: Voigt = random.vector(1e-2);
            let found = material.flow(&strain, &history, None, (&change, 0.5));
            let after = moved(&strain, &change, 1.0);
            // The trial stress is that of an elastic material.
            let expected = normal(&VonMises { yield_stress: None, ..material }, &after, &history);
            (0..6).for_each(|i| assert!((found[i] - expected[i]).abs() < 1e-9, "{found:?} {expected:?}"));
            continue;
        }
        plastic += 1;
        let expected = normal(&material, &strain, &history);
        let flow = direction(&mut random, 0.7);
        let still = material.flow(&strain, &history, Some(&flow), (&[0.0; 6], 1.0));
        let none = material.flow(&strain, &history, Some(&flow), (&[0.0; 6], 0.0));
        for i in 0..6 {
            assert!((still[i] - expected[i]).abs() < 1e-9 && (none[i] - flow[i]).abs() < 1e-12);
        }
        // A quadratic error, by two sizes; the ball is left by second-order terms only.
        let change: Voigt = random.vector(1e-5);
        let error = |by: f64| {
            let change = change.map(|c| by * c);
            let found = material.flow(&strain, &history, None, (&change, 1.0));
            let exact = normal(&material, &moved(&strain, &change, 1.0), &history);
            stress_norm(&std::array::from_fn(|i| found[i] - exact[i]))
        };
        let (coarse, fine) = (error(1.0), error(0.5));
        assert!(coarse < 1e-2 && fine <= 0.3 * coarse + 1e-10, "{coarse:e} {fine:e}");
    }
    assert!(plastic > 100);
}

/// What the step assumes of the stress: with the direction as an unknown, `dev sigma = alpha + r xi + (1 - r) Y W`.
#[test]
fn the_tangent_is_that_of_the_stress_with_the_direction_as_an_unknown() {
    let mut random = Random::new(17);
    for (material, strain, history) in states() {
        if !material.respond(&strain, &history).plastic {
            continue;
        }
        let flow = direction(&mut random, 0.2);
        let (change, tiny) = (random.vector(1.0), 1e-7);
        let step = change.map(|c| tiny * c);
        // From inside the ball, where nothing is cut off.
        let found = material.flow(&strain, &history, Some(&flow), (&step, 0.0));
        let still = material.flow(&strain, &history, Some(&flow), (&[0.0; 6], 0.0));
        // The yield radius, the trial stress from an elastic material.
        let free = VonMises { yield_stress: None, ..material };
        let radius = (2.0f64 / 3.0).sqrt() * (material.yield_stress.unwrap() + material.hardening * history.kappa);
        let (r, x) = (material.least_tangent(), deviator(&free.respond(&step, &PlasticState::VIRGIN).stress));
        let turned: Voigt = std::array::from_fn(|i| r * x[i] + (1.0 - r) * radius * (found[i] - still[i]));
        // Its symmetric part is what is there: along the change itself both agree.
        let by_tangent = quadratic(&material.stiffness(&strain, &history, Some(&flow)), &change);
        let volume = crate::tensor::trace(&change);
        let expected = contract(&turned, &change) / tiny + material.hooke().bulk_modulus() * volume * volume;
        close(by_tangent, expected, 1e-6);
    }
}

fn quadratic(matrix: &Tangent, x: &Voigt) -> f64 {
    (0..6).map(|i| (0..6).map(|j| x[i] * matrix[i][j] * x[j]).sum::<f64>()).sum()
}
