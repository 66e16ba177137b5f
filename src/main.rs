//! `fetiplast`: see the crate's documentation and `fetiplast --help`.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::process::exit;

use clap::Parser;
use fetiplast::cli::keeper::Signals;
use fetiplast::cli::{Cli, Command, Failure, run};
use fetiplast::comm::Comm;
use fetiplast::comm::world::{EXIT_BUG, World};
use fetiplast::heap::Heap;
use fetiplast::monitor::stdout::{self, Log};

#[global_allocator]
static HEAP: Heap = Heap;

/// Exit codes of a wrong command line, and of a stream that cannot be written (sysexits).
const EXIT_USAGE: i32 = 64;
const EXIT_OUTPUT: i32 = 74;

fn main() {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command.unwrap_or_else(Command::benchmark),
        Err(error) if error.use_stderr() => {
            if speaks() {
                // A closed stream leaves nobody to tell.
                let _ = error.print();
            }
            exit(EXIT_USAGE);
        }
        Err(help) => answer(|| help.print()),
    };
    match command.answer() {
        None => {}
        Some(Ok(text)) => answer(|| writeln!(io::stdout(), "{text}")),
        Some(Err(message)) => {
            if speaks() {
                tell(message);
            }
            exit(EXIT_USAGE);
        }
    }
    // Before MPI is up, so that a signal at any later moment finds the run prepared; a check may be ended at once.
    let signals = match command {
        Command::Solve(_) | Command::Resume(_) => Signals::catch().unwrap_or_else(|error| {
            tell(format!("signals cannot be caught: {error}"));
            exit(EXIT_BUG)
        }),
        _ => Signals::default(),
    };
    let Some(world) = World::start() else {
        tell("MPI cannot be started");
        exit(EXIT_BUG);
    };
    if world.rank() == 0 {
        let format = tracing_subscriber::fmt::format().without_time().with_target(false).with_level(false).compact();
        tracing_subscriber::fmt().event_format(format).with_writer(Log::default).init();
    }
    match run(command, &world, signals) {
        Ok(code) => world.finish(code),
        Err(failure) => {
            if world.rank() == 0 {
                report(&failure, stdout::failure());
            }
            match failure {
                // After a failed collective write HDF5 may not let go of its file: end without taking leave.
                Failure::Output(_) => world.abort(failure.code()),
                _ => world.finish(failure.code()),
            }
        }
    }
}

/// Prints what was asked for, and ends.
fn answer(print: impl FnOnce() -> io::Result<()>) -> ! {
    if speaks()
        && let Err(error) = print().and_then(|()| io::stdout().flush())
    {
        report(&Failure::Mute { path: None }, Some(&error));
        exit(EXIT_OUTPUT);
    }
    exit(0);
}

/// Says why there is no result. Who closed standard output does not want to hear of it.
fn report(failure: &Failure, output: Option<&io::Error>) {
    match (failure, output) {
        (Failure::Mute { .. }, Some(error)) if error.kind() == ErrorKind::BrokenPipe => {}
        (Failure::Mute { .. }, Some(error)) => tell(format!("{failure} ({error})")),
        _ => tell(failure),
    }
}

/// In one piece, that the launcher's own words do not come between. A closed stream leaves nobody to tell.
fn tell(message: impl Display) {
    let _ = io::stderr().write_all(format!("fetiplast: {message}\n").as_bytes());
}

/// Whether this process answers for all: the launcher's first rank, and without a launcher there is only one.
fn speaks() -> bool {
    // This process' number by the environment of Open MPI, MPICH and SLURM, before MPI is up.
    let names = ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"];
    names.iter().find_map(|name| std::env::var(name).ok()).is_none_or(|rank| rank == "0")
}
