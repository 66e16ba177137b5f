//! `fetiplast`: see the crate's documentation and `fetiplast --help`.

use std::io::Write;
use std::process::exit;

use clap::Parser;
use fetiplast::cli::keeper::Signals;
use fetiplast::cli::{Cli, Command, Failure, run};
use fetiplast::comm::Comm;
use fetiplast::comm::world::{EXIT_BUG, World};
use fetiplast::heap::Heap;

#[global_allocator]
static HEAP: Heap = Heap;

/// Exit code of a wrong command line (sysexits).
const EXIT_USAGE: i32 = 64;

fn main() {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command.unwrap_or_else(Command::benchmark),
        Err(error) => {
            // Every rank fails alike; the launcher's first rank speaks, and without a launcher there is only one.
            if launcher_rank().is_none_or(|rank| rank == "0") {
                // A closed stream leaves nobody to tell.
                let _ = error.print();
            }
            exit(if error.use_stderr() { EXIT_USAGE } else { 0 });
        }
    };
    if let Some(answer) = command.answer() {
        let speaks = launcher_rank().is_none_or(|rank| rank == "0");
        exit(match answer {
            Ok(text) => {
                speaks.then(|| println!("{text}"));
                0
            }
            Err(message) => {
                speaks.then(|| eprintln!("fetiplast: {message}"));
                EXIT_USAGE
            }
        });
    }
    // Before MPI is up, so that a signal at any later moment finds the run prepared; a check may be ended at once.
    let signals = match command {
        Command::Solve(_) | Command::Resume(_) => Signals::catch().unwrap_or_else(|error| {
            eprintln!("fetiplast: signals cannot be caught: {error}");
            exit(EXIT_BUG)
        }),
        _ => Signals::default(),
    };
    let Some(world) = World::start() else {
        eprintln!("fetiplast: MPI cannot be started");
        exit(EXIT_BUG);
    };
    if world.rank() == 0 {
        let format = tracing_subscriber::fmt::format().without_time().with_target(false).with_level(false).compact();
        tracing_subscriber::fmt().event_format(format).init();
    }
    let outcome = run(command, &world, signals);
    if let Err(failure) = &outcome
        && world.rank() == 0
    {
        // In one piece, that the launcher's own words do not come between. A closed stream leaves nobody to tell.
        let _ = std::io::stderr().write_all(format!("fetiplast: {failure}\n").as_bytes());
    }
    match outcome {
        // After a failed collective write HDF5 may not let go of its file: end without taking leave.
        Err(failure @ Failure::Output(_)) => world.abort(failure.code()),
        Err(failure) => world.finish(failure.code()),
        Ok(code) => world.finish(code),
    }
}

/// This process' number by the launcher's environment (Open MPI, MPICH and SLURM), before MPI is up.
fn launcher_rank() -> Option<String> {
    ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"].iter().find_map(|name| std::env::var(name).ok())
}
