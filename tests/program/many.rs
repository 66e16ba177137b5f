//! Many ranks on few cores: groups of groups on 1 to 64 ranks, a way back from 64 to 3, and the death of one among 64. `scripts/many`
//! runs what takes too long for each change.

use std::time::{Duration, Instant};

use crate::checkpoint::{assert_same_result, checkpoint, resume, solve};
use crate::common::{children, run_disturbed, send, wait_for};
use crate::ranks::assert_independent_of_ranks;

/// 750 boxes, in groups of eight and groups of four of these.
const LEVELS: [&str; 2] = ["decomposition.cells=[2, 2, 2]", "decomposition.cluster=[8, 4]"];
const MANY: usize = 64;

/// That a rank is gone is known at once, and the launcher gives the others some time.
const ALL_GONE: Duration = Duration::from_secs(10);

#[test]
fn groups_of_groups_give_the_same_bits_on_1_3_and_16_ranks() {
    let summary = assert_independent_of_ranks("two-blocks", &LEVELS, &[1, 3, 16]);
    assert_eq!((summary["subdomains"].as_u64(), summary["clusters"].as_u64()), (Some(750), Some(96)));
    assert!(summary["coarse_blocks"].as_u64() < Some(40));
}

#[test]
#[ignore = "64 ranks: scripts/many"]
fn groups_of_groups_give_the_same_bits_on_1_2_3_5_16_and_64_ranks() {
    assert_independent_of_ranks("two-blocks", &LEVELS, &[1, 2, 3, 5, 16, MANY]);
}

#[test]
#[ignore = "64 ranks: scripts/many"]
fn a_run_stopped_on_64_ranks_goes_on_on_3_to_the_same_bits() {
    let [whole, out] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let end = run_disturbed(2, &solve(whole.path(), &LEVELS, &["--cascade", "off"]), |_| ());
    assert_eq!(end.code, 0, "{}", end.stderr);
    let at_once = ["--cascade", "off", "--time-limit", "0.000001"];
    let end = run_disturbed(MANY, &solve(out.path(), &LEVELS, &at_once), |_| ());
    assert_eq!(end.code, 75, "{}{}", end.stdout, end.stderr);
    let end = resume(3, &checkpoint(out.path()));
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    assert_same_result(out.path(), whole.path(), "two-blocks");
}

#[test]
#[ignore = "64 ranks: scripts/many"]
fn a_rank_killed_among_64_ends_all_of_them_soon() {
    let out = tempfile::tempdir().unwrap();
    let slowly = ["--qp", "smalse-m", "--preconditioner", "none", "--checkpoint-every", "0.000001"];
    let mut killed = Instant::now();
    let end = run_disturbed(MANY, &solve(out.path(), &LEVELS, &slowly), |launcher| {
        wait_for(&checkpoint(out.path()), 1);
        killed = Instant::now();
        let ranks = children(launcher);
        assert_eq!(ranks.len(), MANY, "{launcher}: {ranks:?}");
        send("KILL", ranks[MANY / 2]);
    });
    assert!(end.code != 0, "{}", end.stdout);
    assert!(killed.elapsed() < ALL_GONE, "{:?}", killed.elapsed());
}
