//! The scene: everything a user says about a study, as plain data read from TOML.
//!
//! Reading goes: text -> value tree -> `--set` overrides -> typed [`Scene`] -> refinement by level -> checks.
//! What leaves [`Scene::load`] is consistent, so later stages need not ask again whether a body exists or a modulus is
//! positive. Numbers carry no units: any consistent system does, and `units` is only echoed.
//!
//! Not here: meshes, geometry beyond counting cells, numerics. This room imports no other.

mod body;
mod check;
mod decomposition;
mod error;
mod held;
pub mod library;
mod material;
mod overrides;
mod read;
mod solver;
mod surface;

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

pub use body::{Axis, Body, Brick, Element};
pub use decomposition::Decomposition;
pub use error::{Fault, Place, SceneError};
pub use material::Material;
pub use solver::{Expansion, Precision, Preconditioner, Qp, Solver};
pub use surface::{Contact, Face, Load, Support, SurfaceError, SurfaceName};

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
    /// Tractions by name; several on one surface add up.
    pub load: BTreeMap<String, Load>,
    /// Contact pairs by name.
    pub contact: BTreeMap<String, Contact>,
    /// How bodies are cut into subdomains.
    pub decomposition: Decomposition,
    /// Methods, tolerances and limits.
    pub solver: Solver,
}

impl Scene {
    /// The scene of this built-in name or file, with `sets` (each `dotted.path=value`) applied and the cells per edge
    /// of every brick multiplied by `level`.
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
    /// An unknown name or an unreadable file.
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
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: name_or_path.to_owned(), source })?;
        Ok((text, name_or_path.to_owned()))
    }

    /// As [`Scene::load`] for TOML that is already in memory; `origin` names it in messages.
    ///
    /// # Errors
    /// As [`Scene::load`], but for reading.
    pub fn from_text(text: &str, origin: &str, level: usize, sets: &[String]) -> Result<Scene, SceneError> {
        if level == 0 {
            return Err(SceneError::Level);
        }
        let mut scene = read::scene(text, origin, sets)?;
        for body in scene.body.values_mut() {
            body.brick.refine(level);
        }
        match check::scene(&scene) {
            Ok(()) => Ok(scene),
            Err(fault) => Err(SceneError::Check { place: read::place(text, origin, sets, &fault.key), fault }),
        }
    }

    /// The effective scene as TOML: level and overrides included, defaults spelled out. Reads back (at level 1) to an
    /// equal scene.
    ///
    /// # Panics
    /// If a count exceeds TOML's integers (2^63), which no checked scene does.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("the counts of a checked scene fit TOML's integers")
    }

    /// Sentences about what is legal but easily a mistake: bodies that only contact can hold.
    pub fn warnings(&self) -> Vec<String> {
        self.body.keys().filter_map(|body| held::warning(body, &held::free_motions(self, body))).collect()
    }
}

#[cfg(test)]
mod tests;
