//! What goes wrong under a run ends it on every rank, soon and with the right code; what earlier runs left stays readable.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::fields::Fields;
use crate::common::{End, children, on_one_machine, run_disturbed, run_in_small_room, send, wait_for};
use fetiplast::comm::Comm;
use fetiplast::comm::world::World;

/// No fault may take longer to end the run.
const SOON: f64 = 60.0;

/// A run of a few seconds.
fn long<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let solve = ["solve", "two-blocks", "--progress", "off", "--qp", "smalse-m", "--preconditioner", "none"];
    [&solve[..], &["--out", out.to_str().unwrap()], more].concat()
}

/// A result of an earlier run of that name.
fn earlier(out: &Path) -> Vec<u8> {
    let cells = ["--set", "body.lower.brick.cells=[15, 5, 5]", "--set", "body.upper.brick.cells=[15, 5, 5]"];
    let more = [&cells[..], &["--set", "decomposition.cells=[5, 5, 5]", "--checkpoint-every", "0.000001"]].concat();
    let end = run_disturbed(2, &long(out, &more), |_| ());
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    fs::read(out.join("two-blocks.vtkhdf")).unwrap()
}

#[track_caller]
fn assert_untouched(out: &Path, earlier: &[u8]) {
    let file = out.join("two-blocks.vtkhdf");
    assert!(fs::read(&file).unwrap() == earlier, "the earlier result was touched");
    assert!(!Fields::read(&file).displacement.is_empty());
}

/// Kills the last rank of a run when it has written so many checkpoints.
fn kill_a_rank(checkpoint: &Path, written: usize, arguments: &[&str]) -> End {
    run_disturbed(2, arguments, |launcher| {
        wait_for(checkpoint, written);
        send("KILL", *children(launcher).last().expect("ranks are running"));
    })
}

#[test]
fn a_killed_rank_ends_the_run_and_leaves_results_and_checkpoints() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let result = earlier(out);
    let file = out.join("two-blocks.checkpoint.h5");
    for written in [1, 2, 4] {
        let end = kill_a_rank(&file, written, &long(out, &["--checkpoint-every", "0.000001"]));
        assert!(end.seconds < SOON, "{} s", end.seconds);
        assert!(end.code != 0, "{}", end.stdout);
        assert_untouched(out, &result);
    }
    let end = run_disturbed(2, &["resume", file.to_str().unwrap()], |_| ());
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
}

#[test]
fn a_result_deleted_under_the_run_is_written_all_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let end = run_disturbed(2, &long(&out, &["--checkpoint-every", "0.2"]), |_| {
        // While it is at work, not while it still tries its files, and not behind: runs get faster.
        let (started, checkpoint) = (Instant::now(), out.join("two-blocks.checkpoint.h5"));
        while !checkpoint.exists() && started.elapsed() < Duration::from_secs(10) {
            sleep(Duration::from_millis(5));
        }
        let _ = fs::remove_dir_all(&out);
    });
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert!(!Fields::read(&out.join("two-blocks.vtkhdf")).displacement.is_empty());
}

#[test]
fn a_full_disk_ends_the_run_with_one_message() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let fits = ["--set", "body.lower.brick.cells=[6, 2, 2]", "--set", "body.upper.brick.cells=[6, 2, 2]"];
    let small = [&fits[..], &["--set", "decomposition.cells=[2, 2, 2]"]].concat();
    let stopped = ["--time-limit", "0.001"];
    for (more, size, wanted) in [(&small[..], "1m", 0), (&[][..], "1m", 74), (&stopped[..], "200k", 74)] {
        let end = run_in_small_room(2, &long(out, more), out, size);
        assert!(end.seconds < SOON, "{} s", end.seconds);
        assert_eq!(end.code, wanted, "{more:?}: {}{}", end.stdout, end.stderr);
        let messages = end.stderr.matches("fetiplast: cannot write").count();
        assert_eq!(messages, usize::from(wanted != 0), "{}", end.stderr);
        assert!(wanted == 0 || end.stderr.contains("no room for"), "{}", end.stderr);
    }
}

/// Not a test: what [`a_rank_that_panics_ends_all_ranks`] starts under mpirun.
#[test]
#[ignore = "to be run under mpirun"]
fn panic_on_the_last_rank() {
    let world = World::start().expect("MPI starts");
    assert!(world.rank() + 1 < world.size(), "this rank panics");
    // The others wait for it.
    world.all_gather(&[1.0], &vec![1; world.size()]);
}

#[test]
fn a_rank_that_panics_ends_all_ranks() {
    let this = std::env::current_exe().unwrap();
    let test = ["--ignored", "--exact", "faults::panic_on_the_last_rank", "--nocapture", "--test-threads", "1"];
    let mut mpirun = Command::new("timeout");
    mpirun.args(["60", "mpirun", "-np", "3"]).arg(this).args(test);
    on_one_machine(&mut mpirun);
    let output = mpirun.output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(70), "{stderr}");
    assert_eq!(stderr.matches("fetiplast: internal error on rank 2; please report it").count(), 1, "{stderr}");
}
