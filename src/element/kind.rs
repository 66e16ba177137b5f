//! Which elements there are. Nodes and faces are numbered as VTK and Gmsh do.

use super::tet4;

/// A kind of finite element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The linear tetrahedron.
    Tet4,
}

impl Kind {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Self::Tet4 => 4,
        }
    }

    /// Local nodes of each face, corners first, counter-clockwise from outside.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tet4 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
        }
    }

    /// Corners of a face.
    pub fn corners_of_face(self) -> usize {
        match self {
            Self::Tet4 => 3,
        }
    }

    /// Elements that fill one hexahedral cell.
    pub fn per_cell(self) -> u64 {
        match self {
            Self::Tet4 => 6,
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
        }
    }
}
