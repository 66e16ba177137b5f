//! Mesh files of Gmsh: MSH 4.1 and 2.2, text and binary (Geuzaine and Remacle 2009; Gmsh reference manual, "MSH file
//! format").
//!
//! [`Msh`] is what a file says about volumes and surfaces; [`volume`] takes one body out of it. Points, lines, node data,
//! periodicity and parametric coordinates are read over. Files come from users, so nothing in them is trusted: memory
//! follows what is there, not what is announced.

pub mod error;
mod groups;
mod kind;
mod nodes;
mod sections;
mod source;
mod surface;
mod version2;
mod version4;
pub mod volume;

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

pub use error::Problem;
pub use kind::Kind;

use error::Place;
use nodes::NodeTags;
use source::Source;

/// A mesh file without its points and lines.
#[derive(Debug, Default, PartialEq)]
pub struct Msh {
    /// Coordinates of the nodes, in the order of the file.
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
    /// Nodes of each, as indices into the points; empty unless the kind is one that is read.
    pub nodes: Vec<u32>,
}

impl Block {
    /// Adds a node to the last cell, if the kind is one that is used.
    fn add_node(&mut self, place: Place, tag: u64, tags: &NodeTags) -> Result<(), Problem> {
        let index = tags.index(tag).ok_or(Problem::NoNode { place, kind: self.kind.name, node: tag })?;
        if self.kind.is_read() {
            self.nodes.push(index);
        }
        Ok(())
    }
}

impl Msh {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or is no sound mesh.
    pub fn read(path: &Path) -> Result<Self, Problem> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if !about.is_file() {
            // Nobody knows how long a pipe is.
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            return Self::parse(&bytes[..], bytes.len() as u64);
        }
        let length = about.len();
        Self::parse(BufReader::with_capacity(1 << 16, file), length)
    }

    /// Reads from bytes of this total length.
    ///
    /// # Errors
    /// As [`Msh::read`].
    pub fn parse(input: impl BufRead, length: u64) -> Result<Self, Problem> {
        let mut source = Source::new(input, length);
        let version = sections::header(&mut source)?;
        let mut msh = Self::default();
        let mut entities = HashMap::new();
        let mut tags = None;
        let mut has_elements = false;
        while let Some((place, line)) = source.filled_line()? {
            match &line[..] {
                b"$PhysicalNames" => msh.names = sections::physical_names(&mut source)?,
                b"$Entities" if version == 4 => entities = sections::entities(&mut source)?,
                b"$PartitionedEntities" => return Err(Problem::Partitioned),
                b"$Nodes" => {
                    let read = if version == 4 { version4::nodes } else { version2::nodes };
                    let (points, numbers) = read(&mut source)?;
                    (msh.points, tags) = (points, Some(numbers));
                }
                b"$Elements" => {
                    let tags = tags.as_ref().ok_or(Problem::NoSection("Nodes", "it must come before $Elements"))?;
                    msh.blocks = match version {
                        4 => version4::elements(&mut source, tags, &entities)?,
                        _ => version2::elements(&mut source, tags)?,
                    };
                    has_elements = true;
                }
                [b'$', name @ ..] if !name.starts_with(b"End") => {
                    let name = String::from_utf8_lossy(name).into_owned();
                    if !source.skip_to(&format!("$End{name}"))? {
                        return Err(Problem::NoEnd { place, name });
                    }
                }
                other => return Err(Problem::expected(place, "the beginning of a section, as $Nodes", other)),
            }
        }
        match (tags, has_elements) {
            (None, _) => Err(Problem::NoSection("Nodes", "save the mesh again")),
            (_, false) => Err(Problem::NoSection("Elements", "save the mesh again")),
            _ => Ok(msh),
        }
    }
}

#[cfg(test)]
mod tests;
