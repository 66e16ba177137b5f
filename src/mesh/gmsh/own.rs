//! What results of this program say of their meshes beside what VTKHDF has: names of volumes and surfaces.
//!
//! The group `mesh` has two arrays. `names` are the bytes of a JSON text: volumes by the numbers of body and material in `CellData`, and
//! surfaces. A row of `facets` is the number of a surface and the nodes of a face, by the numbers in `PointData/node`, with -1 behind them.
//! Only surfaces that the scene of the run named are there.

use hdf5_metno::File;
use serde::{Deserialize, Serialize};

use super::GroupName;
use crate::comm::Comm;
use crate::comm::words::share;

/// Nodes of a face at most.
pub const WIDTH: usize = 6;

/// Names of volumes and surfaces.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// Numbers of the body and of the material, and the name.
    pub volumes: Vec<(i64, i64, String)>,
    /// Names of surfaces; those of several bodies may have one name.
    pub surfaces: Vec<String>,
}

impl Names {
    /// The names as groups of Gmsh.
    pub(super) fn groups(&self) -> Vec<GroupName> {
        let volumes = self.volumes.iter().map(|(.., name)| (3, name)).zip(1..);
        let surfaces = self.surfaces.iter().map(|name| (2, name)).zip(1..);
        let group = |((dimension, name), tag): ((i32, &String), i32)| GroupName { dimension, tag, name: name.clone() };
        volumes.chain(surfaces).map(group).collect()
    }

    /// The group of a cell of this body and material.
    pub(super) fn volume(&self, of: (i64, i64)) -> Option<i32> {
        self.volumes.iter().zip(1..).find(|((body, material, _), _)| (*body, *material) == of).map(|(_, tag)| tag)
    }
}

/// Names, and this rank's share of the faces: the number of a surface and the nodes.
pub(super) type Named = (Names, Vec<(i64, Vec<u64>)>);

/// What a file has; none if it is no result of this program.
///
/// # Errors
/// If it is a damaged one.
pub(super) fn read(comm: &dyn Comm, file: &File) -> Result<Option<Named>, String> {
    if !file.link_exists("mesh") {
        return Ok(None);
    }
    let text = |error: hdf5_metno::Error| error.to_string();
    let bytes = file.dataset("mesh/names").and_then(|names| names.read_1d::<i64>()).map_err(text)?;
    let bytes: Vec<u8> = bytes.iter().map(|byte| *byte as u8).collect();
    let names: Names = serde_json::from_slice(&bytes).map_err(|error| format!("its names of surfaces: {error}"))?;
    let facets = file.dataset("mesh/facets").map_err(text)?;
    let rows = facets.shape().first().map_or(0, |&rows| rows as u64);
    let own = share(rows, comm);
    let mut found = Vec::new();
    if own.start < own.end {
        let rows = facets.read_slice_2d::<i64, _>((own.start as usize..own.end as usize, 0..=WIDTH)).map_err(text)?;
        for row in rows.rows() {
            let nodes: Vec<u64> = row.iter().skip(1).take_while(|node| **node >= 0).map(|node| *node as u64).collect();
            if row[0] < 0 || row[0] as usize >= names.surfaces.len() || !matches!(nodes.len(), 3 | 4 | 6) {
                return Err("a face of its surfaces is of none, or no face".to_owned());
            }
            found.push((row[0], nodes));
        }
    }
    Ok(Some((names, found)))
}
