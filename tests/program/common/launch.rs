//! Starts the program, alone or under `mpirun`, with a time limit; some runs are disturbed, or have little room.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::{Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::Run;

/// One run at a time: ranks wait busily, and two runs on two cores would each wait for the other.
static TURN: Mutex<()> = Mutex::new(());

const TIME_LIMIT: Duration = Duration::from_secs(240);

/// When a rank ends with a code other than 0, mpirun would wait a second before it ends itself: in vain where the ranks
/// have waited for each other.
pub(super) const NO_GRACE: (&str, &str) = ("OMPI_MCA_odls_base_sigkill_timeout", "0");

/// How a run ended and what it said.
pub struct End {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
    pub seconds: f64,
}

/// Runs the program with these arguments, which say where its files go. `disturb` is told the process that was started
/// (mpirun's, for more than one rank) and may do it harm.
pub fn run_disturbed(ranks: usize, arguments: &[&str], disturb: impl FnOnce(u32)) -> End {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let directory = tempfile::tempdir().unwrap();
    let (command, streams) = prepare(ranks, arguments, directory.path());
    end(command, streams, disturb)
}

fn end(command: Command, streams: [PathBuf; 2], disturb: impl FnOnce(u32)) -> End {
    let start = Instant::now();
    let status = wait(command, disturb);
    let [stdout, stderr] = streams.map(|path| fs::read_to_string(path).unwrap());
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    let code = status.code().or(signal.map(|signal| 128 + signal)).unwrap();
    End { code, stdout, stderr, seconds: start.elapsed().as_secs_f64() }
}

/// Runs the program in a directory that takes so much (a file system of its own, which nobody else sees).
pub fn run_in_small_room(ranks: usize, arguments: &[&str], directory: &Path, size: &str) -> End {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let outside = tempfile::tempdir().unwrap();
    let (program, streams) = prepare(ranks, arguments, outside.path());
    let mut command = Command::new("unshare");
    let mount = format!("mount -t tmpfs -o size={size} none {} && exec \"$@\"", directory.display());
    command.args(["--mount", "--map-root-user", "sh", "-c", &mount, "sh"]).arg(program.get_program());
    command.args(program.get_args());
    command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    command.stdout(File::create(&streams[0]).unwrap()).stderr(File::create(&streams[1]).unwrap());
    end(command, streams, |_| ())
}

/// Runs the program where each rank may have so many KiB of addresses.
pub fn run_short_of_memory(ranks: usize, arguments: &[&str], kibibytes: usize) -> End {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let outside = tempfile::tempdir().unwrap();
    let (program, streams) = prepare(1, arguments, outside.path());
    let mut command = Command::new("mpirun");
    let limited = format!("ulimit -v {kibibytes} && exec \"$@\"");
    command.args(["-np", &ranks.to_string(), "sh", "-c", &limited, "sh"]).arg(program.get_program());
    command.args(program.get_args());
    command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    command.stdout(File::create(&streams[0]).unwrap()).stderr(File::create(&streams[1]).unwrap());
    end(command, streams, |_| ())
}

/// Processes that a process has started.
pub fn children(process: u32) -> Vec<u32> {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let of_threads = threads.map(|thread| fs::read_to_string(thread.path().join("children")).unwrap_or_default());
    of_threads.collect::<String>().split_whitespace().map(|child| child.parse().unwrap()).collect()
}

/// Waits until a file has been written, anew, so many times; not for ever.
pub fn wait_for(file: &Path, times: usize) {
    let written = || fs::metadata(file).and_then(|data| data.modified()).ok();
    let (start, mut last, mut seen) = (Instant::now(), written(), 0);
    while seen < times && start.elapsed() < TIME_LIMIT {
        sleep(Duration::from_millis(2));
        let now = written();
        if now.is_some() && now != last {
            (last, seen) = (now, seen + 1);
        }
    }
}

/// Sends a signal to a process.
pub fn send(signal: &str, process: u32) {
    // It may be gone already.
    Command::new("kill").args([&format!("-{signal}"), &process.to_string()]).output().unwrap();
}

/// One of these runs at a time: others would take the cores that it counts on.
pub(super) fn launch(ranks: usize, arguments: &[&str], directory: TempDir) -> Run {
    // A failed test poisons the lock, which guards no data.
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    launch_beside_others(ranks, arguments, directory, &[NO_GRACE])
}

pub(super) fn launch_beside_others(
    ranks: usize,
    arguments: &[&str],
    directory: TempDir,
    environment: &[(&str, &str)],
) -> Run {
    let (mut command, streams) = prepare(ranks, arguments, directory.path());
    command.envs(environment.iter().copied());
    let status = wait(command, |_| ());
    let [stdout, stderr] = streams.map(|path| fs::read_to_string(path).unwrap());
    let code = status.code().unwrap_or_else(|| panic!("{status}: {stderr}"));
    Run { code, stdout, stderr, directory }
}

/// The command, and the files that its output goes to.
fn prepare(ranks: usize, arguments: &[&str], directory: &Path) -> (Command, [PathBuf; 2]) {
    let program = env!("CARGO_BIN_EXE_fetiplast");
    let mut command = if ranks == 1 { Command::new(program) } else { Command::new("mpirun") };
    if ranks > 1 {
        command.args(["-np", &ranks.to_string(), program]);
    }
    command.args(arguments).env("RUST_BACKTRACE", "1");
    on_one_machine(&mut command);
    if ranks > 2 {
        command.env("OMPI_MCA_mpi_yield_when_idle", "1");
    }
    // Files, unlike pipes, never fill up.
    let streams = ["stdout", "stderr"].map(|name| directory.join(name));
    command.stdout(File::create(&streams[0]).unwrap()).stderr(File::create(&streams[1]).unwrap());
    (command, streams)
}

/// What Open MPI has to know on a machine with few cores, where the tests may be root.
pub fn on_one_machine(command: &mut Command) {
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    // Looking for networks takes half of the time of a start, and the daemon that a single rank asks for as much.
    command.env("OMPI_MCA_rmaps_base_oversubscribe", "1").env("OMPI_MCA_pml", "ob1");
    command.env("OMPI_MCA_ess_singleton_isolated", "1");
}

/// The end of a command, which is killed and a failure of the test if it does not come in time.
fn wait(mut command: Command, disturb: impl FnOnce(u32)) -> ExitStatus {
    let mut child = command.spawn().expect("the program can be started");
    let start = Instant::now();
    disturb(child.id());
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if start.elapsed() > TIME_LIMIT {
            // On SIGTERM mpirun ends its ranks too.
            Command::new("kill").arg(child.id().to_string()).status().unwrap();
            sleep(Duration::from_secs(5));
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("no end after {TIME_LIMIT:?}: {command:?}");
        }
        sleep(Duration::from_millis(10));
    }
}
