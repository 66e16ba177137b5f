//! Large binary files of version 4.1, of which each rank reads its own bytes.
//!
//! Rank 0 walks along the headers of blocks and finds out where their items are, which have a fixed size. Then each rank reads
//! consecutive nodes and consecutive cells, and those that have a node's number and those that have its place meet on the
//! rank that the number points to. What is wrong has the same message as in files that rank 0 reads.

use std::fs::File;
use std::io::{self, BufRead, Seek};
use std::ops::Range;
use std::os::unix::fs::FileExt;

use super::error::{Place, Problem};
use super::kind::Kind;
use super::sections::{Entities, Section, sections};
use super::source::Source;
use super::{Block, Msh, version4};
use crate::comm::Comm;
use crate::comm::agree::agree;
use crate::comm::meeting::ask;
use crate::comm::words::{least, share};

/// Bytes of a number.
const NUMBER: u64 = 8;
/// Numbers that are read at once.
const CHUNK: u64 = 1 << 17;

/// Where nodes and cells are in a file.
pub(super) struct Outline {
    /// All but nodes and cells.
    pub msh: Msh,
    /// Blocks of nodes.
    pub stretches: Vec<Stretch>,
    /// Byte of the first cell of each block.
    pub places: Vec<u64>,
}

/// A block of nodes: first their numbers, then their coordinates.
pub(super) struct Stretch {
    /// Byte of the first number.
    pub at: u64,
    /// How many nodes.
    pub count: u64,
    /// Parameters behind the coordinates of each.
    pub parameters: u64,
}

/// Finds blocks in a file, behind its header.
///
/// # Errors
/// If it does not fit the format.
pub(super) fn outline(source: &mut Source<impl BufRead + Seek>) -> Result<Outline, Problem> {
    let mut outline = Outline { msh: Msh::default(), stretches: Vec::new(), places: Vec::new() };
    outline.msh.names = sections(source, 4, |source, section| match section {
        Section::Nodes => {
            outline.stretches = stretches(source)?;
            outline.msh.nodes = outline.stretches.iter().map(|stretch| stretch.count).sum();
            most_nodes(outline.msh.nodes)
        }
        Section::Elements(entities) => {
            (outline.msh.blocks, outline.places) = blocks(source, entities)?;
            Ok(())
        }
    })?;
    Ok(outline)
}

/// Walks along `$Nodes`.
fn stretches(source: &mut Source<impl BufRead + Seek>) -> Result<Vec<Stretch>, Problem> {
    let (blocks, announced) = version4::counts(source, "Nodes")?;
    source.announce("Nodes", "nodes", announced, 8)?;
    let (mut stretches, mut found) = (Vec::new(), 0_u64);
    for _ in 0..blocks {
        let dimension = source.int("the dimension of an entity")?;
        source.int("the tag of an entity")?;
        let parametric = source.int("0 or 1")? != 0;
        let count = source.size("a number of nodes")?;
        found = found.saturating_add(count);
        if found > announced {
            return Err(Problem::Count { section: "Nodes", items: "nodes", announced, found });
        }
        let stretch =
            Stretch { at: source.byte, count, parameters: if parametric { dimension.max(0) as u64 } else { 0 } };
        source.pass(count, NUMBER, false)?;
        source.pass(count, stretch.stride(), true)?;
        if count > 0 {
            stretches.push(stretch);
        }
    }
    if found != announced {
        return Err(Problem::Count { section: "Nodes", items: "nodes", announced, found });
    }
    source.end("$EndNodes")?;
    Ok(stretches)
}

/// Walks along `$Elements`: blocks, and the byte of the first cell of each.
fn blocks(source: &mut Source<impl BufRead + Seek>, entities: &Entities) -> Result<(Vec<Block>, Vec<u64>), Problem> {
    let (count, announced) = version4::counts(source, "Elements")?;
    source.announce("Elements", "elements", announced, 4)?;
    let (mut blocks, mut places, mut found) = (Vec::new(), Vec::new(), 0);
    for _ in 0..count {
        let block = version4::block(source, entities, (&mut found, announced))?;
        let at = source.byte;
        source.pass(block.cells, stride(block.kind), true)?;
        if block.kind.dimension >= 2 {
            blocks.push(block);
            places.push(at);
        }
    }
    version4::all_found(source, found, announced)?;
    Ok((blocks, places))
}

/// Refuses more nodes than 32 bits can count.
fn most_nodes(nodes: u64) -> Result<(), Problem> {
    let limit = format!("{} are not read", u32::MAX);
    let refusal = Problem::TooMany { section: "Nodes", items: "nodes", announced: nodes, limit };
    if nodes < u64::from(u32::MAX) { Ok(()) } else { Err(refusal) }
}

/// Bytes of a cell: its number and those of its nodes.
fn stride(kind: Kind) -> u64 {
    NUMBER * (1 + kind.nodes as u64)
}

impl Stretch {
    /// Bytes of the coordinates and parameters of a node.
    fn stride(&self) -> u64 {
        NUMBER * (3 + self.parameters)
    }
}

/// What a rank reads.
#[derive(Default)]
struct Read {
    tags: Vec<u64>,
    points: Vec<[f64; 3]>,
    /// Numbers of the nodes of cells.
    cells: Vec<u64>,
}

impl Outline {
    /// This rank's share. Collective.
    pub fn read(self, comm: &dyn Comm, file: io::Result<File>) -> Result<Msh, Problem> {
        let (nodes, cells) = (share(self.msh.nodes, comm), share(self.msh.cells(), comm));
        let parts = self.msh.parts(&cells);
        let read = file.and_then(|file| self.own(&file, &nodes, &parts));
        let unreadable = |text| Problem::Told { text, is_unreadable: true };
        let Read { tags, points, cells } = agree(comm, "cannot read the mesh file", read).map_err(unreadable)?;
        let is_finite = |point: &[f64; 3]| point.iter().all(|x| x.is_finite());
        let place = points.iter().position(|point| !is_finite(point));
        if let Some([_, tag]) = least(comm, place.map(|k| [nodes.start + k as u64, tags[k]])) {
            return Err(Problem::NotFinite(tag));
        }
        let indices = indices(comm, (nodes.start, tags), &cells)?;
        let mut msh = self.msh;
        let (mut rest, mut missing) = ((&indices[..], &cells[..]), None);
        for ((block, part), at) in msh.blocks.iter_mut().zip(parts).zip(self.places) {
            let count = (part.end - part.start) as usize * block.kind.nodes;
            let (own, tags);
            ((own, rest.0), (tags, rest.1)) = (rest.0.split_at(count), rest.1.split_at(count));
            if let (Some(k), None) = (own.iter().position(|&index| index == u32::MAX), missing) {
                let (cell, node) = (k / block.kind.nodes, k % block.kind.nodes);
                let byte = at + (part.start + cell as u64) * stride(block.kind) + NUMBER * (1 + node as u64);
                missing = Some([byte, block.kind.number as u64, tags[k]]);
            }
            (block.first, block.nodes) = (part.start, own.to_vec());
        }
        match least(comm, missing) {
            Some([byte, kind, node]) => {
                let kind = Kind::of(kind as i32).expect("it is one of those read").name;
                Err(Problem::NoNode { place: Place::Byte(byte), kind, node })
            }
            None => Ok(Msh { points, ..msh }),
        }
    }

    /// Reads some nodes, and some cells of each block.
    fn own(&self, file: &File, nodes: &Range<u64>, parts: &[Range<u64>]) -> io::Result<Read> {
        let mut read = Read::default();
        let mut end = 0;
        for stretch in &self.stretches {
            let begin = end;
            end += stretch.count;
            let own = nodes.start.clamp(begin, end) - begin..nodes.end.clamp(begin, end) - begin;
            let tags = &mut read.tags;
            numbers(file, stretch.at, NUMBER, &own, |numbers| tags.push(u64::from_ne_bytes(numbers[0])))?;
            let at = stretch.at + NUMBER * stretch.count;
            numbers(file, at, stretch.stride(), &own, |numbers| {
                read.points.push([0, 1, 2].map(|a| f64::from_ne_bytes(numbers[a])));
            })?;
        }
        for ((block, part), &at) in self.msh.blocks.iter().zip(parts).zip(&self.places) {
            let cells = &mut read.cells;
            numbers(file, at, stride(block.kind), part, |numbers| {
                cells.extend(numbers[1..].iter().map(|&number| u64::from_ne_bytes(number)));
            })?;
        }
        Ok(read)
    }
}

/// Gives the numbers of some of the items of so many bytes that begin at a byte.
fn numbers(file: &File, at: u64, bytes: u64, items: &Range<u64>, mut give: impl FnMut(&[[u8; 8]])) -> io::Result<()> {
    let at_once = (CHUNK * NUMBER / bytes).max(1);
    let mut first = items.start;
    while first < items.end {
        let count = at_once.min(items.end - first);
        let mut chunk = vec![0; (count * bytes) as usize];
        file.read_exact_at(&mut chunk, at + first * bytes)?;
        chunk.chunks_exact(bytes as usize).for_each(|item| give(item.as_chunks().0));
        first += count;
    }
    Ok(())
}

/// Places in the file of nodes with these numbers, `u32::MAX` where there is no such node. `tags` are those of own nodes, from a
/// place on. Collective.
fn indices(comm: &dyn Comm, (first, tags): (u64, Vec<u64>), wanted: &[u64]) -> Result<Vec<u32>, Problem> {
    let meeting = |tag: u64| (tag % comm.size() as u64) as usize;
    let mut outgoing = vec![Vec::new(); comm.size()];
    (first..).zip(tags).for_each(|(place, tag)| outgoing[meeting(tag)].extend([tag, place]));
    let mut known: Vec<[u64; 2]> =
        comm.all_to_all(outgoing).iter().flat_map(|theirs| theirs.as_chunks().0).copied().collect();
    known.sort_unstable();
    let twice = known.windows(2).find(|pair| pair[0][0] == pair[1][0]).map(|pair| [pair[0][0]]);
    if let Some([tag]) = least(comm, twice) {
        return Err(Problem::NodeTwice(tag));
    }
    let mut asked: Vec<[u64; 1]> = wanted.iter().map(|&tag| [tag]).collect();
    asked.sort_unstable();
    asked.dedup();
    let place = |[tag]: &[u64; 1]| {
        known.binary_search_by_key(tag, |entry| entry[0]).map_or(u64::from(u32::MAX), |at| known[at][1])
    };
    let places = ask(comm, &asked, |[tag]| meeting(*tag), |_| place);
    Ok(wanted.iter().map(|&tag| places[asked.binary_search(&[tag]).expect("it was asked for")] as u32).collect())
}

#[cfg(test)]
mod tests;
