//! Where a solution stands as arrays of a checkpoint, and back.
//!
//! Arrays go by mesh numbering: displacements by node, with a row for each subdomain's copy, multipliers by row of B,
//! history by integration point of the elements, subdomain after subdomain in their order. So the ranks do not matter.
//! Copies of a node agree to round-off only and are kept apart, that the solution goes on to the same bits (`same`). Rows
//! say which node, element or contact they are of: on other subdomains of the same meshes the solution goes on from there,
//! too (`recut`).

mod arrays;
mod recut;
mod same;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use self::arrays::Packer;
use self::same::Miss;
use super::Standing;
use super::meshes::fingerprints;
use crate::assembly::flow::Flow;
use crate::comm::Comm;
use crate::constraint::{Kind, Row};
use crate::contact::ContactPair;
use crate::feti::Torn;
use crate::feti::inverse::basis::Bases;
use crate::material::History;
use crate::model::discrete::Discrete;
use crate::newton::committed::{Committed, Sizes};
use crate::newton::control::Reach;
use crate::newton::energies::Energies;
use crate::newton::forcing::Forcing;
use crate::newton::path::Attempt;
use crate::newton::program::ProgramState;
use crate::newton::snapshot::Reached;
use crate::newton::{Snapshot, SolverState, StepRecord};
use crate::record::rows::StepRow;
use crate::results::checkpoint::Checkpoint;
use crate::results::piece::{Field, Piece, Values};
use crate::scene::Moved;
use crate::sparse::cholesky::Precision;

/// The text that holds the numbers of which there are few.
const NUMBERS: &str = "state/numbers";
/// The text that holds the fields' names.
const RECORDED: &str = "state/recorded";

/// What is not an array.
#[derive(Serialize, Deserialize)]
struct Numbers {
    /// Fingerprints of the bodies' meshes.
    meshes: Vec<u64>,
    attempt: Attempt,
    sizes: Sizes,
    energies: Energies,
    has_reached: bool,
    /// Of all attempts, with the number of the increment.
    steps: Vec<(usize, StepRecord)>,
    /// Of attempts before the present one.
    before: usize,
    forcing: Forcing,
    reference: Option<f64>,
    first: bool,
    norm: Option<f64>,
    has_kept: bool,
    is_double: bool,
    reach: Option<Reach>,
    rows: Vec<StepRow>,
    times: Vec<f64>,
    moved: Moved,
}

/// Name, numbers a row and whether they are real, of the fields of points and of cells.
type Layout = [Vec<(String, usize, bool)>; 2];

/// Recorded fields, of points or of cells.
struct Recorded {
    group: &'static str,
    layout: Vec<(String, usize, bool)>,
    /// How many times were recorded.
    states: u64,
}

impl Recorded {
    /// The fields, from arrays of real numbers and of integers that are given by name, numbers a row, and state.
    fn read(
        &self,
        real: impl Fn((&str, usize, u64)) -> Result<Vec<f64>, String>,
        integer: impl Fn((&str, usize, u64)) -> Result<Vec<i64>, String>,
    ) -> Result<Vec<Field>, String> {
        let field = |(name, components, is_real): &(String, usize, bool)| {
            let path = format!("{}/{name}", self.group);
            let state = |state| {
                let at = (&path[..], *components, state);
                if *is_real { real(at).map(Values::Real) } else { integer(at).map(Values::Integer) }
            };
            let states = (0..self.states).map(state).collect::<Result<_, String>>()?;
            Ok(Field { name: name.clone(), components: *components, states })
        };
        self.layout.iter().map(field).collect()
    }
}

/// What a checkpoint has in arrays, on own subdomains.
struct Arrays {
    u: Torn,
    /// Of the last increment that was reached, or of where the history goes on from.
    reached_u: Torn,
    lambda: Vec<f64>,
    reached_lambda: Vec<f64>,
    /// The rows that multipliers act on.
    kept: Vec<bool>,
    /// What surfaces have slid in friction rows; empty without friction.
    slips: Vec<f64>,
    flows: Vec<Flow>,
    bases: Vec<Bases>,
    histories: Vec<Vec<History>>,
    point_data: Vec<Field>,
    cell_data: Vec<Field>,
}

/// Texts and arrays of a checkpoint. Collective.
pub fn pack(comm: &dyn Comm, discrete: &Discrete, standing: Standing) -> (Vec<(&'static str, String)>, Vec<Field>) {
    let Standing { newton, rows, recorded, moved } = standing;
    let mut arrays = Packer::new(comm, discrete, &newton).arrays();
    let numbers = Numbers {
        meshes: fingerprints(comm, discrete),
        attempt: newton.attempt,
        sizes: newton.committed.sizes,
        energies: newton.committed.energies,
        has_reached: newton.reached.is_some(),
        steps: newton.steps,
        before: newton.before,
        forcing: newton.forcing,
        reference: newton.solver.programs.reference,
        first: newton.solver.programs.first,
        norm: newton.solver.programs.norm,
        has_kept: newton.solver.programs.kept.is_some(),
        is_double: newton.solver.precision == Precision::Double,
        reach: newton.reach,
        rows,
        times: recorded.times,
        moved,
    };
    let layout = |fields: &[Field]| -> Vec<_> {
        let is_real = |field: &Field| field.states.iter().all(|state| state.real().is_some());
        fields.iter().map(|field| (field.name.clone(), field.components, is_real(field))).collect()
    };
    let layout: Layout = [layout(&recorded.point_data), layout(&recorded.cell_data)];
    for (group, fields) in [("point_fields", recorded.point_data), ("cell_fields", recorded.cell_data)] {
        arrays.extend(fields.into_iter().map(|field| Field { name: format!("{group}/{}", field.name), ..field }));
    }
    let text = |json: serde_json::Result<String>| json.expect("numbers and names can be written as JSON");
    let texts =
        vec![(NUMBERS, text(serde_json::to_string(&numbers))), (RECORDED, text(serde_json::to_string(&layout)))];
    (texts, arrays)
}

/// What tells a row of a contact from others, however bodies are cut: the number of the contact, the slave node, and the smooth
/// part of the surface around it; then 0 for the normal, or the number of the direction of friction, from 1.
fn contact(Discrete { constraints, contacts, .. }: &Discrete, row: usize) -> Option<[i64; 4]> {
    let (pair, direction) = match constraints.rows[row].kind {
        Kind::Contact { pair } => (pair, 0),
        Kind::Friction { pair, axis } => (pair, 1 + i64::from(axis)),
        Kind::Gluing | Kind::Support { .. } => return None,
    };
    let ContactPair { contact, slave, part, .. } = contacts.pairs[pair];
    Some([contact as i64, slave as i64, i64::from(part), direction])
}

/// Lowest node of a row.
fn lowest_node(row: &Row) -> u64 {
    row.terms.iter().map(|term| term.node).min().unwrap_or_default()
}

/// Why a checkpoint that is whole is no start for a scene; the same on every rank.
#[derive(Debug, thiserror::Error)]
pub enum Unfit {
    /// Its meshes are others.
    #[error("the meshes have changed since the checkpoint was written: elements or coordinates of nodes differ")]
    Mesh,
    /// It cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

impl From<String> for Unfit {
    fn from(reason: String) -> Self {
        Self::Unreadable(reason)
    }
}

/// What [`pack`] made of a standing of the same discrete problem, on any number of ranks, and whether that was cut into
/// other subdomains. Collective.
///
/// # Errors
/// If it is of another problem, or cannot be read.
pub fn unpack(comm: &dyn Comm, discrete: &Discrete, file: &Checkpoint) -> Result<(Standing, bool), Unfit> {
    let json = |error: serde_json::Error| Unfit::Unreadable(format!("its numbers are not understood: {error}"));
    let numbers: Numbers = serde_json::from_str(&file.text(NUMBERS)?).map_err(json)?;
    let [of_points, of_cells]: Layout = serde_json::from_str(&file.text(RECORDED)?).map_err(json)?;
    if numbers.meshes != fingerprints(comm, discrete) {
        return Err(Unfit::Mesh);
    }
    let states = numbers.times.len() as u64;
    let recorded = [("point_fields", of_points), ("cell_fields", of_cells)];
    let recorded = recorded.map(|(group, layout)| Recorded { group, layout, states });
    let (arrays, is_recut) = match same::read(comm, discrete, file, &recorded) {
        Ok(arrays) => (arrays, false),
        Err(Miss::Others) => (recut::read(comm, discrete, file, &recorded)?, true),
        Err(Miss::Unreadable(reason)) => return Err(reason.into()),
    };

    let kept = numbers.has_kept.then_some(arrays.kept);
    let (of_programs, kept) = if is_recut { (None, kept) } else { (kept, None) };
    // The operator of other subdomains has another norm.
    let norm = numbers.norm.filter(|_| !is_recut);
    let programs = ProgramState { kept: of_programs, reference: numbers.reference, first: numbers.first, norm };
    let precision = if numbers.is_double { Precision::Double } else { Precision::Single };
    let (reached, origin) = match numbers.has_reached {
        true => (Some(Reached { u: arrays.reached_u, lambda: arrays.reached_lambda }), None),
        false => (None, Some(arrays.reached_u)),
    };
    let newton = Snapshot {
        attempt: numbers.attempt,
        committed: Committed {
            histories: arrays.histories,
            sizes: numbers.sizes,
            slips: arrays.slips,
            energies: numbers.energies,
        },
        reached,
        origin,
        steps: numbers.steps,
        before: numbers.before,
        u: arrays.u,
        lambda: arrays.lambda,
        kept,
        forcing: numbers.forcing,
        solver: SolverState { programs, flows: arrays.flows, precision, bases: arrays.bases },
        reach: numbers.reach,
    };
    let Arrays { point_data, cell_data, .. } = arrays;
    let recorded = Piece { times: numbers.times, point_data, cell_data, ..Piece::default() };
    Ok((Standing { newton, rows: numbers.rows, recorded, moved: numbers.moved }, is_recut))
}
