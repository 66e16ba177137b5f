//! Pressure and body force against what a traction does, and against closed forms that linear elements meet exactly.

use crate::common::{assert_close, assert_near, number, solve_tightly, vector};
use serde_json::Value;

const RANKS: usize = 2;

fn bar(sets: &[&str]) -> Value {
    solve_tightly(RANKS, "bar", sets).summary()
}

#[test]
fn a_pressure_that_pulls_is_a_traction_along_the_normal() {
    let (pulled, pressed) = (bar(&[]), bar(&["load.pull={surface = 'bar.xmax', pressure = -500}"]));
    for key in ["energy", "max_displacement", "max_von_mises"] {
        assert_close(key, number(&pressed, key), number(&pulled, key), 1e-9);
    }
    assert_near("reaction", vector(&pressed["reactions"]["back"]), vector(&pulled["reactions"]["back"]), 1e-9);
}

/// A uniaxial state `u_p` is in the space of linear elements, so Betti's theorem holds to round-off: the pressure's work on
/// the displacement of the weight is the weight's on that of the pressure, `-p/E integral of (b_x x - nu (b_y y + b_z z))`.
#[test]
fn weight_and_pressure_work_on_each_other_by_betti() {
    let elastic = "material.steel={young = 210000, poisson = 0.29}";
    let [b, p, nu] = [[3e-4, -2e-4, 1e-4], [40.0; 3], [0.29; 3]];
    let work = |weight: f64, pressure: f64| {
        let force = format!("load.weight={{body = 'bar', body_force = {:?}}}", b.map(|b| weight * b));
        let pull = format!("load.pull={{surface = 'bar.xmax', pressure = {}}}", pressure * p[0]);
        let summary = bar(&[elastic, &force, &pull]);
        let back = vector(&summary["reactions"]["back"])[0];
        assert_close("reaction", back, -500.0 * 500.0 * (1000.0 * weight * b[0] - pressure * p[0]), 1e-9);
        number(&summary, "external_work")
    };
    let mutual = work(1.0, 1.0) - work(1.0, 0.0) - work(0.0, 1.0);
    let volume = 1000.0 * 500.0 * 500.0;
    let exact = -p[0] / 210_000.0 * volume * (b[0] * 500.0 - nu[0] * (b[1] + b[2]) * 250.0);
    assert_close("mutual work", mutual, 2.0 * exact, 1e-8);
}

/// Amplitudes scale every kind of load; of several loads those named go their own way.
#[test]
fn every_kind_of_load_follows_the_steps() {
    let loads =
        ["load.pull={surface = 'bar.xmax', pressure = 50}", "load.weight={body = 'bar', body_force = [0.1, 0, 0]}"];
    let steps = "step=[{amplitude=-0.5}, {load={pull=2, weight=-0.25}}, {amplitude=0}]";
    let summary = bar(&[&loads[..], &[steps]].concat());
    let (pressure, weight) = (50.0, 0.1 * 1000.0);
    for (row, (p, w)) in [(-0.5, -0.5), (2.0, -0.25), (0.0, 0.0)].into_iter().enumerate() {
        let reaction = vector(&summary["steps"][row]["reactions"]["back"])[0];
        let expected = 250_000.0 * (p * pressure - w * weight);
        assert!((reaction - expected).abs() < 1e-9 * 250_000.0 * pressure, "{row}: {reaction} is not {expected}");
    }
}
