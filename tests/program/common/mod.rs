//! Runs the program as a user would, and reads back what it wrote.

pub mod fields;
mod launch;
pub mod msh;
pub mod random;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use fetiplast::cli::keeper::Signals;
use fetiplast::cli::{Cli, run};
use fetiplast::comm::threads;
use serde_json::{Map, Value};
use tempfile::TempDir;

pub use launch::{
    End, children, on_one_machine, run_disturbed, run_in_small_room, run_short_of_memory, send, wait_for,
};
use launch::{NO_GRACE, launch, launch_beside_others};

/// How a run ended and what it said. Its files vanish with it.
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
    directory: TempDir,
}

impl Run {
    /// The summary that it wrote.
    pub fn summary(&self) -> Value {
        let path = self.directory.path().join(SUMMARY);
        let text = fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("no summary: {error}; exit code {}: {}", self.code, self.stderr));
        serde_json::from_str(&text).expect("the summary is JSON")
    }

    /// The result file that it wrote.
    pub fn result(&self) -> PathBuf {
        let files = fs::read_dir(self.directory.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut results = files.filter(|path| path.extension().is_some_and(|extension| extension == "vtkhdf"));
        results.next().unwrap_or_else(|| panic!("no result file; exit code {}: {}", self.code, self.stderr))
    }

    /// Passes on a run that converged: then forces and moments on each body are in balance, to the size of the residual.
    pub fn converged(self) -> Run {
        assert_eq!(self.code, 0, "{}{}", self.stdout, self.stderr);
        let summary = self.summary();
        assert_eq!(summary["converged"], true);
        let [balance, residual] = ["residual_balance", "residual_equilibrium"].map(|key| number(&summary, key));
        assert!(balance <= 10.0 * residual + 1e-9, "{balance:.1e} is out of balance, the residual is {residual:.1e}");
        // Where energies are known: they are products of forces out of balance and displacements.
        let energies = summary["residual_energies"].as_f64().unwrap_or_default();
        assert!(
            energies <= 100.0 * residual + 1e-9,
            "{energies:.1e} of energies are missing, the residual is {residual:.1e}"
        );
        self
    }
}

const SUMMARY: &str = "summary.json";

/// The benchmark with cells twice as large: plastic flow, contact and all six subdomains survive that.
pub const COARSE: [&str; 3] =
    ["body.lower.brick.cells=[15, 5, 5]", "body.upper.brick.cells=[15, 5, 5]", "decomposition.cells=[5, 5, 5]"];

/// With cells three times as large: four subdomains.
pub const COARSEST: [&str; 3] =
    ["body.lower.brick.cells=[10, 3, 3]", "body.upper.brick.cells=[10, 3, 3]", "decomposition.cells=[5, 3, 3]"];

/// A summary without what belongs to the run, and may depend on the ranks or on the clock.
pub fn only_result(summary: Value) -> Map<String, Value> {
    const OF_THE_RUN: [&str; 14] = [
        "ranks",
        "time",
        "work",
        "counts",
        "counts_total",
        "partners",
        "communication",
        "time_total",
        "imbalance",
        "peak_rss_mb",
        "peak_private_mb",
        "peak_rss_mb_max",
        "mesh_reading_mb",
        "provenance",
    ];
    let Value::Object(mut summary) = summary else { panic!("the summary is an object") };
    OF_THE_RUN.iter().for_each(|key| assert!(summary.remove(*key).is_some(), "no key {key}"));
    for list in ["newton", "cascade", "refinements"] {
        for row in summary[list].as_array_mut().unwrap() {
            assert!(row.as_object_mut().unwrap().remove("seconds").is_some());
        }
    }
    summary
}

/// Solves a built-in scene or scene file, with each of `sets` as a `--set`.
pub fn solve(ranks: usize, scene: &str, sets: &[&str]) -> Run {
    solve_level(ranks, scene, 1, sets)
}

/// As [`solve`], refined.
pub fn solve_level(ranks: usize, scene: &str, level: usize, sets: &[&str]) -> Run {
    solve_with(ranks, scene, level, sets, &[])
}

/// As [`solve_level`], with more options.
pub fn solve_with(ranks: usize, scene: &str, level: usize, sets: &[&str], more: &[&str]) -> Run {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap().to_owned();
    let more = [&["--progress", "off", "--out", &out], more].concat();
    scene_command("solve", ranks, scene, level, sets, &more, directory)
}

/// As [`solve`], as exactly as double precision allows; fails unless it converges.
pub fn solve_tightly(ranks: usize, scene: &str, sets: &[&str]) -> Run {
    const TIGHT: [&str; 3] =
        ["solver.newton_tolerance=1e-11", "solver.residual_tolerance=1e-11", "solver.qp_tolerance=1e-13"];
    solve(ranks, scene, &[&TIGHT[..], sets].concat()).converged()
}

/// Checks a scene without solving it.
pub fn check(ranks: usize, scene: &str, level: usize, sets: &[&str]) -> Run {
    scene_command("check", ranks, scene, level, sets, &[], tempfile::tempdir().unwrap())
}

/// Runs `verify` with these arguments.
pub fn verify(ranks: usize, arguments: &[&str]) -> Run {
    let directory = tempfile::tempdir().unwrap();
    let summary = directory.path().join(SUMMARY);
    launch(ranks, &[&["verify", "--summary", summary.to_str().unwrap()], arguments].concat(), directory)
}

fn scene_command(
    command: &str,
    ranks: usize,
    scene: &str,
    level: usize,
    sets: &[&str],
    more: &[&str],
    directory: TempDir,
) -> Run {
    let (level, summary) = (level.to_string(), directory.path().join(SUMMARY));
    let mut arguments = vec![command, scene, "--level", &level, "--summary", summary.to_str().unwrap()];
    arguments.extend(more);
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    launch(ranks, &arguments, directory)
}

/// Runs the program with these arguments. For runs that end before they solve anything: most of their time they wait
/// for processes to start.
pub fn run_briefly(ranks: usize, arguments: &[&str]) -> Run {
    launch_beside_others(ranks, arguments, tempfile::tempdir().unwrap(), &[NO_GRACE])
}

/// As [`run_briefly`], for what ends before MPI is up: there ranks do not wait for each other.
pub fn run_misused(ranks: usize, arguments: &[&str]) -> Run {
    launch_beside_others(ranks, arguments, tempfile::tempdir().unwrap(), &[])
}

/// Writes a scene file of this text to a directory.
pub fn scene_file(directory: &Path, text: &str) -> String {
    let path = directory.join("scene.toml");
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The number under this key.
pub fn number(summary: &Value, key: &str) -> f64 {
    summary[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {summary:#}"))
}

/// The vector under this key.
pub fn vector(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap_or_else(|error| panic!("{value} is no vector: {error}"))
}

/// Euclidean norm of `a - b`.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Fails unless `found` is `expected` to a relative tolerance.
#[track_caller]
pub fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{what}: {found} instead of {expected}, relative error {error:.2e}");
}

/// Fails unless a vector is `expected` to a tolerance relative to its length.
#[track_caller]
pub fn assert_near(what: &str, found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let error = distance(found, expected) / distance(expected, [0.0; 3]);
    assert!(error <= tolerance, "{what}: {found:?} instead of {expected:?}, relative error {error:.2e}");
}

/// Fails if one of the residuals of the glued problem is above the bound.
#[track_caller]
pub fn assert_residuals(summary: &Value, bound: f64) {
    for key in ["residual_equilibrium", "residual_gluing", "residual_gap", "residual_complementarity"] {
        let residual = number(summary, key);
        assert!(residual <= bound, "{key} is {residual:.2e}");
    }
}

/// What stands in files that a refused run must not touch.
pub const EARLIER: &str = "earlier results";

/// Fails unless the program says one thing, once, without a backtrace, that has all the parts.
#[track_caller]
pub fn assert_refused(run: &Run, code: i32, parts: &[&str]) {
    assert_message(&run.stderr, run.code, code, parts);
}

#[track_caller]
fn assert_message(said: &str, ended: i32, code: i32, parts: &[&str]) {
    assert_eq!(ended, code, "{said}");
    let messages = said.lines().filter(|line| line.starts_with("fetiplast:") || line.starts_with("error:")).count();
    assert_eq!(messages, 1, "{said}");
    for part in parts {
        assert!(said.contains(part), "nothing about `{part}` in: {said}");
    }
    for word in ["panicked", "backtrace", "Caused by"] {
        assert!(!said.contains(word), "{said}");
    }
}

/// Fails unless solving the scene with these overrides, on 1 and 2 ranks, ends on every rank with this exit code and the
/// same message, which has all the parts, and leaves results of that name as they were. Ranks are threads of the test, for
/// starting processes takes long; how the program ends with what a rank is told, [`assert_program_refuses`] shows.
#[track_caller]
pub fn assert_scene_refused(scene: &str, sets: &[&str], code: i32, parts: &[&str]) {
    for ranks in [1, 2] {
        where_results_are(scene, sets, |arguments| {
            let refusals = threads::run(ranks, |comm| {
                let cli = Cli::try_parse_from([&["fetiplast"], arguments].concat()).expect("the command line is sound");
                let command = cli.command.expect("a command is given");
                let refusal = run(command, comm, Signals::default()).expect_err("the scene is refused");
                (refusal.code(), refusal.to_string())
            });
            for refusal in &refusals {
                assert_eq!(*refusal, refusals[0], "every rank says the same");
            }
            assert_message(&format!("fetiplast: {}", refusals[0].1), refusals[0].0, code, parts);
        });
    }
}

/// As [`assert_scene_refused`], for the program under `mpirun`: the message comes once.
#[track_caller]
pub fn assert_program_refuses(scene: &str, sets: &[&str], code: i32, parts: &[&str]) {
    for ranks in [1, 2] {
        where_results_are(scene, sets, |arguments| assert_refused(&run_briefly(ranks, arguments), code, parts));
    }
    assert_scene_refused(scene, sets, code, parts);
}

/// Hands the arguments that solve a scene where results of that name exist, and fails if these are not as before then.
#[track_caller]
fn where_results_are(scene: &str, sets: &[&str], refused: impl FnOnce(&[&str])) {
    let name = Path::new(scene).file_stem().unwrap().to_str().unwrap();
    let out = tempfile::tempdir().unwrap();
    let (result, summary) = (out.path().join(format!("{name}.vtkhdf")), out.path().join(format!("{name}.json")));
    fs::write(&result, EARLIER).unwrap();
    fs::write(&summary, EARLIER).unwrap();
    let mut arguments = vec!["solve", scene, "--out", out.path().to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    refused(&arguments);
    assert_eq!(fs::read_to_string(&result).unwrap(), EARLIER);
    assert_eq!(fs::read_to_string(&summary).unwrap(), EARLIER);
    assert_eq!(fs::read_dir(out.path()).unwrap().count(), 2, "no other files appear");
}
