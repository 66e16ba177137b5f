//! Meshes are refined until the error of a number is as small as the user asks for.

use crate::checkpoint::{assert_same_result, resume_with, stopped_after};
use crate::common::{
    assert_close, assert_scene_refused, number, only_result, run_briefly, run_misused, scene_file, solve_with, vector,
};
use fetiplast::analytic::hollow_sphere::HollowSphere;
use fetiplast::analytic::nested_spheres::NestedSpheres;
use fetiplast::material::VonMises;
use serde_json::Value;

const STEEL: VonMises = VonMises {
    young: 210_000.0,
    poisson: 0.29,
    yield_stress: Some(450.0),
    hardening: 10_000.0,
    kinematic_hardening: 0.0,
};
const SPHERE: HollowSphere = HollowSphere { inner: 100.0, outer: 200.0, material: STEEL };

fn scene(name: &str) -> String {
    format!("{}/scenes/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// The row of the last mesh.
pub fn last(summary: &Value) -> &Value {
    summary["refinements"].as_array().unwrap().last().unwrap()
}

/// The true error is not above the one that is asked for, and not far below it.
fn assert_met(scene: &str, sets: &[&str], error: f64, of: &str, exact: f64) {
    let wanted = error.to_string();
    let run = solve_with(2, scene, 1, sets, &["--error", &wanted, "--error-of", of]);
    assert!(run.stdout.contains("Q = "), "{}", run.stdout);
    let summary = run.converged().summary();
    let row = last(&summary);
    assert!(number(row, "error") <= error);
    assert_eq!(row["goal"], summary["steps"].as_array().unwrap().last().unwrap()["goal"]);
    let found = (number(&row["goal"], "value") / exact - 1.0).abs() / error;
    assert!((0.3..1.05).contains(&found), "{scene}, {of}, {error}: {found}");
}

/// Points inside, at the bore and outside of a sphere that yields in part.
#[test]
fn displacements_of_a_sphere_are_as_exact_as_asked_for() {
    let state = SPHERE.loaded(450.0, 0.0).unwrap();
    let scene = scene("precision/hollow-sphere.toml");
    let diagonal = 100.0 / 3.0_f64.sqrt();
    let bore = format!("displacement:{diagonal},{diagonal},{diagonal}:1,1,1");
    for error in [0.01, 0.005, 0.001] {
        assert_met(&scene, &[], error, &bore, state.displacement(100.0));
    }
    for error in [0.005, 0.002, 0.001] {
        assert_met(&scene, &[], error, "displacement:200,0,0:x", state.displacement(200.0));
    }
}

/// Two spheres, one of which yields: through contact.
#[test]
fn displacements_behind_a_contact_are_as_exact_as_asked_for() {
    let outer_material = VonMises::elastic(STEEL.young, STEEL.poisson);
    let exact = NestedSpheres { inner: SPHERE, outer_radius: 300.0, outer_material, gap: 0.05 }.loaded(600.0).unwrap();
    let cells = ["inner", "outer"].map(|body| format!("body.{body}.sphere.cells=[2, 2]"));
    let (scene, cells) = (scene("precision/nested-spheres.toml"), [&cells[0][..], &cells[1][..]]);
    for error in [0.02, 0.005] {
        assert_met(&scene, &cells, error, "displacement:300,0,0:x", exact.outer.displacement(300.0));
    }
}

/// A pressure in the bore: the reaction of a plane of symmetry balances it whatever the mesh, but for its curved faces.
#[test]
fn a_reaction_that_balances_loads_needs_one_mesh() {
    let run =
        solve_with(1, &scene("precision/hollow-sphere.toml"), 1, &[], &["--error", "0.1%", "--error-of", "reaction:z"]);
    let summary = run.converged().summary();
    assert_eq!(summary["refinements"].as_array().unwrap().len(), 1);
    let exact = -450.0 * std::f64::consts::PI * 100.0 * 100.0 / 4.0;
    assert_close("reaction", number(&last(&summary)["goal"], "value"), exact, 1e-4);
}

/// Against the contact force of meshes with twenty times the unknowns, and what is left of the load.
#[test]
fn forces_of_the_benchmark_are_as_exact_as_asked_for() {
    const FORCE: f64 = 1.948_05e8;
    const LOAD: f64 = 150.0 * 3000.0 * 1000.0;
    for error in [0.002, 0.001] {
        assert_met("two-blocks", &[], error, "contact_force", FORCE);
    }
    assert_met("two-blocks", &[], 0.002, "reaction:right:z", LOAD - FORCE);
    // What the solver left is not in it, and is in the forces of the summary.
    let run = solve_with(2, "two-blocks", 1, &[], &["--error", "0.5%", "--error-of", "contact_force:joint:z"]);
    let summary = run.converged().summary();
    let (force, goal) = (vector(&summary["contact_forces"]["joint"])[2], &last(&summary)["goal"]);
    let left = (force - number(goal, "value")).abs();
    assert!((left / number(goal, "gap") - 1.0).abs() < 1e-3 && left < 1e-3 * force, "{left} {goal}");
}

#[test]
fn ranks_change_no_bit_of_it() {
    let of = |ranks| {
        let more = ["--error", "0.05", "--error-of", "displacement:600,500,2000:z", "--max-unknowns", "20000"];
        only_result(solve_with(ranks, "two-blocks", 1, &[], &more).summary())
    };
    let alone = of(1);
    assert!(alone["refinements"].as_array().unwrap().len() > 2);
    assert!([2, 3, 5].into_iter().all(|ranks| of(ranks) == alone));
}

/// Stopped on the second mesh of a history.
#[test]
fn it_goes_on_from_a_checkpoint() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, out) = (directory.path().join("whole"), directory.path().join("stopped"));
    let sets = ["solver.error=0.02", "solver.error_of=contact_force", "step=[{increments=2}, {amplitude=0.5}]"];
    let mut arguments = vec!["solve", "two-blocks", "--progress", "off", "--out", whole.to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|set| ["--set", *set]));
    let run = run_briefly(2, &arguments);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let file = stopped_after(10, &out, &sets);
    let end = resume_with(2, &file, &[]);
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_same_result(&out, &whole, "two-blocks");
}

/// By symmetry nothing pushes sidewards; and a contact that is open has no force.
#[test]
fn a_number_that_is_zero_ends_with_a_message() {
    let run = solve_with(2, "two-blocks", 1, &[], &["--error", "1%", "--error-of", "reaction:left:x"]);
    assert_eq!(run.code, 1);
    let text = run.summary()["error"].as_str().unwrap().to_owned();
    assert!(text.contains("the number is zero"), "{text}");
    let sets = ["contact.joint.gap=500.0", "load.top.traction=[0.0, 0.0, -1.0]"];
    let run = solve_with(1, "two-blocks", 1, &sets, &["--error", "1%", "--error-of", "contact_force"]);
    assert_eq!(run.code, 1);
    assert!(run.summary()["error"].as_str().unwrap().contains("the number is zero"));
}

#[test]
fn numbers_that_do_not_exist_are_refused() {
    let refused = |of: &str, words: &[&str]| {
        assert_scene_refused("two-blocks", &["solver.error=0.01", &format!("solver.error_of={of}")], 65, words);
    };
    refused("displacement:9000,0,0:z", &["[9000.0, 0.0, 0.0] is outside of all bodies"]);
    refused("displacement:900,500,1000:z", &["lower and upper both have the point", "displacement:X,Y,Z:z:lower"]);
    refused("displacement:0,500,500:z", &["supports prescribe the displacement of the point"]);
    refused("contact_force:bolt", &["no such contact: known are joint"]);
    refused("reaction:floor:z", &["no such support: known are left, right"]);
    for bad in ["heat", "displacement:1,2:z", "displacement:1,2,3:up", "contact_force:joint:z:z"] {
        assert_eq!(run_misused(1, &["solve", "two-blocks", "--error", "1%", "--error-of", bad]).code, 64, "{bad}");
    }
    let directory = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(scene("limit/cylinder.toml")).unwrap();
    let file = scene_file(directory.path(), &text);
    assert_scene_refused(&file, &["solver.error=0.01", "solver.error_of=reaction"], 65, &["with [limit]"]);
}
