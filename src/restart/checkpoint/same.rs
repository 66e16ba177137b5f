//! Arrays of a checkpoint on the same subdomains as there: each rank reads its own rows, and everything is as it was.

use std::collections::HashMap;
use std::ops::Range;

use super::arrays::basis;
use super::{Arrays, Recorded, lowest_node};
use crate::assembly::flow::Flow;
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::feti::Torn;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::basis::{Bases, Basis};
use crate::material::{History, history};
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
    let reader = Reader::new(comm, discrete, file)?;
    let Reader { points, cells, .. } = &reader;
    let torn = |name: &str| -> Result<Torn, String> { Ok(points.split(points.read(file, name, 0)?, 3)) };
    let (of_rows, kept, slips) = reader.rows()?;
    let [of_points, of_cells] = recorded;
    Ok(Arrays {
        u: torn("points/displacement")?,
        reached_u: torn("points/last")?,
        lambda: of_rows.iter().map(|row| row[0]).collect(),
        reached_lambda: of_rows.iter().map(|row| row[1]).collect(),
        kept,
        slips,
        flows: reader.flows("flow")?,
        bases: reader.bases(&torn)?,
        histories: reader.histories()?,
        point_data: of_points
            .read(|(name, _, k)| points.read(file, name, k), |(name, _, k)| points.read(file, name, k))?,
        cell_data: of_cells.read(|(name, _, k)| cells.read(file, name, k), |(name, _, k)| cells.read(file, name, k))?,
    })
}

/// Multipliers, whether rows are kept, and slips.
type OfRows = (Vec<[f64; 2]>, Vec<bool>, Vec<f64>);

/// Reads what belongs to own subdomains.
struct Reader<'a> {
    comm: &'a dyn Comm,
    discrete: &'a Discrete,
    file: &'a Checkpoint<'a>,
    /// Rows that each own subdomain owns.
    owned: Vec<Range<usize>>,
    alone: Part,
    points: Part,
    cells: Part,
    rows: Part,
}

impl<'a> Reader<'a> {
    /// Of a file on the same subdomains. Collective.
    fn new(comm: &'a dyn Comm, discrete: &'a Discrete, file: &'a Checkpoint<'a>) -> Result<Self, Miss> {
        let Discrete { decomposition, constraints, .. } = discrete;
        let (shares, own) = (&decomposition.shares, &decomposition.subdomains);
        let owned = RowSpace::new(comm, shares, constraints).owned().to_vec();
        let part = |name: &str, count: &dyn Fn(usize) -> Option<usize>| Part::find(comm, discrete, file, name, count);
        let alone = Part { begin: shares.begin(comm.rank()), counts: vec![1; own.len()], total: shares.total() };
        let points = part("points", &|k| Some(own[k].nodes.len()))?;
        let cells = part("cells", &|k| Some(own[k].elements.len()))?;
        let rows = part("rows", &|k| Some(owned[k].len()))?;
        let reader = Self { comm, discrete, file, owned, alone, points, cells, rows };
        demand(comm, reader.is_same()?)?;
        Ok(reader)
    }

    /// Whether clusters, nodes, elements and rows of own subdomains are those of the file.
    fn is_same(&self) -> Result<bool, String> {
        let Self { discrete: Discrete { decomposition, constraints, .. }, file, .. } = *self;
        let own = &decomposition.subdomains;
        let clusters = (self.alone.begin..self.alone.begin + own.len()).map(|id| decomposition.clusters.of(id) as i64);
        let nodes = own.iter().flat_map(|s| &s.nodes).map(|&node| node as i64);
        let elements = own.iter().flat_map(|s| s.elements.iter().flat_map(|element| key(element, &s.nodes)));
        let rows = self.owned.iter().flat_map(Range::clone).map(|row| lowest_node(&constraints.rows[row]) as i64);
        // All of them are read: reading is collective.
        Ok(self.alone.read::<i64>(file, "subdomains/cluster", 0)?.into_iter().eq(clusters)
            & self.points.read::<i64>(file, "points/node", 0)?.into_iter().eq(nodes)
            & self.cells.read::<i64>(file, "cells/nodes", 0)?.into_iter().eq(elements)
            & self.rows.read::<i64>(file, "rows/node", 0)?.into_iter().eq(rows))
    }

    /// A group whose subdomains may have any number of rows.
    fn part(&self, name: &str) -> Result<Part, Miss> {
        Part::find(self.comm, self.discrete, self.file, name, &|_| None)
    }

    fn flows(&self, name: &str) -> Result<Vec<Flow>, Miss> {
        let part = self.part(name)?;
        let directions = part.split(part.read::<f64>(self.file, &format!("{name}/direction"), 0)?, 6);
        Ok(directions.into_iter().map(|flow| Flow::new(flow.as_chunks::<6>().0.to_vec())).collect())
    }

    fn bases(&self, torn: &dyn Fn(&str) -> Result<Torn, String>) -> Result<Vec<Bases>, Miss> {
        let of = |name: &str| -> Result<Vec<Option<Basis>>, Miss> {
            let codes = self.alone.read::<i64>(self.file, &format!("subdomains/{name}"), 0)?;
            let (torn, flows) = (torn(&format!("points/{name}"))?, self.flows(&format!("{name}_flow"))?);
            Ok(codes.into_iter().zip(torn).zip(flows).map(|((code, u), flow)| basis(code, u, flow)).collect())
        };
        let drift = self.alone.read::<f64>(self.file, "subdomains/drift", 0)?;
        let bases = of("factor")?.into_iter().zip(of("interior")?).zip(drift);
        Ok(bases.map(|((factor, interior), drift)| Bases { factor, interior, drift }).collect())
    }

    /// Multiplier and last multiplier of each row on this rank, whether it is kept, and what surfaces have slid along it.
    fn rows(&self) -> Result<OfRows, Miss> {
        let Self { comm, discrete, file, .. } = *self;
        let multiplier = self.rows.read::<f64>(file, "rows/multiplier", 0)?;
        let last = self.rows.read::<f64>(file, "rows/last", 0)?;
        let kept = self.rows.read::<i64>(file, "rows/kept", 0)?;
        let rubs = discrete.constraints.has_friction;
        let slips = if rubs { self.rows.read::<f64>(file, "rows/slip", 0)? } else { vec![0.0; kept.len()] };
        let mut of_rows = vec![[0; 4]; discrete.constraints.rows.len()];
        let values = multiplier.into_iter().zip(last).zip(kept).zip(slips);
        for (row, (((multiplier, last), kept), slip)) in self.owned.iter().flat_map(Range::clone).zip(values) {
            of_rows[row] = [multiplier.to_bits(), last.to_bits(), kept as u64, slip.to_bits()];
        }
        complete(comm, discrete, &mut of_rows);
        let slips = if rubs { of_rows.iter().map(|row| f64::from_bits(row[3])).collect() } else { Vec::new() };
        let (multipliers, kept) = of_rows.iter().map(|row| ([row[0], row[1]].map(f64::from_bits), row[2] == 1)).unzip();
        Ok((multipliers, kept, slips))
    }

    fn histories(&self) -> Result<Vec<Vec<History>>, Miss> {
        let part = self.part("histories")?;
        let points = history::from_arrays(|name| part.read::<f64>(self.file, &format!("histories/{name}"), 0))?;
        Ok(part.split(points, 1))
    }
}

/// Refuses other subdomains on every rank, unless all ranks find theirs the same.
fn demand(comm: &dyn Comm, same: bool) -> Result<(), Miss> {
    agree(comm, "subdomains", if same { Ok(()) } else { Err("others") }).map_err(|_| Miss::Others)
}

/// The rows of an array that belong to own subdomains.
struct Part {
    begin: usize,
    counts: Vec<usize>,
    /// Of all subdomains.
    total: usize,
}

impl Part {
    /// Of a group. The file tells how many rows each subdomain has; `count` tells how many an own one must have, if that is known.
    fn find(
        comm: &dyn Comm,
        discrete: &Discrete,
        file: &Checkpoint,
        name: &str,
        count: &dyn Fn(usize) -> Option<usize>,
    ) -> Result<Self, Miss> {
        let shares = &discrete.decomposition.shares;
        let (first, own) = (shares.begin(comm.rank()), discrete.decomposition.subdomains.len());
        let counts = file.whole::<i64>(&format!("subdomains/{name}"))?;
        let fits = |k: usize| count(k).is_none_or(|n| counts[first + k] == n as i64);
        demand(comm, counts.len() == shares.total() && (0..own).all(fits))?;
        let counts: Vec<usize> = counts.iter().map(|&count| count as usize).collect();
        let begin = counts[..first].iter().sum();
        Ok(Self { begin, counts: counts[first..][..own].to_vec(), total: counts.iter().sum() })
    }

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
fn complete(comm: &dyn Comm, discrete: &Discrete, rows: &mut [[u64; 4]]) {
    let (constraints, shares) = (&discrete.constraints, &discrete.decomposition.shares);
    let blocks = constraints.blocks.iter().zip(&constraints.block_subdomains);
    let (mut own, mut foreign) = (HashMap::new(), vec![Vec::new(); comm.size()]);
    for (block, subdomains) in blocks {
        let name = constraints.name(block);
        match shares.owner(subdomains[0] as usize) {
            owner if owner == comm.rank() => {
                own.insert(name, block.clone());
            }
            owner => foreign[owner].push((name, block.clone())),
        }
    }
    let wishes = foreign.iter().map(|blocks| blocks.iter().flat_map(|(name, _)| *name).collect()).collect();
    let answer = |wish: Vec<u64>| {
        wish.as_chunks().0.iter().flat_map(|name: &[u64; 2]| rows[own[name].clone()].concat()).collect()
    };
    let answers: Vec<Vec<u64>> = comm.all_to_all(wishes).into_iter().map(answer).collect();
    for (blocks, answers) in foreign.into_iter().zip(comm.all_to_all(answers)) {
        let of_blocks = blocks.into_iter().flat_map(|(_, block)| block);
        of_blocks.zip(answers.as_chunks::<4>().0).for_each(|(row, answer)| rows[row] = *answer);
    }
}
