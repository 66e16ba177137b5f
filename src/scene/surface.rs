//! Surfaces, addressed as `body.surface`, and the supports on them.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::body::Axis;

/// A surface of a body, written `body.surface`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SurfaceName {
    /// Name of the body.
    pub body: String,
    /// Which of its surfaces: a [`Face`] of a brick, a physical surface of a mesh file.
    pub surface: String,
}

impl SurfaceName {
    /// The face of this name, for surfaces of bricks.
    pub fn face(&self) -> Option<Face> {
        Face::ALL.into_iter().find(|face| face.name() == self.surface)
    }

    /// Splits the text anew where both parts may have dots: behind the longest name of a body that it begins with.
    pub(super) fn settle<'a>(&mut self, bodies: impl Iterator<Item = &'a String>) {
        let text = self.to_string();
        let fits = |body: &&String| text.strip_prefix(body.as_str()).is_some_and(|rest| rest.starts_with('.'));
        if let Some(body) = bodies.filter(fits).max_by_key(|body| body.len()) {
            *self = Self { body: body.clone(), surface: text[body.len() + 1..].to_owned() };
        }
    }
}

/// The six faces of a brick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Face {
    /// The face with the smallest x.
    Xmin,
    /// The face with the largest x.
    Xmax,
    /// The face with the smallest y.
    Ymin,
    /// The face with the largest y.
    Ymax,
    /// The face with the smallest z.
    Zmin,
    /// The face with the largest z.
    Zmax,
}

impl Face {
    /// All faces.
    pub const ALL: [Face; 6] = [Face::Xmin, Face::Xmax, Face::Ymin, Face::Ymax, Face::Zmin, Face::Zmax];

    /// The axis that is normal to the face.
    pub fn axis(self) -> Axis {
        Axis::ALL[self as usize / 2]
    }

    /// Whether the outward normal points along the positive axis.
    pub fn is_max(self) -> bool {
        self as usize % 2 == 1
    }

    /// As in scene files: `xmin`, `xmax`, ...
    pub fn name(self) -> &'static str {
        ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][self as usize]
    }
}

impl fmt::Display for SurfaceName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{}", self.body, self.surface)
    }
}

/// Why a text is not a surface; bodies and their surfaces are looked up later, when all are known.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a surface: write body.surface, as in lower.zmax")]
pub struct SurfaceError(String);

impl FromStr for SurfaceName {
    type Err = SurfaceError;

    /// Splits at the last dot.
    fn from_str(text: &str) -> Result<Self, SurfaceError> {
        match text.rsplit_once('.') {
            Some((body, surface)) if !body.is_empty() && !surface.is_empty() => {
                Ok(SurfaceName { body: body.to_owned(), surface: surface.to_owned() })
            }
            _ => Err(SurfaceError(text.to_owned())),
        }
    }
}

impl TryFrom<String> for SurfaceName {
    type Error = SurfaceError;

    fn try_from(text: String) -> Result<Self, SurfaceError> {
        text.parse()
    }
}

impl From<SurfaceName> for String {
    fn from(name: SurfaceName) -> String {
        name.to_string()
    }
}

/// Prescribed displacement of some components on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Where.
    pub surface: SurfaceName,
    /// The components that are prescribed.
    pub fix: Vec<Axis>,
    /// Their values (a length); absent means zero. Components that are not fixed must be 0.
    pub displacement: Option<[f64; 3]>,
}

impl Support {
    /// The prescribed value along this axis, if it is fixed.
    pub fn prescribed(&self, axis: Axis) -> Option<f64> {
        self.fix.contains(&axis).then(|| self.displacement.map_or(0.0, |values| values[axis.index()]))
    }
}
