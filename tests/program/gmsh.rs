//! Bodies from mesh files: the benchmark's bricks written as files give the bricks' solution, for every number of
//! subdomains and ranks; meshes of Gmsh itself pass a patch test.

use std::fs;
use std::path::Path;

use crate::common::fields::Fields;
use crate::common::msh::{Form, write};
use crate::common::{COARSE, assert_close, assert_near, check, number, scene_file, solve, vector};
use fetiplast::mesh::Brick;
use serde_json::Value;
use tempfile::TempDir;

const TIGHT: [&str; 3] =
    ["solver.newton_tolerance=1e-8", "solver.residual_tolerance=1e-10", "solver.qp_tolerance=1e-10"];

const LOWER: Brick = Brick { origin: [0.0; 3], size: [3000.0, 1000.0, 1000.0], cells: [15, 5, 5] };
const UPPER: Brick = Brick { origin: [600.0, 0.0, 1000.0], ..LOWER };

/// The benchmark's scene with these bodies instead of its bricks, in a directory with this mesh file.
fn two_blocks(mesh: &[u8], lower: &str, upper: &str) -> (TempDir, String) {
    let text = include_str!("../../src/scene/library/two-blocks.toml");
    let mut bodies = [lower, upper].into_iter();
    let line = |line: &str| match line {
        _ if line.starts_with("brick =") => {
            format!("gmsh = {{ file = \"parts/two.msh\", {} }}", bodies.next().unwrap())
        }
        _ if line.starts_with("method =") || line.starts_with("cells =") => String::new(),
        _ => line.to_owned(),
    };
    let text: Vec<String> = text.lines().map(line).collect();
    let directory = tempfile::tempdir().unwrap();
    fs::create_dir(directory.path().join("parts")).unwrap();
    fs::write(directory.path().join("parts/two.msh"), mesh).unwrap();
    let scene = scene_file(directory.path(), &text.join("\n"));
    (directory, scene)
}

fn by_name(form: Form) -> (TempDir, String) {
    let mesh = write(&[("first", LOWER), ("second one", UPPER)], form);
    two_blocks(&mesh, "volume = \"first\"", "volume = \"second one\"")
}

#[track_caller]
fn assert_same_solution(found: &Value, expected: &Value) {
    for key in ["plastic_elements", "active_contacts", "nodes", "elements", "dirichlet_rows", "contact_rows"] {
        assert_eq!(found[key], expected[key], "{key}");
    }
    for key in ["energy", "internal_energy", "external_work", "max_displacement", "max_von_mises"] {
        assert_close(key, number(found, key), number(expected, key), 1e-8);
    }
    assert_near("contact force", vector(&found["contact_force"]), vector(&expected["contact_force"]), 1e-7);
    for support in ["left", "right"] {
        let [found, expected] = [found, expected].map(|s| vector(&s["reactions"][support]));
        assert_near(&format!("reaction of {support}"), found, expected, 1e-7);
    }
}

#[test]
fn files_of_every_form_give_the_solution_of_the_bricks_for_2_7_and_24_subdomains() {
    let bricks = solve(2, "two-blocks", &[&COARSE[..], &TIGHT].concat()).converged().summary();
    for (form, subdomains) in [(Form::Text41, 2), (Form::Binary41, 7), (Form::Text22, 7), (Form::Binary22, 24)] {
        let (_directory, scene) = by_name(form);
        let parts = format!("decomposition.subdomains={subdomains}");
        let summary = solve(2, &scene, &[&TIGHT[..], &[&parts]].concat()).converged().summary();
        assert!(number(&summary, "subdomains") >= f64::from(subdomains));
        assert!(number(&summary, "mesh_reading_mb") > 1.0);
        assert_eq!(summary["warnings"], bricks["warnings"]);
        assert_same_solution(&summary, &bricks);
    }
}

#[test]
fn one_volume_may_be_several_bodies_scaled_turned_and_moved() {
    let bricks = solve(1, "two-blocks", &[&COARSE[..], &TIGHT].concat()).converged().summary();
    let in_metres = Brick { size: [3.0, 1.0, 1.0], ..LOWER };
    let mesh = write(&[("block", in_metres)], Form::Binary41);
    let (_directory, scene) = two_blocks(&mesh, "scale = 1000", "scale = 1e3, translate = [600, 0, 1000]");
    let summary = solve(2, &scene, &[&TIGHT[..], &["decomposition.subdomains=5"]].concat()).converged().summary();
    assert_same_solution(&summary, &bricks);

    // The whole scene turned about z: x becomes y.
    let quarter = "rotate = { axis = [0, 0, 2], angle_deg = 90 }";
    let upper = format!("scale = 1e3, {quarter}, translate = [0, 600, 1000]");
    let (_directory, scene) = two_blocks(&mesh, &format!("scale = 1e3, {quarter}"), &upper);
    let summary = solve(2, &scene, &[&TIGHT[..], &["decomposition.subdomains=5"]].concat()).converged().summary();
    for key in ["energy", "max_displacement", "max_von_mises"] {
        assert_close(key, number(&summary, key), number(&bricks, key), 1e-8);
    }
    let [x, y, z] = vector(&bricks["reactions"]["left"]);
    assert_near("reaction", vector(&summary["reactions"]["left"]), [-y, x, z], 1e-7);
}

#[test]
fn bricks_and_files_go_together_and_nobody_need_name_subdomains() {
    let mesh = write(&[("only", UPPER)], Form::Text41);
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("upper.msh"), mesh).unwrap();
    let text = include_str!("../../src/scene/library/two-blocks.toml");
    let (head, tail) = text.split_once("[decomposition]").unwrap();
    let brick = "brick = { origin = [600.0, 0.0, 1000.0], size = [3000.0, 1000.0, 1000.0], cells = [30, 10, 10] }";
    assert!(head.contains(brick));
    let text = head.replace(brick, "gmsh = { file = \"upper.msh\" }") + &tail[tail.find("[solver]").unwrap()..];
    let scene = scene_file(directory.path(), &text);
    let sets = [&["body.lower.brick.cells=[15, 5, 5]"][..], &TIGHT].concat();
    let summary = solve(2, &scene, &sets).converged().summary();
    let bricks = solve(1, "two-blocks", &[&COARSE[..], &TIGHT].concat()).converged().summary();
    assert_same_solution(&summary, &bricks);

    let checked = check(1, &scene, 1, &sets[..1]);
    assert_eq!(checked.code, 0, "{}", checked.stderr);
    assert_eq!(checked.summary()["subdomains"], summary["subdomains"]);
    assert!(checked.stdout.contains("at contact surfaces") && checked.stdout.contains("reading meshes"));
}

/// A block of Gmsh's own mesh, held below and pulled above, without lateral contraction: every strain is the same.
#[test]
fn meshes_of_gmsh_pass_the_patch_test() {
    for (file, volume, elements) in [("tets-41-binary.msh", "block", 90), ("hexes-and-prisms.msh", "block", 324)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes").join(file);
        let text = format!(
            r#"
            [material.cork]
            young = 20.0
            poisson = 0.0
            [body.block]
            material = "cork"
            element = "tet4"
            gmsh = {{ file = {path:?}, volume = "{volume}" }}
            [support.base]
            surface = "block.base"
            fix = ["x", "y", "z"]
            [load.pull]
            surface = "block.top"
            traction = [0.0, 0.0, 0.5]
            [decomposition]
            subdomains = 4
            "#
        );
        let directory = tempfile::tempdir().unwrap();
        let summary = solve(2, &scene_file(directory.path(), &text), &TIGHT).converged().summary();
        assert_eq!(summary["elements"], elements);
        // Stress 0.5 in a volume of 2 x 1 x 1.
        assert_close("energy", number(&summary, "energy"), -0.5 * 0.5 * 0.5 / 20.0 * 2.0, 1e-10);
        assert_close("displacement", number(&summary, "max_displacement"), 0.5 / 20.0, 1e-10);
        assert_close("stress", number(&summary, "max_von_mises"), 0.5, 1e-9);
        assert_near("reaction", vector(&summary["reactions"]["base"]), [0.0, 0.0, -1.0], 1e-10);
    }
}

/// A bar of four volumes under tension, checkered; started once more from its own state, cut otherwise.
#[test]
fn volumes_of_a_body_have_materials_of_their_own() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes/quarters.msh");
    let text = format!(
        r#"
        material.a = {{ young = 200.0, poisson = 0.3 }}
        material.b = {{ young = 1.0, poisson = 0.3 }}
        material.c = {{ young = 50.0, poisson = 0.3, yield_stress = 0.2, hardening = 5.0 }}
        [body.bar]
        material = {{ left-low = "a", right-low = "c", left-high = "c", right-high = "a" }}
        element = "tet4"
        gmsh = {{ file = {path:?}, volume = ["left-low", "left-high", "right-low", "right-high"] }}
        [support.fixed]
        surface = "bar.x0"
        fix = ["x", "y", "z"]
        [load.pull]
        surface = "bar.x3"
        traction = [0.3, 0.0, 0.0]
        "#
    );
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &text);
    let run = solve(2, &scene, &TIGHT).converged();
    let summary = run.summary();
    assert_eq!(summary["subdomains"], 4);
    assert_eq!(summary["warnings"].to_string(), r#"["material.b: no body is made of it"]"#);
    assert_eq!(check(1, &scene, 1, &[]).summary()["subdomains"], 4);
    let fields = Fields::read(&run.result());
    let (materials, kappa) = (fields.integers_of_elements("material"), fields.of_elements("equivalent_plastic_strain"));
    assert!(kappa.iter().any(|&k| k > 0.0));
    for ((nodes, material), kappa) in fields.elements.iter().zip(materials).zip(kappa) {
        let [x, _, z] = std::array::from_fn(|a| nodes.iter().map(|&n| fields.points[n][a]).sum::<f64>() / 4.0);
        let expected = if (x < 1.0) == (z < 0.25) { 0 } else { 2 };
        assert!(material == expected && (kappa == 0.0 || material == 2), "{material} at {x}, {z}");
    }

    let state = format!("initial.result={:?}", run.result());
    let again = solve(1, &scene, &[&TIGHT[..], &[&state, "decomposition.subdomains=9"]].concat()).converged().summary();
    assert!(number(&again, "subdomains") >= 9.0);
    assert_close("displacement", number(&again, "max_displacement"), number(&summary, "max_displacement"), 1e-7);
    assert_eq!(again["plastic_elements"], 0, "the load is borne by what has hardened under it");
}

#[test]
fn unused_volumes_and_bodies_that_only_contact_holds_are_told() {
    let mesh = write(&[("first", LOWER), ("second one", UPPER), ("spare", UPPER)], Form::Binary41);
    let (_directory, scene) = two_blocks(&mesh, "volume = \"first\"", "volume = \"second one\"");
    let warnings = check(2, &scene, 1, &["support.right.fix=['x', 'y']"]).summary()["warnings"].to_string();
    assert!(warnings.contains("two.msh: no body is made of volume spare"), "{warnings}");
    assert!(warnings.contains("body upper") && warnings.contains("translation along z"), "{warnings}");
}
