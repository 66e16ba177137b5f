//! Files that are complete or not there: written under a temporary name in the same directory, then renamed.
//!
//! That is the directory of the file behind all symbolic links ([`super::target`]), and only regular files are renamed over.
//! Whether the disk has room is asked before anything is written, where the file system can tell: a collective write to a
//! full disk is not sure to end (see [`super::hdf5`]).
//! A run that ends half-way leaves the earlier file of that name untouched. Two runs that write the same file at the
//! same time are not kept apart.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{Access, FallocateFlags, access, fallocate};
use rustix::io::Errno;

use super::OutputError;
use super::target::{self, Target};
use crate::comm::Comm;
use crate::comm::agree::{agree, on_root};

/// What is written, and so where it may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Text: to files and streams.
    Text,
    /// HDF5: to regular files only.
    Hdf5,
}

/// Lets `fill` write the file under the temporary name it is given; then rank 0 renames it to `path`. Rank 0 creates
/// missing directories and the file first, with room for `bytes`, so that ranks enter `fill` only if it can be written.
/// Collective; `fill` must have the same outcome on every rank, rank 0's `bytes` count.
///
/// # Errors
/// [`OutputError::Write`] on every rank if any step fails or `path` is no regular file; the temporary file is removed then.
pub fn replace(
    comm: &dyn Comm,
    path: &Path,
    bytes: u64,
    fill: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<(), OutputError> {
    let write = |target: PathBuf| {
        let temporary = temporary_name(&target);
        on_root(comm, "creating the file", || create(&temporary, bytes))?;
        let outcome =
            fill(&temporary).and_then(|()| on_root(comm, "completing the file", || complete(&temporary, &target)));
        if outcome.is_err() && comm.rank() == 0 {
            // Somebody else may have removed it.
            let _ = fs::remove_file(&temporary);
        }
        outcome
    };
    let target = agree(comm, "finding the file", Target::of(path).and_then(Target::file));
    target.and_then(write).map_err(|reason| OutputError::Write { path: path.to_owned(), reason })
}

/// Rank 0 writes a text, into a file at once as [`replace`] does, or to a stream. Collective.
///
/// # Errors
/// [`OutputError::Write`] on every rank if it cannot.
pub fn text(comm: &dyn Comm, path: &Path, text: &str) -> Result<(), OutputError> {
    let write = || {
        let Target::File(target) = Target::of(path)? else {
            return target::open(path)?.write_all(text.as_bytes());
        };
        let temporary = temporary_name(&target);
        create(&temporary, text.len() as u64)?;
        fs::write(&temporary, text).and_then(|()| complete(&temporary, &target)).inspect_err(|_| {
            let _ = fs::remove_file(&temporary);
        })
    };
    on_root(comm, "writing", write).map_err(|reason| OutputError::Write { path: path.to_owned(), reason })
}

/// Whether the file could be written later: its directory exists or can be made, and takes a file. Streams are left alone, for
/// who reads a pipe would take that for its end. Collective.
///
/// # Errors
/// [`OutputError::Write`] on every rank if not.
pub fn probe(comm: &dyn Comm, path: &Path, form: Form) -> Result<(), OutputError> {
    let attempt = || match (Target::of(path)?, form) {
        (Target::Stream, Form::Text) => Ok(access(path, Access::WRITE_OK)?),
        (target, _) => {
            let temporary = temporary_name(&target.file()?);
            create(&temporary, 0).and_then(|()| fs::remove_file(&temporary))
        }
    };
    on_root(comm, "trying the file", attempt).map_err(|reason| OutputError::Write { path: path.to_owned(), reason })
}

fn temporary_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

fn create(temporary: &Path, bytes: u64) -> io::Result<()> {
    target::create_directory(temporary)?;
    // What a run that was killed left may be written over; a link, pipe or device of that name is not ours.
    if fs::symlink_metadata(temporary).is_ok_and(|about| !about.is_file()) {
        return Err(io::Error::other(format!("{} is in the way", temporary.display())));
    }
    let file = File::create(temporary)?;
    reserve(&file, bytes).inspect_err(|_| {
        let _ = fs::remove_file(temporary);
    })
}

fn reserve(file: &File, bytes: u64) -> io::Result<()> {
    let full = [Errno::NOSPC, Errno::DQUOT, Errno::FBIG];
    match fallocate(file, FallocateFlags::empty(), 0, bytes) {
        Err(error) if full.contains(&error) => {
            Err(io::Error::other(format!("no room for {} MB: {error}", bytes.div_ceil(1_000_000))))
        }
        // Not every file system can reserve space; whoever fills the file finds out.
        _ => file.set_len(0),
    }
}

/// Rename only what has reached the disk: after a power cut there is the old file or the new one.
fn complete(temporary: &Path, target: &Path) -> io::Result<()> {
    File::open(temporary)?.sync_all()?;
    fs::rename(temporary, target)
}
