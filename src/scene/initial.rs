//! What a run starts from, if not from rest: the state that an earlier run of the same meshes left.

use serde::{Deserialize, Serialize};

/// Plastic strain and hardening from a result file, as they were when that run ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// The result file; relative paths are from the scene file.
    pub result: String,
    /// Bodies that take their state from there, while the others start from rest; all of them if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bodies: Option<Vec<String>>,
}
