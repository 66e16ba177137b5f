//! Where a solution stands as arrays of a checkpoint, and back.
//!
//! Arrays go by mesh numbering: displacements by node, with a row for each subdomain's copy, multipliers by row of B,
//! history by integration point of the elements, subdomain after subdomain in their order. So the ranks do not matter. Copies
//! of a node agree to round-off only and are kept apart, that the solution goes on to the same bits.

use std::collections::HashMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::meshes::fingerprints;
use super::{Discrete, Standing};
use crate::comm::{Comm, Shares};
use crate::constraint::Row;
use crate::feti::Torn;
use crate::feti::cholesky::Precision;
use crate::feti::space::RowSpace;
use crate::material::History;
use crate::newton::basis::{Bases, Basis};
use crate::newton::committed::{Committed, Sizes};
use crate::newton::forcing::Forcing;
use crate::newton::loading::{Attempt, Halt};
use crate::newton::program::ProgramState;
use crate::newton::{self, Residuals, SolverState, StepRecord};
use crate::results::agree::agree;
use crate::results::checkpoint::Checkpoint;
use crate::results::piece::{Field, Piece, Values};
use crate::results::summary::StepRow;

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
    secant: f64,
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

/// Texts and arrays of a checkpoint. Collective.
pub fn pack(comm: &dyn Comm, discrete: &Discrete, standing: Standing) -> (Vec<(&'static str, String)>, Vec<Field>) {
    let Discrete { decomposition, constraints, .. } = discrete;
    let space = RowSpace::new(comm, &decomposition.shares, constraints);
    let Standing { halt, rows, recorded } = standing;
    let Halt { attempt, committed, last, steps, standing } = halt;
    let newton::Standing { u, lambda, forcing, solver, steps: own_steps } = standing;
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
        secant: solver.secant,
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
    let nodes = subdomains.iter().flat_map(|s| &s.nodes).map(|&node| node as i64).collect();
    let histories: Vec<&History> = owns.clone().flat_map(history).collect();
    let mut arrays = vec![
        Field::integer("subdomains/points", count(&|own| subdomains[own].nodes.len())),
        Field::integer("subdomains/cells", count(&|own| subdomains[own].elements.len())),
        Field::integer("subdomains/rows", count(&|own| space.owned()[own].len())),
        Field::integer("subdomains/histories", count(&|own| history(own).len())),
        Field::integer("subdomains/factor", factor.iter().map(code).collect()),
        Field::integer("subdomains/interior", interior.iter().map(code).collect()),
        Field::scalar("subdomains/drift", drift),
        Field::integer("points/node", nodes),
        vector("points/displacement", u.concat()),
        vector("points/last", last_u.concat()),
        vector("points/factor", displacements(&factor, zero())),
        vector("points/interior", displacements(&interior, zero())),
        Field::integer("rows/node", owned.iter().map(|&row| lowest_node(&constraints.rows[row]) as i64).collect()),
        Field::integer("rows/kept", owned.iter().map(|&row| i64::from(kept[row])).collect()),
        Field::scalar("rows/multiplier", owned.iter().map(|&row| lambda[row]).collect()),
        Field::scalar("rows/last", owned.iter().map(|&row| last_lambda[row]).collect()),
        Field {
            name: "histories/plastic_strain".into(),
            components: 6,
            states: vec![Values::Real(histories.iter().flat_map(|history| history.plastic_strain).collect())],
        },
        Field::scalar("histories/kappa", histories.iter().map(|history| history.kappa).collect()),
    ];
    for (group, fields) in [("point_fields", recorded.point_data), ("cell_fields", recorded.cell_data)] {
        arrays.extend(fields.into_iter().map(|field| Field { name: format!("{group}/{}", field.name), ..field }));
    }
    (texts, arrays)
}

fn vector(name: &str, values: Vec<f64>) -> Field {
    Field { name: name.into(), components: 3, states: vec![Values::Real(values)] }
}

fn code(basis: &Option<Basis>) -> i64 {
    match basis {
        None => 0,
        Some(Basis::Elastic) => 1,
        Some(Basis::At(_)) => 2,
    }
}

/// Zeros where the basis is none.
fn displacements(bases: &[Option<Basis>], mut zero: Torn) -> Vec<f64> {
    for (basis, zero) in bases.iter().zip(&mut zero) {
        if let Some(Basis::At(u)) = basis {
            zero.clone_from(u);
        }
    }
    zero.concat()
}

fn basis(code: i64, u: Vec<f64>) -> Option<Basis> {
    match code {
        0 => None,
        1 => Some(Basis::Elastic),
        _ => Some(Basis::At(Arc::new(u))),
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
    /// Its subdomains are others.
    #[error("the subdomains are others than when the checkpoint was written, though scene and meshes are the same")]
    Subdomains,
    /// It cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

impl From<String> for Unfit {
    fn from(reason: String) -> Self {
        Self::Unreadable(reason)
    }
}

/// What [`pack`] made of a standing of the same discrete problem, on any number of ranks. Collective.
///
/// # Errors
/// If it is of another problem, or cannot be read.
pub fn unpack(comm: &dyn Comm, discrete: &Discrete, file: &Checkpoint) -> Result<Standing, Unfit> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains);
    let json = |error: serde_json::Error| Unfit::Unreadable(format!("its numbers are not understood: {error}"));
    let numbers: Numbers = serde_json::from_str(&file.text(NUMBERS)?).map_err(json)?;
    let layout: Layout = serde_json::from_str(&file.text(RECORDED)?).map_err(json)?;
    if numbers.meshes != fingerprints(comm, discrete) {
        return Err(Unfit::Mesh);
    }
    let space = RowSpace::new(comm, shares, constraints);
    let first = shares.begin(comm.rank());
    let part = |name: &str, own: &dyn Fn(usize) -> Option<usize>| -> Result<Part, Unfit> {
        let counts = file.whole::<i64>(&format!("subdomains/{name}"))?;
        let fits = counts.len() == shares.total()
            && (0..subdomains.len()).all(|k| own(k).is_none_or(|n| counts[first + k] == n as i64));
        agree(comm, "subdomains", if fits { Ok(()) } else { Err("others") }).map_err(|_| Unfit::Subdomains)?;
        let counts: Vec<usize> = counts.iter().map(|&count| count as usize).collect();
        let begin = counts[..first].iter().sum();
        Ok(Part { begin, counts: counts[first..][..subdomains.len()].to_vec(), total: counts.iter().sum() })
    };
    let points = part("points", &|own| Some(subdomains[own].nodes.len()))?;
    let cells = part("cells", &|own| Some(subdomains[own].elements.len()))?;
    let rows = part("rows", &|own| Some(space.owned()[own].len()))?;
    let histories = part("histories", &|_| None)?;
    let alone = Part { begin: first, counts: vec![1; subdomains.len()], total: shares.total() };

    let nodes = subdomains.iter().flat_map(|s| &s.nodes).map(|&node| node as i64);
    let owned = space.owned().iter().flatten();
    let of_rows = owned.map(|&row| lowest_node(&constraints.rows[row as usize]) as i64);
    let same = points.read::<i64>(file, "points/node", 0)?.into_iter().eq(nodes)
        & rows.read::<i64>(file, "rows/node", 0)?.into_iter().eq(of_rows);
    agree(comm, "subdomains", if same { Ok(()) } else { Err("others") }).map_err(|_| Unfit::Subdomains)?;
    let torn = |name: &str| -> Result<Torn, Unfit> { Ok(points.split(points.read(file, name, 0)?, 3)) };
    let bases = |name: &str| -> Result<Vec<Option<Basis>>, Unfit> {
        let codes = alone.read::<i64>(file, &format!("subdomains/{name}"), 0)?;
        Ok(codes.into_iter().zip(torn(&format!("points/{name}"))?).map(|(code, u)| basis(code, u)).collect())
    };
    let drift = alone.read::<f64>(file, "subdomains/drift", 0)?;
    let (factor, interior) = (bases("factor")?, bases("interior")?);
    let bases = factor.into_iter().zip(interior).zip(drift);
    let bases = bases.map(|((factor, interior), drift)| Bases { factor, interior, drift }).collect();

    let multiplier = rows.read::<f64>(file, "rows/multiplier", 0)?;
    let last = rows.read::<f64>(file, "rows/last", 0)?;
    let kept = rows.read::<i64>(file, "rows/kept", 0)?;
    let mut of_rows = vec![[0; 3]; constraints.rows.len()];
    let owned = space.owned().iter().flatten();
    for (row, ((multiplier, last), kept)) in owned.zip(multiplier.into_iter().zip(last).zip(kept)) {
        of_rows[*row as usize] = [multiplier.to_bits(), last.to_bits(), kept as u64];
    }
    complete(comm, shares, discrete, &mut of_rows);
    let column = |k: usize| of_rows.iter().map(move |row| f64::from_bits(row[k])).collect::<Vec<f64>>();
    let kept = numbers.has_kept.then(|| of_rows.iter().map(|row| row[2] == 1).collect());

    let strains = histories.read::<f64>(file, "histories/plastic_strain", 0)?;
    let kappas = histories.read::<f64>(file, "histories/kappa", 0)?;
    let strains = strains.as_chunks::<6>().0.iter();
    let all = strains.zip(kappas).map(|(&plastic_strain, kappa)| History { plastic_strain, kappa }).collect();
    let committed = Committed { histories: histories.split(all, 1), sizes: numbers.sizes };

    let fields = |group: &str, layout: &[(String, usize, bool)], part: &Part| {
        let field = |(name, components, is_real): &(String, usize, bool)| {
            let path = format!("{group}/{name}");
            let state = |state| -> Result<Values, Unfit> {
                Ok(if *is_real {
                    Values::Real(part.read(file, &path, state)?)
                } else {
                    Values::Integer(part.read(file, &path, state)?)
                })
            };
            let states = (0..numbers.times.len()).map(state).collect::<Result<_, _>>()?;
            Ok(Field { name: name.clone(), components: *components, states })
        };
        layout.iter().map(field).collect::<Result<Vec<Field>, Unfit>>()
    };
    let point_data = fields("point_fields", &layout[0], &points)?;
    let cell_data = fields("cell_fields", &layout[1], &cells)?;
    let last = match numbers.last {
        None => None,
        Some(reached) => Some(newton::Solution {
            u: torn("points/last")?,
            lambda: column(1),
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
        }),
    };
    let programs = ProgramState { kept, reference: numbers.reference, first: numbers.first, norm: numbers.norm };
    let precision = if numbers.is_double { Precision::Double } else { Precision::Single };
    let standing = newton::Standing {
        u: torn("points/displacement")?,
        lambda: column(0),
        forcing: numbers.forcing,
        solver: SolverState { programs, secant: numbers.secant, precision, bases },
        steps: numbers.own_steps,
    };
    let halt = Halt { attempt: numbers.attempt, committed, last, steps: numbers.steps, standing };
    let recorded = Piece { times: numbers.times, point_data, cell_data, ..Piece::default() };
    Ok(Standing { halt, rows: numbers.rows, recorded })
}

/// The rows of an array that belong to own subdomains.
struct Part {
    begin: usize,
    counts: Vec<usize>,
    /// Of all subdomains.
    total: usize,
}

impl Part {
    /// Of one of several states.
    fn read<T: crate::results::hdf5::Number>(
        &self,
        file: &Checkpoint,
        name: &str,
        state: usize,
    ) -> Result<Vec<T>, String> {
        let begin = (state * self.total + self.begin) as u64;
        file.rows(name, begin, self.counts.iter().sum::<usize>() as u64)
    }

    /// Numbers of each own subdomain, `width` a row.
    fn split<T>(&self, all: Vec<T>, width: usize) -> Vec<Vec<T>> {
        let mut all = all.into_iter();
        self.counts.iter().map(|count| all.by_ref().take(count * width).collect()).collect()
    }
}

/// Fills in what ranks know of rows that they hold but do not own, from those that do. Collective.
fn complete(comm: &dyn Comm, shares: &Shares, discrete: &Discrete, rows: &mut [[u64; 3]]) {
    let constraints = &discrete.constraints;
    let blocks = constraints.blocks.iter().zip(&constraints.block_subdomains);
    let (mut own, mut foreign) = (HashMap::new(), vec![Vec::new(); comm.size()]);
    for (block, subdomains) in blocks {
        let node = block.clone().map(|row| lowest_node(&constraints.rows[row])).min().unwrap_or_default();
        match shares.owner(subdomains[0] as usize) {
            owner if owner == comm.rank() => {
                own.insert(node, block.clone());
            }
            owner => foreign[owner].push((node, block.clone())),
        }
    }
    let wishes = foreign.iter().map(|blocks| blocks.iter().map(|(node, _)| *node).collect()).collect();
    let answer = |wish: Vec<u64>| wish.iter().flat_map(|node| rows[own[node].clone()].concat()).collect();
    let answers: Vec<Vec<u64>> = comm.all_to_all(wishes).into_iter().map(answer).collect();
    for (blocks, answers) in foreign.into_iter().zip(comm.all_to_all(answers)) {
        let of_blocks = blocks.into_iter().flat_map(|(_, block)| block);
        of_blocks.zip(answers.as_chunks::<3>().0).for_each(|(row, answer)| rows[row] = *answer);
    }
}
