//! What an error is of: the energy, the stress, or one number that the user is after.
//!
//! Numbers are written as a text, `displacement:X,Y,Z:DIRECTION`, `reaction:SUPPORT:DIRECTION`, `contact_force:CONTACT:DIRECTION`, or as a
//! table. Names and directions may be left out where the scene leaves no choice.

use std::fmt;
use std::str::FromStr;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Scene;
use super::body::Axis;
use super::require::{Checked, all_finite, known, names, require, whole};

/// What an error is of.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ErrorOf {
    /// The energy `J`, relative to it.
    #[default]
    Energy,
    /// The stress, in the norm of its complementary energy, relative to the stress.
    Stress,
    /// A number, relative to it.
    Goal(Goal),
}

/// A number that a solution has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Goal {
    /// The displacement of a point along a direction.
    Displacement {
        /// Where it is before the displacement.
        point: [f64; 3],
        /// Along what.
        direction: Direction,
        /// The body that it is of, where several have the point.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
    /// The force of a support on the bodies along a direction.
    Reaction {
        /// Which; the only one if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        support: Option<String>,
        /// Along what; the one that the support fixes if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        direction: Option<Direction>,
    },
    /// The force of a contact on the body that it names first.
    ContactForce {
        /// Which; the only one if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        contact: Option<String>,
        /// Along what; its own direction if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        direction: Option<Direction>,
    },
}

/// A direction, of length one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "[f64; 3]")]
pub struct Direction(pub [f64; 3]);

/// A direction as it is written.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Name(String),
    Vector([f64; 3]),
}

/// Squares of lengths that differ from one by less are one.
const UNIT: f64 = 1e-14;

/// Why a text is no goal.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum GoalError {
    /// Of another form.
    #[error(
        "`{0}` has no error: write energy, stress, displacement:X,Y,Z:DIRECTION, reaction:SUPPORT:DIRECTION or contact_force:CONTACT:DIRECTION"
    )]
    Form(String),
    /// No direction.
    #[error("`{0}` is no direction: write x, -x, y, -y, z, -z, or three numbers, not all zero")]
    Direction(String),
    /// No point.
    #[error("`{0}` is no point: write three numbers, as in 0,0.5,1")]
    Point(String),
}

impl Direction {
    /// Of a vector that points somewhere.
    fn along(vector: [f64; 3], text: impl Fn() -> String) -> Result<Self, GoalError> {
        let largest = vector.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        if !(largest > 0.0 && vector.iter().all(|x| x.is_finite())) {
            return Err(GoalError::Direction(text()));
        }
        // One that was read before stays as it is to the last bit.
        let square = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>();
        if (square(vector) - 1.0).abs() < UNIT {
            return Ok(Self(vector));
        }
        let scaled = vector.map(|x| x / largest);
        let length = square(scaled).sqrt();
        Ok(Self(scaled.map(|x| x / length)))
    }

    /// Whether it has a part along an axis.
    fn has(self, axis: Axis) -> bool {
        self.0[axis.index()] != 0.0
    }
}

/// Three numbers with commas between them.
fn three(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

impl FromStr for Direction {
    type Err = GoalError;

    fn from_str(text: &str) -> Result<Self, GoalError> {
        let (name, sign) = text.strip_prefix('-').map_or((text, 1.0), |name| (name, -1.0));
        if let Some(axis) = Axis::ALL.into_iter().find(|axis| axis.to_string() == name) {
            let mut along = [0.0; 3];
            along[axis.index()] = sign;
            return Ok(Self(along));
        }
        Self::along(three(text).unwrap_or_default(), || text.to_owned())
    }
}

impl TryFrom<Written> for Direction {
    type Error = GoalError;

    fn try_from(written: Written) -> Result<Self, GoalError> {
        match written {
            Written::Name(text) => text.parse(),
            Written::Vector(vector) => Self::along(vector, || format!("{vector:?}")),
        }
    }
}

impl From<Direction> for [f64; 3] {
    fn from(Direction(along): Direction) -> Self {
        along
    }
}

impl FromStr for ErrorOf {
    type Err = GoalError;

    fn from_str(text: &str) -> Result<Self, GoalError> {
        let name = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
        let parts: Vec<&str> = text.split(':').collect();
        let goal = match parts[..] {
            ["energy"] => return Ok(Self::Energy),
            ["stress"] => return Ok(Self::Stress),
            ["displacement", point, direction, ref body @ ..] if body.len() <= 1 => Goal::Displacement {
                point: three(point).ok_or_else(|| GoalError::Point(point.to_owned()))?,
                direction: direction.parse()?,
                body: body.first().and_then(|body| name(body)),
            },
            ["reaction"] => Goal::Reaction { support: None, direction: None },
            ["reaction", support] => Goal::Reaction { support: name(support), direction: None },
            ["reaction", support, direction] => {
                Goal::Reaction { support: name(support), direction: Some(direction.parse()?) }
            }
            ["contact_force"] => Goal::ContactForce { contact: None, direction: None },
            ["contact_force", contact] => Goal::ContactForce { contact: name(contact), direction: None },
            ["contact_force", contact, direction] => {
                Goal::ContactForce { contact: name(contact), direction: Some(direction.parse()?) }
            }
            _ => return Err(GoalError::Form(text.to_owned())),
        };
        Ok(Self::Goal(goal))
    }
}

impl ErrorOf {
    /// Whether it is what errors are of if nobody says.
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The number, if it is of one.
    pub fn goal(&self) -> Option<&Goal> {
        if let Self::Goal(goal) = self { Some(goal) } else { None }
    }
}

impl Serialize for ErrorOf {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Energy => serializer.serialize_str("energy"),
            Self::Stress => serializer.serialize_str("stress"),
            Self::Goal(goal) => goal.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ErrorOf {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOrTable)
    }
}

struct TextOrTable;

impl<'de> Visitor<'de> for TextOrTable {
    type Value = ErrorOf;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("energy, stress, or a displacement, reaction or contact_force")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<ErrorOf, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ErrorOf, A::Error> {
        Goal::deserialize(MapAccessDeserializer::new(map)).map(ErrorOf::Goal)
    }
}

impl Goal {
    /// The first fault, in a scene that asks for its error.
    pub(super) fn check(&self, scene: &Scene) -> Checked {
        let key = "solver.error_of";
        if scene.limit.is_some() {
            let rule =
                "with [limit] the error is that of the energy or of the stress: what is sought is the limit load";
            return Err(whole(key, rule));
        }
        match self {
            Self::Displacement { point, body, .. } => {
                all_finite(key, point)?;
                let stranger = body.iter().find(|name| !scene.body.contains_key(*name));
                stranger.map_or(Ok(()), |name| require(false, key, name, known("body", scene.body.keys())))
            }
            Self::Reaction { support, direction } => {
                let name = one(key, "support", support, scene.support.keys())?;
                let fix = &scene.support[name].fix;
                let Some(direction) = direction else {
                    let rule = format!("support.{name} fixes several components: say which, as in reaction:{name}:z");
                    return if fix.len() == 1 { Ok(()) } else { Err(whole(key, rule)) };
                };
                let free = Axis::ALL.into_iter().find(|axis| direction.has(*axis) && !fix.contains(axis));
                let rule = |axis: Axis| format!("support.{name} does not fix {axis}, so it has no reaction along it");
                free.map_or(Ok(()), |axis| Err(whole(key, rule(axis))))
            }
            Self::ContactForce { contact, .. } => one(key, "contact", contact, scene.contact.keys()).map(drop),
        }
    }
}

/// The name that is given, or the only one of a section.
fn one<'a>(
    key: &str,
    section: &str,
    given: &'a Option<String>,
    mut all: impl Iterator<Item = &'a String> + Clone,
) -> Result<&'a String, super::Fault> {
    let all_names = all.clone();
    if let Some(name) = given {
        require(all.any(|known| known == name), key, name, known(section, all_names))?;
        return Ok(name);
    }
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(whole(key, format!("the scene has no {section}"))),
        _ => Err(whole(key, format!("the scene has several: name one of {}", names(all_names)))),
    }
}
