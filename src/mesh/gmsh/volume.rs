//! One body out of a mesh file: the elements of physical volumes, and physical surfaces on its boundary.

use std::collections::BTreeSet;

use super::error::Problem;
use super::groups::{higher_order, listed};
use super::surface::Boundary;
use super::{Block, Msh};
use crate::element::Kind;
use crate::mesh::faces::Neighbours;
use crate::mesh::quality::Quality;
use crate::mesh::whole::{self, Found};
use crate::mesh::{Elements, SolidMesh, split};

impl Msh {
    /// The physical volumes of these names (or numbers, if they have no name), or the only one there is, with these
    /// surfaces, as elements of a kind: cells are split into linear tetrahedra, and for others they must be what the kind
    /// is. Each volume is a region; elements come in the order of the file.
    ///
    /// # Errors
    /// If a volume or one of the surfaces is missing, volumes have a cell in common, elements cannot be computed with, or
    /// the mesh only looks whole.
    pub fn body(&self, volumes: &[&str], surfaces: &[&str], kind: Kind) -> Result<SolidMesh, Problem> {
        self.refuse_untagged()?;
        let volumes = self.choose(volumes)?;
        for volume in &volumes {
            refuse_others(volume, kind, &self.group(3, volume).collect::<Vec<_>>())?;
        }
        let blocks = self.blocks_of(&volumes)?;
        let volume = &volumes.join("` + `");
        self.refuse_repeated(&volumes, &blocks)?;

        let mut index = vec![u32::MAX; self.points.len()];
        blocks.iter().flat_map(|(b, _)| &b.nodes).for_each(|&n| index[n as usize] = 0);
        let mut points = Vec::new();
        for (index, point) in index.iter_mut().zip(&self.points).filter(|(index, _)| **index == 0) {
            *index = points.len() as u32;
            points.push(*point);
        }
        let (mut nodes, mut regions, gmsh) = (Vec::new(), Vec::new(), kind.gmsh());
        // Both sides of a face are cut alike because nodes keep their order.
        for (block, region) in &blocks {
            for cell in block.nodes.chunks_exact(block.kind.nodes) {
                match gmsh.is_split() {
                    true => split::tetrahedra(cell, |tet| nodes.extend(tet.map(|n| index[n as usize]))),
                    false => nodes.extend(gmsh.order.iter().map(|&k| index[cell[k] as usize])),
                }
            }
            if volumes.len() > 1 {
                regions.resize(nodes.len() / kind.nodes(), *region as u32);
            }
        }
        let elements = Elements::new(kind, nodes);
        let most = MOST_FACES / kind.faces().len();
        if elements.len() >= most {
            let limit = format!("the {most} whose faces can be counted");
            let announced = elements.len() as u64;
            return Err(Problem::TooMany { section: "Elements", items: "elements", announced, limit });
        }
        let cells = blocks.iter().map(|(b, _)| b.cells).sum();
        let mut mesh = SolidMesh { points, elements, cells, surfaces: Vec::new(), regions, pieces: Vec::new() };
        check_elements(volume, &mesh)?;
        let neighbours = Neighbours::new(mesh.points.len(), &mesh.elements);
        if let Some(node) = neighbours.overlaps_at {
            let (volume, faces, near) = (volume.clone(), neighbours.overlapping, mesh.points[node as usize]);
            return Err(Problem::Overlapping { volume, faces, near });
        }
        mesh.pieces = whole::pieces(&mesh, &neighbours).map_err(|found| not_whole(&volumes, found))?;
        mesh.surfaces =
            Boundary { msh: self, volume, mesh: &mesh, neighbours: &neighbours, index: &index }.surfaces(surfaces)?;
        Ok(mesh)
    }

    /// Blocks of physical volumes, each with the index of its volume.
    fn blocks_of(&self, volumes: &[String]) -> Result<Vec<(&Block, usize)>, Problem> {
        let mut found = Vec::new();
        for block in &self.blocks {
            let mut of = (0..volumes.len()).filter(|&volume| self.is_in(block, 3, &volumes[volume]));
            let Some(first) = of.next() else { continue };
            if let Some(second) = of.next() {
                let [first, second] = [first, second].map(|volume| volumes[volume].clone());
                return Err(Problem::Shared { first, second, entity: block.entity, cells: block.cells });
            }
            found.push((block, first));
        }
        Ok(found)
    }

    /// Refuses cells that have a node twice.
    fn refuse_repeated(&self, volumes: &[String], blocks: &[(&Block, usize)]) -> Result<(), Problem> {
        let (mut count, mut first) = (0, None);
        for (block, volume) in blocks {
            for cell in block.nodes.chunks_exact(block.kind.nodes) {
                if let Some(&node) = (1..cell.len()).find(|&k| cell[..k].contains(&cell[k])).map(|k| &cell[k]) {
                    count += 1;
                    first.get_or_insert((block.kind.name, volumes[*volume].clone(), self.points[node as usize]));
                }
            }
        }
        let refused = |(kind, volume, near)| Err(Problem::Repeated { volume, cells: count, kind, near });
        first.map_or(Ok(()), refused)
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

    fn choose(&self, volumes: &[&str]) -> Result<Vec<String>, Problem> {
        let known = self.group_names(3);
        if let Some(name) = volumes.iter().find(|name| !known.contains_key(**name)) {
            return Err(Problem::NoVolume { name: name.to_string(), known: listed(&known, "cells") });
        }
        match volumes {
            [] if known.len() == 1 => Ok(known.into_keys().collect()),
            [] => Err(Problem::WhichVolume { count: known.len(), known: listed(&known, "cells") }),
            _ => Ok(volumes.iter().map(|name| name.to_string()).collect()),
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

/// What only looks whole, with the names of its volumes.
fn not_whole(volumes: &[String], Found { flaw, near, regions: [one, other] }: Found) -> Problem {
    let volume = if one == other {
        format!("volume `{}`", volumes[one])
    } else {
        format!("volumes `{}` and `{}`", volumes[one.min(other)], volumes[one.max(other)])
    };
    Problem::NotWhole { volume, near, flaw }
}

/// Refuses cells that the kind of element cannot be made of.
fn refuse_others(volume: &str, kind: Kind, blocks: &[&Block]) -> Result<(), Problem> {
    let gmsh = kind.gmsh();
    let fits = |block: &Block| if gmsh.is_split() { block.kind.linear } else { block.kind.number == gmsh.cell };
    let others: Vec<&&Block> = blocks.iter().filter(|block| !fits(block)).collect();
    let Some(first) = others.first() else { return Ok(()) };
    let cells = others.iter().map(|block| block.cells).sum();
    Err(match gmsh.needs {
        Some(needs) if first.kind.linear || kind.degree() > 1 => {
            let volume = volume.to_owned();
            Problem::OtherCells { volume, cells, kind: first.kind.name, element: kind.name(), needs }
        }
        _ => higher_order(format!("volume `{volume}`"), blocks.iter().copied()),
    })
}

/// Faces that can be counted, in 31 bits.
const MOST_FACES: usize = 1 << 31;
