//! Large scenes are checked without being built, what cannot fit is refused, and running out of memory has an end of its own.

use std::time::Instant;

use serde_json::json;

use crate::common::{self, number, run_briefly, run_disturbed, run_misused, run_short_of_memory};

const BAD_SCENE: i32 = 65;
/// Exit code where the machine has not enough memory.
const MEMORY: i32 = 71;

/// In MiB, of each rank.
const LITTLE: f64 = 100.0;
/// Most of it is starting MPI, on a machine that runs other tests.
const SECONDS: f64 = 10.0;

fn check(ranks: usize, level: usize, sets: &[&str]) -> serde_json::Value {
    let start = Instant::now();
    let run = common::check(ranks, "two-blocks", level, sets);
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(run.code, 0, "{}", run.stderr);
    let summary = run.summary();
    assert!(number(&summary, "peak_rss_mb_max") < LITTLE, "{sets:?}: {} MiB", summary["peak_rss_mb_max"]);
    assert!(seconds < SECONDS, "{sets:?}: {seconds} s");
    summary
}

#[test]
fn a_scene_of_any_size_is_checked_at_once() {
    for ranks in [1, 2] {
        let summary = check(ranks, 100, &[]);
        let expected = json!({
            "nodes": 2 * 3001 * 1001_u64 * 1001,
            "cells": 6_000_000_000_u64,
            "subdomains": 6_000_000,
            "clusters": 750_000,
            "contact_subdomains": 60_000,
            "primal_dofs": 6_000_000 * 3993_u64,
            "gluing_rows": 6_000_000 * 3993_u64 - 6 * 3001 * 1001_u64 * 1001,
            "dirichlet_rows": 2 * 3 * 1001 * 1001,
            "contact_rows": 2401 * 1001,
            "estimated": [],
        });
        for (key, value) in expected.as_object().unwrap() {
            assert_eq!(&summary[key], value, "{key}");
        }
        assert_eq!(summary["contacts"][0]["rule"], "node to node");
        assert!(number(&summary, "memory_estimate_mb") > 1e7);
        let available = number(&summary, "memory_available_mb");
        assert!(available > LITTLE, "{available}");
        let warnings = summary["warnings"].to_string();
        assert!(warnings.contains("refuses that") && warnings.contains("100 times as large"), "{warnings}");
    }
    let huge = ["body.lower.brick.cells=[2000, 2000, 2000]", "body.upper.brick.cells=[2000, 2000, 2000]"];
    assert_eq!(check(1, 1, &huge)["cells"], 16_000_000_000_u64);
    for element in ["hex8", "tet10"] {
        let elements = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
        let summary = check(1, 50, &[&elements[0], &elements[1]]);
        assert_eq!(summary["contact_rows"], if element == "hex8" { 1201 * 501 } else { 2401 * 1001 });
    }
    let metis = check(1, 5, &["decomposition.subdomains=1000"]);
    assert!(metis["estimated"].to_string().contains("gluing_rows"), "{}", metis["estimated"]);
    assert!((number(&metis, "subdomains") - 1000.0).abs() < 1.5);
}

#[test]
fn meshes_that_do_not_meet_and_curved_obstacles_are_estimated() {
    let cells = ["body.upper.brick.cells=[250, 80, 80]", "body.lower.brick.cells=[100, 33, 33]"];
    let summary = check(1, 1, &[&cells[..], &["decomposition.method=metis"]].concat());
    let contact = &summary["contacts"][0];
    assert_eq!((&contact["slave"], &contact["rule"]), (&json!("upper.zmin"), &json!("mortar")));
    // Slave nodes above the master.
    let expected = 201.0 * 81.0;
    assert!((number(contact, "conditions") / expected - 1.0).abs() < 0.1, "{contact}");
}

#[test]
fn what_solving_would_refuse_is_refused_without_building_it() {
    for (set, parts) in [
        ("support.right.fix=['x']", &["body.upper", "translation along +y", "times as large"][..]),
        ("body.upper.brick.origin.0=9000.0", &["contact.joint", "opposite"]),
        ("decomposition.method=metis", &["body.lower", "METIS"]),
    ] {
        for ranks in [1, 2] {
            let refused = run_briefly(ranks, &["check", "two-blocks", "--level", "60", "--set", set]);
            common::assert_refused(&refused, BAD_SCENE, parts);
        }
    }
    let scene = common::check(1, "step-42", 20, &[]);
    assert_eq!(scene.code, 0, "{}", scene.stderr);
    assert!(scene.stdout.contains('~') && scene.stdout.contains("rigid"), "{}", scene.stdout);
}

#[test]
fn what_cannot_fit_is_refused_before_anything_is_built() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    for ranks in [1, 2] {
        let start = Instant::now();
        let arguments = ["solve", "two-blocks", "--level", "100", "--out", out.to_str().unwrap()];
        let refused = run_briefly(ranks, &arguments);
        common::assert_refused(&refused, MEMORY, &["would take about", "MiB left", "--ignore-memory"]);
        assert!(!out.exists() && start.elapsed().as_secs_f64() < SECONDS);
    }
}

#[test]
fn running_out_of_memory_is_told_and_ends_all_ranks() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let solve = |level| ["solve", "two-blocks", "--cascade", "off", "--ignore-memory", "--out", out, "--level", level];
    for (ranks, level) in [(1, "3"), (2, "4"), (3, "100")] {
        let end = run_short_of_memory(ranks, &solve(level), 600_000);
        assert_eq!(end.code, MEMORY, "{} {}", end.stdout, end.stderr);
        assert!(end.stderr.contains("out of memory") && end.stderr.contains("MiB more"), "{}", end.stderr);
        assert!(!end.stderr.contains("report it"), "{}", end.stderr);
    }
    assert!(directory.path().read_dir().unwrap().next().is_none(), "nothing is left behind");
    let end = run_disturbed(1, &["solve", "patch", "--ignore-memory", "--out", out], |_| ());
    assert_eq!(end.code, 0, "{}", end.stderr);
}

/// A larger scene leaves what every rank holds as it is, but for what is named, and more ranks leave each a smaller share.
#[test]
fn what_a_rank_would_hold_is_told_item_by_item_for_any_number_of_ranks() {
    let held = |ranks: usize, level: &str, of: usize| {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("summary.json");
        let of = of.to_string();
        let arguments = ["check", "two-blocks", "--level", level, "--ranks", &of, "--summary", file.to_str().unwrap()];
        let run = run_briefly(ranks, &arguments);
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(run.stdout.contains(&format!("MiB on each of {of}")), "{}", run.stdout);
        let summary: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
        let rows = summary["memory_of_rank"].as_array().unwrap().clone();
        assert!(rows.iter().all(|row| run.stdout.contains(row["item"].as_str().unwrap())), "{}", run.stdout);
        rows
    };
    let small = held(1, "1", 64);
    assert_eq!(small, held(2, "1", 64), "whoever asks");
    for (few, many) in small.iter().zip(held(1, "1", 128)) {
        assert!((number(few, "owned_mb") - 2.0 * number(&many, "owned_mb")).abs() < 1e-9, "{few}");
    }
    // Level 1 is built, the others are counted.
    for level in ["2", "100"] {
        for (small, large) in small.iter().zip(held(1, level, 64)) {
            let grows = ["coarse problem", "lists of clusters"].iter().any(|name| *name == small["item"]);
            let stays = small["everywhere_mb"] == large["everywhere_mb"];
            assert!(stays != grows || small["item"] == "work on a factor", "level {level}: {small} {large}");
        }
    }
    let refused = run_misused(1, &["check", "two-blocks", "--ranks", "0"]);
    assert_eq!(refused.code, 64, "{}", refused.stderr);
}
