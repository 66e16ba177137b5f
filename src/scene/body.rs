//! Bodies: materials, an element and a shape, which is a brick with axis-parallel edges, another structured body or
//! volumes of a mesh file.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::mapped::{Cylinder, Grid, Sphere};
use super::volumes::{Materials, Volumes};
use crate::element::Kind;

/// One body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Section", into = "Section")]
pub struct Body {
    /// What it is made of.
    pub material: Materials,
    /// Finite element of its mesh.
    pub element: Kind,
    /// Shape and mesh.
    pub shape: Shape,
}

/// What a body looks like.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box, meshed by its number of cells.
    Brick(Brick),
    /// Volumes of a mesh file.
    Gmsh(Gmsh),
    /// An octant of a hollow sphere.
    Sphere(Sphere),
    /// A quarter of a hollow cylinder.
    Cylinder(Cylinder),
    /// A box of unequal cells.
    Grid(Grid),
}

impl Body {
    /// The brick, if the body is one.
    pub fn brick(&self) -> Option<&Brick> {
        if let Shape::Brick(brick) = &self.shape { Some(brick) } else { None }
    }

    /// The mesh file, if the body is from one.
    pub fn gmsh(&self) -> Option<&Gmsh> {
        if let Shape::Gmsh(gmsh) = &self.shape { Some(gmsh) } else { None }
    }
}

/// The section as written.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    material: Materials,
    element: Kind,
    brick: Option<Brick>,
    gmsh: Option<Gmsh>,
    sphere: Option<Sphere>,
    cylinder: Option<Cylinder>,
    grid: Option<Grid>,
}

/// Not exactly one shape.
#[derive(Debug, thiserror::Error)]
enum ShapeError {
    #[error(
        "a body needs a shape: brick = {{ origin, size, cells }}, gmsh = {{ file = \"PART.msh\", volume = \"NAME\" }}, \
         sphere, cylinder or grid"
    )]
    None,
    #[error("a body has one shape, but both {0} and {1} are given: remove one")]
    Both(&'static str, &'static str),
}

impl TryFrom<Section> for Body {
    type Error = ShapeError;

    fn try_from(section: Section) -> Result<Self, ShapeError> {
        let Section { material, element, brick, gmsh, sphere, cylinder, grid } = section;
        let mut shapes = [
            brick.map(|it| ("brick", Shape::Brick(it))),
            gmsh.map(|it| ("gmsh", Shape::Gmsh(it))),
            sphere.map(|it| ("sphere", Shape::Sphere(it))),
            cylinder.map(|it| ("cylinder", Shape::Cylinder(it))),
            grid.map(|it| ("grid", Shape::Grid(it))),
        ]
        .into_iter()
        .flatten();
        let (first, shape) = shapes.next().ok_or(ShapeError::None)?;
        match shapes.next() {
            Some((second, _)) => Err(ShapeError::Both(first, second)),
            None => Ok(Self { material, element, shape }),
        }
    }
}

impl From<Body> for Section {
    fn from(body: Body) -> Self {
        let Body { material, element, shape } = body;
        let section = Section { material, element, brick: None, gmsh: None, sphere: None, cylinder: None, grid: None };
        match shape {
            Shape::Brick(brick) => Self { brick: Some(brick), ..section },
            Shape::Gmsh(gmsh) => Self { gmsh: Some(gmsh), ..section },
            Shape::Sphere(sphere) => Self { sphere: Some(sphere), ..section },
            Shape::Cylinder(cylinder) => Self { cylinder: Some(cylinder), ..section },
            Shape::Grid(grid) => Self { grid: Some(grid), ..section },
        }
    }
}

/// Physical volumes of a Gmsh file, scaled, then rotated about an axis through the origin, then moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gmsh {
    /// The mesh file; relative paths are from the scene file.
    pub file: String,
    /// Its physical volumes; may be absent if there is only one.
    pub volume: Option<Volumes>,
    /// Factor of all coordinates, positive.
    #[serde(default = "one")]
    pub scale: f64,
    /// A rotation.
    pub rotate: Option<Rotation>,
    /// What is added to all coordinates in the end.
    #[serde(default)]
    pub translate: [f64; 3],
    /// Its faces are meant to be as flat as they are: refinement looks for no round surfaces among them.
    #[serde(default)]
    pub faceted: bool,
}

impl Gmsh {
    /// Names of the volumes; none stands for the only one in the file.
    pub fn volumes(&self) -> &[String] {
        self.volume.as_ref().map_or(&[], Volumes::names)
    }
}

fn one() -> f64 {
    1.0
}

/// A rotation about an axis through the origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Direction, not zero.
    pub axis: [f64; 3],
    /// Angle in degrees, counter-clockwise seen against the axis.
    pub angle_deg: f64,
}

/// A box cut into equal hexahedral cells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brick {
    /// The corner with the smallest coordinates.
    pub origin: [f64; 3],
    /// Edge lengths, positive.
    pub size: [f64; 3],
    /// Cells along each edge, at least one.
    pub cells: [usize; 3],
}

impl Brick {
    /// Cells in all.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Multiplies the cells per edge; a product beyond the integers saturates, which the checks refuse.
    pub(super) fn refine(&mut self, level: usize) {
        for cells in &mut self.cells {
            *cells = cells.saturating_mul(level);
        }
    }
}

/// A coordinate direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
    /// Third coordinate.
    Z,
}

impl Axis {
    /// x, y, z.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Position in coordinate arrays: 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(["x", "y", "z"][self.index()])
    }
}
