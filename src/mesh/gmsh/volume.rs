//! One body out of a mesh file: the elements of a physical volume, and physical surfaces on its boundary.

use std::collections::{BTreeMap, BTreeSet};

use super::error::Problem;
use super::surface::Boundary;
use super::{Block, Msh};
use crate::element::Kind;
use crate::mesh::faces::Neighbours;
use crate::mesh::quality::Quality;
use crate::mesh::{Elements, SolidMesh, split};

impl Msh {
    /// The physical volume of this name (or number, if it has no name), or the only one there is, with these surfaces, as
    /// elements of a kind: cells are split into linear tetrahedra, and for others they must be what the kind is.
    ///
    /// # Errors
    /// If the volume or one of the surfaces is missing, or elements cannot be computed with.
    pub fn volume(&self, volume: Option<&str>, surfaces: &[&str], kind: Kind) -> Result<SolidMesh, Problem> {
        self.refuse_untagged()?;
        let volume = &self.choose(volume)?;
        let blocks: Vec<&Block> = self.group(3, volume).collect();
        refuse_others(volume, kind, &blocks)?;

        let mut index = vec![u32::MAX; self.points.len()];
        blocks.iter().flat_map(|b| &b.nodes).for_each(|&n| index[n as usize] = 0);
        let mut points = Vec::new();
        for (index, point) in index.iter_mut().zip(&self.points).filter(|(index, _)| **index == 0) {
            *index = points.len() as u32;
            points.push(*point);
        }
        let mut nodes = Vec::new();
        // Both sides of a face are cut alike because nodes keep their order.
        for block in &blocks {
            for cell in block.nodes.chunks_exact(block.kind.nodes) {
                match kind {
                    Kind::Tet4 => split::tetrahedra(cell, |tet| nodes.extend(tet.map(|n| index[n as usize]))),
                    // Gmsh has the last two middles the other way round.
                    Kind::Tet10 => nodes.extend([0, 1, 2, 3, 4, 5, 6, 7, 9, 8].map(|k| index[cell[k] as usize])),
                    Kind::Hex8 => nodes.extend(cell.iter().map(|&n| index[n as usize])),
                }
            }
        }
        let elements = Elements::new(kind, nodes);
        let most = MOST_FACES / kind.faces().len();
        if elements.len() >= most {
            let limit = format!("the {most} that a graph of METIS can have");
            let announced = elements.len() as u64;
            return Err(Problem::TooMany { section: "Elements", items: "elements", announced, limit });
        }
        let cells = blocks.iter().map(|b| b.cells).sum();
        let mut mesh = SolidMesh { points, elements, cells, surfaces: Vec::new() };
        check_elements(volume, &mesh)?;
        let neighbours = Neighbours::new(mesh.points.len(), &mesh.elements);
        if neighbours.overlapping > 0 {
            return Err(Problem::Overlapping { volume: volume.clone(), faces: neighbours.overlapping });
        }
        mesh.surfaces =
            Boundary { msh: self, volume, mesh: &mesh, neighbours: &neighbours, index: &index }.surfaces(surfaces)?;
        Ok(mesh)
    }

    /// Volumes that some physical group names, by name.
    pub fn volume_names(&self) -> BTreeSet<String> {
        self.group_names(3).into_keys().collect()
    }

    /// Cells of each physical group of a dimension, by its name, or its number if it has none.
    pub(super) fn group_names(&self, dimension: i32) -> BTreeMap<String, u64> {
        let mut names = BTreeMap::new();
        for block in self.blocks.iter().filter(|b| b.kind.dimension == dimension) {
            for name in block.groups.iter().map(|&tag| self.name(dimension, tag)) {
                *names.entry(name).or_default() += block.cells;
            }
        }
        names
    }

    fn name(&self, dimension: i32, tag: i32) -> String {
        let known = self.names.iter().find(|n| n.dimension == dimension && n.tag == tag);
        known.map_or_else(|| tag.to_string(), |n| n.name.clone())
    }

    /// Blocks of a physical group.
    pub(super) fn group(&self, dimension: i32, name: &str) -> impl Iterator<Item = &Block> {
        let of = move |b: &&Block| {
            b.kind.dimension == dimension && b.groups.iter().any(|&tag| self.name(dimension, tag) == name)
        };
        self.blocks.iter().filter(of)
    }

    fn refuse_untagged(&self) -> Result<(), Problem> {
        let volumes = || self.blocks.iter().filter(|b| b.kind.dimension == 3 && b.cells > 0);
        let all: u64 = volumes().map(|b| b.cells).sum();
        if all == 0 {
            return Err(Problem::NoVolumeCells);
        }
        let untagged = || volumes().filter(|b| b.groups.is_empty());
        let cells: u64 = untagged().map(|b| b.cells).sum();
        if cells == 0 {
            return Ok(());
        }
        let entities: BTreeSet<i32> = untagged().map(|b| b.entity).collect();
        let shown: Vec<String> = entities.iter().take(10).map(i32::to_string).collect();
        let entities = if entities.len() > 10 { format!("{}, ...", shown.join(", ")) } else { shown.join(", ") };
        let hint = if cells < all { ", or save named ones only with `Mesh.SaveAll = 0;`" } else { "" };
        Err(Problem::Untagged { cells, all, entities, hint })
    }

    fn choose(&self, volume: Option<&str>) -> Result<String, Problem> {
        let known = self.group_names(3);
        match volume {
            Some(name) if known.contains_key(name) => Ok(name.to_owned()),
            Some(name) => Err(Problem::NoVolume { name: name.to_owned(), known: listed(&known, "cells") }),
            None if known.len() == 1 => Ok(known.into_keys().next().expect("there is one")),
            None => Err(Problem::WhichVolume { count: known.len(), known: listed(&known, "cells") }),
        }
    }
}

/// Refuses elements without a positive volume.
fn check_elements(volume: &str, mesh: &SolidMesh) -> Result<(), Problem> {
    let Quality { elements, inverted, degenerate, first, .. } = Quality::of(mesh);
    let Some(near) = first else { return Ok(()) };
    let hint = if inverted == elements { ", or turn all cells inside out" } else { "" };
    Err(Problem::BadElements { volume: volume.to_owned(), elements, inverted, degenerate, near, hint })
}

/// Refuses cells that the kind of element cannot be made of.
fn refuse_others(volume: &str, kind: Kind, blocks: &[&Block]) -> Result<(), Problem> {
    let fits = |block: &Block| match kind {
        Kind::Tet4 => block.kind.linear,
        Kind::Tet10 | Kind::Hex8 => block.kind.dimension == 3 && block.kind.nodes == kind.nodes(),
    };
    let others: Vec<&&Block> = blocks.iter().filter(|block| !fits(block)).collect();
    let Some(first) = others.first() else { return Ok(()) };
    let cells = others.iter().map(|block| block.cells).sum();
    let (volume, found) = (volume.to_owned(), first.kind.name);
    Err(match kind {
        Kind::Hex8 if first.kind.linear => Problem::NoHexahedra { volume, cells, kind: found },
        Kind::Tet10 => Problem::NoQuadratic { volume, cells, kind: found },
        Kind::Tet4 | Kind::Hex8 => higher_order(format!("volume `{volume}`"), blocks.iter().copied()),
    })
}

/// Cells of higher order, counted.
pub(super) fn higher_order<'a>(what: String, blocks: impl Iterator<Item = &'a Block>) -> Problem {
    let curved: Vec<&Block> = blocks.filter(|b| !b.kind.linear).collect();
    let cells = curved.iter().map(|b| b.cells).sum();
    Problem::HigherOrder { what, cells, kind: curved.first().map_or("curved", |b| b.kind.name) }
}

/// Names and counts in words.
pub(super) fn listed(known: &BTreeMap<String, u64>, items: &str) -> String {
    if known.is_empty() {
        return "there are none".to_owned();
    }
    let each: Vec<String> = known.iter().map(|(name, count)| format!("`{name}` ({count} {items})")).collect();
    format!("there are {}", each.join(", "))
}

/// Faces that the graph of METIS can number, in 31 bits.
const MOST_FACES: usize = 1 << 31;
