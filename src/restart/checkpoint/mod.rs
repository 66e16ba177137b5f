//! Where a solution stands as arrays of a checkpoint, and back.
//!
//! Arrays go by mesh numbering: displacements by node, with a row for each subdomain's copy, multipliers by row of B,
//! history by integration point of the elements, subdomain after subdomain in their order. So the ranks do not matter.
//! Copies of a node agree to round-off only and are kept apart, that the solution goes on to the same bits (`same`). Rows
//! say which node, element or contact they are of: on other subdomains of the same meshes the solution goes on from there,
//! too (`recut`).

mod recut;
mod same;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use self::same::Miss;
use super::Standing;
use super::meshes::fingerprints;
use super::places::key;
use crate::assembly::flow::Flow;
use crate::comm::Comm;
use crate::constraint::{Kind, Row};
use crate::contact::ContactPair;
use crate::feti::Torn;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::basis::{Bases, Basis};
use crate::material::{History, Variable, history};
use crate::model::discrete::Discrete;
use crate::newton::committed::{Committed, Sizes};
use crate::newton::forcing::Forcing;
use crate::newton::loading::{Attempt, Halt};
use crate::newton::program::ProgramState;
use crate::newton::{self, Residuals, SolverState, StepRecord};
use crate::record::rows::StepRow;
use crate::results::checkpoint::Checkpoint;
use crate::results::piece::{Field, Piece, Values};
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
    last: Option<Reached>,
    /// Of the attempts before, with the number of the increment.
    steps: Vec<(usize, StepRecord)>,
    /// Of the attempt.
    own_steps: Vec<StepRecord>,
    forcing: Forcing,
    reference: Option<f64>,
    first: bool,
    norm: Option<f64>,
    has_kept: bool,
    is_double: bool,
    rows: Vec<StepRow>,
    times: Vec<f64>,
}

/// A solution but for its arrays and steps.
#[derive(Serialize, Deserialize)]
struct Reached {
    residuals: Residuals,
    energy: f64,
    internal_energy: f64,
    external_work: f64,
    plastic_elements: usize,
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
    /// Of the last solution.
    last_u: Torn,
    lambda: Vec<f64>,
    last_lambda: Vec<f64>,
    /// The rows that multipliers act on.
    kept: Vec<bool>,
    flows: Vec<Flow>,
    bases: Vec<Bases>,
    histories: Vec<Vec<History>>,
    point_data: Vec<Field>,
    cell_data: Vec<Field>,
}

/// Texts and arrays of a checkpoint. Collective.
pub fn pack(comm: &dyn Comm, discrete: &Discrete, standing: Standing) -> (Vec<(&'static str, String)>, Vec<Field>) {
    let Discrete { decomposition, constraints, .. } = discrete;
    let space = RowSpace::new(comm, &decomposition.shares, constraints);
    let Standing { halt, rows, recorded } = standing;
    let Halt { attempt, committed, last, steps, standing } = halt;
    let newton::Standing { u, lambda, forcing, solver, steps: own_steps, held: _ } = standing;
    let ProgramState { kept, reference, first, norm } = solver.programs;
    let reached = |solution: &newton::Solution| Reached {
        residuals: solution.residuals,
        energy: solution.energy,
        internal_energy: solution.internal_energy,
        external_work: solution.external_work,
        plastic_elements: solution.plastic_elements,
    };
    let numbers = Numbers {
        meshes: fingerprints(comm, discrete),
        attempt,
        sizes: committed.sizes,
        last: last.as_ref().map(reached),
        steps,
        own_steps,
        forcing,
        reference,
        first,
        norm,
        has_kept: kept.is_some(),
        is_double: solver.precision == Precision::Double,
        rows,
        times: recorded.times,
    };
    let layout = |fields: &[Field]| -> Vec<_> {
        let is_real = |field: &Field| field.states.iter().all(|state| state.real().is_some());
        fields.iter().map(|field| (field.name.clone(), field.components, is_real(field))).collect()
    };
    let layout: Layout = [layout(&recorded.point_data), layout(&recorded.cell_data)];
    let text = |json: serde_json::Result<String>| json.expect("numbers and names can be written as JSON");
    let texts =
        vec![(NUMBERS, text(serde_json::to_string(&numbers))), (RECORDED, text(serde_json::to_string(&layout)))];

    let subdomains = &decomposition.subdomains;
    let history = |own: usize| committed.history(own);
    let owns = 0..subdomains.len();
    let count = |of: &dyn Fn(usize) -> usize| owns.clone().map(|own| of(own) as i64).collect::<Vec<_>>();
    let of_bases = |of: &dyn Fn(&Bases) -> Option<Basis>| solver.bases.iter().map(of).collect::<Vec<_>>();
    let (factor, interior) = (of_bases(&|b| b.factor.clone()), of_bases(&|b| b.interior.clone()));
    let drift = solver.bases.iter().map(|bases| bases.drift).collect();
    let zero = || subdomains.iter().map(|s| vec![0.0; s.dofs()]).collect::<Torn>();
    let last_u = last.as_ref().map_or_else(zero, |last| last.u.clone());
    let last_lambda = last.map_or_else(|| vec![0.0; lambda.len()], |last| last.lambda);
    let kept = kept.unwrap_or_else(|| vec![false; lambda.len()]);
    let owned: Vec<usize> = space.owned().iter().flatten().map(|&row| row as usize).collect();
    let contacts: Vec<(usize, [i64; 3])> =
        owned.iter().filter_map(|&row| Some((row, contact(discrete, row)?))).collect();
    let force = |row: usize| constraints.rows[row].scale * last_lambda[row];
    let nodes = subdomains.iter().flat_map(|s| &s.nodes).map(|&node| node as i64).collect();
    let elements = subdomains.iter().flat_map(|s| s.elements.iter().flat_map(|element| key(element, &s.nodes)));
    let first = decomposition.shares.begin(comm.rank());
    let clusters = owns.clone().map(|own| decomposition.clusters.of(first + own) as i64);
    let histories: Vec<&History> = owns.clone().flat_map(history).collect();
    let mut arrays = vec![
        Field::integer("subdomains/points", count(&|own| subdomains[own].nodes.len())),
        Field::integer("subdomains/cells", count(&|own| subdomains[own].elements.len())),
        Field::integer("subdomains/rows", count(&|own| space.owned()[own].len())),
        Field::integer("subdomains/histories", count(&|own| history(own).len())),
        Field::integer("subdomains/cluster", clusters.collect()),
        Field::integer("subdomains/factor", factor.iter().map(code).collect()),
        Field::integer("subdomains/interior", interior.iter().map(code).collect()),
        Field::scalar("subdomains/drift", drift),
        Field::integer("points/node", nodes),
        vector("points/displacement", u.concat()),
        vector("points/last", last_u.concat()),
        vector("points/factor", displacements(&factor, zero())),
        vector("points/interior", displacements(&interior, zero())),
        Field::of("cells/nodes", 4, Values::Integer(elements.collect())),
        Field::of("contacts/condition", 3, Values::Integer(contacts.iter().flat_map(|(_, key)| *key).collect())),
        Field::integer("contacts/kept", contacts.iter().map(|(row, _)| i64::from(kept[*row])).collect()),
        Field::scalar("contacts/last_force", contacts.iter().map(|(row, _)| force(*row)).collect()),
        Field::integer("rows/node", owned.iter().map(|&row| lowest_node(&constraints.rows[row]) as i64).collect()),
        Field::integer("rows/kept", owned.iter().map(|&row| i64::from(kept[row])).collect()),
        Field::scalar("rows/multiplier", owned.iter().map(|&row| lambda[row]).collect()),
        Field::scalar("rows/last", owned.iter().map(|&row| last_lambda[row]).collect()),
    ];
    let variables = history::arrays(histories.into_iter());
    let of_histories =
        |of: Variable, values| Field::of(&format!("histories/{}", of.name), of.components, Values::Real(values));
    arrays.extend(variables.map(|(of, values)| of_histories(of, values)));
    let of_basis = |basis: &Option<Basis>| match basis {
        Some(Basis::At(_, flow)) => Flow::clone(flow),
        _ => Flow::default(),
    };
    let flows = |bases: &[Option<Basis>]| bases.iter().map(of_basis).collect();
    for (name, flows) in [("flow", solver.flows), ("factor_flow", flows(&factor)), ("interior_flow", flows(&interior))]
    {
        let counts = flows.iter().map(|flow| flow.len() as i64).collect();
        arrays.push(Field::integer(&format!("subdomains/{name}"), counts));
        let directions = Values::Real(flows.iter().flat_map(|flow| flow.iter().flatten().copied()).collect());
        arrays.push(Field::of(&format!("{name}/direction"), 6, directions));
    }
    for (group, fields) in [("point_fields", recorded.point_data), ("cell_fields", recorded.cell_data)] {
        arrays.extend(fields.into_iter().map(|field| Field { name: format!("{group}/{}", field.name), ..field }));
    }
    (texts, arrays)
}

fn vector(name: &str, values: Vec<f64>) -> Field {
    Field::of(name, 3, Values::Real(values))
}

/// What tells a row of a contact from others, however bodies are cut: the number of the contact, the slave node, and the smooth
/// part of the surface around it.
fn contact(Discrete { constraints, pairs, .. }: &Discrete, row: usize) -> Option<[i64; 3]> {
    let Kind::Contact { pair } = constraints.rows[row].kind else { return None };
    let ContactPair { contact, slave, part, .. } = pairs[pair];
    Some([contact as i64, slave as i64, i64::from(part)])
}

fn code(basis: &Option<Basis>) -> i64 {
    match basis {
        None => 0,
        Some(Basis::Elastic) => 1,
        Some(Basis::At(..)) => 2,
    }
}

/// Zeros where the basis is none.
fn displacements(bases: &[Option<Basis>], mut zero: Torn) -> Vec<f64> {
    for (basis, zero) in bases.iter().zip(&mut zero) {
        if let Some(Basis::At(u, _)) = basis {
            zero.clone_from(u);
        }
    }
    zero.concat()
}

fn basis(code: i64, u: Vec<f64>, flow: Flow) -> Option<Basis> {
    match code {
        0 => None,
        1 => Some(Basis::Elastic),
        _ => Some(Basis::At(Arc::new(u), flow)),
    }
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

    let last = numbers.last.map(|reached| newton::Solution {
        u: arrays.last_u,
        lambda: arrays.last_lambda,
        outcome: newton::Outcome::Converged,
        steps: Vec::new(),
        residuals: reached.residuals,
        // Told in the rows.
        errors: None,
        ended_by_accuracy: false,
        energy: reached.energy,
        internal_energy: reached.internal_energy,
        external_work: reached.external_work,
        plastic_elements: reached.plastic_elements,
    });
    let kept = numbers.has_kept.then_some(arrays.kept);
    let (kept, held) = if is_recut { (None, kept) } else { (kept, None) };
    // The operator of other subdomains has another norm.
    let norm = numbers.norm.filter(|_| !is_recut);
    let programs = ProgramState { kept, reference: numbers.reference, first: numbers.first, norm };
    let precision = if numbers.is_double { Precision::Double } else { Precision::Single };
    let standing = newton::Standing {
        u: arrays.u,
        lambda: arrays.lambda,
        held,
        forcing: numbers.forcing,
        solver: SolverState { programs, flows: arrays.flows, precision, bases: arrays.bases },
        steps: numbers.own_steps,
    };
    let committed = Committed { histories: arrays.histories, sizes: numbers.sizes };
    let halt = Halt { attempt: numbers.attempt, committed, last, steps: numbers.steps, standing };
    let Arrays { point_data, cell_data, .. } = arrays;
    let recorded = Piece { times: numbers.times, point_data, cell_data, ..Piece::default() };
    Ok((Standing { halt, rows: numbers.rows, recorded }, is_recut))
}
