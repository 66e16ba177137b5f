//! Meshes as fine as an error asks for.
//!
//! A scene begins on few elements ([`start`]). When it is solved there, the [`error`] is estimated; [`aim`] says how much of it
//! the next mesh is to leave, and [`marking`] names the elements that have most of it. These are bisected
//! ([`crate::mesh::bisection`]), and the displacement passes to the finer meshes. What was bisected is kept: a run that goes on
//! makes the same meshes from the first ones again.

pub mod aim;
pub mod error;
pub mod marking;
pub mod start;
#[cfg(test)]
mod tests;

use std::collections::HashSet;
use std::ops::Range;

use super::cascade::{displacements, fetch};
use super::{Solved, fields};
use crate::comm::Comm;
use crate::comm::words::share;
use crate::decomposition::BodyMesh;
use crate::feti::Torn;
use crate::mesh::SolidMesh;
use crate::mesh::bisection::{Refinable, Round};
use crate::mesh::form::Forms;
use crate::model::Discrete;
use crate::model::meshes::{MeshError, Meshes, mapped};
use crate::record::summary::Summary;
use crate::results::checkpoint::Checkpoint;
use crate::results::piece::Field;
use crate::scene::{self, ErrorOf, Scene};

/// Elements to be bisected, body by body: their corners within the body (ascending), and how often.
pub type Wanted = Vec<Vec<(Vec<u32>, usize)>>;

/// The meshes of all bodies.
#[derive(Clone)]
pub struct Adaptive {
    bodies: Vec<Refinable>,
    /// What the user should know of them.
    pub warnings: Vec<String>,
    /// What was made of their surfaces, in words.
    pub notes: Vec<String>,
    /// What this rank named for each refinement.
    past: Vec<Wanted>,
}

impl Adaptive {
    /// The first meshes of a scene, with the elements that mesh files may have ([`start::Start`]). Collective.
    ///
    /// # Errors
    /// If there are none.
    pub fn new(scene: &Scene, [given, linear]: &[Scene; 2], comm: &dyn Comm) -> Result<Self, MeshError> {
        let made = match Meshes::new(given, comm) {
            Err(MeshError::Bad(reason)) if linear != given => {
                Meshes::new(linear, comm).map_err(|_| MeshError::Bad(reason))
            }
            made => made,
        };
        let Meshes { solids, warnings, .. } = made?;
        let of = |(body, mesh): (&scene::Body, &SolidMesh)| {
            let forms = match (mapped(&body.shape), body.gmsh()) {
                (Some(mapped), _) => mapped.forms(comm, mesh),
                (None, Some(gmsh)) if !gmsh.faceted => Forms::found(comm, mesh),
                _ => Forms::default(),
            };
            Refinable::new(comm, mesh, forms, body.element)
        };
        let bodies: Vec<Refinable> = scene.body.values().zip(solids.values()).map(of).collect();
        let from_file = scene.body.iter().zip(&bodies).filter(|((_, body), _)| body.gmsh().is_some());
        let notes = from_file.flat_map(|((name, _), mesh)| notes(name, mesh.round())).collect();
        Ok(Self { bodies, warnings, notes, past: Vec::new() })
    }

    /// This rank's parts of the meshes.
    pub fn meshes(&self, scene: &Scene) -> Meshes {
        let solids = self.bodies.iter().map(Refinable::mesh).enumerate().collect();
        Meshes { warnings: self.warnings.clone(), ..Meshes::of(scene, solids) }
    }

    /// Unknowns: three a node.
    pub fn unknowns(&self) -> u64 {
        3 * self.bodies.iter().map(|mesh| mesh.counts().nodes).sum::<u64>()
    }

    /// Bisects elements; nodes take a displacement with them, which is of the meshes of `discrete`. Collective.
    pub fn refine(&mut self, comm: &dyn Comm, (discrete, u): (&Discrete, &Torn), wanted: Wanted) {
        let needed =
            |(mesh, body): (&Refinable, &BodyMesh)| mesh.nodes().map(|node| global(body, node)).collect::<Vec<_>>();
        let needed: HashSet<u64> = self.bodies.iter().zip(&discrete.bodies).flat_map(needed).collect();
        let known = fetch(comm, displacements(&discrete.decomposition.subdomains, u), needed);
        for (mesh, body) in self.bodies.iter_mut().zip(&discrete.bodies) {
            mesh.displace(|node| known[&global(body, node)]);
        }
        self.bisect(comm, wanted);
    }

    fn bisect(&mut self, comm: &dyn Comm, wanted: Wanted) {
        self.bodies.iter_mut().zip(&wanted).for_each(|(mesh, wanted)| mesh.refine(comm, wanted));
        self.past.push(wanted);
    }

    /// The displacement that the nodes have, torn. Collective.
    pub fn displacement(&self, comm: &dyn Comm, discrete: &Discrete) -> Torn {
        let subdomains = &discrete.decomposition.subdomains;
        let needed = subdomains.iter().flat_map(|s| s.nodes.iter().copied()).collect();
        let known = self.bodies.iter().zip(&discrete.bodies);
        let known = known.flat_map(|(mesh, body)| mesh.nodes().map(|node| (global(body, node), mesh.at(node)[1])));
        let known = fetch(comm, known, needed);
        subdomains.iter().map(|s| s.nodes.iter().flat_map(|node| known[node]).collect()).collect()
    }

    /// What was bisected so far, as arrays of a checkpoint.
    pub fn arrays(&self) -> Vec<Field> {
        let row = |(corners, times): &(Vec<u32>, usize)| {
            corners.iter().map(|&corner| i64::from(corner)).chain([*times as i64]).collect::<Vec<_>>()
        };
        let field = |refinement: usize, body: usize, of: &Vec<(Vec<u32>, usize)>| Field {
            components: ROW,
            ..Field::integer(&path(refinement, body), of.iter().flat_map(row).collect())
        };
        let of_refinement = |(refinement, wanted): (usize, &Wanted)| {
            wanted.iter().enumerate().map(|(body, of)| field(refinement, body, of)).collect::<Vec<_>>()
        };
        self.past.iter().enumerate().flat_map(of_refinement).collect()
    }

    /// Refines the first meshes as often as a checkpoint says. Collective.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn repeat(&mut self, comm: &dyn Comm, checkpoint: &Checkpoint, refinements: usize) -> Result<(), String> {
        for refinement in 0..refinements {
            let of_body = |body: usize| {
                let path = path(refinement, body);
                let own = share(checkpoint.arrays().count(&path)?, comm);
                let rows: Vec<i64> = checkpoint.arrays().read(&path, own.start, own.end - own.start)?;
                let row =
                    |row: &[i64]| (row[..ROW - 1].iter().map(|&corner| corner as u32).collect(), row[ROW - 1] as usize);
                Ok(rows.chunks_exact(ROW).map(row).collect())
            };
            let wanted = (0..self.bodies.len()).map(of_body).collect::<Result<_, String>>()?;
            self.bisect(comm, wanted);
        }
        Ok(())
    }
}

/// The increments that count for errors: all. Equilibria on the way to a limit load compare where they did the same work: at the end of
/// the first mesh, which is where others begin.
pub fn counting(summary: &Summary, is_first: bool) -> Range<usize> {
    let all = summary.steps.len();
    match summary.limit_load {
        None => 0..all,
        Some(_) if is_first => all - 1..all,
        Some(_) => 0..1,
    }
}

/// What each element of each of this rank's subdomains has of the error: an energy, or a square; the largest of some increments.
pub fn parts(discrete: &Discrete, solved: &Solved, of: &ErrorOf, increments: &Range<usize>) -> Vec<Vec<f64>> {
    let largest = |name| fields::largest(&solved.piece, increments, &discrete.decomposition.subdomains, name);
    match of {
        ErrorOf::Energy => largest(fields::ENERGY_ERROR),
        ErrorOf::Goal(_) => largest(fields::GOAL_ERROR),
        ErrorOf::Stress => {
            let squares = |parts: Vec<f64>| parts.into_iter().map(|part| part * part).collect();
            largest(fields::STRESS_ERROR).into_iter().map(squares).collect()
        }
    }
}

/// What is said of the round forms that were found among the faces of a body, and of the elements that cannot follow them.
fn notes(body: &str, round: &Round) -> Vec<String> {
    let found = format!("spheres, cones or tori that finer meshes follow (not with body.{body}.gmsh.faceted = true)");
    let spoilt =
        "elements with straight edges there, which curved ones would turn inside out; a finer mesh avoids that";
    let text = |(what, count): (&str, u64)| (count > 0).then(|| format!("body {body}: {what}: {count}"));
    [(&found[..], round.count() as u64), (spoilt, round.spoilt)].into_iter().filter_map(text).collect()
}

/// Numbers of a bisected element in a checkpoint: its corners, and how often.
const ROW: usize = 5;

fn path(refinement: usize, body: usize) -> String {
    format!("refined/{refinement}-{body}")
}

/// The number of a node among those of all bodies.
fn global(body: &BodyMesh, node: u32) -> u64 {
    body.first_node + u64::from(node)
}
