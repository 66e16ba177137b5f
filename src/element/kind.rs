//! Which elements there are. Nodes and faces are numbered as VTK and Gmsh do.

use super::{hex8, tet4, tet10};

/// A kind of finite element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The linear tetrahedron.
    Tet4,
    /// The quadratic tetrahedron.
    Tet10,
    /// The trilinear hexahedron with mean dilatation.
    Hex8,
}

impl Kind {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Self::Tet4 => 4,
            Self::Tet10 => 10,
            Self::Hex8 => 8,
        }
    }

    /// Integration points of an element.
    pub fn points(self) -> usize {
        match self {
            Self::Tet4 => 1,
            Self::Tet10 => 4,
            Self::Hex8 => 8,
        }
    }

    /// Local nodes of each face, counter-clockwise from outside: corners, then the middles of the edges between them.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tet4 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Tet10 => &[&[0, 2, 1, 6, 5, 4], &[0, 1, 3, 4, 8, 7], &[1, 2, 3, 5, 9, 8], &[0, 3, 2, 7, 9, 6]],
            Self::Hex8 => &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
        }
    }

    /// Degree of the shape functions along an edge.
    pub fn degree(self) -> usize {
        match self {
            Self::Tet4 | Self::Hex8 => 1,
            Self::Tet10 => 2,
        }
    }

    /// Corners of a face.
    pub fn corners_of_face(self) -> usize {
        match self {
            Self::Tet4 | Self::Tet10 => 3,
            Self::Hex8 => 4,
        }
    }

    /// Elements that fill one hexahedral cell.
    pub fn per_cell(self) -> u64 {
        match self {
            Self::Tet4 | Self::Tet10 => 6,
            Self::Hex8 => 1,
        }
    }

    /// Linear tetrahedra with as many nodes: what an element costs to solve for.
    pub fn tetrahedra(self) -> u64 {
        match self {
            Self::Tet4 => 1,
            Self::Tet10 => 8,
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
            Self::Tet10 => tet10::shape(nodes.try_into().expect(whole)),
            Self::Hex8 => hex8::shape(nodes.try_into().expect(whole)),
        }
    }
}
