//! Kinds of cells by Gmsh's numbers.

use crate::element::{self, Gmsh};

/// A kind of cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Gmsh's number.
    pub number: i32,
    /// What messages call it.
    pub name: &'static str,
    /// 0 for points to 3 for volumes.
    pub dimension: i32,
    /// Nodes of a cell.
    pub nodes: usize,
    /// Whether it is of first order, with nodes at its corners only.
    pub linear: bool,
}

/// Corners, sides and volumes up to second order, and the common ones beyond (Gmsh reference manual, "MSH file format").
const KINDS: [Kind; 26] = [
    linear(15, "point", 0, 1),
    linear(1, "line", 1, 2),
    linear(2, "triangle", 2, 3),
    linear(3, "quadrangle", 2, 4),
    linear(4, "tetrahedron", 3, 4),
    linear(5, "hexahedron", 3, 8),
    linear(6, "prism", 3, 6),
    linear(7, "pyramid", 3, 5),
    curved(8, "3-node line", 1, 3),
    curved(9, "6-node triangle", 2, 6),
    curved(10, "9-node quadrangle", 2, 9),
    curved(11, "10-node tetrahedron", 3, 10),
    curved(12, "27-node hexahedron", 3, 27),
    curved(13, "18-node prism", 3, 18),
    curved(14, "14-node pyramid", 3, 14),
    curved(16, "8-node quadrangle", 2, 8),
    curved(17, "20-node hexahedron", 3, 20),
    curved(18, "15-node prism", 3, 15),
    curved(19, "13-node pyramid", 3, 13),
    curved(20, "9-node triangle", 2, 9),
    curved(21, "10-node triangle", 2, 10),
    curved(26, "4-node line", 1, 4),
    curved(27, "5-node line", 1, 5),
    curved(29, "20-node tetrahedron", 3, 20),
    curved(30, "35-node tetrahedron", 3, 35),
    curved(36, "16-node quadrangle", 2, 16),
];

const fn linear(number: i32, name: &'static str, dimension: i32, nodes: usize) -> Kind {
    Kind { number, name, dimension, nodes, linear: true }
}

const fn curved(number: i32, name: &'static str, dimension: i32, nodes: usize) -> Kind {
    Kind { number, name, dimension, nodes, linear: false }
}

impl Kind {
    /// Whether cells of this kind can be faces or elements.
    pub fn is_read(&self) -> bool {
        let of_element = |gmsh: Gmsh| [gmsh.cell, gmsh.face].contains(&self.number);
        self.dimension >= 2 && (self.linear || element::Kind::ALL.iter().any(|kind| of_element(kind.gmsh())))
    }

    /// The kind of this number.
    pub fn of(number: i32) -> Option<Self> {
        KINDS.into_iter().find(|kind| kind.number == number)
    }
}
