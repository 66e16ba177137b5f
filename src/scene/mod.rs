//! The scene: everything a user says about a study, as plain data read from TOML.
//!
//! Reading goes: text -> value tree -> `--set` overrides -> typed [`Scene`] -> refinement by level -> checks.
//! What leaves [`Scene::load`] is consistent, so later stages need not ask again whether a body exists or a modulus is
//! positive. Numbers carry no units: any consistent system does, and `units` is only echoed.
//!
//! Not here: meshes, geometry beyond counting cells, numerics. This room imports no other.

mod body;
mod changes;
mod check;
mod coarser;
mod contact;
mod decomposition;
mod error;
mod goal;
mod held;
mod idle;
mod initial;
pub mod library;
mod limit;
mod load;
mod mapped;
mod moved;
mod overrides;
mod read;
mod require;
mod solver;
mod step;
mod surface;
mod volumes;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::material::{Law, Material};

pub use body::{Axis, Body, Brick, Gmsh, Rotation, Shape};
pub use changes::changes;
pub use contact::{Contact, Friction, Obstacle, Sides};
pub use decomposition::{Decomposition, Groups, Method, PAPER_CELLS};
pub use error::{Fault, Place, SceneError};
pub use goal::{Direction, ErrorOf, Goal};
pub use held::Held;
pub use initial::Initial;
pub use limit::Limit;
pub use load::Load;
pub use mapped::{Cylinder, Grid, Sphere};
pub use moved::Moved;
pub use overrides::{concerns, recut, well_formed};
pub use solver::{Precision, Preconditioner, Qp, Solver};
pub use step::Step;
pub use surface::{Face, Support, SurfaceError, SurfaceName};
pub use volumes::{Materials, Volumes};

/// A study: bodies, what holds and loads them, where they touch, how to cut and how to solve.
///
/// Names are the user's; the maps are ordered by name, which is the order of bodies everywhere else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// One line for headings.
    pub title: String,
    /// The unit system in words, echoed in results and never interpreted.
    pub units: String,
    /// Materials by name.
    pub material: BTreeMap<String, Material>,
    /// Bodies by name.
    pub body: BTreeMap<String, Body>,
    /// Prescribed displacements by name.
    pub support: BTreeMap<String, Support>,
    /// Tractions, pressures and body forces by name; those at one place add up.
    pub load: BTreeMap<String, Load>,
    /// Contacts by name.
    pub contact: BTreeMap<String, Contact>,
    /// The state to start from; absent: rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<Initial>,
    /// The load history as given; see [`Scene::steps`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub step: Vec<Step>,
    /// The limit load to be found, instead of a history.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// How bodies are cut into subdomains.
    pub decomposition: Decomposition,
    /// Methods, tolerances and limits.
    pub solver: Solver,
    /// Where the scene comes from: relative paths of mesh files begin here.
    #[serde(skip)]
    pub directory: PathBuf,
}

impl Scene {
    /// The scene of this built-in name or file, with `sets` (each `dotted.path=value`) applied and the cells per edge
    /// of every body that is not from a mesh file multiplied by `level`.
    ///
    /// # Errors
    /// An unknown name, an unreadable file, bad TOML, an override that does not fit, or a failed check, with its place.
    pub fn load(name_or_path: &str, level: usize, sets: &[String]) -> Result<Scene, SceneError> {
        let (text, origin) = Scene::find(name_or_path)?;
        Scene::from_text(&text, &origin, level, sets)
    }

    /// The TOML of a built-in scene or a file, and how messages call it.
    ///
    /// # Errors
    /// An unknown name, an unreadable file, or one that is no text.
    pub fn find(name_or_path: &str) -> Result<(String, String), SceneError> {
        if let Some(text) = library::text(name_or_path) {
            return Ok((text.to_owned(), format!("built-in scene {name_or_path}")));
        }
        let path = Path::new(name_or_path);
        let means_a_file = path.components().count() > 1 || path.extension().is_some() || path.exists();
        if !means_a_file {
            let known = library::names().collect::<Vec<_>>().join(", ");
            return Err(SceneError::UnknownScene { name: name_or_path.to_owned(), known });
        }
        let bytes = std::fs::read(path).map_err(|source| SceneError::Read { path: name_or_path.to_owned(), source })?;
        Ok((read::text(bytes, name_or_path)?, name_or_path.to_owned()))
    }

    /// As [`Scene::load`] for TOML that is already in memory; `origin` names it in messages, and mesh files are sought
    /// beside it.
    ///
    /// # Errors
    /// As [`Scene::load`], but for reading.
    pub fn from_text(text: &str, origin: &str, level: usize, sets: &[String]) -> Result<Scene, SceneError> {
        if level == 0 {
            return Err(SceneError::Level);
        }
        let mut scene = read::scene(text, origin, sets)?;
        scene.directory = Path::new(origin).parent().map(Path::to_path_buf).unwrap_or_default();
        for (name, body) in &mut scene.body {
            match &mut body.shape {
                Shape::Brick(brick) => brick.refine(level),
                Shape::Sphere(sphere) => sphere.refine(level),
                Shape::Cylinder(cylinder) => cylinder.refine(level),
                Shape::Grid(grid) => grid.refine(level),
                Shape::Gmsh(_) if level > 1 => return Err(SceneError::LevelOfMesh { level, body: name.clone() }),
                Shape::Gmsh(_) => {}
            }
        }
        scene.settle_surfaces();
        match check::scene(&scene) {
            Ok(()) => Ok(scene),
            Err(fault) => Err(SceneError::Check { place: read::place(text, origin, sets, &fault.key), fault }),
        }
    }

    fn settle_surfaces(&mut self) {
        let supports = self.support.values_mut().map(|s| &mut s.surface);
        let loads = self.load.values_mut().filter_map(Load::surface_mut);
        let contacts = self.contact.values_mut().flat_map(Contact::surfaces_mut);
        supports.chain(loads).chain(contacts).for_each(|surface| surface.settle(self.body.keys()));
    }

    /// The effective scene as TOML: level and overrides included, defaults spelled out. Reads back (at level 1) to an
    /// equal scene.
    ///
    /// # Panics
    /// If a count exceeds TOML's integers (2^63), which no checked scene does.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("the counts of a checked scene fit TOML's integers")
    }

    /// The load history: one step to the full loads if the scene gives none.
    pub fn steps(&self) -> &[Step] {
        match self.step.is_empty() {
            false => &self.step,
            // Overlaps and prescribed displacements are there from the beginning: half of the loads is less only where there are loads.
            true if self.has_limit_load() && !self.load.is_empty() => &step::AT_MOST,
            true => &step::AT_ONCE,
        }
    }

    /// Whether a material flows without hardening, so that there are loads without an equilibrium.
    pub fn has_limit_load(&self) -> bool {
        self.material.values().any(Law::has_limit)
    }

    /// Surfaces that supports, loads and contacts name, with repetitions.
    pub fn surfaces(&self) -> impl Iterator<Item = &SurfaceName> {
        let supports = self.support.values().map(|s| &s.surface);
        let loads = self.load.values().filter_map(Load::surface);
        supports.chain(loads).chain(self.contact.values().flat_map(Contact::surfaces))
    }

    /// Whether every body is a brick: only bricks have coarser levels that a solution can be passed on from.
    pub fn is_of_bricks(&self) -> bool {
        self.body.values().all(|body| body.brick().is_some())
    }

    /// Whether a body takes part in a contact.
    pub fn touches(&self, body: &str) -> bool {
        self.contact.values().flat_map(Contact::surfaces).any(|surface| surface.body == body)
    }

    /// Sentences about what is legal but easily a mistake: bricks that only contact can hold, and keys without effect. Other
    /// bodies are looked at when their meshes are there.
    pub fn warnings(&self) -> Vec<String> {
        let bricks = self.body.iter().filter(|(_, body)| body.brick().is_some());
        bricks.filter_map(|(name, _)| Held::brick(self, name).warning()).chain(idle::warnings(self)).collect()
    }
}

#[cfg(test)]
mod tests;
