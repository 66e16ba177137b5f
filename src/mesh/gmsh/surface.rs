//! Physical surfaces as faces on the boundary of a volume.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::Msh;
use super::error::Problem;
use super::groups::{higher_order, listed};
use crate::mesh::faces::{Neighbours, key};
use crate::mesh::solid::{NamedSurface, SolidMesh};
use crate::mesh::split;

/// The boundary of a volume, and the file that names parts of it.
pub(super) struct Boundary<'a> {
    pub msh: &'a Msh,
    /// Name of the volume.
    pub volume: &'a str,
    /// Its elements.
    pub mesh: &'a SolidMesh,
    pub neighbours: &'a Neighbours,
    /// From the file's nodes to the mesh's; `u32::MAX` for nodes of other volumes.
    pub index: &'a [u32],
}

/// What a physical surface has.
struct Surface {
    /// Faces whose nodes are all in the volume, with ascending nodes.
    faces: Vec<Vec<u32>>,
    /// All faces.
    all: u64,
}

impl Boundary<'_> {
    /// The part of each physical surface that is on the boundary, with the sense of the elements: Gmsh's surfaces have
    /// either.
    ///
    /// # Errors
    /// If a surface is missing, lies elsewhere, or inside the volume.
    pub fn surfaces(&self, names: &[&str]) -> Result<Vec<NamedSurface>, Problem> {
        let wanted = names.iter().map(|name| self.wanted(name)).collect::<Result<Vec<_>, _>>()?;
        let mut of_face: HashMap<&[u32], Vec<usize>> = HashMap::new();
        for (surface, Surface { faces, .. }) in wanted.iter().enumerate() {
            for face in faces {
                let surfaces = of_face.entry(face).or_default();
                // A file may have the same face several times.
                if surfaces.last() != Some(&surface) {
                    surfaces.push(surface);
                }
            }
        }
        let surfaces_of = |face: &[u32]| of_face.get(&key(face)[..]).into_iter().flatten().copied();
        let empty = |name: &&str| NamedSurface { name: name.to_string(), faces: Vec::new() };
        let mut result: Vec<_> = names.iter().map(empty).collect();
        for face in self.neighbours.outer(&self.mesh.elements) {
            surfaces_of(&face).for_each(|surface| result[surface].faces.push(face.clone()));
        }
        let mut inner = vec![0; names.len()];
        let inner_faces = self.neighbours.inner(&self.mesh.elements);
        inner_faces.flat_map(|face| surfaces_of(&face)).for_each(|surface| inner[surface] += 1);

        let volume = || self.volume.to_owned();
        for ((found, inner), Surface { all, .. }) in result.iter().zip(inner).zip(&wanted) {
            let (name, triangles) = (found.name.clone(), *all);
            if inner > 0 {
                return Err(Problem::InnerSurface { name, volume: volume(), inner, triangles });
            }
            if found.faces.is_empty() {
                return Err(Problem::ElsewhereSurface { name, triangles, volume: volume(), known: self.known() });
            }
        }
        Ok(result)
    }

    fn wanted(&self, name: &str) -> Result<Surface, Problem> {
        let surface = self.surface(name)?;
        if surface.all == 0 {
            let known = listed(&self.msh.group_names(2), "triangles or quadrangles");
            return Err(Problem::NoSurface { name: name.to_owned(), known });
        }
        Ok(surface)
    }

    fn surface(&self, name: &str) -> Result<Surface, Problem> {
        let mut surface = Surface { faces: Vec::new(), all: 0 };
        for block in self.msh.group(2, name) {
            if !block.kind.linear && block.kind.nodes != self.mesh.elements.kind().faces()[0].len() {
                return Err(higher_order(format!("surface `{name}`"), self.msh.group(2, name)));
            }
            let mut add = |face: &[u32]| {
                surface.all += 1;
                let local: Vec<u32> = face.iter().map(|&n| self.index[n as usize]).collect();
                if !local.contains(&u32::MAX) {
                    surface.faces.push(key(&local));
                }
            };
            for cell in block.nodes.chunks_exact(block.kind.nodes) {
                match self.mesh.elements.kind().gmsh().is_split() {
                    true => split::triangles(cell, |triangle| add(&triangle)),
                    false => add(cell),
                }
            }
        }
        Ok(surface)
    }

    /// Physical surfaces with triangles on the boundary.
    fn known(&self) -> String {
        let outer: HashSet<_> = self.neighbours.outer(&self.mesh.elements).map(|face| key(&face)).collect();
        let mut known = BTreeMap::new();
        for name in self.msh.group_names(2).into_keys() {
            let faces = self.surface(&name).map_or(Vec::new(), |surface| surface.faces);
            let count = faces.iter().filter(|face| outer.contains(*face)).count() as u64;
            if count > 0 {
                known.insert(name, count);
            }
        }
        listed(&known, "triangles")
    }
}
