//! One body out of a mesh file: the elements of physical volumes, and physical surfaces on its boundary.

use std::collections::BTreeSet;

use super::error::Problem;
use super::groups::{higher_order, listed};
use super::numbers::Numbers;
use super::surface::Boundary;
use super::{Block, Msh};
use crate::comm::Comm;
use crate::comm::words::{least, sum};
use crate::element::Kind;
use crate::mesh::joints::Joints;
use crate::mesh::portion::Portion;
use crate::mesh::quality::Quality;
use crate::mesh::solid::Counts;
use crate::mesh::whole::{self, Found};
use crate::mesh::{Elements, SolidMesh, split};

impl Msh {
    /// The physical volumes of these names (or numbers, if they have no name), or the only one there is, with these
    /// surfaces, as elements of a kind: cells are split into linear tetrahedra, and for others they must be what the kind
    /// is. Each volume is a region; elements and nodes are numbered in the order of the file. Each rank gets a piece of a
    /// space-filling curve. Collective.
    ///
    /// # Errors
    /// If a volume or one of the surfaces is missing, volumes have a cell in common, elements cannot be computed with, or
    /// the mesh only looks whole; the same on every rank.
    pub fn body(&self, comm: &dyn Comm, volumes: &[&str], surfaces: &[&str], kind: Kind) -> Result<SolidMesh, Problem> {
        self.refuse_untagged()?;
        let volumes = self.choose(volumes)?;
        for volume in &volumes {
            refuse_others(volume, kind, &self.group(3, volume).collect::<Vec<_>>())?;
        }
        let blocks = self.blocks_of(&volumes)?;
        let volume = &volumes.join("` + `");
        self.refuse_repeated(comm, &volumes, &blocks)?;
        let elements = blocks.iter().map(|(block, _)| per_cell(block, kind) * block.cells).sum();
        let most = (MOST_FACES / kind.faces().len()) as u64;
        if elements >= most {
            let limit = format!("the {most} whose faces can be counted");
            return Err(Problem::TooMany { section: "Elements", items: "elements", announced: elements, limit });
        }
        let (portion, numbers) = self.portion(comm, &blocks, kind);
        check_elements(volume, Quality::of(comm, &portion))?;
        let portion = portion.along_curve(comm, elements);
        let joints = Joints::new(comm, &portion);
        if let Some((faces, node)) = joints.overlapping {
            let own = portion.nodes.binary_search(&node).ok();
            let point = least(comm, own.map(|k| portion.points[k].map(f64::to_bits)));
            let near = point.expect("some rank has the node").map(f64::from_bits);
            return Err(Problem::Overlapping { volume: volume.clone(), faces, near });
        }
        let (pieces, piece_count) =
            whole::pieces(comm, &portion, &joints).map_err(|found| not_whole(&volumes, found))?;
        let boundary = Boundary { comm, msh: self, volume, portion: &portion, joints: &joints, numbers: &numbers };
        let surfaces = boundary.surfaces(surfaces)?;
        let cells = blocks.iter().map(|(b, _)| b.cells).sum();
        let counts = Counts { nodes: numbers.total, cells, elements };
        Ok(SolidMesh { portion, pieces, surfaces, piece_count, counts })
    }

    /// The elements in this rank's share of the cells. Collective.
    fn portion<'a>(&'a self, comm: &'a dyn Comm, blocks: &[(&Block, usize)], kind: Kind) -> (Portion, Numbers<'a>) {
        let (mut of_elements, mut wholes, gmsh) = (Vec::new(), Vec::new(), kind.gmsh());
        let (mut first, mut before) = (None, 0);
        // Both sides of a face are cut alike because nodes keep their order.
        for (block, region) in blocks {
            if !block.nodes.is_empty() {
                first.get_or_insert(before + per_cell(block, kind) * block.first);
            }
            before += per_cell(block, kind) * block.cells;
            for cell in block.own() {
                match gmsh.is_split() {
                    true => split::tetrahedra(cell, |tet| of_elements.extend(tet)),
                    false => of_elements.extend(gmsh.order.iter().map(|&k| cell[k])),
                }
            }
            wholes.resize(of_elements.len() / kind.nodes(), *region as u32);
        }
        let mut used = of_elements.clone();
        used.sort_unstable();
        used.dedup();
        let numbers = Numbers::new(comm, self, &used);
        let (nodes, points) = numbers.of(&used);
        let local = |node: &u32| used.binary_search(node).expect("every node is listed") as u32;
        of_elements.iter_mut().for_each(|node| *node = local(node));
        let first = first.unwrap_or_default() as u32;
        let (elements, part) = (Elements::new(kind, of_elements), vec![0; wholes.len()]);
        let own = (first..).take(elements.len()).collect();
        (Portion { numbers: own, elements, wholes, part, nodes, points }, numbers)
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
    fn refuse_repeated(&self, comm: &dyn Comm, volumes: &[String], blocks: &[(&Block, usize)]) -> Result<(), Problem> {
        let (mut count, mut first) = (0, None);
        for (k, (block, _)) in (0..).zip(blocks) {
            for (cell, nodes) in (block.first..).zip(block.own()) {
                if let Some(&node) = (1..nodes.len()).find(|&k| nodes[..k].contains(&nodes[k])).map(|k| &nodes[k]) {
                    count += 1;
                    first.get_or_insert([k, cell, node.into()]);
                }
            }
        }
        let Some([block, _, node]) = least(comm, first) else { return Ok(()) };
        let (block, volume) = blocks[block as usize];
        let (cells, near) = (sum(comm, vec![count])[0], self.point(comm, node));
        Err(Problem::Repeated { volume: volumes[volume].clone(), cells, kind: block.kind.name, near })
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

/// Elements that a cell becomes.
fn per_cell(block: &Block, kind: Kind) -> u64 {
    if kind.gmsh().is_split() { split::tetrahedra_of(block.kind.nodes) } else { 1 }
}

/// Refuses elements without a positive volume.
fn check_elements(volume: &str, quality: Quality) -> Result<(), Problem> {
    let Quality { elements, inverted, degenerate, first, .. } = quality;
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
