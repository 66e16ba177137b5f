//! Bad input: one message that names what is wrong and what is allowed, the right exit code, on 1 and on 2 ranks, and
//! earlier results stay as they were. The program is started for each way that a refusal may take.

use std::fs;

use crate::common::{
    EARLIER, assert_program_refuses, assert_refused, assert_scene_refused, run_briefly, run_misused, scene_file,
};

const USAGE: i32 = 64;
const BAD_SCENE: i32 = 65;
const INPUT_OUTPUT: i32 = 74;

#[track_caller]
fn assert_override_refused(set: &str, parts: &[&str]) {
    assert_scene_refused("patch", &[set], BAD_SCENE, parts);
}

/// The built-in scene `patch` as a file, with `from` replaced by `to`.
#[track_caller]
fn assert_text_refused(from: &str, to: &str, parts: &[&str]) {
    let text = include_str!("../../src/scene/library/patch.toml");
    assert!(text.contains(from));
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &text.replace(from, to));
    assert_scene_refused(&file, &[], BAD_SCENE, parts);
}

#[test]
fn an_unknown_key_is_named_with_its_place_and_the_known_ones() {
    assert_text_refused("young =", "youg =", &["youg", "line 8", "young", "poisson", "yield_stress", "hardening"]);
    let parts = ["solver.tolerance=1e-3", "newton_tolerance", "qp_tolerance"];
    assert_program_refuses("patch", &["solver.tolerance=1e-3"], BAD_SCENE, &parts);
}

#[test]
fn a_missing_material_is_named_with_the_known_ones() {
    assert_override_refused("body.upper.material=wood", &["body.upper.material", "wood", "steel"]);
    assert_text_refused("material = \"steel\"\n", "", &["material", "line 13"]);
}

#[test]
fn an_incompressible_material_is_refused() {
    for poisson in ["0.5", "nan"] {
        let set = format!("material.steel.poisson={poisson}");
        assert_override_refused(&set, &["material.steel.poisson", "below 0.5"]);
    }
}

#[test]
fn moduli_and_stresses_that_are_not_positive_and_finite_are_refused() {
    assert_override_refused("material.steel.young=-210000", &["material.steel.young", "positive"]);
    assert_override_refused("material.steel.young=nan", &["material.steel.young", "finite"]);
    assert_override_refused("material.steel.hardening=nan", &["material.steel.hardening", "finite"]);
}

#[test]
fn geometry_and_displacements_that_are_not_finite_are_refused() {
    assert_override_refused("body.upper.brick.size.1=nan", &["body.upper.brick.size", "positive and finite"]);
    assert_override_refused("support.top.displacement.2=nan", &["support.top.displacement", "finite"]);
}

#[test]
fn a_load_that_is_not_finite_is_refused() {
    let add = "[load.press]\nsurface = \"upper.zmax\"\ntraction = [0.0, 0.0, nan]\n[decomposition]";
    assert_text_refused("[decomposition]", add, &["load.press.traction", "finite"]);
}

#[test]
fn what_would_be_ignored_is_refused() {
    let three = "surfaces = [\"upper.zmin\", \"lower.zmax\", \"lower.xmin\"]";
    let sides = "slave = \"upper.zmin\"\nmaster = \"lower.zmax\"";
    assert_text_refused(sides, three, &["line 44", "length 3", "contact.joint.surfaces"]);
    assert_text_refused("yield_stress = 450.0\n", "", &["material.steel.hardening = 10000.0", "add yield_stress"]);
}

#[test]
fn surfaces_that_do_not_exist_are_named() {
    assert_override_refused("support.top.surface=upper.top", &["upper.top", "zmax"]);
}

#[test]
fn surfaces_that_nowhere_face_each_other_are_no_contact() {
    let sets = ["body.upper.brick.origin.0=5000"];
    assert_program_refuses("patch", &sets, BAD_SCENE, &["contact.joint", "opposite"]);
}

#[test]
fn contact_that_would_hold_twice_is_refused() {
    let twin = "[contact.other]\nslave = \"lower.zmax\"\nmaster = \"upper.zmin\"\n[decomposition]";
    assert_text_refused("[decomposition]", twin, &["contact.other.master", "contact.joint", "same two surfaces"]);
    let sets = ["body.upper.brick.cells=[6, 4, 4]", "support.top.surface=upper.zmin"];
    assert_scene_refused("patch", &sets, BAD_SCENE, &["contact.joint", "hold all nodes", "swap slave and master"]);
}

#[test]
fn obstacles_that_make_no_sense_are_refused() {
    let refused = |sets: &[&str], parts: &[&str]| assert_scene_refused("step-42", sets, BAD_SCENE, parts);
    refused(&["contact.ball.rigid.sphere.radius=-0.6"], &["contact.ball.rigid.sphere.radius = -0.6", "positive"]);
    refused(&["contact.ball.rigid={sphere = {centre = [0, 0, 0]}}"], &["contact.ball.rigid", "radius"]);
    refused(&["contact.ball.rigid.plane={point = [0, 0, 0], normal = [0, 0, 1]}"], &["contact.ball.rigid.plane"]);
    refused(&["contact.ball.master=cube.zmin"], &["contact.ball.master", "either master or rigid"]);
    refused(&["contact.ball.rigid.sphere.centre.2=-5"], &["contact.ball", "289", "faces the obstacle"]);
    let under = ["contact.ball.slave=cube.zmin", "contact.ball.rigid.sphere.centre.2=-0.59"];
    assert_program_refuses(
        "step-42",
        &under,
        BAD_SCENE,
        &["contact.ball", "supports hold 13 of its nodes", "1.00e-2 deep"],
    );
}

#[test]
fn a_body_that_nothing_holds_is_named_with_its_free_motions() {
    let text = include_str!("../../src/scene/library/bar.toml").replace("fix = [\"z\"]", "fix = [\"y\"]");
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &text);
    assert_program_refuses(&file, &[], BAD_SCENE, &["body.bar", "translation along z", "add supports"]);
}

#[test]
fn a_subdomain_count_out_of_range_is_refused_with_the_range() {
    assert_override_refused("decomposition.subdomains=1", &["decomposition.subdomains", "2 bodies"]);
    assert_override_refused("decomposition.subdomains=769", &["decomposition.subdomains", "768 elements"]);
    assert_override_refused("decomposition.cells=[3, 2, 2]", &["decomposition.cells", "divide", "along x"]);
}

#[test]
fn steps_that_name_nothing_or_contradict_each_other_are_refused() {
    assert_override_refused("step=[{support={topp=1}}]", &["step.0.support.topp", "no such support", "lower-back"]);
    assert_override_refused("step=[{amplitude=nan}]", &["step.0.amplitude", "finite"]);
    assert_override_refused("step=[{increments=0}]", &["step.0.increments", "at least 1"]);
    assert_override_refused("step=[{amplitudes=1}]", &["amplitudes", "increments", "halvings"]);
    let add = "[[step]]\n[[step]]\namplitude = \"none\"\n[decomposition]";
    assert_text_refused("[decomposition]", add, &["line 49", "none"]);
    assert_override_refused("material.steel.kinematic_hardening=-1", &["kinematic_hardening", "not negative"]);
}

#[test]
fn bad_toml_is_shown_with_line_and_column() {
    assert_text_refused("young = 210000.0", "young = = 210000.0", &["line 8, column"]);
    assert_text_refused("young = 210000.0", "young = \"stiff\"", &["line 8, column", "stiff"]);
}

#[test]
fn an_unknown_scene_is_told_the_known_ones() {
    assert_program_refuses("two-bloks", &[], BAD_SCENE, &["two-bloks", "two-blocks", "patch", "TOML file"]);
    assert_program_refuses("no/such/scene.toml", &[], INPUT_OUTPUT, &["no/such/scene.toml", "No such file"]);
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_anything_is_solved() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, EARLIER).unwrap();
    for ranks in [1, 2] {
        for out in [file.join("below").to_str().unwrap(), "/proc/fetiplast"] {
            let refused = run_briefly(ranks, &["solve", "patch", "--out", out]);
            assert_refused(&refused, INPUT_OUTPUT, &[out, "cannot write"]);
            assert!(!refused.stdout.contains("criterion"), "nothing was solved: {}", refused.stdout);
        }
        let summary = file.join("summary.json");
        let refused = run_briefly(ranks, &["check", "patch", "--summary", summary.to_str().unwrap()]);
        assert_refused(&refused, INPUT_OUTPUT, &["summary.json", "cannot write"]);
        assert_eq!(fs::read_to_string(&file).unwrap(), EARLIER);
    }
}

#[test]
fn a_wrong_command_line_is_a_usage_error() {
    for ranks in [1, 2] {
        assert_refused(&run_misused(ranks, &["solve", "patch", "--fast"]), USAGE, &["--fast"]);
        assert_refused(&run_misused(ranks, &["slove"]), USAGE, &["slove"]);
        assert_refused(&run_misused(ranks, &["solve", "patch", "--level", "two"]), USAGE, &["--level", "two"]);
        assert_refused(&run_misused(ranks, &["show", "nothing"]), USAGE, &["nothing", "two-blocks"]);
    }
}

#[test]
fn a_malformed_value_of_any_option_is_a_usage_error() {
    let set = ["novalue", "=3", "a b=1", "solver.qp_limit=[", "contact.joint.slave=", "title=\"open"];
    let time = ["", "0", "-1", "soon", "1:2:3:4"];
    let options: [(&str, &[&str], &str); 10] = [
        ("--set", &set, "value"),
        ("--level", &["0", "-1", "1.5", "two", "99999999999999999999"], "start at 1"),
        ("--qp", &["foo", "", "mprgp"], "active-set"),
        ("--preconditioner", &["foo", ""], "dirichlet"),
        ("--accuracy", &["-1", "0", "1", "nan", "inf", "tenth"], "above 0 and below 1"),
        ("--cascade", &["maybe"], "auto, on, off"),
        ("--progress", &["often"], "auto, plain or off"),
        ("--time-limit", &time, "30m"),
        ("--checkpoint-every", &time, "30m"),
        ("--summary", &[""], "--summary"),
    ];
    for (option, values, told) in options {
        for value in values {
            let refused = run_misused(1, &["solve", "patch", &format!("{option}={value}")]);
            assert_refused(&refused, USAGE, &[option]);
            assert!(value.is_empty() || refused.stderr.contains(told) || option == "--set", "{}", refused.stderr);
        }
    }
    assert_refused(&run_misused(1, &["solve", "patch", "--accuracy", "-1"]), USAGE, &["--accuracy", "above 0"]);
    assert_refused(&run_misused(1, &["check", "patch", "--level", "-1"]), USAGE, &["--level", "start at 1"]);
    assert_refused(&run_misused(1, &["resume", "none.h5", "--set", "decomposition"]), USAGE, &["decomposition"]);
    assert_refused(&run_misused(1, &["verify", "--element", "hex20"]), USAGE, &["hex20", "tet4, hex8 or tet10"]);
    // What is well formed, but fits no scene, is a bad scene.
    assert_override_refused("solver.qp=foo", &["solver.qp=foo", "active-set"]);
}

#[test]
fn what_is_no_text_is_a_bad_scene_and_what_cannot_be_read_is_not() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("scene.toml");
    let path = file.to_str().unwrap();
    for bytes in [&b"title = 'a'\nunits = 'mm\xb2'"[..], b"title = 'a'\nunits = 'mm\0'"] {
        fs::write(&file, bytes).unwrap();
        assert_scene_refused(path, &[], BAD_SCENE, &["scene.toml, line 2, column 12", "UTF-8"]);
    }
    fs::remove_file(&file).unwrap();
    assert_scene_refused(path, &[], INPUT_OUTPUT, &["scene.toml", "No such file"]);
    fs::create_dir(&file).unwrap();
    assert_scene_refused(path, &[], INPUT_OUTPUT, &["scene.toml", "Is a directory"]);
    let body = "body.bar={material = 'steel', element = 'tet4', gmsh = {file = '/'}}";
    let sets = [body, "decomposition={method = 'metis'}"];
    assert_scene_refused("bar", &sets, INPUT_OUTPUT, &["mesh file", "Is a directory"]);
    for (result, reason) in [("/none.vtkhdf", "No such file"), ("/", "is a directory")] {
        assert_scene_refused("bar", &[&format!("initial.result='{result}'")], INPUT_OUTPUT, &[result, reason]);
    }
}

/// A run that cannot converge says so and writes what it has.
fn assert_outcome(set: &str, reason: &str) {
    for ranks in [1, 2] {
        let run = crate::common::solve(ranks, "bar", &[set]);
        assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        let summary = run.summary();
        assert_eq!(summary["converged"], false);
        let error = summary["error"].as_str().unwrap_or_default();
        assert!(error.contains(reason), "{error}");
        assert!(run.result().exists());
    }
}

#[test]
fn a_load_beyond_all_numbers_ends_as_an_outcome_with_results() {
    assert_outcome("load.pull.traction.0=1e300", "not finite");
}

#[test]
fn a_stiffness_beyond_all_numbers_ends_as_an_outcome_with_results() {
    assert_outcome("material.steel.young=1e308", "stiffness matrix is not positive definite");
}
