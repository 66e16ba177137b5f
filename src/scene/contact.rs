//! What may touch what: two surfaces, or a surface and a rigid obstacle. Without friction.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::check::{Checked, all_finite, require};
use super::surface::SurfaceName;

/// A contact. Each slave node carries one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "Section")]
pub enum Contact {
    /// Between surfaces of two bodies.
    Surfaces {
        /// The surface whose nodes are checked.
        slave: SurfaceName,
        /// The surface of another body, which they must not enter.
        master: SurfaceName,
    },
    /// With an obstacle that neither moves nor deforms.
    Rigid {
        /// The surface whose nodes are checked.
        slave: SurfaceName,
        /// What they must not enter.
        rigid: Obstacle,
    },
}

impl Contact {
    /// The surface whose nodes are checked.
    pub fn slave(&self) -> &SurfaceName {
        match self {
            Self::Surfaces { slave, .. } | Self::Rigid { slave, .. } => slave,
        }
    }

    /// Every surface that takes part.
    pub fn surfaces(&self) -> impl Iterator<Item = &SurfaceName> {
        let master = if let Self::Surfaces { master, .. } = self { Some(master) } else { None };
        [self.slave()].into_iter().chain(master)
    }

    /// The same, to be settled.
    pub(super) fn surfaces_mut(&mut self) -> impl Iterator<Item = &mut SurfaceName> {
        let (slave, master) = match self {
            Self::Surfaces { slave, master } => (slave, Some(master)),
            Self::Rigid { slave, .. } => (slave, None),
        };
        [slave].into_iter().chain(master)
    }
}

/// A rigid body that needs no mesh. Lengths are those of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Obstacle {
    /// A half space.
    Plane {
        /// A point of its surface.
        point: [f64; 3],
        /// Points out of the obstacle, to where bodies may be; of any length.
        normal: [f64; 3],
    },
    /// A ball, or all that is outside of one.
    Sphere {
        /// Its centre.
        centre: [f64; 3],
        /// Its radius.
        radius: f64,
        /// Whether bodies are inside: a spherical cavity.
        #[serde(default)]
        inside: bool,
    },
    /// An endless round cylinder, or all that is outside of one.
    Cylinder {
        /// A point of its axis.
        point: [f64; 3],
        /// Direction of the axis; of any length.
        axis: [f64; 3],
        /// Its radius.
        radius: f64,
        /// Whether bodies are inside: a bore.
        #[serde(default)]
        inside: bool,
    },
    /// Ground `z = h(x, y)`, bilinear between heights on a grid. There is nothing beside the grid.
    Heightfield {
        /// x and y of the first height.
        origin: [f64; 2],
        /// Distance between heights along x and along y.
        spacing: [f64; 2],
        /// `heights[i][j]` is at `x = origin.0 + i spacing.0`, `y = origin.1 + j spacing.1`.
        heights: Vec<Vec<f64>>,
        /// Whether the obstacle is above the field instead of below: a ceiling.
        #[serde(default)]
        above: bool,
    },
}

impl Obstacle {
    /// Whether the values make an obstacle; `key` is its place in the scene.
    pub(super) fn check(&self, key: &str) -> Checked {
        match self {
            Self::Plane { point, normal } => {
                all_finite(&format!("{key}.plane.point"), point)?;
                direction(&format!("{key}.plane.normal"), *normal)
            }
            Self::Sphere { centre, radius, .. } => {
                all_finite(&format!("{key}.sphere.centre"), centre)?;
                positive(&format!("{key}.sphere.radius"), *radius)
            }
            Self::Cylinder { point, axis, radius, .. } => {
                all_finite(&format!("{key}.cylinder.point"), point)?;
                direction(&format!("{key}.cylinder.axis"), *axis)?;
                positive(&format!("{key}.cylinder.radius"), *radius)
            }
            Self::Heightfield { origin, spacing, heights, .. } => {
                let key = format!("{key}.heightfield");
                all_finite(&format!("{key}.origin"), origin)?;
                let rule = "must be positive and finite along x and y";
                let sound = spacing.iter().all(|s| s.is_finite() && *s > 0.0);
                require(sound, &format!("{key}.spacing"), spacing, rule)?;
                let key = format!("{key}.heights");
                let lengths: Vec<usize> = heights.iter().map(Vec::len).collect();
                let even = lengths.len() >= 2 && lengths[0] >= 2 && lengths.iter().all(|n| *n == lengths[0]);
                let rule = "lists of equal length are needed, at least two of at least two heights";
                require(even, &key, Lengths(lengths), rule)?;
                heights.iter().try_for_each(|list| all_finite(&key, list))
            }
        }
    }
}

/// Lengths of lists, to be shown instead of the lists.
struct Lengths(Vec<usize>);

impl fmt::Debug for Lengths {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "lists of lengths {:?}", self.0)
    }
}

fn direction(key: &str, vector: [f64; 3]) -> Checked {
    all_finite(key, &vector)?;
    require(vector.iter().any(|x| *x != 0.0), key, vector, "must point somewhere")
}

fn positive(key: &str, length: f64) -> Checked {
    require(length.is_finite() && length > 0.0, key, length, "must be positive and finite")
}

/// The section as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    slave: SurfaceName,
    master: Option<SurfaceName>,
    rigid: Option<Obstacle>,
}

/// Keys of the section that contradict each other.
#[derive(Debug, thiserror::Error)]
enum SectionError {
    #[error("a contact needs a second side: master (a surface) or rigid (an obstacle)")]
    OneSided,
    #[error("a contact has one second side: remove either master or rigid; other contacts may name the same slave")]
    ThreeSided,
}

impl TryFrom<Section> for Contact {
    type Error = SectionError;

    fn try_from(Section { slave, master, rigid }: Section) -> Result<Self, SectionError> {
        match (master, rigid) {
            (Some(master), None) => Ok(Self::Surfaces { slave, master }),
            (None, Some(rigid)) => Ok(Self::Rigid { slave, rigid }),
            (None, None) => Err(SectionError::OneSided),
            (Some(_), Some(_)) => Err(SectionError::ThreeSided),
        }
    }
}
