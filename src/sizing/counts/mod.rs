//! How large a scene is, from counts: nothing is built that grows with its meshes.
//!
//! Exact are cells, elements and nodes of structured bodies, rows of supports, and what comes of cutting bricks into boxes:
//! a box of `c` cells has `(d c_x + 1) (d c_y + 1) (d c_z + 1)` nodes with elements of degree `d`, a node with `m` copies
//! `3 (m - 1)` gluing rows, so all of them are as many as the unknowns of all boxes are more than those of the bodies. What parts
//! makes of a body is estimated as if it were cut into about as many boxes, as near to cubes as the body lets them;
//! [`Sizes::estimated`] names what is. Rows of contact are counted by [`contacts`].

pub mod contacts;
mod local;
mod parts;
mod structured;
#[cfg(test)]
mod tests;

use self::parts::Parts;
use self::structured::Structured;
use super::held::kind;
use super::memory::{Held, Lengths, Memory, Numbers, megabytes};
use crate::decomposition::{BodyMesh, Cut, bricks, tetrahedra};
use crate::element::Kind;
use crate::model::discrete::{can_be_cut, cut, groups, is_thin};
use crate::model::meshes;
use crate::model::meshes::MeshError;
use crate::record::counts::Sizes;
use crate::scene::{Axis, Body, Contact, Scene, SurfaceName};

/// A scene's bodies, counted.
pub struct Counted<'a> {
    scene: &'a Scene,
    bodies: Vec<BodyMesh>,
    shapes: Vec<Structured<'a>>,
    cut: Cut,
}

/// What cutting into parts takes for each element, in bytes.
const CUTTING: f64 = 250.0;

/// What is estimated of compact parts.
const OF_PARTS: [&str; 7] =
    ["subdomains", "clusters", "coarse_blocks", "contact_subdomains", "primal_dofs", "gluing_rows", "dual_dofs"];

impl<'a> Counted<'a> {
    /// Counts the bodies of a scene; `None` if there are meshes from files.
    pub fn new(scene: &'a Scene) -> Option<Self> {
        let shapes = scene.body.values().map(Structured::new).collect::<Option<Vec<_>>>()?;
        let bodies = meshes::of_counts(scene, shapes.iter().map(Structured::counts));
        Some(Self::of_shapes(scene, bodies, shapes))
    }

    /// The same for meshes from files, once they are read; `None` if there are none.
    pub fn of_read(scene: &'a Scene, bodies: &[BodyMesh]) -> Option<Self> {
        let shape = |(body, mesh): (&'a Body, &BodyMesh)| {
            Structured::new(body).unwrap_or_else(|| Structured::of_mesh(body, mesh.counts()))
        };
        let shapes = scene.body.values().zip(bodies).map(shape).collect();
        scene.body.values().any(|body| body.gmsh().is_some()).then(|| Self::of_shapes(scene, bodies.to_vec(), shapes))
    }

    /// The same for meshes whatever the scene's are.
    pub fn of_meshes(scene: &'a Scene, bodies: &[BodyMesh]) -> Self {
        let shape = |(body, mesh): (&'a Body, &BodyMesh)| Structured::of_mesh(body, mesh.counts());
        Self::of_shapes(scene, bodies.to_vec(), scene.body.values().zip(bodies).map(shape).collect())
    }

    fn of_shapes(scene: &'a Scene, bodies: Vec<BodyMesh>, shapes: Vec<Structured<'a>>) -> Self {
        let cut = cut(&scene.decomposition.method, &bodies);
        Self { scene, bodies, shapes, cut }
    }

    /// As many linear tetrahedra as would take the work of the scene's elements.
    pub fn tetrahedra(&self) -> u64 {
        tetrahedra(&self.bodies)
    }

    /// Refuses what cannot be cut.
    ///
    /// # Errors
    /// If there is more than can be counted.
    pub fn can_be_cut(&self) -> Result<(), MeshError> {
        can_be_cut(self.scene, &self.bodies, self.cut)
    }

    /// All sizes but those of contact.
    pub fn sizes(&self) -> Sizes {
        let mut sizes = Sizes::default();
        for (body, parts) in self.bodies.iter().zip(self.parts()) {
            let counts = body.counts();
            for (sum, part) in [
                (&mut sizes.nodes, counts.nodes),
                (&mut sizes.cells, counts.cells),
                (&mut sizes.elements, counts.elements),
                (&mut sizes.subdomains, parts.count),
                (&mut sizes.clusters, parts.clusters),
                (&mut sizes.coarse_blocks, parts.coarse_blocks),
                (&mut sizes.contact_subdomains, parts.touching),
                (&mut sizes.primal_dofs, parts.unknowns),
                (&mut sizes.gluing_rows, parts.unknowns - 3 * counts.nodes),
            ] {
                *sum = sum.saturating_add(part);
            }
        }
        sizes.dirichlet_rows = self.supported();
        sizes.dual_dofs = sizes.gluing_rows.saturating_add(sizes.dirichlet_rows);
        if let Cut::Parts(_) = self.cut {
            sizes.estimated = OF_PARTS.map(String::from).to_vec();
        }
        sizes
    }

    /// What solving takes.
    pub fn memory(&self) -> Memory {
        let (mut numbers, mut subdomains, mut coarse_blocks, mut largest) = (Numbers::default(), 0.0, 0.0, 0.0_f64);
        for parts in self.parts() {
            numbers += parts.numbers;
            numbers += Numbers::of_slots(parts.slots);
            subdomains += parts.count as f64;
            coarse_blocks += parts.coarse_blocks as f64;
            largest = largest.max(parts.factor);
        }
        let conditions = self.conditions();
        // Of nodes with one copy for the most part, on both sides.
        numbers += Numbers::of_slots(self.supported() as f64 + 3.0 * conditions.iter().sum::<f64>());
        let is_cut_at_once = |body: &&BodyMesh| matches!(self.cut, Cut::Parts(_)) || body.brick().is_none();
        let elements = self.bodies.iter().filter(is_cut_at_once).map(|body| body.counts().elements as f64);
        let surfaces = self.scene.contact.values().flat_map(Contact::surfaces).count() as f64;
        let held = Held { numbers, subdomains, coarse_blocks, conditions, surfaces, largest };
        Memory { items: held.items(), numbers, cutting_mb: megabytes(CUTTING * elements.sum::<f64>()) }
    }

    /// Rows of all supports.
    fn supported(&self) -> u64 {
        let on = |(name, shape): (&String, &Structured)| -> u64 {
            let fixed = |axis: &Axis| {
                let of_body = self.scene.support.values().filter(|s| s.surface.body == *name && s.fix.contains(axis));
                shape.on(&of_body.map(|s| &s.surface.surface[..]).collect::<Vec<_>>())
            };
            Axis::ALL.iter().map(fixed).sum()
        };
        self.scene.body.keys().zip(&self.shapes).map(on).fold(0, u64::saturating_add)
    }

    /// Most conditions that contacts can have, by their [`kind`].
    fn conditions(&self) -> [f64; 3] {
        let mut conditions = [0.0; 3];
        for contact in self.scene.contact.values() {
            let is_rigid = contact.surfaces().nth(1).is_none();
            let meshes_match = is_rigid || contacts::count(self.scene, contact).is_some();
            let count = contact.surfaces().next().map_or(0.0, |slave| self.nodes_on(slave) as f64);
            conditions[kind(self.scene, contact, meshes_match, count)] += count;
        }
        conditions
    }

    /// Nodes of a surface.
    pub fn nodes_on(&self, surface: &SurfaceName) -> u64 {
        let body = self.scene.body.keys().position(|name| *name == surface.body);
        body.map_or(0, |body| self.shapes[body].on(&[&surface.surface]))
    }

    /// Surfaces of a body that are in contact.
    fn touching(&self, body: &str) -> Vec<&str> {
        let surfaces = self.scene.contact.values().flat_map(Contact::surfaces);
        surfaces.filter(|surface| surface.body == body).map(|surface| &surface.surface[..]).collect()
    }

    /// The parts of each body.
    fn parts(&self) -> Vec<Parts> {
        let all = self.tetrahedra();
        let bodies = || self.scene.body.keys().zip(&self.bodies).zip(&self.shapes);
        let groups = |subdomains: usize| groups(self.scene, is_thin(&self.bodies, self.cut), subdomains, all);
        match self.cut {
            Cut::Bricks(cells) => {
                let count = self.bodies.iter().map(|body| bricks::count(body, cells)).fold(0, usize::saturating_add);
                let groups = groups(count);
                // Boxes of one kind of elements are alike.
                let mut known: Vec<(Kind, Lengths)> = Vec::new();
                let mut lengths = |kind: Kind| match known.iter().find(|(of, _)| *of == kind) {
                    Some((_, lengths)) => *lengths,
                    None => {
                        known.push((kind, local::of_box(kind, cells)));
                        known[known.len() - 1].1
                    }
                };
                let of = |((name, body), shape): ((&String, &BodyMesh), &Structured)| {
                    let touching = shape.boxes_on(cells, &self.touching(name));
                    Parts::boxes(self.scene, body, (cells, lengths(body.kind)), &groups, touching)
                };
                bodies().map(of).collect()
            }
            Cut::Parts(parts) => {
                let groups = groups(parts);
                let of = |((name, body), shape): ((&String, &BodyMesh), &Structured)| {
                    let share = tetrahedra(std::slice::from_ref(body)) as f64 / all as f64;
                    let parts = (parts as f64 * share).max(1.0);
                    let touching = shape.on(&self.touching(name));
                    Parts::pieces(self.scene, body, shape.extent(), (parts, &groups), touching as f64)
                };
                bodies().map(of).collect()
            }
        }
    }
}
