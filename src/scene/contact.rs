//! What may touch what: two surfaces, or a surface and a rigid obstacle; with friction or without.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::require::{Checked, all_finite, require};
use super::step::Step;
use super::surface::SurfaceName;

/// A contact. Each slave node carries one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Section", into = "Section")]
pub struct Contact {
    /// What touches what.
    pub sides: Sides,
    /// What is added to the distance of the meshes everywhere (length); negative for an overlap.
    pub gap: f64,
    /// The distance everywhere, whatever that of the meshes is (length): for surfaces that are meant to fit, where facets
    /// would leave gaps and overlaps of their own.
    pub clearance: Option<f64>,
    /// What resists sliding, if anything does.
    pub friction: Option<Friction>,
}

/// A law of friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// Coulomb: the friction stress is at most this share of the pressure.
    Coulomb(f64),
    /// Tresca: the friction stress is at most this, whatever the pressure, also where surfaces are apart (stress).
    Tresca(f64),
}

impl Friction {
    /// The coefficient, or the limit of the stress.
    pub fn value(self) -> f64 {
        match self {
            Self::Coulomb(value) | Self::Tresca(value) => value,
        }
    }

    /// The same law with another coefficient or limit.
    pub fn with(self, value: f64) -> Self {
        match self {
            Self::Coulomb(_) => Self::Coulomb(value),
            Self::Tresca(_) => Self::Tresca(value),
        }
    }

    /// The key of its value in scenes.
    pub fn key(self) -> &'static str {
        match self {
            Self::Coulomb(_) => "friction",
            Self::Tresca(_) => "shear_limit",
        }
    }
}

/// The two sides of a contact. The nodes of the slave must not enter the other side.
#[derive(Clone, Debug, PartialEq)]
pub enum Sides {
    /// Surfaces of two bodies.
    Named {
        /// The surface whose nodes are checked.
        slave: SurfaceName,
        /// The surface of another body.
        master: SurfaceName,
    },
    /// Surfaces of two bodies, either of which may be the slave.
    Either([SurfaceName; 2]),
    /// A surface, and an obstacle that does not deform.
    Rigid {
        /// The surface whose nodes are checked.
        slave: SurfaceName,
        /// What they must not enter.
        obstacle: Obstacle,
        /// How far the obstacle is moved, if it is (length); steps have factors of it.
        displacement: Option<[f64; 3]>,
    },
}

impl Contact {
    /// How far its rigid obstacle is moved where steps have the factor one (length); zero for surfaces.
    pub fn displacement(&self) -> [f64; 3] {
        match self.sides {
            Sides::Rigid { displacement, .. } => displacement.unwrap_or_default(),
            Sides::Named { .. } | Sides::Either(_) => [0.0; 3],
        }
    }

    /// Whether there is friction in any of these steps.
    pub fn rubs(&self, name: &str, steps: &[Step]) -> bool {
        steps.iter().any(|step| step.friction(name, self).is_some())
    }

    /// Every surface that takes part: both, or the slave of an obstacle.
    pub fn surfaces(&self) -> impl Iterator<Item = &SurfaceName> {
        let (first, second) = match &self.sides {
            Sides::Named { slave, master } => (slave, Some(master)),
            Sides::Either([one, other]) => (one, Some(other)),
            Sides::Rigid { slave, .. } => (slave, None),
        };
        [first].into_iter().chain(second)
    }

    /// The same, to be settled.
    pub(super) fn surfaces_mut(&mut self) -> impl Iterator<Item = &mut SurfaceName> {
        let (first, second) = match &mut self.sides {
            Sides::Named { slave, master } => (slave, Some(master)),
            Sides::Either([one, other]) => (one, Some(other)),
            Sides::Rigid { slave, .. } => (slave, None),
        };
        [first].into_iter().chain(second)
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
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    slave: Option<SurfaceName>,
    master: Option<SurfaceName>,
    surfaces: Option<[SurfaceName; 2]>,
    #[serde(default)]
    gap: f64,
    clearance: Option<f64>,
    rigid: Option<Obstacle>,
    displacement: Option<[f64; 3]>,
    friction: Option<f64>,
    shear_limit: Option<f64>,
}

/// Keys of the section that contradict each other.
#[derive(Debug, thiserror::Error)]
enum SectionError {
    #[error("a contact needs a second side: master (a surface) or rigid (an obstacle)")]
    OneSided,
    #[error("a contact has one second side: remove either master or rigid; other contacts may name the same slave")]
    ThreeSided,
    #[error("surfaces names both sides of a contact: remove slave, master and rigid, or name the sides by these alone")]
    NamedTwice,
    #[error(
        "displacement moves a rigid obstacle, and there is none: surfaces move with supports and loads of their bodies"
    )]
    NothingToMove,
    #[error("friction (Coulomb) and shear_limit (Tresca) are two laws of friction: remove one")]
    TwoLaws,
    #[error("a contact needs a slave (a surface) with a master or a rigid obstacle, or two surfaces")]
    NoSlave,
}

impl TryFrom<Section> for Contact {
    type Error = SectionError;

    fn try_from(section: Section) -> Result<Self, SectionError> {
        let Section { slave, master, surfaces, gap, clearance, rigid, displacement, friction, shear_limit } = section;
        if rigid.is_none() && displacement.is_some() {
            return Err(SectionError::NothingToMove);
        }
        let sides = match (surfaces, slave, master, rigid) {
            (Some(surfaces), None, None, None) => Sides::Either(surfaces),
            (Some(_), ..) => return Err(SectionError::NamedTwice),
            (None, None, ..) => return Err(SectionError::NoSlave),
            (None, Some(slave), Some(master), None) => Sides::Named { slave, master },
            (None, Some(slave), None, Some(obstacle)) => Sides::Rigid { slave, obstacle, displacement },
            (None, Some(_), None, None) => return Err(SectionError::OneSided),
            (None, Some(_), Some(_), Some(_)) => return Err(SectionError::ThreeSided),
        };
        let friction = match (friction, shear_limit) {
            (Some(_), Some(_)) => return Err(SectionError::TwoLaws),
            (friction, limit) => friction.map(Friction::Coulomb).or(limit.map(Friction::Tresca)),
        };
        Ok(Self { sides, gap, clearance, friction })
    }
}

impl From<Contact> for Section {
    fn from(Contact { sides, gap, clearance, friction: law }: Contact) -> Self {
        let of = |key: &str| law.filter(|law| law.key() == key).map(Friction::value);
        let (friction, shear_limit) = (of("friction"), of("shear_limit"));
        let (slave, master, surfaces, rigid, displacement) = (None, None, None, None, None);
        let empty = Self { slave, master, surfaces, gap, clearance, rigid, displacement, friction, shear_limit };
        match sides {
            Sides::Named { slave, master } => Self { slave: Some(slave), master: Some(master), ..empty },
            Sides::Either(surfaces) => Self { surfaces: Some(surfaces), ..empty },
            Sides::Rigid { slave, obstacle, displacement } => {
                Self { slave: Some(slave), rigid: Some(obstacle), displacement, ..empty }
            }
        }
    }
}
