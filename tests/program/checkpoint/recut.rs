//! Runs that go on on other subdomains arrive at the same result, but for the tolerances.

use std::fs;
use std::path::Path;

use super::{HISTORY, assert_same_result, newton, result, resume, resume_with, solve, stopped_after};
use crate::common::fields::{Fields, difference, state_at};
use crate::common::{COARSE, COARSEST, assert_close, assert_near, number, run_disturbed, vector};

const TIGHT: [&str; 3] =
    ["solver.newton_tolerance=1e-9", "solver.residual_tolerance=1e-9", "solver.qp_tolerance=1e-11"];

const NOTICE: &str = "subdomains are others than when the checkpoint was written";

/// Fails unless all increments have the same energies, forces and fields.
#[track_caller]
fn assert_alike(out: &Path, whole: &Path, name: &str) {
    const ALIKE: f64 = 1e-6;
    let [rows, rows_1] = [out, whole].map(|out| result(out, name).0["steps"].as_array().unwrap().clone());
    assert_eq!(rows.len(), rows_1.len());
    for (row, row_1) in rows.iter().zip(&rows_1) {
        for key in ["step", "increment", "time", "converged", "plastic_elements", "active_contacts"] {
            assert_eq!(row[key], row_1[key], "{key}");
        }
        for key in ["energy", "internal_energy", "external_work", "max_displacement", "max_von_mises"] {
            assert_close(key, number(row, key), number(row_1, key), ALIKE);
        }
        let force = |row: &serde_json::Value| vector(&row["contact_force"]);
        assert_near("contact force", force(row), force(row_1), ALIKE);
        for support in ["left", "right"] {
            let reaction = |row: &serde_json::Value| vector(&row["reactions"][support]);
            assert_near(support, reaction(row), reaction(row_1), ALIKE);
        }
    }
    let [file, file_1] = [out, whole].map(|out| out.join(format!("{name}.vtkhdf")));
    assert_eq!(Fields::times(&file), Fields::times(&file_1));
    for time in 0..rows.len() {
        let ((moved, answers), (moved_1, answers_1)) = (state_at(&file, time), state_at(&file_1, time));
        let errors = [difference(&moved, &moved_1), difference(&answers, &answers_1)];
        assert!(errors.iter().all(|error| *error < ALIKE), "{errors:?} at time {time}");
    }
}

/// Stopped in the middle of the second increment of three, between plastic steps.
#[test]
fn a_history_goes_on_on_other_boxes_and_on_parts() {
    let sets = [&COARSE[..], &TIGHT, &[HISTORY]].concat();
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    assert_eq!(run_disturbed(2, &solve(&at("whole"), &sets, &[]), |_| ()).code, 0);
    let increments = newton(&at("whole"));
    let before = increments.iter().position(|&increment| increment == 2).unwrap();
    assert_eq!(increments[before..before + 3], [2; 3], "{increments:?}");
    let file = stopped_after(before + 1, &at("stopped"), &sets);

    let boxes = ["--set", "decomposition.cells=[3, 5, 5]"];
    let parts = ["--set", "decomposition.subdomains=7"];
    for (ranks, cut, subdomains) in [(2, boxes, 10), (3, parts, 7)] {
        let out = at(&subdomains.to_string());
        let end = resume_with(ranks, &file, &[&cut[..], &["--out", out.to_str().unwrap()]].concat());
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert_eq!(end.stdout.matches(NOTICE).count(), 1, "{}", end.stdout);
        assert!(end.stdout.contains("increment 2 of 2") && !end.stdout.contains("increment 1 of 2"), "{}", end.stdout);
        assert_alike(&out, &at("whole"), "two-blocks");
        assert!(result(&out, "two-blocks").0["subdomains"].as_u64() >= Some(subdomains));
        let steps = newton(&out);
        assert!(steps.len() <= increments.len() + 2, "{steps:?}, not {increments:?}");
    }
    let alone = at("alone");
    let end = resume_with(1, &file, &[&parts[..], &["--out", alone.to_str().unwrap()]].concat());
    assert_eq!(end.code, 0, "{}", end.stderr);
    assert_same_result(&alone, &at("7"), "two-blocks");
}

/// Its checkpoints are of the new subdomains, and know what was set.
#[test]
fn what_went_on_on_other_subdomains_goes_on_again() {
    let sets = [&COARSEST[..], &["decomposition.method=bricks", HISTORY]].concat();
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let file = stopped_after(2, &at("stopped"), &sets);
    let parts = ["--set", "decomposition.subdomains=5", "--out"];
    let go_on =
        |out: &Path, more: &[&str]| resume_with(2, &file, &[&parts[..], &[out.to_str().unwrap()], more].concat());
    let end = go_on(&at("whole"), &[]);
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    let end = go_on(&at("again"), &["--time-limit", "0.000001"]);
    assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    let end = resume(3, &at("again").join("two-blocks.checkpoint.h5"));
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert!(!end.stdout.contains(NOTICE), "{}", end.stdout);
    assert_same_result(&at("again"), &at("whole"), "two-blocks");
}

/// One increment, and the cut of the scene's file itself is another one.
#[test]
fn a_scene_that_is_cut_otherwise_now_goes_on_with_a_notice() {
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("blocks.toml");
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/library/two-blocks.toml")).unwrap();
    fs::write(&scene, text.replace("[30, 10, 10]", "[10, 3, 3]").replace("[10, 10, 10]", "[5, 3, 3]")).unwrap();
    let run = |out: &Path, more: &[&str]| {
        let mut arguments = solve(out, &TIGHT, more);
        arguments[1] = scene.to_str().unwrap();
        run_disturbed(2, &arguments, |_| ())
    };
    let (whole, out) = (directory.path().join("whole"), directory.path().join("out"));
    assert_eq!(run(&whole, &[]).code, 0);
    assert_eq!(run(&out, &["--time-limit", "0.000001"]).code, 75);
    let changed = fs::read_to_string(&scene).unwrap().replace("[5, 3, 3]", "[2, 3, 1]");
    fs::write(&scene, changed).unwrap();
    let end = resume(3, &out.join("blocks.checkpoint.h5"));
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_eq!(end.stdout.matches(NOTICE).count(), 1, "{}", end.stdout);
    assert_alike(&out, &whole, "blocks");
    assert_eq!(result(&out, "blocks").0["subdomains"], 30);
}

/// Stopped on the coarse level, whose boxes were told apart by what is expected to yield.
#[test]
fn a_cascade_goes_on_on_other_subdomains() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let sets = [&COARSEST[..], &TIGHT].concat();
    let level = ["--level", "2", "--cascade", "on"];
    assert_eq!(run_disturbed(2, &solve(&at("whole"), &sets, &level), |_| ()).code, 0);
    let limit = [&level[..], &["--time-limit", "0.000001"]].concat();
    let file = at("out").join("two-blocks-level2.checkpoint.h5");
    assert_eq!(run_disturbed(1, &solve(&at("out"), &sets, &limit), |_| ()).code, 75);
    let fine = ["--set", "decomposition.cells=[4, 3, 3]"];
    let end = resume_with(2, &file, &fine);
    assert_eq!(end.code, 65, "{}", end.stderr);
    assert!(end.stderr.contains("decomposition.cells"), "{}", end.stderr);
    let end = resume_with(2, &file, &["--set", "decomposition.cells=[2, 3, 3]"]);
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_eq!(end.stdout.matches(NOTICE).count(), 1, "{}", end.stdout);
    assert_alike(&at("out"), &at("whole"), "two-blocks-level2");
}

#[test]
fn other_keys_than_those_of_the_cut_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let file = stopped_after(1, out, &COARSEST);
    for (set, told) in [
        ("material.upper.young=1000", "only keys of decomposition can be set"),
        ("solver.qp=smalse-m", "only keys of decomposition can be set"),
        ("decomposition.parts=4", "unknown key `parts`"),
        ("decomposition.cells=[7, 3, 3]", "decomposition.cells"),
    ] {
        let end = resume_with(2, &file, &["--set", set]);
        assert_eq!(end.code, 65, "{}{}", end.stdout, end.stderr);
        assert_eq!(end.stderr.matches(&format!("fetiplast: --set {set}")).count(), 1, "{}", end.stderr);
        assert!(end.stderr.contains(told), "{}", end.stderr);
        assert!(!out.join("two-blocks.json").exists());
    }
    assert_eq!(resume(2, &file).code, 0);
}
