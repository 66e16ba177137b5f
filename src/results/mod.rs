//! What a run leaves behind: the result file, the summary, and where both come from.
//!
//! [`vtkhdf`] writes the fields for ParaView, [`summary`] one JSON object for scripts, [`provenance`] the circumstances
//! of the run, [`checkpoint`] what it takes to go on with it. Every file is written under a temporary name and renamed when it is complete ([`replace`]);
//! [`target`] tells files from devices and pipes. A failure on one rank is the same [`OutputError`] on all.
//! It computes nothing: what is to be written comes in ready.

pub mod agree;
pub mod checkpoint;
pub mod contact;
pub mod fields;
pub mod hdf5;
pub mod piece;
pub mod provenance;
pub mod replace;
pub mod seal;
pub mod summary;
pub mod target;
pub mod vtkhdf;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::comm::Comm;

/// Why a file was not written; the same on every rank.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OutputError {
    /// The file system or HDF5 refused.
    #[error(
        "cannot write {}: {reason}\nAn earlier file of that name is untouched. Check that the directory is writable \
         and has space left, or choose another one",
        path.display()
    )]
    Write {
        /// The file as the user named it.
        path: PathBuf,
        /// What failed, on which rank, and what the system said.
        reason: String,
    },
    /// The arrays of a piece do not belong together, or the ranks disagree on the fields: a bug of the caller.
    #[error("the results to be written to {} do not fit together: {reason}; please report it", path.display())]
    Layout {
        /// The file as the user named it.
        path: PathBuf,
        /// What does not fit, on which rank.
        reason: String,
    },
}

/// Writes one JSON object; numbers that are not finite become null. Collective; rank 0's object counts.
///
/// # Errors
/// [`OutputError::Write`] if the file cannot be written; an earlier one is untouched then.
pub fn write_json(comm: &dyn Comm, path: &Path, object: &impl Serialize) -> Result<(), OutputError> {
    let text = serde_json::to_string_pretty(object).unwrap_or_default() + "\n";
    replace::text(comm, path, &text)
}
