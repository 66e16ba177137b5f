//! Meshes in VTKHDF files (VTK file formats, "VTKHDF", `UnstructuredGrid`), as what a file of Gmsh would say of them.
//!
//! A file may be in pieces, as parallel programs write them. Each rank reads consecutive points and consecutive cells, whatever
//! pieces they are in. Nodes that several pieces have are one node if `PointData/GlobalPointIds` says so; without it pieces have
//! nothing in common. Cells are of the group that an integer array in `CellData` gives: `gmsh:physical`, `PhysicalIds` or
//! `group`; without one all are of group 1. Groups have no names, so scenes call them by their numbers. Results of this program have
//! names and surfaces, and their nodes have numbers ([`super::own`]); their mesh is that of all time steps.
//!
//! Read are linear cells and tetrahedra of ten nodes, and triangles and quadrangles for surfaces; of other files with several time steps
//! nothing.

use std::ops::Range;
use std::path::Path;

use hdf5_metno::{File, Group, H5Type};

use super::error::Problem;
use super::kind::Kind;
use super::own::{self, Names};
use super::{Block, Msh};
use crate::comm::agree::agree;
use crate::comm::meeting::{ask, home, look_up};
use crate::comm::words::{holder, share, sum};
use crate::comm::{Comm, all_gather_u64};

/// How HDF5 files begin.
pub(super) const SIGNATURE: [u8; 8] = *b"\x89HDF\r\n\x1a\n";
/// Names of the array with the groups of cells.
const GROUPS: [&str; 3] = ["gmsh:physical", "PhysicalIds", "group"];
/// Where there is none.
const ONLY: i32 = 1;
/// The last two nodes of VTK's quadratic tetrahedron are the other way round in Gmsh's.
const TETRAHEDRON: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];

/// Cells of VTK by Gmsh's numbers.
const CELLS: [(u8, i32); 13] = [
    (1, 15),
    (3, 1),
    (5, 2),
    (9, 3),
    (10, 4),
    (12, 5),
    (13, 6),
    (14, 7),
    (21, 8),
    (22, 9),
    (23, 16),
    (24, 11),
    (25, 17),
];

/// Where a piece begins in the arrays, and the end.
struct Piece {
    points: Range<u64>,
    cells: Range<u64>,
    connectivity: u64,
}

/// A rank's share in a file.
struct Share {
    /// Points of all ranks.
    nodes: u64,
    points: Vec<[f64; 3]>,
    ids: Option<Vec<i64>>,
    cells: Vec<Cell>,
    /// Of results of this program.
    named: Option<own::Named>,
}

/// Kind, group and places of points.
struct Cell {
    kind: Kind,
    group: i32,
    nodes: Vec<u64>,
}

/// Reads this rank's share. Collective.
///
/// # Errors
/// If the file cannot be read, or is another one; the same on every rank.
pub(super) fn read(comm: &dyn Comm, path: &Path) -> Result<Msh, Problem> {
    let told = |text| Problem::Told { text, is_unreadable: false };
    let mine = Share::read(comm, path);
    let Share { nodes, points, ids, mut cells, named } = agree(comm, "the VTKHDF file", mine).map_err(told)?;
    cells.retain(|cell| cell.kind.dimension >= 2);
    let first = share(nodes, comm).start;
    let mut names = Vec::new();
    if let Some(ids) = ids {
        let faces = named.map(|(known, faces)| {
            names = known.groups();
            of_surfaces(comm, first, &ids, faces)
        });
        let one = canonical(comm, first, &ids);
        let asked: Vec<[u64; 1]> = cells.iter().flat_map(|cell| &cell.nodes).map(|&node| [node]).collect();
        let of = |[node]: &[u64; 1]| one[(node - first) as usize];
        let places = ask(comm, &asked, |[node]| holder(*node, nodes, comm), |_| of);
        cells.iter_mut().flat_map(|cell| &mut cell.nodes).zip(places).for_each(|(node, place)| *node = place);
        cells.extend(agree(comm, "the faces of surfaces", faces.unwrap_or(Ok(Vec::new()))).map_err(told)?);
    }
    Ok(dealt(comm, Msh { nodes, points, names, ..Msh::default() }, &cells))
}

/// Faces of surfaces as cells, from the numbers of nodes; `ids` are those of this rank's points, from `first`. Collective.
fn of_surfaces(comm: &dyn Comm, first: u64, ids: &[i64], faces: Vec<(i64, Vec<u64>)>) -> Result<Vec<Cell>, String> {
    let known = ids.iter().zip(first..).map(|(id, at)| ([id.cast_unsigned()], vec![at]));
    let places = look_up(comm, known, faces.iter().flat_map(|(_, nodes)| nodes).map(|&node| [node]));
    let kind_of = |nodes: usize| {
        Kind::of(match nodes {
            3 => 2,
            4 => 3,
            _ => 9,
        })
    };
    let cell = |(surface, nodes): (i64, Vec<u64>)| {
        let kind = kind_of(nodes.len())?;
        let nodes = nodes.iter().map(|&node| places.get(&[node]).map(|place| place[0])).collect::<Option<_>>()?;
        Some(Cell { kind, group: surface as i32 + 1, nodes })
    };
    let cells: Option<Vec<Cell>> = faces.into_iter().map(cell).collect();
    cells.ok_or_else(|| "a face of its surfaces has a node that is not there".to_owned())
}

impl Share {
    fn read(comm: &dyn Comm, path: &Path) -> Result<Self, String> {
        let text = |error: hdf5_metno::Error| error.to_string();
        let file = File::open(path).map_err(text)?;
        let root = file.group("VTKHDF").map_err(|_| "it has no group VTKHDF".to_owned())?;
        let named = own::read(comm, &file)?;
        if root.link_exists("Steps") && named.is_none() {
            return Err("it has time steps: save one of them".to_owned());
        }
        let pieces = pieces(&root).map_err(text)??;
        let [nodes, cells] = pieces.last().map_or([0; 2], |last| [last.points.end, last.cells.end]);
        if nodes >= u64::from(u32::MAX) {
            return Err(format!("{nodes} points are more than are read, {}", u32::MAX));
        }
        let own = share(nodes, comm);
        let points: Vec<f64> = rows(&root, "Points", &own, 3).map_err(text)?;
        let points: Vec<[f64; 3]> = points.as_chunks().0.to_vec();
        if let Some(at) = points.iter().position(|point| point.iter().any(|x| !x.is_finite())) {
            return Err(format!("point {} is nowhere: its coordinates are not finite", own.start + at as u64));
        }
        let numbers = if named.is_some() { "PointData/node" } else { "PointData/GlobalPointIds" };
        let known = root.link_exists("PointData") && root.link_exists(numbers);
        if named.is_some() && !known {
            return Err(format!("it has names of surfaces, and no {numbers} that say where they are"));
        }
        let ids = known.then(|| rows(&root, numbers, &own, 1)).transpose().map_err(text)?;
        let names = named.as_ref().map(|(names, _)| names);
        let mut found = Vec::new();
        let own = share(cells, comm);
        for (number, piece) in pieces.iter().enumerate() {
            let begin = own.start.clamp(piece.cells.start, piece.cells.end);
            let end = own.end.clamp(piece.cells.start, piece.cells.end);
            if begin < end {
                found.extend(of_piece(&root, (number as u64, piece), begin..end, names).map_err(text)??);
            }
        }
        Ok(Self { nodes, points, ids, cells: found, named })
    }
}

/// The pieces, from the numbers of what they have.
fn pieces(root: &Group) -> hdf5_metno::Result<Result<Vec<Piece>, String>> {
    let names = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];
    let mut counts = Vec::new();
    for name in names {
        counts.push(root.dataset(name)?.read_1d::<i64>()?.to_vec());
    }
    let arrays = ["Points", "Types", "Connectivity"];
    let mut ends = [0; 3];
    let mut pieces = Vec::new();
    for at in 0..counts[0].len() {
        let begins = ends;
        for (end, counts) in ends.iter_mut().zip(&counts) {
            *end += counts.get(at).map_or(0, |&count| count.max(0) as u64);
        }
        pieces.push(Piece { points: begins[0]..ends[0], cells: begins[1]..ends[1], connectivity: begins[2] });
    }
    for ((name, array), end) in names.iter().zip(arrays).zip(ends) {
        let found = root.dataset(array)?.shape().first().map_or(0, |&rows| rows as u64);
        if found != end {
            return Ok(Err(format!("{name} is {end} in all, and {array} has {found} rows")));
        }
    }
    Ok(Ok(pieces))
}

/// Some cells of a piece.
fn of_piece(
    root: &Group,
    (number, piece): (u64, &Piece),
    cells: Range<u64>,
    names: Option<&Names>,
) -> hdf5_metno::Result<Result<Vec<Cell>, String>> {
    let types: Vec<u8> = rows(root, "Types", &cells, 1)?;
    // Each piece before has one offset more than cells.
    let offsets: Vec<i64> = rows(root, "Offsets", &(cells.start + number..cells.end + number + 1), 1)?;
    let is_sound = offsets.windows(2).all(|pair| 0 <= pair[0] && pair[0] <= pair[1]);
    if !is_sound {
        return Ok(Err(format!("the offsets of piece {number} do not ascend")));
    }
    let [first, last] = [0, offsets.len() - 1].map(|k| piece.connectivity + offsets[k] as u64);
    let connectivity: Vec<i64> = rows(root, "Connectivity", &(first..last), 1)?;
    let groups = match groups(root, &cells, names)? {
        Some(groups) => groups,
        None => return Ok(Err(format!("a cell of piece {number} is of no body that it names"))),
    };
    let points = piece.points.end - piece.points.start;
    let mut found = Vec::new();
    for ((cell, (of, group)), ends) in cells.zip(types.iter().zip(groups)).zip(offsets.windows(2)) {
        let kind = CELLS.iter().find(|(vtk, _)| vtk == of).and_then(|(_, number)| Kind::of(*number));
        let Some(kind) = kind else { return Ok(Err(format!("cell {cell} is of VTK's type {of}, which is not read"))) };
        let nodes = &connectivity[(ends[0] - offsets[0]) as usize..(ends[1] - offsets[0]) as usize];
        if nodes.len() != kind.nodes {
            return Ok(Err(format!("cell {cell}, a {}, has {} points, not {}", kind.name, nodes.len(), kind.nodes)));
        }
        if let Some(node) = nodes.iter().find(|node| **node < 0 || **node as u64 >= points) {
            return Ok(Err(format!("cell {cell} has point {node} of a piece that has {points}")));
        }
        let place = |k: usize| piece.points.start + nodes[if kind.number == 11 { TETRAHEDRON[k] } else { k }] as u64;
        found.push(Cell { kind, group, nodes: (0..kind.nodes).map(place).collect() });
    }
    Ok(Ok(found))
}

/// The group of each of some cells; none if one has a body without a name.
fn groups(root: &Group, cells: &Range<u64>, names: Option<&Names>) -> hdf5_metno::Result<Option<Vec<i32>>> {
    if let Some(names) = names {
        let [bodies, materials]: [Vec<i64>; 2] =
            [rows(root, "CellData/body", cells, 1)?, rows(root, "CellData/material", cells, 1)?];
        return Ok(bodies.into_iter().zip(materials).map(|of| names.volume(of)).collect());
    }
    let name =
        GROUPS.into_iter().find(|name| root.link_exists("CellData") && root.link_exists(&format!("CellData/{name}")));
    Ok(Some(match name {
        Some(name) => rows(root, &format!("CellData/{name}"), cells, 1)?,
        None => vec![ONLY; (cells.end - cells.start) as usize],
    }))
}

/// Rows of an array, `width` numbers each.
fn rows<T: H5Type + Clone>(root: &Group, name: &str, rows: &Range<u64>, width: usize) -> hdf5_metno::Result<Vec<T>> {
    let dataset = root.dataset(name)?;
    let (begin, end) = (rows.start as usize, rows.end as usize);
    if begin == end {
        return Ok(Vec::new());
    }
    let numbers = match width {
        1 => dataset.read_slice_1d::<T, _>(begin..end)?.to_vec(),
        _ => dataset.read_slice_2d::<T, _>((begin..end, 0..width))?.into_iter().collect(),
    };
    Ok(numbers)
}

/// For each of this rank's points the first of all points with the same number. Collective.
fn canonical(comm: &dyn Comm, first: u64, ids: &[i64]) -> Vec<u64> {
    let mine: Vec<[u64; 2]> = ids.iter().map(|id| id.cast_unsigned()).zip(first..).map(|(id, at)| [id, at]).collect();
    ask(
        comm,
        &mine,
        |[id, _]| home(&[*id], comm.size()),
        |all| {
            let mut known: Vec<[u64; 2]> = all.iter().copied().flatten().copied().collect();
            known.sort_unstable();
            move |[id, _]| known[known.partition_point(|entry| entry[0] < *id)][1]
        },
    )
}

/// Cells by kind and group, and of these this rank's share. Collective.
fn dealt(comm: &dyn Comm, mut msh: Msh, cells: &[Cell]) -> Msh {
    let key = |cell: &Cell| [cell.kind.number as u64, cell.group.cast_unsigned().into()];
    let distinct = |mut keys: Vec<[u64; 2]>| {
        keys.sort_unstable();
        keys.dedup();
        keys
    };
    let mine = distinct(cells.iter().map(key).collect());
    let all = distinct(all_gather_u64(comm, mine.as_flattened()).as_chunks().0.to_vec());
    let block_of = |cell: &Cell| all.binary_search(&key(cell)).expect("every kind is known");
    let mut counts = vec![0; all.len()];
    cells.iter().for_each(|cell| counts[block_of(cell)] += 1);
    let of_ranks = all_gather_u64(comm, &counts);
    let mut next = vec![0; all.len()];
    for theirs in of_ranks.chunks(all.len().max(1)).take(comm.rank()) {
        next.iter_mut().zip(theirs).for_each(|(next, count)| *next += count);
    }
    for (&[kind, group], count) in all.iter().zip(sum(comm, counts)) {
        let kind = Kind::of(kind as i32).expect("it was found by its number");
        let group = (group as u32).cast_signed();
        msh.blocks.push(Block { kind, entity: group, groups: vec![group], cells: count, first: 0, nodes: Vec::new() });
    }
    // Cells go to the ranks that have their places in the order of blocks.
    let total = msh.cells();
    let read = |block: &Block| if block.kind.is_read() { block.cells } else { 0 };
    let begins: Vec<u64> =
        msh.blocks.iter().scan(0, |end, block| Some(std::mem::replace(end, *end + read(block)))).collect();
    let mut outgoing = vec![Vec::new(); comm.size()];
    for cell in cells {
        let block = block_of(cell);
        let place = begins[block] + next[block];
        next[block] += 1;
        if cell.kind.is_read() {
            let message = &mut outgoing[holder(place, total, comm)];
            message.extend([block as u64, place]);
            message.extend(&cell.nodes);
        }
    }
    let mut found: Vec<(u64, usize, Vec<u64>)> = Vec::new();
    for theirs in comm.all_to_all(outgoing) {
        let mut rest = &theirs[..];
        while let [block, place, nodes @ ..] = rest {
            let (nodes, others) = nodes.split_at(msh.blocks[*block as usize].kind.nodes);
            found.push((*place, *block as usize, nodes.to_vec()));
            rest = others;
        }
    }
    found.sort_unstable();
    let parts = msh.parts(&share(total, comm));
    msh.blocks.iter_mut().zip(parts).for_each(|(block, part)| block.first = part.start);
    for (_, block, nodes) in found {
        msh.blocks[block].nodes.extend(nodes.into_iter().map(|node| node as u32));
    }
    msh
}

#[cfg(test)]
mod tests;
