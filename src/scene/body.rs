//! Bodies: a material, an element and a shape. The only shape so far is the brick with axis-parallel edges.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name of its material.
    pub material: String,
    /// Finite element of its mesh.
    pub element: Element,
    /// Shape and mesh density.
    pub brick: Brick,
}

/// Finite elements to choose from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Element {
    /// Linear tetrahedra, six to a cell.
    Tet4,
}

impl Element {
    /// Elements that fill one hexahedral cell.
    pub fn per_cell(self) -> usize {
        match self {
            Element::Tet4 => 6,
        }
    }
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
