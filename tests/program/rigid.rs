//! Contact with rigid obstacles: homogeneous states against closed forms, balance of forces, and the force of a ball
//! against published numbers.

use crate::common::fields::{EXACT, Fields, assert_displacement, assert_uniform};
use crate::common::{assert_close, assert_near, assert_residuals, scene_file, solve, solve_tightly, vector};
use fetiplast::analytic::cycle::Cycle;
use fetiplast::material::VonMises;

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.29;

/// A cube of steel in eight subdomains, with what else the scene has.
fn cube(rest: &str) -> String {
    format!(
        r#"
        [material.steel]
        young = {YOUNG:?}
        poisson = {POISSON:?}
        yield_stress = 450.0
        hardening = 10000.0
        [body.cube]
        material = "steel"
        element = "tet4"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 1000.0], cells = [4, 4, 4] }}
        [decomposition]
        cells = [2, 2, 2]
        {rest}"#
    )
}

/// The same held along x and y at its sides and along z at its top, free to widen.
fn held(rest: &str) -> String {
    cube(&format!(
        r#"
        [support.back]
        surface = "cube.xmin"
        fix = ["x"]
        [support.side]
        surface = "cube.ymin"
        fix = ["y"]
        [support.top]
        surface = "cube.zmax"
        fix = ["z"]
        {rest}"#
    ))
}

/// Pushed down onto a floor 0.5 below: the stress is 472.5 (verification by hand: see `patch.rs`).
fn assert_floor(floor: &str, sets: &[&str]) {
    let rest = format!(
        r#"
        displacement = [0.0, 0.0, -5.0]
        [contact.floor]
        slave = "cube.zmin"
        rigid = {{ {floor} }}"#
    );
    let directory = tempfile::tempdir().unwrap();
    let run = solve_tightly(2, &scene_file(directory.path(), &held(&rest)), sets);
    let fields = Fields::read(&run.result());
    let (stress, plastic) = (472.5, 22.5 / 10_000.0);
    let (along, across) = (-stress / YOUNG - plastic, POISSON * stress / YOUNG + plastic / 2.0);
    assert_close("strain", along, -4.5e-3, 1e-14);
    assert_displacement(&fields, |node| {
        let [x, y, z] = fields.points[node];
        [across * x, across * y, along * z - 0.5]
    });
    assert_uniform("von Mises stress", fields.of_elements("von_mises"), stress, stress);
    let (pressure, gap) = (fields.of_points("contact_pressure"), fields.of_points("contact_gap"));
    let status = fields.integers_of_points("contact_status");
    let slaves: Vec<usize> = (0..gap.len()).filter(|&node| fields.points[node][2] == 0.0).collect();
    assert_uniform("contact pressure", slaves.iter().map(|&node| pressure[node]), stress, stress);
    assert_uniform("gap", slaves.iter().map(|&node| gap[node]), 0.0, 5.0);
    for node in 0..gap.len() {
        let slave = slaves.contains(&node);
        assert_eq!((status[node], gap[node].is_nan()), (if slave { 1 } else { -1 }, !slave));
    }
    let summary = run.summary();
    assert_eq!(summary["active_contacts"], 25);
    assert_near("contact force", vector(&summary["contact_forces"]["floor"]), [0.0, 0.0, stress * 1e6], EXACT);
    assert_eq!(summary["contact_force"], summary["contact_forces"]["floor"]);
}

#[test]
fn a_cube_on_a_plane_or_a_flat_height_field_is_in_the_state_of_the_closed_form() {
    assert_floor("plane = { point = [7.0, -3.0, -0.5], normal = [0.0, 0.0, 0.2] }", &[]);
    assert_floor("plane = { point = [7.0, -3.0, -0.5], normal = [0.0, 0.0, 0.2] }", &["solver.qp=smalse-m"]);
    let heights = "heights = [[-0.5, -0.5, -0.5], [-0.5, -0.5, -0.5]]";
    assert_floor(
        &format!("heightfield = {{ origin = [0.0, -5.0], spacing = [1000.0, 600.0], {heights} }}"),
        &["solver.preconditioner=lumped"],
    );
    assert_floor("plane = { point = [0.0, 0.0, 1.5], normal = [0.0, 0.0, 1.0] }", &["contact.floor.gap=2"]);
}

/// A floor that comes up, goes away, and comes again: what is left of the height is the plastic strain.
#[test]
fn a_moving_floor_presses_and_lets_go() {
    let rest = r#"
        [contact.floor]
        slave = "cube.zmin"
        rigid = { plane = { point = [0.0, 0.0, -0.5], normal = [0.0, 0.0, 1.0] } }
        displacement = [3.0, 0.0, 5.0]
        [[step]]
        increments = 2
        [[step]]
        amplitude = 0.0
        [[step]]
        amplitude = 0.3
        contact = { floor = 0.8 }"#;
    let directory = tempfile::tempdir().unwrap();
    let run = solve_tightly(2, &scene_file(directory.path(), &held(rest)), &[]);
    let material = VonMises { yield_stress: Some(450.0), hardening: 1e4, ..VonMises::elastic(YOUNG, POISSON) };
    let mut exact = Cycle::new(material);
    for (state, factor) in [(1, 1.0), (2, 0.0), (3, 0.8)] {
        // The floor carries no tension.
        let height = 5.0 * factor - 0.5;
        exact.stretch((-height / 1000.0_f64).min(exact.plastic));
        let gap = if exact.stress < 0.0 { 0.0 } else { -1000.0 * exact.plastic - height };
        let fields = Fields::at(&run.result(), state);
        let [along, across] = exact.uniaxial();
        assert_displacement(&fields, |node| {
            let [x, y, z] = fields.points[node];
            [across * x, across * y, along * (z - 1000.0)]
        });
        let gaps = fields.of_points("contact_gap").into_iter().filter(|gap| gap.is_finite());
        assert_uniform("gap", gaps, gap, 5.0);
        assert_uniform("von Mises stress", fields.of_elements("von_mises"), -exact.stress, 450.0);
        let force = vector(&run.summary()["steps"][state]["contact_forces"]["floor"]);
        assert_uniform("force", [force[2]], -exact.stress * 1e6, 450.0 * 1e6);
    }
    assert!(exact.plastic < -2e-3 && exact.stress < -200.0);
}

/// The loads press a cube into a corner; it has no supports, and its edges and a vertex are in several contacts.
#[test]
fn a_cube_that_only_three_planes_hold_is_in_the_state_of_the_closed_form() {
    let pressures = [100.0, 50.0, 20.0];
    let mut rest = String::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let unit = |length: f64| -> [f64; 3] { std::array::from_fn(|a| if a == axis { length } else { 0.0 }) };
        rest += &format!(
            r#"
            [load.{name}]
            surface = "cube.{name}max"
            traction = {:?}
            [contact.{name}]
            slave = "cube.{name}min"
            rigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = {:?} }} }}"#,
            unit(-pressures[axis]),
            unit(1.0)
        );
    }
    // One that the floor implies.
    rest += r#"
            [contact.again]
            slave = "cube.zmin"
            rigid = { plane = { point = [0.0, 0.0, -1.0], normal = [0.0, 0.0, 1.0] } }"#;
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &cube(&rest));
    for qp in ["solver.qp=active-set", "solver.qp=smalse-m"] {
        let run = solve_tightly(2, &file, &[qp]);
        let fields = Fields::read(&run.result());
        let sum: f64 = pressures.iter().sum();
        let strains = pressures.map(|p| (-(1.0 + POISSON) * p + POISSON * sum) / YOUNG);
        assert_displacement(&fields, |node| std::array::from_fn(|a| strains[a] * fields.points[node][a]));
        let summary = run.summary();
        assert_eq!(summary["active_contacts"], 75, "three conditions a vertex, two an edge");
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let expected = std::array::from_fn(|a| if a == axis { pressures[axis] * 1e6 } else { 0.0 });
            assert_near("contact force", vector(&summary["contact_forces"][name]), expected, EXACT);
        }
        assert_eq!(vector(&summary["contact_forces"]["again"]), [0.0; 3]);
        assert_eq!(summary["reactions"], serde_json::json!({}));
    }
}

#[test]
fn forces_on_a_cube_under_a_ball_balance_and_are_near_published_ones() {
    let summary = solve(2, "step-42", &[]).converged().summary();
    assert_residuals(&summary, 1e-6);
    let ball = vector(&summary["contact_forces"]["ball"]);
    let mut sum = ball;
    for (_, reaction) in summary["reactions"].as_object().unwrap() {
        vector(reaction).iter().zip(&mut sum).for_each(|(r, s)| *s += r);
    }
    assert!(sum.iter().all(|s| s.abs() < 1e-5 * ball[2].abs()), "{sum:?} is left of {ball:?}");
    // deal.II's on cells of the same width.
    assert_close("force on the whole ball", -4.0 * ball[2], 59.0988, 0.06);
    assert!(summary["plastic_elements"].as_u64() > Some(500));
}
