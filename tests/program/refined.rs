//! Meshes are refined until the error is as small as the user asks for.

use crate::checkpoint::{assert_same_result, resume_with, stopped_after};
use crate::common::fields::Fields;
use crate::common::{
    assert_close, assert_refused, assert_scene_refused, number, only_result, run_briefly, run_misused, scene_file,
    solve_with,
};
use fetiplast::analytic::hertz::Hertz;
use fetiplast::material::VonMises;
use serde_json::Value;

/// Of two-blocks, from two families of adaptive meshes of another program.
const LEAST_ENERGY: f64 = -1.4876e9;
/// Of nested spheres, the limit of uniform meshes of curved elements.
const SPHERES: f64 = -1_301_975.0;

fn rows(summary: &Value) -> &Vec<Value> {
    summary["refinements"].as_array().unwrap()
}

/// The true error of the energy on each mesh falls, and the last is near the one that was asked for, not above it.
#[test]
fn the_error_is_what_was_asked_for() {
    let summary = solve_with(2, "two-blocks", 1, &[], &["--error", "2%"]).converged().summary();
    let errors: Vec<f64> = rows(&summary).iter().map(|row| number(row, "energy") / LEAST_ENERGY - 1.0).collect();
    assert!(errors.len() > 3 && errors.windows(2).all(|pair| pair[1].abs() < pair[0].abs()), "{errors:?}");
    let last = errors.last().unwrap().abs();
    assert!((0.4..1.0).contains(&(last / 0.02)), "{last}");
    let row = rows(&summary).last().unwrap();
    assert!(number(row, "error") <= 0.02 && number(row, "unknowns") < 50_000.0);
    let multiplications: f64 = rows(&summary).iter().map(|row| number(row, "hessian_multiplications")).sum();
    assert!(multiplications < 140.0, "{multiplications}");
    assert_eq!(row["energy"], summary["energy"]);
    assert_eq!(row["elements"], summary["elements"]);
}

/// Contact of curved surfaces whose meshes stop to match; those of the limit match.
#[test]
fn curved_contact_does_not_limit_the_error() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/precision/nested-spheres.toml");
    let cells = ["inner", "outer"].map(|body| format!("body.{body}.sphere.cells=[2, 2]"));
    for (error, wanted, least, unknowns) in [("0.05%", 5e-4, 0.4, 8e3), ("0.01%", 1e-4, 0.1, 25e3)] {
        let run = solve_with(2, scene, 1, &[&cells[0], &cells[1]], &["--error", error]);
        let summary = run.converged().summary();
        let found = (number(&summary, "energy") / SPHERES - 1.0).abs();
        assert!((least..1.0).contains(&(found / wanted)), "{error}: {found}");
        let last = rows(&summary).last().unwrap();
        assert!(number(last, "unknowns") < unknowns, "{error}: {last}");
    }
}

/// Flat faces of a mesh file become the spheres that they stand for, unless they are meant to be flat.
#[test]
fn round_surfaces_of_mesh_files_are_followed() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/ring.toml");
    let faceted = ["inner", "outer"].map(|body| format!("body.{body}.gmsh.faceted=true"));
    for (sets, is_round) in [(&[][..], true), (&[&faceted[0][..], &faceted[1]][..], false)] {
        let run = solve_with(2, scene, 1, sets, &["--error", "0.05%"]).converged();
        let error = (number(&run.summary(), "energy") / SPHERES - 1.0).abs();
        assert!(if is_round { error < 5e-4 } else { error > 4e-3 }, "{is_round} {error}");
        assert_eq!(run.stdout.contains("body inner: spheres, cones or tori that"), is_round, "{}", run.stdout);
    }
}

/// A rigid ball on a block that begins with 162 tetrahedra: the pressure on its axis is that of Hertz for the force that is found.
#[test]
fn the_peak_of_a_pressure_is_found_from_a_few_hundred_elements() {
    const TEXT: &str = r#"
        [material.steel]
        young = 210000.0
        poisson = 0.3
        [body.block]
        material = "steel"
        element = "tet4"
        brick = { origin = [0.0, 0.0, -13.0], size = [13.0, 13.0, 13.0], cells = [3, 3, 3] }
        [support]
        x = { surface = "block.xmin", fix = ["x"] }
        y = { surface = "block.ymin", fix = ["y"] }
        ground = { surface = "block.zmin", fix = ["z"] }
        [contact.ball]
        slave = "block.zmax"
        rigid = { sphere = { centre = [0.0, 0.0, 99.99], radius = 100.0 } }
    "#;
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), TEXT);
    let run = solve_with(2, &scene, 1, &[], &["--error", "0.02%"]);
    let fields = Fields::read(&run.result());
    let summary = run.converged().summary();
    assert_eq!(rows(&summary)[0]["elements"], 162);
    let force = 4.0 * summary["contact_force"][2].as_f64().unwrap().abs();
    let peak = Hertz::new(&VonMises::elastic(210_000.0, 0.3), 100.0, force).peak;
    let on_axis = fields.points.iter().position(|x| *x == [0.0; 3]).unwrap();
    assert_close("peak pressure", fields.of_points("contact_pressure")[on_axis], peak, 0.01);
}

#[test]
fn ranks_change_no_bit_of_it() {
    let of = |ranks| {
        let run = solve_with(ranks, "two-blocks", 1, &[], &["--error", "0.06"]).converged();
        only_result(run.summary())
    };
    let alone = of(1);
    assert!(alone["refinements"].as_array().unwrap().len() > 2);
    assert!([2, 3, 5].into_iter().all(|ranks| of(ranks) == alone));
}

/// Stopped on the first, the second and the third mesh.
#[test]
fn it_goes_on_from_a_checkpoint_on_any_mesh() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, out) = (directory.path().join("whole"), directory.path().join("stopped"));
    let arguments = |out: &std::path::Path| {
        ["solve", "two-blocks", "--progress", "off", "--set", "solver.error=0.06", "--out", out.to_str().unwrap()]
            .map(String::from)
    };
    let whole_run = arguments(&whole);
    let run = run_briefly(1, &whole_run.each_ref().map(|s| &s[..]));
    assert_eq!(run.code, 0, "{}", run.stderr);
    for (steps, ranks) in [(1, 2), (5, 3), (6, 1)] {
        let file = stopped_after(steps, &out, &["solver.error=0.06"]);
        let end = resume_with(ranks, &file, &[]);
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert_same_result(&out, &whole, "two-blocks");
    }
}

/// The result on the largest mesh that is allowed is written, with its error.
#[test]
fn a_limit_of_unknowns_ends_it_with_the_best_result() {
    let run = solve_with(2, "two-blocks", 1, &[], &["--error", "1%", "--max-unknowns", "12000"]);
    assert_eq!(run.code, 1);
    assert!(run.result().exists());
    let summary = run.summary();
    let text = summary["error"].as_str().unwrap();
    assert!(text.contains("not 1.00 %") && text.contains("solver.max_unknowns is 12000"), "{text}");
    let row = rows(&summary).last().unwrap();
    assert!(number(row, "unknowns") > 6000.0 && number(row, "unknowns") <= 12000.0);
}

/// Errors of stresses, with linear tetrahedra that the user chose.
#[test]
fn the_stress_and_the_element_may_be_chosen() {
    let sets = ["body.lower.element=tet4", "body.upper.element=tet4", "load.top.traction=[0.0, 0.0, -20.0]"];
    let run = solve_with(2, "two-blocks", 1, &sets, &["--error", "30%", "--error-of", "stress"]).converged();
    assert!(!run.stdout.contains("tet10 in place"), "{}", run.stdout);
    let summary = run.summary();
    let last = rows(&summary).last().unwrap();
    assert!(number(last, "error") <= 0.3 && number(last, "stress") <= 0.3 && rows(&summary).len() > 1);
}

/// What is decided in place of the scene is told.
#[test]
fn the_choice_of_elements_is_told() {
    let run = solve_with(1, "two-blocks", 1, &["body.upper.element=tet4"], &["--error", "10%"]).converged();
    assert!(run.stdout.contains("body lower: tet10 in place of tet4"), "{}", run.stdout);
    assert!(!run.stdout.contains("body upper: tet10"), "{}", run.stdout);
}

#[test]
fn what_makes_no_sense_is_refused() {
    for bad in ["0", "1", "-1%", "150%", "much", "nan"] {
        let run = run_misused(1, &["solve", "two-blocks", "--error", bad]);
        assert_eq!(run.code, 64, "{bad}");
    }
    assert_scene_refused("two-blocks", &["solver.error=2"], 65, &["solver.error = 2", "above 0 and below 1"]);
    let run = solve_with(2, "two-blocks", 1, &["body.upper.element=hex8"], &["--error", "1%"]);
    assert_refused(&run, 65, &["body.upper.element = \"hex8\"", "only tet4 and tet10"]);
}

/// A history is refined where any of its increments has much of the error; it goes on from a checkpoint in its second increment.
#[test]
fn histories_are_solved_on_each_mesh() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, out) = (directory.path().join("whole"), directory.path().join("stopped"));
    let sets = ["solver.error=0.2", "step=[{increments=2}, {amplitude=0.2}]"];
    let mut arguments = vec!["solve", "two-blocks", "--progress", "off", "--out", whole.to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|set| ["--set", *set]));
    let run = run_briefly(2, &arguments);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let file = stopped_after(8, &out, &sets);
    let end = resume_with(2, &file, &[]);
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_same_result(&out, &whole, "two-blocks");
}
