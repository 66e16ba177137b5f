//! Mesh files of Gmsh: MSH 4.1 and 2.2, text and binary (Geuzaine and Remacle 2009; Gmsh reference manual, "MSH file
//! format").
//!
//! [`Msh`] is what a file says about volumes and surfaces, and a rank's share in their nodes and cells; [`volume`] takes one
//! body out of it. Of large binary files of version 4.1 each rank reads its own bytes (`ranges`); others rank 0 reads, and
//! deals them out (`deal`). Files of VTKHDF are taken for such meshes too (`vtkhdf`). Points, lines, node data,
//! periodicity and parametric coordinates are read over. Files come from users, so nothing in them is trusted: memory
//! follows what is there, not what is announced. Results of this program are such files, with names (`own`).

mod deal;
pub mod error;
mod groups;
mod kind;
mod nodes;
mod numbers;
pub mod own;
mod ranges;
mod sections;
mod source;
mod surface;
mod version2;
mod version4;
pub mod volume;
mod vtkhdf;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;

pub use error::Problem;
pub use kind::Kind;

use crate::comm::{Comm, decide};
use deal::{Look, told};
use error::Place;
use nodes::NodeTags;
use sections::Section;
use source::Source;

/// Bytes of a file that each rank reads its own part of, if it is binary and of version 4.1.
pub const LARGE: u64 = 1 << 24;

/// A mesh file without its points and lines. Ranks have consecutive shares in its nodes and in its cells; names and blocks
/// they all know.
#[derive(Debug, Default, PartialEq)]
pub struct Msh {
    /// How many nodes there are.
    pub nodes: u64,
    /// Coordinates of this rank's share in the nodes, in the order of the file.
    pub points: Vec<[f64; 3]>,
    /// Physical groups of dimension 2 and 3 that have a name.
    pub names: Vec<GroupName>,
    /// Cells of dimension 2 and 3.
    pub blocks: Vec<Block>,
}

/// The name of a physical group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupName {
    /// 2 or 3.
    pub dimension: i32,
    /// Number of the group among those of its dimension.
    pub tag: i32,
    /// The name.
    pub name: String,
}

/// Cells of one kind in the same surface or volume of the geometry.
#[derive(Debug, PartialEq)]
pub struct Block {
    /// Their kind.
    pub kind: Kind,
    /// Tag of the surface or volume.
    pub entity: i32,
    /// Physical groups.
    pub groups: Vec<i32>,
    /// How many.
    pub cells: u64,
    /// The first one in this rank's share.
    pub first: u64,
    /// Nodes of each in this rank's share, by their places in the file; empty unless the kind is one that is read.
    pub nodes: Vec<u32>,
}

impl Block {
    /// Adds a node to the last cell, if the kind is one that is used.
    fn add_node(&mut self, place: Place, tag: u64, tags: &NodeTags) -> Result<(), Problem> {
        if self.kind.is_read() {
            let index = tags.index(tag).ok_or(Problem::NoNode { place, kind: self.kind.name, node: tag })?;
            self.nodes.push(index);
        }
        Ok(())
    }

    /// Cells of this rank's share, each by its nodes.
    fn own(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.nodes)
    }
}

impl Msh {
    /// Reads this rank's share in a file. Those of at least `large` bytes are read in parts if that can be; see [`LARGE`].
    /// Collective.
    ///
    /// # Errors
    /// If it cannot be read, or is no sound mesh; the same on every rank.
    pub fn read(comm: &dyn Comm, path: &Path, large: u64) -> Result<Self, Problem> {
        if decide(comm, comm.rank() == 0 && is_hdf5(path)) {
            return vtkhdf::read(comm, path);
        }
        let looked = if comm.rank() == 0 { Self::look(path, large) } else { Ok(Look::Whole(Self::default())) };
        let look = told(comm, looked)?;
        deal::deal(comm, path, look)
    }

    /// What rank 0 does.
    fn look(path: &Path, large: u64) -> Result<Look, Problem> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if !about.is_file() {
            // Nobody knows how long a pipe is.
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            return Self::parse(&bytes[..], bytes.len() as u64).map(Look::Whole);
        }
        let mut source = Source::new(BufReader::with_capacity(1 << 16, file), about.len());
        let version = sections::header(&mut source)?;
        match version == 4 && source.binary && about.len() >= large {
            true => ranges::outline(&mut source).map(Look::Ranges),
            false => Self::whole(&mut source, version).map(Look::Whole),
        }
    }

    /// Reads all from bytes of this total length.
    ///
    /// # Errors
    /// If they are no sound mesh.
    pub fn parse(input: impl BufRead, length: u64) -> Result<Self, Problem> {
        let mut source = Source::new(input, length);
        let version = sections::header(&mut source)?;
        Self::whole(&mut source, version)
    }

    fn whole(source: &mut Source<impl BufRead>, version: u8) -> Result<Self, Problem> {
        let (mut points, mut blocks, mut tags) = (Vec::new(), Vec::new(), None);
        let names = sections::sections(source, version, |source, section| {
            match section {
                Section::Nodes => {
                    let read = if version == 4 { version4::nodes } else { version2::nodes };
                    let (places, numbers) = read(source)?;
                    (points, tags) = (places, Some(numbers));
                }
                Section::Elements(entities) => {
                    let tags = tags.as_ref().expect("nodes come first");
                    blocks = match version {
                        4 => version4::elements(source, tags, entities)?,
                        _ => version2::elements(source, tags)?,
                    };
                }
            }
            Ok(())
        })?;
        Ok(Self { nodes: points.len() as u64, points, names, blocks })
    }

    /// Cells whose nodes are read, of all blocks.
    fn cells(&self) -> u64 {
        self.blocks.iter().filter(|block| block.kind.is_read()).map(|block| block.cells).sum()
    }

    /// The part of each block that is in a share of the cells whose nodes are read.
    fn parts(&self, share: &Range<u64>) -> Vec<Range<u64>> {
        let mut end = 0;
        let part = |block: &Block| {
            let begin = end;
            end += if block.kind.is_read() { block.cells } else { 0 };
            share.start.clamp(begin, end) - begin..share.end.clamp(begin, end) - begin
        };
        self.blocks.iter().map(part).collect()
    }
}

/// Whether a file begins as HDF5 files do. Pipes are not looked into.
fn is_hdf5(path: &Path) -> bool {
    let mut begin = [0; vtkhdf::SIGNATURE.len()];
    let is_file = path.metadata().is_ok_and(|about| about.is_file());
    is_file && File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == vtkhdf::SIGNATURE
}

#[cfg(test)]
mod tests;
