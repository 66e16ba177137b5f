//! Files that are complete or not there: written under a temporary name in the same directory, then renamed.
//!
//! Whether the disk has room is asked before anything is written, where the file system can tell: a collective write to a
//! full disk is not sure to end (see [`super::hdf5`]).
//! A run that ends half-way leaves the earlier file of that name untouched. Two runs that write the same file at the
//! same time are not kept apart.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;

use super::OutputError;
use super::agree::on_root;
use crate::comm::Comm;

/// Lets `fill` write the file under the temporary name it is given; then rank 0 renames it to `path`. Rank 0 creates
/// missing directories and the file first, with room for `bytes`, so that ranks enter `fill` only if it can be written.
/// Collective; `fill` must have the same outcome on every rank, rank 0's `bytes` count.
///
/// # Errors
/// [`OutputError::Write`] on every rank if any step fails; the temporary file is removed then.
pub fn replace(
    comm: &dyn Comm,
    path: &Path,
    bytes: u64,
    fill: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<(), OutputError> {
    let temporary = temporary_name(path);
    let outcome = on_root(comm, "creating the file", || create(&temporary, bytes))
        .and_then(|()| fill(&temporary))
        .and_then(|()| on_root(comm, "completing the file", || complete(&temporary, path)));
    outcome.map_err(|reason| {
        if comm.rank() == 0 {
            // Nothing to remove if it could not even be created.
            let _ = fs::remove_file(&temporary);
        }
        OutputError::Write { path: path.to_owned(), reason }
    })
}

/// Whether the file could be written later: its directory exists or can be made, and takes a file. Collective.
///
/// # Errors
/// [`OutputError::Write`] on every rank if not.
pub fn probe(comm: &dyn Comm, path: &Path) -> Result<(), OutputError> {
    let temporary = temporary_name(path);
    let attempt = || create(&temporary, 0).and_then(|()| fs::remove_file(&temporary));
    on_root(comm, "trying the directory", attempt)
        .map_err(|reason| OutputError::Write { path: path.to_owned(), reason })
}

fn temporary_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

fn create(temporary: &Path, bytes: u64) -> io::Result<()> {
    if let Some(directory) = temporary.parent() {
        fs::create_dir_all(directory)?;
    }
    let file = File::create(temporary)?;
    let full = [Errno::NOSPC, Errno::DQUOT, Errno::FBIG];
    match fallocate(&file, FallocateFlags::empty(), 0, bytes) {
        Err(error) if full.contains(&error) => {
            Err(io::Error::other(format!("no room for {} MB: {error}", bytes.div_ceil(1_000_000))))
        }
        // Not every file system can reserve space; whoever fills the file finds out.
        _ => file.set_len(0),
    }
}

/// Rename only what has reached the disk: after a power cut there is the old file or the new one.
fn complete(temporary: &Path, path: &Path) -> io::Result<()> {
    File::open(temporary)?.sync_all()?;
    fs::rename(temporary, path)
}
