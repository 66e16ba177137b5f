//! The scenes with meshes from files, solved as they are or with fewer increments: against closed forms and balances.

use crate::common::fields::Fields;
use crate::common::{Run, assert_close, assert_residuals, number, solve, vector};
use fetiplast::analytic::hertz::Hertz;
use fetiplast::material::VonMises;
use serde_json::Value;

fn scene(name: &str, sets: &[&str]) -> Run {
    solve(2, &format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR")), sets).converged()
}

fn distance_from_axis([x, y, _]: [f64; 3]) -> f64 {
    x.hypot(y)
}

/// Elements are a tenth of the contact radius; finer ones are in `bench-results/accuracy.md`.
#[test]
fn a_ball_on_a_block_is_near_hertz() {
    let run = scene("hertz", &["solver.accuracy=0.1"]);
    let force = 4.0 * vector(&run.summary()["reactions"]["push"])[2].abs();
    // Two bodies that give as much are half as stiff as one on a rigid ball.
    let exact = Hertz::new(&VonMises::elastic(0.5 * 210_000.0, 0.3), 100.0, force);
    assert_close("approach", exact.approach, 0.01, 0.04);
    let fields = Fields::read(&run.result());
    let status = fields.integers_of_points("contact_status");
    let closed = (0..status.len()).filter(|&node| status[node] == 1);
    let radius = closed.fold(0.0_f64, |radius, node| radius.max(distance_from_axis(fields.points[node])));
    assert!((radius - exact.radius).abs() < 0.1 * exact.radius, "radius {radius} against {}", exact.radius);
    let peak = fields.of_points("contact_pressure").into_iter().fold(0.0, f64::max);
    assert_close("peak pressure", peak, exact.peak, 0.06);
}

/// What the head of the bolt bears goes through the washer and the plates to the nut, and the pull is taken off it.
#[test]
fn forces_in_bolted_plates_balance() {
    let run = scene("bolt", &["step.1.increments=1"]);
    let summary = run.summary();
    let rows = summary["steps"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    let pulls = rows.iter().map(|row| {
        assert_residuals(row, 1e-6);
        let along = |forces: &str, name: &str| vector(&row[forces][name])[2].abs();
        let [plates, washer, head, nut] =
            ["plates", "washer", "head", "nut"].map(|contact| along("contact_forces", contact));
        for (name, force) in [("washer", washer), ("nut", nut)] {
            assert_close(name, force, head, 1e-5);
        }
        let pull = along("reactions", "frame");
        assert!((washer - plates - pull).abs() < 1e-5 * head, "{washer} is not {plates} + {pull}");
        assert!(plates > 0.0 && row["plastic_elements"].as_u64() > Some(0));
        pull / head
    });
    let pulls: Vec<f64> = pulls.collect();
    assert!(pulls[0] < 1e-5 && pulls[1] > 0.1, "{pulls:?}");
}

/// Where all slips, what passes is what friction bears on both faces of the upper plate. What the support puts in through a closed
/// cycle is what friction dissipates, but for its increments.
#[test]
fn a_bolted_joint_slips_and_sticks_through_a_cycle() {
    let run = scene("joint", &["step.1.increments=5", "step.2.increments=10", "step.3.increments=10"]);
    let summary = run.summary();
    let rows = summary["steps"].as_array().unwrap();
    assert_eq!(rows.len(), 26);
    let force = |row: &Value, of: &str, name: &str, axis: usize| vector(&row[of][name])[axis];
    let passes = |row: &Value| force(row, "reactions", "pull", 0);
    let bears =
        |row: &Value| 0.2 * (force(row, "contact_forces", "plates", 2) + force(row, "contact_forces", "head", 2)).abs();
    for row in rows {
        assert_residuals(row, 1e-6);
        assert!(passes(row).abs() < (1.0 + 1e-6) * bears(row), "{} of {}", passes(row), bears(row));
        let [head, nut] = ["head", "nut"].map(|contact| force(row, "contact_forces", contact, 0));
        assert!((head + nut).abs() < 1e-5 * bears(row), "{head} and {nut} on the bolt");
    }
    for end in [5, 15, 25] {
        assert_close("force that slips", passes(&rows[end]).abs(), bears(&rows[end]), 1e-3);
    }
    let (mut area, mut dissipated) = (0.0, 0.0);
    for k in 6..26 {
        let moved = if k < 16 { -0.018 } else { 0.018 };
        area += 0.5 * (passes(&rows[k - 1]) + passes(&rows[k])) * moved;
        let contacts = rows[k]["friction"].as_object().unwrap();
        dissipated += contacts.values().map(|contact| number(contact, "dissipation")).sum::<f64>();
    }
    assert_close("area of the loop", area, dissipated, 0.02);
}

/// Pressed in and released: nothing touches any more, and a dent is left where it is deepest under the nose.
#[test]
fn a_punch_leaves_an_imprint() {
    let run = scene("punch", &["step.0.increments=1", "step.1.increments=1"]);
    let summary = run.summary();
    let [pressed, released] = [0, 1].map(|state| Fields::at(&run.result(), state));
    let rows = &summary["steps"];
    let force = vector(&rows[0]["contact_force"])[2].abs();
    assert!(vector(&rows[1]["contact_force"])[2].abs() < 1e-6 * force);
    let dent = |fields: &Fields| {
        let bodies = fields.body_of_points();
        let of_block = (0..bodies.len()).filter(|&node| bodies[node] == 0);
        let depth = |node: usize| (-fields.displacement[node][2], distance_from_axis(fields.points[node]));
        of_block.map(depth).fold((0.0, 0.0), |deepest, here| if here.0 > deepest.0 { here } else { deepest })
    };
    let (deep, left) = (dent(&pressed), dent(&released));
    assert!(deep.0 < 0.2 && left.0 < deep.0, "{deep:?} {left:?}");
    assert!(left.0 > 0.3 * deep.0 && left.1 < 0.5, "{left:?} of {deep:?}");
    let kappa = released.of_elements("equivalent_plastic_strain").into_iter().fold(0.0, f64::max);
    assert!(kappa > 1e-3);
}
