//! Homogeneous states and rigid motions, whose measures are known.

use crate::comm::threads;
use crate::fixture::RANKS;
use crate::monitor::timing::Timer;
use crate::record::state::Extreme;
use crate::record::summary::Summary;
use crate::scene::Scene;
use crate::study;
use crate::vector::{difference, length};

/// What a built-in scene ends with after these changes.
fn solve(name: &str, sets: &[&str]) -> Summary {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    solve_scene(&Scene::load(name, 1, &sets).unwrap())
}

/// What a scene ends with, the same on any ranks.
fn solve_scene(scene: &Scene) -> Summary {
    let mut found = RANKS.into_iter().map(|ranks| {
        let summaries = threads::run(ranks, |comm| {
            let discrete = crate::model::discrete::discretise(scene, comm).unwrap();
            study::solve(scene, &discrete, comm, study::Begin::Rest, &Timer::start(), &mut ()).unwrap().summary
        });
        assert!(summaries.iter().all(|s| s.warnings == summaries[0].warnings));
        summaries.into_iter().next().unwrap()
    });
    let first = found.next().unwrap();
    assert!(
        found
            .all(|other| (other.state.measures, other.warnings)
                == (first.state.measures.clone(), first.warnings.clone()))
    );
    assert_eq!(first.converged, Some(true), "{:?}", first.error);
    first
}

#[track_caller]
fn assert_is(found: &Option<Extreme>, of: &str, expected: f64) {
    let found = found.as_ref().expect("it is measured");
    assert!(found.of == of && (found.value / expected - 1.0).abs() < 1e-3, "{found:?}, not {expected}");
}

/// Pure shear of an elastic block.
fn shear(angle: f64, more: &[&str]) -> Summary {
    let stress = angle * 210_000.0 / 2.58;
    let sets = [
        "material.steel.yield_stress=1e9".to_owned(),
        format!("support.top.displacement.0={}", 1000.0 * angle),
        format!("load.left.traction.1={}", -stress),
        format!("load.right.traction.1={stress}"),
    ];
    solve("shear", &[&sets.each_ref().map(|set| &set[..])[..], more].concat())
}

#[test]
fn strain_rotation_and_displacement_are_those_of_pure_shear() {
    for (angle, told) in [(0.1, 0), (0.3, 3)] {
        let Summary { state, warnings, .. } = shear(angle, &[]);
        assert_is(&state.measures.max_strain, "block", angle / 2.0_f64.sqrt());
        assert_is(&state.measures.max_rotation, "block", 0.5 * angle);
        assert_is(&state.measures.max_relative_displacement, "block", angle / 3.0_f64.sqrt());
        assert_eq!(state.measures.max_relative_displacement.unwrap().at[1], 1000.0);
        assert_eq!(warnings.len(), told, "{warnings:?}");
        for (warning, part) in warnings.iter().zip(["strain", "rotation", "displacement"]) {
            assert!(warning.contains(part) && warning.contains("body block reaches 0."), "{warning}");
            assert!(warning.contains("near [") && !warning.contains("at time"), "{warning}");
        }
    }
}

#[test]
fn a_history_is_told_by_its_worst_increment() {
    let Summary { state, warnings, .. } = shear(0.3, &["step=[{amplitude=0.2}, {}, {amplitude=0}]"]);
    assert!(state.measures.max_strain.is_none_or(|strain| strain.value < 1e-6));
    assert!(warnings.len() == 3 && warnings.iter().all(|w| w.contains("at time 2,")), "{warnings:?}");
}

#[test]
fn sliding_and_closing_gaps_are_measured_where_contact_is_closed() {
    for (way, told) in [(300.0, false), (400.0, true)] {
        let found = solve("patch", &[&format!("support.upper-back.displacement=[{way}, 0, 0]")]);
        assert_is(&found.state.measures.max_sliding, "joint", way / (250.0 * 2.0_f64.sqrt()));
        assert_eq!(found.warnings.iter().any(|w| w.contains("in contact joint")), told, "{:?}", found.warnings);
    }
    for (gap, told) in [(100.0, false), (300.0, true)] {
        let origin = format!("body.upper.brick.origin.2={}", 1000.0 + gap);
        let top = |way: f64| format!("support.top.displacement.2={way}");
        let found = solve("patch", &[&origin, &top(-gap - 3.0)]);
        assert_is(&found.state.measures.max_closed_gap, "joint", gap / 3e6_f64.sqrt());
        assert_eq!(found.warnings.iter().any(|w| w.contains("gap that closes")), told, "{:?}", found.warnings);
        assert_eq!(solve("patch", &[&origin, &top(-0.5 * gap)]).state.measures.max_closed_gap, None);
    }
}

/// A ball that is moved over the cube: nodes slide against it, though they hardly move.
#[test]
fn obstacles_slide_too() {
    let way = |x: f64| format!("contact.ball.displacement=[{x}, 0, 0]");
    let coarse = ["body.cube.brick.cells=[8, 8, 8]", "material.metal.yield_stress=1e9"];
    let edge = 0.5 / 8.0 * 2.0_f64.sqrt();
    let found = solve("step-42", &[&coarse[..], &[&way(0.1)]].concat());
    let sliding = found.state.measures.max_sliding.unwrap();
    assert!((0.9..1.1).contains(&(sliding.value * edge / 0.1)), "{sliding:?}");
    assert!(found.warnings.iter().any(|w| w.contains("the sliding")), "{:?}", found.warnings);
}

#[test]
fn overlaps_are_told_before_anything_is_solved() {
    let told = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let scene = Scene::load("patch", 1, &sets).unwrap();
        threads::run(2, |comm| crate::model::discrete::discretise(&scene, comm).unwrap().warnings).swap_remove(0)
    };
    assert_eq!(told(&[]), Vec::<String>::new());
    assert_eq!(told(&["body.upper.brick.origin.2=950"]), Vec::<String>::new());
    for (set, depth) in [
        ("body.upper.brick.origin.2=800", "200"),
        ("contact.joint.gap=-150", "150"),
        ("contact.joint.clearance=-5000", "5000"),
        ("body.upper.brick.origin.2=0", "1000"),
    ] {
        let warnings = told(&[set]);
        assert!(warnings.len() == 1 && warnings[0].contains(&format!("overlap by {depth} near")), "{warnings:?}");
    }
}

#[test]
fn coordinates_too_large_for_the_strain_are_told() {
    let far = |x: f64| {
        let origins = [("lower", 0.0), ("upper", 1000.0)];
        let origin = |(body, z): (&str, f64)| format!("body.{body}.brick.origin=[{x}, {x}, {}]", x + z);
        let origins = origins.map(origin);
        solve("patch", &[&origins[0], &origins[1], "support.top.displacement.2=-1e-3"])
    };
    assert_eq!(far(1e8).warnings, Vec::<String>::new());
    let found = far(1e10);
    assert!(found.warnings.len() == 1 && found.warnings[0].contains("rounding of coordinates"), "{:?}", found.warnings);
    let rounding = found.state.measures.max_rounding.unwrap().value;
    let stretch = found.state.measures.max_strain.unwrap().value * 3e6_f64.sqrt();
    assert!((rounding / (f64::EPSILON * 1e10 / stretch) - 1.0).abs() < 1e-2);
}

/// A ball in a block, above the middle of a face: where nodes are too far away they do not know of it.
#[test]
fn an_obstacle_between_nodes_is_told() {
    let solved = |depth: f64, cells: usize| {
        let sets = [
            format!("contact.ball.rigid.sphere.centre=[0.75, 0.75, {}]", 1.6 - depth),
            format!("body.cube.brick.cells=[{cells}, {cells}, 5]"),
            "decomposition.cells=[5, 5, 5]".to_owned(),
            "body.cube.element=\"hex8\"".to_owned(),
            "material.metal.yield_stress=1e9".to_owned(),
        ];
        solve("step-42", &sets.each_ref().map(|set| &set[..]))
    };
    // Corners of the face are 4.2e-3 from the undeformed ball.
    let missed = solved(3e-3, 5);
    assert_is(&missed.state.measures.max_missed_pressure, "ball", 1.0);
    assert!(length(difference(missed.state.measures.max_missed_pressure.unwrap().at, [0.75, 0.75, 1.0])) < 1e-12);
    assert!(missed.warnings.len() == 1 && missed.warnings[0].contains("between nodes of contact ball"));
    // What enters a face grows with the square of its width, the pressure does not change.
    let [coarse, fine] = [15, 25].map(|cells| {
        let found = solved(0.01, cells);
        assert_eq!(found.warnings, Vec::<String>::new());
        let share = found.state.measures.max_missed_pressure.expect("the ball is between nodes").value;
        share / (1.0 - share)
    });
    assert!((coarse / fine / (25.0 / 15.0) - 1.0).abs() < 0.3, "{coarse} {fine}");
}

/// A hard ball in a soft block, whose faces are far wider than the ball's and are the slave's.
#[test]
fn a_master_between_nodes_is_told() {
    let solved = |cells: usize| {
        let brick =
            format!("brick = {{ origin = [-0.5, -0.5, 1.0], size = [1.0, 1.0, 0.5], cells = [{cells}, {cells}, 2] }}");
        let text = format!(
            r#"
            [material.soft]
            young = 1e3
            poisson = 0.3
            [material.hard]
            young = 1e5
            poisson = 0.3
            [body.block]
            material = "soft"
            element = "tet4"
            {brick}
            [body.ball]
            material = "hard"
            element = "tet4"
            sphere = {{ inner = 0.5, outer = 1.0, cells = [8, 2] }}
            [support.top]
            surface = "block.zmax"
            fix = ["x", "y", "z"]
            displacement = [0.0, 0.0, -0.005]
            [support.inner]
            surface = "ball.inner"
            fix = ["x", "y", "z"]
            [contact.fit]
            surfaces = ["block.zmin", "ball.outer"]
            "#
        );
        solve_scene(&Scene::from_text(&text, "hard ball", 1, &[]).unwrap())
    };
    let missed = solved(3);
    assert_is(&missed.state.measures.max_missed_pressure, "fit", 1.0);
    assert!(missed.warnings.iter().any(|w| w.contains("between nodes of contact fit")), "{:?}", missed.warnings);
    assert!(solved(9).warnings.iter().all(|w| !w.contains("between nodes")));
}
