//! A run that is stopped goes on where it stood, on any number of ranks, and arrives at the same bits.

mod recut;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use crate::common::fields::Fields;
use crate::common::msh::{Form, write};
use crate::common::{COARSE, COARSEST, End, children, only_result, run_disturbed, scene_file, send, wait_for};
use fetiplast::mesh::Brick;
use serde_json::{Map, Value};

/// Plastic flow, and contact that opens again.
const HISTORY: &str = "step=[{increments=2}, {amplitude=0.2}]";
/// A command line that solves two blocks, results in `out`.
pub fn solve<'a>(out: &'a Path, sets: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["solve", "two-blocks", "--progress", "off", "--out", out.to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|set| ["--set", *set]));
    arguments.extend(more);
    arguments
}

pub fn resume(ranks: usize, file: &Path) -> End {
    resume_with(ranks, file, &[])
}

pub fn resume_with(ranks: usize, file: &Path, more: &[&str]) -> End {
    run_disturbed(ranks, &[&["resume", file.to_str().unwrap(), "--progress", "off"], more].concat(), |_| ())
}

/// A run stopped after so many Newton steps: no run does less than one. Where its checkpoint is.
pub fn stopped_after(steps: usize, out: &Path, sets: &[&str]) -> PathBuf {
    const AT_ONCE: [&str; 2] = ["--time-limit", "0.000001"];
    let file = checkpoint(out);
    for step in 0..steps {
        let end = match step {
            0 => run_disturbed(1, &solve(out, sets, &AT_ONCE), |_| ()),
            _ => resume_with(1, &file, &AT_ONCE),
        };
        assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    }
    file
}

/// The increment of each Newton step of a run that came to its end.
pub fn newton(out: &Path) -> Vec<u64> {
    summary(out, "two-blocks")["newton"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["increment"].as_u64().unwrap())
        .collect()
}

pub fn checkpoint(out: &Path) -> PathBuf {
    out.join("two-blocks.checkpoint.h5")
}

/// The summary of a run that came to its end.
pub fn summary(out: &Path, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join(format!("{name}.json"))).unwrap()).unwrap()
}

/// Fields by name.
type Bits = Vec<(String, Vec<u64>)>;

/// The summary but for what belongs to the run, and the bits of all fields.
fn result(out: &Path, name: &str) -> (Map<String, Value>, Bits) {
    let summary = only_result(summary(out, name));
    let file = out.join(format!("{name}.vtkhdf"));
    let fields = Fields::at(&file, 0);
    let mut bits = fields.bits(&["VTKHDF/PointData", "VTKHDF/CellData", "convergence"]);
    bits.retain(|(name, _)| name != "VTKHDF/CellData/rank");
    assert!(bits.len() > 10 && bits.iter().all(|(_, column)| !column.is_empty()), "no fields");
    bits.sort();
    (summary, bits)
}

#[track_caller]
pub fn assert_same_result(out: &Path, whole: &Path, name: &str) {
    let ((summary, bits), (summary_1, bits_1)) = (result(out, name), result(whole, name));
    for (key, value) in &summary_1 {
        assert_eq!(summary[key], *value, "{key}");
    }
    for ((name, column), (name_1, column_1)) in bits.iter().zip(&bits_1) {
        assert!(name == name_1 && column == column_1, "{name} differs");
    }
    assert_eq!((summary.len(), bits.len()), (summary_1.len(), bits_1.len()));
}

/// Exit code where SIGUSR1 meets a process that has not got as far as to catch it.
const BEFORE_IT_BEGAN: i32 = 128 + 10;

/// Stops a run after `delays`, each time going on with another number of ranks, until it ends; returns how often it
/// was stopped.
fn stop_and_go_on(out: &Path, arguments: &[&str], signal: &str, delays: &[Duration]) -> usize {
    let file = checkpoint(out);
    let (mut command, mut stopped) = (arguments.to_vec(), 0);
    for (start, &delay) in delays.iter().enumerate() {
        let end = run_disturbed(1 + start % 3, &command, |process| {
            sleep(delay);
            send(signal, process);
        });
        if end.code == 0 {
            return stopped;
        }
        assert!(end.seconds < 60.0);
        if end.code == BEFORE_IT_BEGAN {
            // To be started again as it was.
            continue;
        }
        assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
        assert_eq!(end.stderr.matches("stopped by SIG").count(), 1, "{}", end.stderr);
        stopped += 1;
        command = vec!["resume", file.to_str().unwrap(), "--progress", "off"];
    }
    let end = run_disturbed(2, &command, |_| ());
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    stopped
}

/// Moments of a run, none like the other, from a seed (Knuth's linear congruences).
fn moments(seed: u64, count: usize, longest: Duration) -> Vec<Duration> {
    let next = |x: &u64| Some(x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407));
    let shares = std::iter::successors(Some(seed), next).skip(1).map(|x| (x >> 11) as f64 / (1_u64 << 53) as f64);
    shares.take(count).map(|share| longest.mul_f64(share)).collect()
}

/// How many moments are tried; `scripts/faults` asks for more.
fn tries() -> usize {
    std::env::var("FETIPLAST_TRIES").ok().map_or(3, |tries| tries.parse().expect("a number of tries"))
}

#[test]
fn a_run_stopped_at_any_moment_arrives_at_the_same_bits_on_other_ranks() {
    let sets = [&COARSE[..], &[HISTORY]].concat();
    let whole = tempfile::tempdir().unwrap();
    let end = run_disturbed(2, &solve(whole.path(), &sets, &[]), |_| ());
    assert_eq!(end.code, 0, "{}", end.stderr);
    let longest = Duration::from_secs_f64(end.seconds);
    let mut stopped = 0;
    for (seed, moment) in moments(6, tries(), longest).into_iter().enumerate() {
        let out = tempfile::tempdir().unwrap();
        let delays = [&[moment], &moments(seed as u64, 2, longest)[..]].concat();
        stopped += stop_and_go_on(out.path(), &solve(out.path(), &sets, &[]), "USR1", &delays);
        assert_same_result(out.path(), whole.path(), "two-blocks");
    }
    assert!(stopped > 0, "no moment was early enough");
}

/// Stops a run after every step but the last two, and goes on on other ranks.
fn assert_stops_change_nothing(sets: &[&str]) {
    let directory = tempfile::tempdir().unwrap();
    let [whole, out] = ["whole", "stopped"].map(|name| directory.path().join(name));
    assert_eq!(run_disturbed(2, &solve(&whole, sets, &[]), |_| ()).code, 0);
    let file = stopped_after(newton(&whole).len() - 2, &out, sets);
    assert_eq!(resume(3, &file).code, 0);
    assert_same_result(&out, &whole, "two-blocks");
}

/// Deluxe scaling and subdomains that supports hold still are not in a checkpoint: they follow from what is.
#[test]
fn a_rigid_body_that_flows_stopped_after_every_step_arrives_at_the_same_bits() {
    assert_stops_change_nothing(&[&COARSE[..], &["material.lower.young=2.1e11"]].concat());
}

/// What slips, its radii and springs follow from multipliers and slips.
#[test]
fn a_history_with_friction_stopped_after_every_step_arrives_at_the_same_bits() {
    for law in ["contact.joint.friction=0.3", "contact.joint.shear_limit=5.0"] {
        assert_stops_change_nothing(&[&COARSE[..], &[HISTORY, law]].concat());
    }
}

#[test]
fn a_cascade_stopped_by_the_clock_goes_on_to_the_same_bits() {
    let whole = tempfile::tempdir().unwrap();
    let level = ["--level", "2", "--cascade", "on"];
    assert_eq!(run_disturbed(2, &solve(whole.path(), &COARSE, &level), |_| ()).code, 0);
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("two-blocks-level2.checkpoint.h5");
    let limit = [&level[..], &["--time-limit", "0.001"]].concat();
    let mut end = run_disturbed(1, &solve(out.path(), &COARSE, &limit), |_| ());
    // The clock stops it after its first step; later it may take one checkpoint's time after the other.
    assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    assert!(end.stderr.contains("stopped before the time limit; go on with: fetiplast resume"), "{}", end.stderr);
    for limit in ["0.1", "0.5", "1", "2"] {
        let arguments = ["resume", file.to_str().unwrap(), "--time-limit", limit];
        end = run_disturbed(2, &arguments, |_| ());
        if end.code == 0 {
            break;
        }
        assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    }
    if end.code != 0 {
        end = resume(3, &file);
    }
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_same_result(out.path(), whole.path(), "two-blocks-level2");
}

#[test]
fn a_signal_to_the_ranks_themselves_stops_the_run_as_one_by_mpirun() {
    let out = tempfile::tempdir().unwrap();
    let more = ["--qp", "smalse-m", "--preconditioner", "none", "--checkpoint-every", "0.000001"];
    let end = run_disturbed(2, &solve(out.path(), &[], &more), |launcher| {
        // The first checkpoint says that the run is under way.
        wait_for(&checkpoint(out.path()), 1);
        children(launcher).into_iter().for_each(|rank| send("TERM", rank));
    });
    assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    assert_eq!(end.stderr.matches("stopped by SIGTERM; go on with: fetiplast resume").count(), 1, "{}", end.stderr);
}

/// A directory with two checkpoints of a small run, the later one taken in the middle.
fn two_checkpoints() -> tempfile::TempDir {
    let out = tempfile::tempdir().unwrap();
    let end = run_disturbed(2, &solve(out.path(), &COARSE, &["--checkpoint-every", "0.000001"]), |_| ());
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert!(checkpoint(out.path()).exists() && before(out.path()).exists());
    out
}

fn before(out: &Path) -> PathBuf {
    out.join("two-blocks.checkpoint.h5.previous")
}

#[test]
fn a_damaged_checkpoint_is_noticed_and_the_one_before_is_taken() {
    let out = two_checkpoints();
    let whole = tempfile::tempdir().unwrap();
    for name in ["two-blocks.vtkhdf", "two-blocks.json"] {
        fs::rename(out.path().join(name), whole.path().join(name)).unwrap();
    }
    let file = checkpoint(out.path());
    let sound = fs::read(&file).unwrap();
    let mut flipped = sound.clone();
    flipped[sound.len() / 2] ^= 1;
    let damaged: [(&[u8], &str); 3] =
        [(&flipped, "its checksum is wrong"), (&sound[..sound.len() / 2], "not complete"), (&[], "not complete")];
    for (bytes, reason) in damaged {
        fs::write(&file, bytes).unwrap();
        let end = resume(2, &file);
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert!(end.stdout.contains(reason) && end.stdout.contains("the one before"), "{}", end.stdout);
        assert_same_result(out.path(), whole.path(), "two-blocks");
    }
    fs::write(before(out.path()), &sound[..100]).unwrap();
    let end = resume(2, &file);
    assert_eq!(end.code, 74, "{}", end.stderr);
    assert_eq!(end.stderr.matches("fetiplast: cannot go on").count(), 1, "{}", end.stderr);
    let end = resume(2, &out.path().join("none.h5"));
    assert!(end.code == 74 && end.stderr.contains("No such file"), "{}", end.stderr);
}

#[test]
fn a_changed_scene_is_refused_and_the_difference_named() {
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("blocks.toml");
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/library/two-blocks.toml")).unwrap();
    fs::write(&scene, &text).unwrap();
    let out = directory.path().join("out");
    let mut arguments = solve(&out, &COARSE, &["--time-limit", "0.001"]);
    arguments[1] = scene.to_str().unwrap();
    assert_eq!(run_disturbed(2, &arguments, |_| ()).code, 75);
    let changed = text.replace("-150.0", "-75.0");
    assert_ne!(changed, text);
    fs::write(&scene, changed).unwrap();
    let file = out.join("blocks.checkpoint.h5");
    let end = resume(2, &file);
    assert_eq!(end.code, 65, "{}", end.stderr);
    assert!(end.stderr.contains("load.top.traction.2 was -150.0, is -75.0"), "{}", end.stderr);
    assert!(!out.join("blocks.json").exists());
    fs::write(&scene, text).unwrap();
    assert_eq!(resume(2, &file).code, 0);
}

#[test]
fn a_changed_mesh_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let mesh = |length: f64| {
        let bar = Brick { origin: [0.0; 3], size: [length, 1.0, 1.0], cells: [6, 2, 2] };
        fs::write(directory.path().join("bar.msh"), write(&[("bar", bar)], Form::Binary41)).unwrap();
    };
    let text = r#"
        material.steel = { young = 210.0, poisson = 0.3, yield_stress = 0.45, hardening = 10.0 }
        body.bar = { material = "steel", element = "tet4", gmsh = { file = "bar.msh" } }
        support.back = { surface = "bar.xmin", fix = ["x", "y", "z"] }
        load.pull = { surface = "bar.xmax", traction = [0.5, 0.0, 0.0] }
        decomposition.subdomains = 3
    "#;
    mesh(3.0);
    let (scene, out) = (scene_file(directory.path(), text), directory.path().join("out"));
    let mut arguments = solve(&out, &[], &["--time-limit", "0.001"]);
    arguments[1] = &scene;
    assert_eq!(run_disturbed(2, &arguments, |_| ()).code, 75);
    let file = out.join("scene.checkpoint.h5");
    for more in [&[][..], &["--set", "decomposition.subdomains=2"]] {
        mesh(3.5);
        let end = resume_with(2, &file, more);
        assert_eq!(end.code, 65, "{}", end.stderr);
        let told = "fetiplast: the meshes have changed since the checkpoint was written: elements or coordinates";
        assert_eq!(end.stderr.matches(told).count(), 1, "{}", end.stderr);
        assert!(!out.join("scene.json").exists());
    }
    mesh(3.0);
    assert_eq!(resume(2, &file).code, 0);
}

#[test]
fn a_run_from_the_state_of_another_goes_on_to_the_same_bits() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    // The second half of the way back depends on where the support was.
    let moved = [&COARSEST[..], &["support.left.displacement=[0.4, 0.0, 0.0]"]].concat();
    assert_eq!(run_disturbed(2, &solve(&at("pressed"), &moved, &[]), |_| ()).code, 0);
    let start = format!("initial.result=\"{}\"", at("pressed").join("two-blocks.vtkhdf").display());
    let sets = [&moved[..], &[&start, "step=[{amplitude=0.2, increments=2}, {amplitude=1.1}]"]].concat();
    assert_eq!(run_disturbed(2, &solve(&at("whole"), &sets, &[]), |_| ()).code, 0);
    let steps = newton(&at("whole"));
    assert!(steps.len() > 5);
    for stop in [1, 2, steps.len() - 2] {
        let out = at(&stop.to_string());
        let file = stopped_after(stop, &out, &sets);
        let end = resume(3, &file);
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert_same_result(&out, &at("whole"), "two-blocks");
    }
}
