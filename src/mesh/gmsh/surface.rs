//! Physical surfaces as faces on the boundary of a volume.

use std::collections::BTreeMap;

use super::groups::{higher_order, listed};
use super::numbers::Numbers;
use super::{Block, Msh, Problem};
use crate::comm::Comm;
use crate::comm::words::sum;
use crate::mesh::faces::key;
use crate::mesh::joints::Joints;
use crate::mesh::marked::forward;
use crate::mesh::portion::Portion;
use crate::mesh::solid::NamedSurface;
use crate::mesh::split;

/// The boundary of a volume, and the file that names parts of it.
pub(super) struct Boundary<'a> {
    pub comm: &'a dyn Comm,
    pub msh: &'a Msh,
    /// Name of the volume.
    pub volume: &'a str,
    /// Its elements.
    pub portion: &'a Portion,
    pub joints: &'a Joints,
    /// From the file's nodes to the body's.
    pub numbers: &'a Numbers<'a>,
}

/// Where the faces of surfaces are.
struct Faces {
    /// Own faces of each on the boundary.
    outer: Vec<Vec<Vec<u32>>>,
    /// Faces of each on the boundary and inside, of all ranks.
    counts: Vec<[u64; 2]>,
}

impl Boundary<'_> {
    /// The part of each physical surface that is on the boundary, with the sense of the elements: Gmsh's surfaces have
    /// either. Collective.
    ///
    /// # Errors
    /// If a surface is missing, lies elsewhere, or inside the volume.
    pub fn surfaces(&self, names: &[&str]) -> Result<Vec<NamedSurface>, Problem> {
        for name in names {
            if self.msh.group(2, name).all(|block| block.cells == 0) {
                let known = listed(&self.msh.group_names(2), "triangles or quadrangles");
                return Err(Problem::NoSurface { name: name.to_string(), known });
            }
            if !self.can_be_read(name) {
                return Err(higher_order(format!("surface `{name}`"), self.msh.group(2, name)));
            }
        }
        let Faces { outer, counts } = self.find(names);
        for (&name, [outer, inner]) in names.iter().zip(counts) {
            let triangles = self.msh.group(2, name).map(|block| self.per_cell(block) * block.cells).sum();
            let (name, volume) = (name.to_owned(), self.volume.to_owned());
            if inner > 0 {
                return Err(Problem::InnerSurface { name, volume, inner, triangles });
            }
            if outer == 0 {
                return Err(Problem::ElsewhereSurface { name, triangles, volume, known: self.known() });
            }
        }
        let named = |(name, faces): (&&str, _)| NamedSurface { name: name.to_string(), faces };
        Ok(names.iter().zip(outer).map(named).collect())
    }

    /// Whether cells of a surface can be faces of the elements.
    fn can_be_read(&self, name: &str) -> bool {
        let width = self.portion.elements.kind().faces()[0].len();
        self.msh.group(2, name).all(|block| block.kind.linear || block.kind.nodes == width)
    }

    /// Faces that a cell becomes.
    fn per_cell(&self, block: &Block) -> u64 {
        if self.portion.elements.kind().gmsh().is_split() { block.kind.nodes as u64 - 2 } else { 1 }
    }

    /// Looks for the faces of surfaces among those of the elements. Collective.
    fn find(&self, names: &[&str]) -> Faces {
        let kind = self.portion.elements.kind();
        let mut faces: Vec<(Vec<u32>, usize)> = Vec::new();
        for (surface, name) in names.iter().enumerate() {
            for cell in self.msh.group(2, name).flat_map(Block::own) {
                match kind.gmsh().is_split() {
                    true => split::triangles(cell, |triangle| faces.push((triangle.to_vec(), surface))),
                    false => faces.push((cell.to_vec(), surface)),
                }
            }
        }
        let mut used: Vec<u32> = faces.iter().flat_map(|(face, _)| face).copied().collect();
        used.sort_unstable();
        used.dedup();
        let (numbers, _) = self.numbers.of(&used);
        let number = |node: &u32| numbers[used.binary_search(node).expect("every node is listed")];
        let width = kind.faces()[0].len();
        faces.iter_mut().for_each(|(face, _)| *face = key(&face.iter().map(number).collect::<Vec<_>>()));
        faces.retain(|(face, _)| face.len() == width && !face.contains(&u32::MAX));
        let marked = forward(self.comm, &self.portion.nodes, width, &faces);
        let global = |(element, side): (usize, usize)| -> Vec<u32> {
            let face = self.portion.elements.face(element, side);
            face.iter().map(|&node| self.portion.nodes[node as usize]).collect()
        };
        let (mut outer, mut counts) = (vec![Vec::new(); names.len()], vec![0; 2 * names.len()]);
        for face in self.joints.outer(self.portion).map(global).filter(|_| !marked.is_empty()) {
            for &surface in marked.get(&key(&face)).into_iter().flatten() {
                outer[surface].push(face.clone());
                counts[2 * surface] += 1;
            }
        }
        for face in self.joints.inner(self.portion).map(global).filter(|_| !marked.is_empty()) {
            marked.get(&key(&face)).into_iter().flatten().for_each(|&surface| counts[2 * surface + 1] += 1);
        }
        Faces { outer, counts: sum(self.comm, counts).as_chunks().0.to_vec() }
    }

    /// Physical surfaces with triangles on the boundary. Collective.
    fn known(&self) -> String {
        let names: Vec<String> = self.msh.group_names(2).into_keys().filter(|name| self.can_be_read(name)).collect();
        let Faces { counts, .. } = self.find(&names.iter().map(|name| &name[..]).collect::<Vec<_>>());
        let known: BTreeMap<String, u64> =
            names.into_iter().zip(counts).map(|(name, [outer, _])| (name, outer)).filter(|known| known.1 > 0).collect();
        listed(&known, "triangles")
    }
}
