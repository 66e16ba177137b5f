//! Going on from what an earlier run left: a checkpoint of the same run, or the state at the end of a result file.
//!
//! [`checkpoint`] turns what a run stands on into arrays and back, on any number of ranks; [`state`] does so for the material's
//! history and the displacement alone. [`places`] finds integration points again by where they are, [`meshes`] tells whether
//! meshes are the same.

pub mod checkpoint;
pub mod meshes;
pub mod places;
pub mod state;

use crate::newton::Snapshot;
use crate::record::rows::StepRow;
use crate::results::piece::Piece;
use crate::scene::Moved;

/// Where the solution of a scene stands between two Newton steps: all that the rest of it depends on.
pub struct Standing {
    /// In the load history.
    pub newton: Snapshot,
    /// The increments reached so far.
    pub rows: Vec<StepRow>,
    /// Their fields; no mesh.
    pub recorded: Piece,
    /// Where supports and obstacles were at the beginning of the history; they move on from there.
    pub moved: Moved,
}
