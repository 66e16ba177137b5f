//! What drives bodies besides prescribed displacements: traction or pressure on a surface, force in a body.

use serde::{Deserialize, Serialize};

use super::surface::SurfaceName;

/// A uniform dead load. Directions and areas are those of the undeformed body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "Section")]
pub enum Load {
    /// In a fixed direction.
    Traction {
        /// Where.
        surface: SurfaceName,
        /// Force per undeformed area, in coordinate directions (a stress).
        traction: [f64; 3],
    },
    /// Against the outward normal of each facet.
    Pressure {
        /// Where.
        surface: SurfaceName,
        /// Force per undeformed area (a stress); negative pulls.
        pressure: f64,
    },
    /// Throughout a body, such as its weight.
    BodyForce {
        /// Name of the body.
        body: String,
        /// Force per undeformed volume, in coordinate directions.
        body_force: [f64; 3],
    },
}

impl Load {
    /// Where it acts, unless throughout a body.
    pub fn surface(&self) -> Option<&SurfaceName> {
        match self {
            Self::Traction { surface, .. } | Self::Pressure { surface, .. } => Some(surface),
            Self::BodyForce { .. } => None,
        }
    }

    /// Whether nothing acts.
    pub(super) fn is_zero(&self) -> bool {
        match self {
            Self::Traction { traction: v, .. } | Self::BodyForce { body_force: v, .. } => *v == [0.0; 3],
            Self::Pressure { pressure, .. } => *pressure == 0.0,
        }
    }

    /// The same, to be settled.
    pub(super) fn surface_mut(&mut self) -> Option<&mut SurfaceName> {
        match self {
            Self::Traction { surface, .. } | Self::Pressure { surface, .. } => Some(surface),
            Self::BodyForce { .. } => None,
        }
    }
}

/// The section as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    surface: Option<SurfaceName>,
    traction: Option<[f64; 3]>,
    pressure: Option<f64>,
    body: Option<String>,
    body_force: Option<[f64; 3]>,
}

/// Keys of the section that contradict each other.
#[derive(Debug, thiserror::Error)]
enum SectionError {
    #[error("missing key `surface` (beside traction or pressure) or `body` (beside body_force)")]
    Nowhere,
    #[error("a load acts on a surface or in a body: remove either surface or body")]
    TwoPlaces,
    #[error("missing key `traction` or `pressure`: what acts on the surface")]
    NothingOnSurface,
    #[error("missing key `body_force`: what acts in the body")]
    NothingInBody,
    #[error("a load is either a traction or a pressure: remove one; other loads may name the same surface")]
    TwoKinds,
    #[error("body_force acts in a body, not on a surface: give body = \"BODY\" instead, and nothing else")]
    ForceOnSurface,
    #[error("traction and pressure act on a surface: give surface = \"BODY.SURFACE\" instead of body")]
    StressInBody,
}

impl TryFrom<Section> for Load {
    type Error = SectionError;

    fn try_from(section: Section) -> Result<Self, SectionError> {
        let Section { surface, traction, pressure, body, body_force } = section;
        match (surface, body) {
            (Some(_), Some(_)) => Err(SectionError::TwoPlaces),
            (None, None) => Err(SectionError::Nowhere),
            (Some(surface), None) => match (traction, pressure, body_force) {
                (_, _, Some(_)) => Err(SectionError::ForceOnSurface),
                (Some(traction), None, None) => Ok(Self::Traction { surface, traction }),
                (None, Some(pressure), None) => Ok(Self::Pressure { surface, pressure }),
                (Some(_), Some(_), None) => Err(SectionError::TwoKinds),
                (None, None, None) => Err(SectionError::NothingOnSurface),
            },
            (None, Some(body)) => match (traction.is_some() || pressure.is_some(), body_force) {
                (true, _) => Err(SectionError::StressInBody),
                (false, Some(body_force)) => Ok(Self::BodyForce { body, body_force }),
                (false, None) => Err(SectionError::NothingInBody),
            },
        }
    }
}
