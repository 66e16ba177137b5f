//! Arrays of a checkpoint on the same subdomains as there: each rank reads its own rows, and everything is as it was.

use std::collections::HashMap;

use super::{Arrays, Recorded, basis, lowest_node};
use crate::assembly::flow::Flow;
use crate::comm::agree::agree;
use crate::comm::{Comm, Shares};
use crate::feti::Torn;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::basis::{Bases, Basis};
use crate::material::history;
use crate::model::discrete::Discrete;
use crate::restart::places::key;
use crate::results::checkpoint::Checkpoint;
use crate::results::hdf5::Number;

/// Why this is no way to read a checkpoint; the same on every rank.
pub(super) enum Miss {
    /// Its subdomains or clusters are others.
    Others,
    /// It cannot be read.
    Unreadable(String),
}

impl From<String> for Miss {
    fn from(reason: String) -> Self {
        Self::Unreadable(reason)
    }
}

/// The arrays. Collective.
///
/// # Errors
/// If subdomains are others, or the file cannot be read.
pub(super) fn read(
    comm: &dyn Comm,
    discrete: &Discrete,
    file: &Checkpoint,
    recorded: &[Recorded; 2],
) -> Result<Arrays, Miss> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains);
    let space = RowSpace::new(comm, shares, constraints);
    let first = shares.begin(comm.rank());
    let demand =
        |same: bool| agree(comm, "subdomains", if same { Ok(()) } else { Err("others") }).map_err(|_| Miss::Others);
    let part = |name: &str, own: &dyn Fn(usize) -> Option<usize>| -> Result<Part, Miss> {
        let counts = file.whole::<i64>(&format!("subdomains/{name}"))?;
        let fits = counts.len() == shares.total()
            && (0..subdomains.len()).all(|k| own(k).is_none_or(|n| counts[first + k] == n as i64));
        demand(fits)?;
        let counts: Vec<usize> = counts.iter().map(|&count| count as usize).collect();
        let begin = counts[..first].iter().sum();
        Ok(Part { begin, counts: counts[first..][..subdomains.len()].to_vec(), total: counts.iter().sum() })
    };
    let points = part("points", &|own| Some(subdomains[own].nodes.len()))?;
    let cells = part("cells", &|own| Some(subdomains[own].elements.len()))?;
    let rows = part("rows", &|own| Some(space.owned()[own].len()))?;
    let histories = part("histories", &|_| None)?;
    let alone = Part { begin: first, counts: vec![1; subdomains.len()], total: shares.total() };

    let clusters = (first..first + subdomains.len()).map(|id| decomposition.clusters.of(id) as i64);
    let nodes = subdomains.iter().flat_map(|s| &s.nodes).map(|&node| node as i64);
    let elements = subdomains.iter().flat_map(|s| s.elements.iter().flat_map(|element| key(element, &s.nodes)));
    let owned = space.owned().iter().flatten();
    let of_rows = owned.map(|&row| lowest_node(&constraints.rows[row as usize]) as i64);
    let same = alone.read::<i64>(file, "subdomains/cluster", 0)?.into_iter().eq(clusters)
        & points.read::<i64>(file, "points/node", 0)?.into_iter().eq(nodes)
        & cells.read::<i64>(file, "cells/nodes", 0)?.into_iter().eq(elements)
        & rows.read::<i64>(file, "rows/node", 0)?.into_iter().eq(of_rows);
    demand(same)?;
    let torn = |name: &str| -> Result<Torn, String> { Ok(points.split(points.read(file, name, 0)?, 3)) };
    let flows = |name: &str| -> Result<Vec<Flow>, Miss> {
        let part = part(name, &|_| None)?;
        let directions = part.split(part.read::<f64>(file, &format!("{name}/direction"), 0)?, 6);
        Ok(directions.into_iter().map(|flow| Flow::new(flow.as_chunks::<6>().0.to_vec())).collect())
    };
    let bases = |name: &str| -> Result<Vec<Option<Basis>>, Miss> {
        let codes = alone.read::<i64>(file, &format!("subdomains/{name}"), 0)?;
        let (torn, flows) = (torn(&format!("points/{name}"))?, flows(&format!("{name}_flow"))?);
        Ok(codes.into_iter().zip(torn).zip(flows).map(|((code, u), flow)| basis(code, u, flow)).collect())
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

    let remembered = history::from_arrays(|name| histories.read::<f64>(file, &format!("histories/{name}"), 0))?;
    let [of_points, of_cells] = recorded;
    Ok(Arrays {
        u: torn("points/displacement")?,
        last_u: torn("points/last")?,
        lambda: column(0),
        last_lambda: column(1),
        kept: of_rows.iter().map(|row| row[2] == 1).collect(),
        flows: flows("flow")?,
        bases,
        histories: histories.split(remembered, 1),
        point_data: of_points
            .read(|(name, _, k)| points.read(file, name, k), |(name, _, k)| points.read(file, name, k))?,
        cell_data: of_cells.read(|(name, _, k)| cells.read(file, name, k), |(name, _, k)| cells.read(file, name, k))?,
    })
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
    fn read<T: Number>(&self, file: &Checkpoint, name: &str, state: u64) -> Result<Vec<T>, String> {
        let begin = state * self.total as u64 + self.begin as u64;
        file.arrays().read(name, begin, self.counts.iter().sum::<usize>() as u64)
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
