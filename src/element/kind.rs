//! Which elements there are. Nodes and faces are numbered as VTK and Gmsh do.

use super::{hex8, tet4};

/// A kind of finite element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The linear tetrahedron.
    Tet4,
    /// The trilinear hexahedron with mean dilatation.
    Hex8,
}

impl Kind {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Self::Tet4 => 4,
            Self::Hex8 => 8,
        }
    }

    /// Local nodes of each face, corners first, counter-clockwise from outside.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tet4 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Hex8 => &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
        }
    }

    /// Corners of a face.
    pub fn corners_of_face(self) -> usize {
        match self {
            Self::Tet4 => 3,
            Self::Hex8 => 4,
        }
    }

    /// Elements that fill one hexahedral cell.
    pub fn per_cell(self) -> u64 {
        match self {
            Self::Tet4 => 6,
            Self::Hex8 => 1,
        }
    }

    /// Linear tetrahedra with as many nodes: what an element costs to solve for.
    pub fn tetrahedra(self) -> u64 {
        match self {
            Self::Tet4 => 1,
            Self::Hex8 => 6,
        }
    }

    /// How good the shape of an element is: 1 at best, negative if it is inverted.
    ///
    /// # Panics
    /// If it has another number of nodes.
    pub fn shape(self, nodes: &[[f64; 3]]) -> f64 {
        let whole = "an element has all its nodes";
        match self {
            Self::Tet4 => tet4::shape(nodes.try_into().expect(whole)),
            Self::Hex8 => hex8::shape(nodes.try_into().expect(whole)),
        }
    }
}
