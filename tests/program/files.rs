//! Where files go, through links, devices and pipes; what ends a run that waits; a log that nobody takes.

use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::{sleep, spawn};
use std::time::Duration;

use crate::common::{COARSEST, End, children, on_one_machine, run_disturbed, scene_file, send};
use serde_json::Value;

const INPUT_OUTPUT: i32 = 74;
const PROGRAM: &str = env!("CARGO_BIN_EXE_fetiplast");

/// A small run.
fn solve<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["solve", "two-blocks", "--progress", "off", "--out", out.to_str().unwrap()];
    arguments.extend(COARSEST.iter().flat_map(|set| ["--set", *set]));
    arguments.extend(more);
    arguments
}

fn run(ranks: usize, out: &Path, more: &[&str]) -> End {
    run_disturbed(ranks, &solve(out, more), |_| ())
}

fn pipe(path: &Path) -> &str {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    path.to_str().unwrap()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn links_are_followed_and_stay() {
    let directory = tempfile::tempdir().unwrap();
    let (out, big) = (directory.path().join("out"), directory.path().join("big"));
    fs::create_dir(&out).unwrap();
    fs::create_dir(&big).unwrap();
    let names = ["two-blocks.vtkhdf", "two-blocks.checkpoint.h5", "two-blocks.json", "log.jsonl"];
    for name in names {
        symlink(Path::new("../big").join(name), out.join(name)).unwrap();
    }
    fs::write(big.join("two-blocks.vtkhdf"), "an earlier result").unwrap();
    let log = out.join("log.jsonl");
    let more = ["--checkpoint-every", "0.000001", "--log-json", log.to_str().unwrap()];
    let end = run(2, &out, &more);
    assert_eq!(end.code, 0, "{}", end.stderr);
    for name in names {
        assert!(fs::symlink_metadata(out.join(name)).unwrap().is_symlink(), "{name}");
        assert!(fs::symlink_metadata(big.join(name)).unwrap().is_file(), "{name}");
    }
    assert_eq!(fs::read_dir(&out).unwrap().count(), names.len());
    assert_eq!(fs::read_dir(&big).unwrap().count(), names.len() + 1, "and the checkpoint before");
    assert_eq!(json(&fs::read_to_string(out.join("two-blocks.json")).unwrap())["converged"], true);
    // The checkpoint before is beside the file.
    fs::write(out.join("two-blocks.checkpoint.h5"), "damaged").unwrap();
    let file = out.join("two-blocks.checkpoint.h5");
    let end = run_disturbed(2, &["resume", file.to_str().unwrap()], |_| ());
    assert_eq!(end.code, 0, "{}", end.stderr);
    assert!(end.stdout.contains("going on from the one before"), "{}", end.stdout);
}

#[test]
fn devices_and_pipes_are_written_to_or_refused_and_never_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    fs::create_dir(&out).unwrap();
    let at = |name: &str| directory.path().join(name);
    symlink("/dev/null", at("null")).unwrap();
    let end = run(2, &out, &["--summary", at("null").to_str().unwrap(), "--log-json", "/dev/null"]);
    assert_eq!(end.code, 0, "{}", end.stderr);
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    assert!(fs::symlink_metadata(at("null")).unwrap().is_symlink());

    let [summary, log] = ["summary", "log"].map(|name| {
        pipe(&at(name));
        let mut text = String::new();
        let path = at(name);
        spawn(move || File::open(path).and_then(|mut pipe| pipe.read_to_string(&mut text)).map(|_| text).unwrap())
    });
    let names = ["summary", "log"].map(at);
    let end = run(2, &out, &["--summary", names[0].to_str().unwrap(), "--log-json", names[1].to_str().unwrap()]);
    assert_eq!(end.code, 0, "{}", end.stderr);
    assert_eq!(json(&summary.join().unwrap())["converged"], true);
    let log = log.join().unwrap();
    assert!(log.lines().map(json).any(|line| line["event"] == "newton_step"), "{log}");
    assert!(names.iter().all(|name| fs::metadata(name).unwrap().file_type().is_fifo()));

    // The file behind standard output is not written over, but gets the summary, too.
    let kept = at("kept");
    fs::write(&kept, "a line before\n").unwrap();
    let stdout = OpenOptions::new().append(true).open(&kept).unwrap();
    let arguments = solve(&out, &["--summary", "/dev/stdout", "--log-json", "/dev/stdout"]);
    assert!(Command::new(PROGRAM).args(&arguments).stdout(stdout).status().unwrap().success());
    let text = fs::read_to_string(&kept).unwrap();
    let parts = ["a line before\n", "\"event\":\"newton_step\"", "\n  \"converged\": true", "Converged in"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");

    for name in ["two-blocks.vtkhdf", "two-blocks.checkpoint.h5", "two-blocks.checkpoint.h5.previous"] {
        let file = out.join(name);
        let _ = fs::remove_file(&file);
        pipe(&file);
        let end = run(2, &out, &[]);
        assert_eq!(end.code, INPUT_OUTPUT, "{}", end.stderr);
        assert!(end.stderr.contains("regular file") && !end.stdout.contains("criterion"), "{}", end.stderr);
        assert!(fs::metadata(&file).unwrap().file_type().is_fifo());
        fs::remove_file(&file).unwrap();
    }
    let end = run(2, &out, &["--summary", out.to_str().unwrap()]);
    assert!(end.code == INPUT_OUTPUT && end.stderr.contains("is a directory"), "{}", end.stderr);
}

/// Exit codes by signal.
const TERM: i32 = 128 + 15;

#[test]
fn sigterm_ends_a_run_that_waits_for_its_input_or_for_who_reads_its_output() {
    let directory = tempfile::tempdir().unwrap();
    let waiting = directory.path().join("pipe.toml");
    let path = pipe(&waiting);
    let mesh = r#"
        material.steel = { young = 1.0, poisson = 0.3 }
        body.bar = { material = "steel", element = "tet4", gmsh = { file = "pipe.toml" } }
    "#;
    let scene = scene_file(directory.path(), mesh);
    let out = directory.path().join("out");
    let summary = solve(&out, &["--summary", path]);
    let log = solve(&out, &["--log-json", path]);
    let cases = [vec!["solve", path], vec!["check", path], vec!["solve", &scene], summary, log];
    for (arguments, ranks) in cases.iter().zip([1, 1, 2, 1, 2]) {
        let end = run_disturbed(ranks, arguments, |process| {
            sleep(Duration::from_secs(1));
            match ranks {
                1 => send("TERM", process),
                _ => children(process).into_iter().for_each(|rank| send("TERM", rank)),
            }
        });
        assert_eq!(end.code, TERM, "{arguments:?}: {}{}", end.stdout, end.stderr);
        assert!(end.seconds < 30.0, "{arguments:?}: {} s", end.seconds);
    }
    let verify = run_disturbed(1, &["verify", "hertz"], |process| {
        sleep(Duration::from_millis(1500));
        send("TERM", process);
    });
    assert_eq!(verify.code, TERM, "{}{}", verify.stdout, verify.stderr);
}

#[test]
fn scenes_and_meshes_may_come_through_pipes() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("pipe.toml");
    let scene = pipe(&path).to_owned();
    let text = include_str!("../../src/scene/library/patch.toml");
    let writer = spawn(move || fs::write(path, text).unwrap());
    let end = run_disturbed(2, &["check", &scene], |_| ());
    writer.join().unwrap();
    assert_eq!(end.code, 0, "{}", end.stderr);
}

/// What became of the program with such a standard output.
fn with_output(arguments: &[&str], stdout: Stdio) -> Output {
    let mut command = Command::new(PROGRAM);
    on_one_machine(&mut command);
    command.args(arguments).env("RUST_BACKTRACE", "1").stdout(stdout).stderr(Stdio::piped()).output().unwrap()
}

#[test]
fn a_log_that_nobody_takes_ends_the_program_quietly() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let check = ["check", "two-blocks"];
    let (solve, verify) = (solve(&out, &[]), ["verify", "uniaxial", "--element", "hex8"]);
    let cases = [&["show", "two-blocks"][..], &["scenes"], &["--help"], &["--version"], &check, &solve, &verify];
    for arguments in cases {
        let full = with_output(arguments, OpenOptions::new().write(true).open("/dev/full").unwrap().into());
        let said = String::from_utf8_lossy(&full.stderr);
        assert_eq!(full.status.code(), Some(INPUT_OUTPUT), "{arguments:?}: {said}");
        assert!(said.lines().count() == 1 && said.contains("No space left on device"), "{arguments:?}: {said}");
        // A pipe without a reader.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let closed = with_output(arguments, writer.into());
        assert_eq!(closed.status.code(), Some(INPUT_OUTPUT), "{arguments:?}");
        assert_eq!(String::from_utf8_lossy(&closed.stderr), "", "{arguments:?}");
    }
    assert!(!out.join("two-blocks.json").exists());
    assert!(!out.join("two-blocks.checkpoint.h5").exists(), "nothing was done that could be kept");
    // All ranks end, though only one of them speaks.
    let command = format!("exec {PROGRAM} \"$@\" >/dev/full");
    let mut mpirun = Command::new("timeout");
    mpirun.args(["60", "mpirun", "-np", "2", "sh", "-c", &command, "sh"]).args(&solve);
    on_one_machine(&mut mpirun);
    let end = mpirun.output().unwrap();
    let said = String::from_utf8_lossy(&end.stderr);
    assert_eq!(end.status.code(), Some(INPUT_OUTPUT), "{said}");
    assert_eq!(said.matches("fetiplast: cannot write to standard output").count(), 1, "{said}");
}

#[test]
fn a_log_that_breaks_off_leaves_a_checkpoint() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let more = ["--qp", "smalse-m", "--preconditioner", "none"];
    let mut command = Command::new(PROGRAM);
    command.args(solve(&out, &more)).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut run = command.spawn().unwrap();
    let mut begin = [0; 2000];
    let mut stdout = run.stdout.take().unwrap();
    // Until Newton's method is under way.
    let mut read = 0;
    while !String::from_utf8_lossy(&begin[..read]).contains("criterion") {
        read += stdout.read(&mut begin[read..]).unwrap();
    }
    drop(stdout);
    let end = run.wait_with_output().unwrap();
    assert_eq!((end.status.code(), end.status.signal()), (Some(INPUT_OUTPUT), None));
    assert_eq!(String::from_utf8_lossy(&end.stderr), "");
    let file = out.join("two-blocks.checkpoint.h5");
    let end = run_disturbed(1, &["resume", file.to_str().unwrap()], |_| ());
    assert_eq!(end.code, 0, "{}", end.stderr);
}
