//! What a run leaves behind: the result file, the summary, and where both come from.
//!
//! [`vtkhdf`] writes the fields for ParaView, `summary` one JSON object for scripts, [`provenance`] the circumstances
//! of the run, [`checkpoint`] what it takes to go on with it. Every file is written under a temporary name and renamed when it is complete ([`replace`]);
//! [`target`] tells files from devices and pipes. A failure on one rank is the same [`OutputError`] on all.
//! It computes nothing: what is to be written comes in ready.

pub mod checkpoint;
pub mod hdf5;
pub mod piece;
pub mod provenance;
pub mod replace;
pub mod seal;
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{OutputError, write_json};
    use crate::comm::threads;
    use crate::record::state::{Residuals, State};
    use crate::record::summary::Summary;
    use serde_json::Value;

    #[test]
    fn numbers_read_back_bitwise_and_absent_ones_are_null() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/summary.json");
        let summary = Summary {
            converged: Some(true),
            state: State {
                energy: Some(-1245323411.382042),
                max_displacement: Some(0.1 + 0.2),
                residuals: Residuals { equilibrium: Some(f64::NAN), gluing: Some(5e-324), ..Residuals::default() },
                reactions: BTreeMap::from([("left".into(), [1.0 / 3.0, -0.0, 1e300])]),
                ..State::default()
            },
            ..Summary::default()
        };
        threads::run(3, |comm| write_json(comm, &path, &summary).unwrap());
        let read: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(read["energy"].as_f64(), summary.state.energy);
        assert_eq!(read["max_displacement"].as_f64(), Some(0.1 + 0.2));
        assert_eq!(read["residual_gluing"].as_f64(), Some(5e-324));
        assert_eq!(read["reactions"]["left"][0].as_f64(), Some(1.0 / 3.0));
        for key in ["residual_equilibrium", "residual_gap", "smalse_iterations", "error", "contact_force"] {
            assert_eq!(read.get(key), Some(&Value::Null), "{key}");
        }
        assert_eq!(read["dual_dofs"], 0);
    }

    #[test]
    fn an_impossible_place_is_everybodys_error() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("file");
        std::fs::write(&file, "kept").unwrap();
        let outcomes = threads::run(3, |comm| write_json(comm, &file.join("summary.json"), &Summary::default()));
        assert!(matches!(&outcomes[0], Err(OutputError::Write { reason, .. }) if reason.contains("rank 0")));
        assert!(outcomes.iter().all(|o| *o == outcomes[0]));
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
    }
}
