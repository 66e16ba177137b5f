//! Meshes of result files as those of other scenes.

use std::path::Path;

use crate::common::{assert_refused, number, only_result, scene_file, solve_with};
use fetiplast::scene::library;

/// two-blocks on the meshes of a result.
fn on_meshes(directory: &Path, result: &Path, element: &str) -> String {
    let mut body = String::new();
    let line = |line: &str| {
        if let Some(name) = line.strip_prefix("[body.") {
            body = name.trim_end_matches(']').to_owned();
        }
        match line.split([' ', '=']).next() {
            Some("brick") => format!("gmsh = {{ file = {:?}, volume = \"{body}\" }}", result.to_str().unwrap()),
            Some("element") => format!("element = \"{element}\""),
            Some("method" | "cells") => String::new(),
            _ => line.to_owned(),
        }
    };
    let lines: Vec<String> = library::text("two-blocks").unwrap().lines().map(line).collect();
    scene_file(directory, &lines.join("\n"))
}

/// The energy of refined quadratic meshes is found again on any ranks, and an error asked for from there.
#[test]
fn refined_meshes_are_read_back() {
    let first = solve_with(2, "two-blocks", 1, &["solver.accuracy=1e-5"], &["--error", "5%"]).converged();
    let summary = first.summary();
    let directory = tempfile::tempdir().unwrap();
    let scene = on_meshes(directory.path(), &first.result(), "tet10");
    let [alone, three] = [1, 3].map(|ranks| solve_with(ranks, &scene, 1, &[], &[]).converged().summary());
    assert_eq!([&alone["elements"], &alone["nodes"]], [&summary["elements"], &summary["nodes"]]);
    let ratio = number(&alone, "energy") / number(&summary, "energy");
    assert!((ratio - 1.0).abs() < 1e-7, "{ratio}");
    assert_eq!(only_result(alone), only_result(three));

    let finer = solve_with(2, &scene, 1, &[], &["--error", "2%"]).converged().summary();
    let rows = finer["refinements"].as_array().unwrap();
    assert_eq!(rows[0]["elements"], summary["elements"]);
    assert!(rows.len() > 1 && number(rows.last().unwrap(), "error") <= 0.02);
}

/// Results of several times have one mesh. Hexahedra keep their faces of four nodes.
#[test]
fn meshes_of_histories_and_of_hexahedra_are_read_back() {
    let small = ["body.lower.brick.cells=[6, 2, 2]", "body.upper.brick.cells=[6, 2, 2]", "decomposition.subdomains=4"];
    let hexahedra = ["body.lower.element=hex8", "body.upper.element=hex8", "step=[{increments=2}]"];
    let tight = ["solver.residual_tolerance=1e-9", "solver.newton_tolerance=1e-9", "solver.qp_tolerance=1e-10"];
    let first = solve_with(2, "two-blocks", 1, &[&small[..], &hexahedra, &tight].concat(), &[]).converged();
    let directory = tempfile::tempdir().unwrap();
    let scene = on_meshes(directory.path(), &first.result(), "hex8");
    let again = solve_with(1, &scene, 1, &[&tight[..], &["step=[{increments=2}]"]].concat(), &[]).converged();
    let ratio = number(&again.summary(), "energy") / number(&first.summary(), "energy");
    assert!((ratio - 1.0).abs() < 1e-8, "{ratio}");
}

/// Surfaces that the first scene did not name are not there.
#[test]
fn what_a_result_does_not_have_is_refused() {
    let first = solve_with(1, "two-blocks", 1, &["decomposition.subdomains=8"], &["--error", "20%"]).converged();
    let directory = tempfile::tempdir().unwrap();
    let scene = on_meshes(directory.path(), &first.result(), "tet10");
    let run = solve_with(2, &scene, 1, &["support.left.surface=lower.ymin"], &[]);
    assert_refused(&run, 65, &["body.lower", "`ymin`", "`xmin`", "`zmax`"]);
    let run = solve_with(2, &scene, 1, &["body.lower.gmsh.volume=middle"], &[]);
    assert_refused(&run, 65, &["`middle`", "`lower`", "`upper`"]);
    let run = solve_with(2, &scene, 1, &["body.lower.element=tet4"], &[]);
    assert_refused(&run, 65, &["`lower`", "10-node tetrahedron"]);
}
