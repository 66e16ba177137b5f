//! What a run leaves behind: a result file that other programs read, and a summary with the keys that scripts rely on.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::fields::Fields;
use crate::common::{Run, check, solve, solve_with};
use serde_json::Value;

fn can_read(python: &Path) -> bool {
    Command::new(python).args(["-c", "import h5py, pytest, vtk"]).output().is_ok_and(|output| output.status.success())
}

/// A Python with h5py, pytest and VTK: the one of `scripts/setup --python`, or the system's.
fn python() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    [own, PathBuf::from("python3")]
        .into_iter()
        .find(|python| can_read(python))
        .expect("no Python with h5py, pytest and vtk: run scripts/setup --python")
}

fn assert_reads_back(run: &Run) {
    let test = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/test_read_back.py");
    let pytest = ["-m", "pytest", "--quiet", "--result"];
    let output = Command::new(python()).args(pytest).arg(run.result()).arg(test).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    assert!(text(&output.stdout).contains("1 passed"), "{}", text(&output.stdout));
}

#[test]
fn a_result_of_two_ranks_is_read_back_by_h5py_and_vtk() {
    assert_reads_back(&solve(2, "patch", &["support.top.displacement.2=-10"]).converged());
}

#[test]
fn a_result_with_an_empty_piece_is_read_back_by_h5py_and_vtk() {
    let run = solve(3, "bar", &[]).converged();
    let mut cells = Fields::read(&run.result()).cells_of_pieces();
    cells.sort_unstable();
    assert_eq!(cells, [0, 48, 48]);
    assert_reads_back(&run);
}

#[test]
fn a_time_series_is_read_back_by_h5py_and_vtk_at_every_time() {
    let steps = "step=[{increments=2}, {amplitude=0}]";
    assert_reads_back(&solve(2, "patch", &["support.top.displacement.2=-10", steps]).converged());
    let run = solve(3, "bar", &[steps]).converged();
    assert_eq!(Fields::times(&run.result()).unwrap(), [0.5, 1.0, 2.0]);
    assert_reads_back(&run);
}

/// Keys of a solved scene with contact and plastic material, by type.
const NUMBERS: [&str; 12] = [
    "plastic_fraction",
    "external_work",
    "internal_energy",
    "energy",
    "max_displacement",
    "max_von_mises",
    "residual_equilibrium",
    "residual_gluing",
    "residual_gap",
    "residual_complementarity",
    "time_total",
    "peak_rss_mb",
];
const COUNTS: [&str; 18] = [
    "level",
    "ranks",
    "nodes",
    "cells",
    "elements",
    "subdomains",
    "primal_dofs",
    "dual_dofs",
    "gluing_rows",
    "dirichlet_rows",
    "contact_rows",
    "plastic_elements",
    "newton_iterations",
    "dual_iterations",
    "hessian_multiplications",
    "preconditioner_applications",
    "factorisations",
    "active_contacts",
];

#[test]
fn the_summary_has_every_key_of_the_contract() {
    for (qp, own, other) in [
        ("smalse-m", "smalse_iterations", "active_set_iterations"),
        ("active-set", "active_set_iterations", "smalse_iterations"),
    ] {
        let set = format!("solver.qp={qp}");
        let summary = solve(2, "patch", &["support.top.displacement.2=-10", &set]).converged().summary();
        assert_contract(&summary);
        assert_eq!(summary["qp"], qp);
        assert!(summary[own].is_u64(), "{own}: {}", summary[own]);
        assert_eq!(summary[other], 0, "this is the other solver");
    }
}

fn assert_contract(summary: &Value) {
    for key in NUMBERS {
        assert!(summary[key].is_number(), "{key}: {}", summary[key]);
    }
    for key in COUNTS {
        assert!(summary[key].is_u64(), "{key}: {}", summary[key]);
    }
    assert_eq!(summary["scene"], "patch");
    assert_eq!(summary["error"], Value::Null);
    assert_eq!((&summary["level"], &summary["ranks"]), (&1.into(), &2.into()));
    crate::common::vector(&summary["contact_force"]);
    let reactions = summary["reactions"].as_object().unwrap();
    let supports: Vec<&String> = reactions.keys().collect();
    assert_eq!(supports, ["bottom", "lower-back", "lower-side", "top", "upper-back", "upper-side"]);
    reactions.values().for_each(|reaction| {
        crate::common::vector(reaction);
    });
    let provenance = |name: &str| summary["provenance"][name].as_str().unwrap_or_else(|| panic!("no {name}"));
    assert_eq!((provenance("ranks"), provenance("hosts").split(' ').count()), ("2", 2));
    assert!(!provenance("commit").is_empty() && !provenance("hdf5_version").is_empty());
    assert_eq!(summary["provenance"]["scene"], Value::Null, "it is in the result file, and long");
    let time = summary["time"].as_object().unwrap();
    assert!(time.len() > 3 && time.values().all(Value::is_number), "{time:?}");
    assert_counts(summary);
}

/// On two ranks, each the other's partner.
fn assert_counts(summary: &Value) {
    let counts = summary["counts"].as_object().unwrap();
    assert!(counts.keys().eq(summary["time"].as_object().unwrap().keys()), "each phase has counts");
    let keys = ["bytes", "bytes_received", "bytes_sent", "collectives", "flops", "largest_message", "messages"];
    for (phase, of) in counts.iter().chain([(&"all".to_owned(), &summary["counts_total"])]) {
        assert_eq!(of.as_object().unwrap().len(), keys.len(), "{phase}: {of}");
        for key in keys {
            let [busiest, mean] = ["busiest", "mean"].map(|of_ranks| of[key][of_ranks].as_f64().unwrap());
            assert!(busiest >= mean && mean >= busiest / 2.0, "{phase}, {key}: {busiest} {mean}");
        }
    }
    for (phase, work) in summary["work"].as_object().unwrap() {
        assert_eq!(work["flops"].as_f64().unwrap(), 2.0 * counts[phase]["flops"]["mean"].as_f64().unwrap(), "{phase}");
    }
    // One message to the other rank in each application of F.
    let messages = &counts["dual operator"]["messages"]["busiest"];
    assert_eq!(messages.as_f64(), summary["hessian_multiplications"].as_u64().map(|count| count as f64));
    assert_eq!(summary["partners"], serde_json::json!({ "busiest": 1.0, "mean": 1.0 }));
}

#[test]
fn the_summary_of_a_check_has_the_same_keys_and_nulls_for_what_was_not_computed() {
    let (solved, checked) = (solve(2, "patch", &[]).converged().summary(), check(2, "patch", 1, &[]).summary());
    let keys = |summary: &Value| summary.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&checked), keys(&solved));
    for key in ["converged", "energy", "newton_iterations", "residual_equilibrium", "contact_force", "error"] {
        assert!(checked.as_object().unwrap().contains_key(key));
        assert_eq!(checked[key], Value::Null, "{key}");
    }
    for key in ["nodes", "elements", "subdomains", "primal_dofs", "dual_dofs", "gluing_rows", "contact_rows"] {
        assert_eq!(checked[key], solved[key], "{key}");
    }
}

#[test]
fn a_newton_limit_that_is_too_low_gives_results_and_exit_code_1() {
    let run = solve(2, "shear", &["solver.newton_limit=2"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let summary = run.summary();
    assert_eq!(summary["converged"], false);
    assert_eq!(summary["newton_iterations"], 2);
    assert!(summary["error"].as_str().unwrap().contains("solver.newton_limit"));
    assert_reads_back(&run);
}

#[test]
fn a_qp_limit_that_is_too_low_gives_results_and_exit_code_1() {
    for scene in ["patch", "shear"] {
        let run = solve(2, scene, &["solver.qp_limit=3"]);
        assert_eq!(run.code, 1, "{}", run.stderr);
        let summary = run.summary();
        assert_eq!(summary["converged"], false);
        assert!(summary["error"].as_str().unwrap().contains("solver.qp_limit"), "{}", summary["error"]);
        assert!(run.result().exists());
    }
}

#[test]
fn the_log_shows_every_newton_step_and_ends_with_the_verdict() {
    let run = solve(2, "shear", &[]).converged();
    let steps = run.summary()["newton_iterations"].as_u64().unwrap();
    for line in ["shear, level 1", "step  criterion", "Converged in", "relative residuals"] {
        assert_eq!(run.stdout.matches(line).count(), 1, "`{line}` once, not once a rank: {}", run.stdout);
    }
    let table =
        run.stdout.lines().filter(|line| line.split_whitespace().next().is_some_and(|n| n.parse::<u64>().is_ok()));
    assert_eq!(table.count() as u64, steps, "{}", run.stdout);
}

#[test]
fn programs_can_follow_a_run_and_what_its_ranks_do() {
    let directory = tempfile::tempdir().unwrap();
    let [trace, log] = ["trace", "logs/run.jsonl"].map(|name| directory.path().join(name));
    let options = ["--trace", trace.to_str().unwrap(), "--log-json", log.to_str().unwrap()];
    let run = solve_with(2, "patch", 1, &[], &options).converged();
    let summary = run.summary();
    let log = std::fs::read_to_string(log).unwrap();
    let events: Vec<Value> = log.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of = |name: &str| events.iter().filter(|event| event["event"] == name).collect::<Vec<_>>();
    assert_eq!(of("newton_step").len(), summary["newton"].as_array().unwrap().len());
    assert_eq!(of("sizes")[0]["data"]["sizes"]["subdomains"], summary["subdomains"]);
    assert_eq!(events.last().unwrap()["data"]["converged"], true);
    assert_eq!(of("phases")[0]["data"]["memory_mb"]["max"], summary["peak_rss_mb_max"]);
    let [private, resident] = ["peak_private_mb", "peak_rss_mb"].map(|key| summary[key].as_f64().unwrap());
    assert!(0.0 < private && private < resident, "{private} {resident}");
    assert!(summary["imbalance"].as_f64().is_some_and(|ratio| ratio >= 1.0), "{}", summary["imbalance"]);
    for rank in [0, 1] {
        let text = std::fs::read_to_string(trace.join(format!("rank-{rank}.json"))).unwrap();
        let trace: Value = serde_json::from_str(&text).unwrap();
        let calls = trace["traceEvents"].as_array().unwrap();
        for name in ["factorisation", "dual operator", "neighbour exchange", "collectives"] {
            assert!(calls.iter().any(|call| call["name"] == name && call["pid"] == rank), "{name}");
        }
    }
}
