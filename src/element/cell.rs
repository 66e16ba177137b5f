//! The reference cells that elements map into space, in the numbering of VTK and Gmsh.

/// A reference cell. A place in it is given by barycentric coordinates of the four corners in a tetrahedron, and by
/// coordinates in `[-1, 1]^3` in a hexahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// Corners 0, 1, 2 counter-clockwise seen from corner 3.
    Tetrahedron,
    /// Corners 0, 1, 2, 3 around the bottom, counter-clockwise from above, 4, 5, 6, 7 above them.
    Hexahedron,
}

/// Corners of each edge of a tetrahedron.
pub const EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)];

/// Coordinates of the [four points](four_points).
pub const NEAR: f64 = 0.585_410_196_624_968_5;
/// See [`NEAR`].
pub const FAR: f64 = 0.138_196_601_125_010_5;

/// Barycentric coordinates of four points of equal weight in a tetrahedron, one near each corner. They integrate polynomials of
/// degree two (Hammer, Marlowe and Stroud 1956).
#[inline]
pub fn four_points() -> [[f64; 4]; 4] {
    std::array::from_fn(|near| std::array::from_fn(|a| if a == near { NEAR } else { FAR }))
}

/// A place in a tetrahedron.
pub(super) fn barycentric(at: &[f64]) -> [f64; 4] {
    at.try_into().expect("a place in a tetrahedron has four coordinates")
}

impl Cell {
    /// Number of corners. They are the first nodes of an element.
    pub fn corners(self) -> usize {
        match self {
            Self::Tetrahedron => 4,
            Self::Hexahedron => 8,
        }
    }

    /// Corners of a face. They are the first nodes of the face of an element.
    pub fn corners_of_face(self) -> usize {
        match self {
            Self::Tetrahedron => 3,
            Self::Hexahedron => 4,
        }
    }

    /// How many of them fill one hexahedral cell of a structured mesh.
    pub fn per_hexahedron(self) -> u64 {
        match self {
            Self::Tetrahedron => 6,
            Self::Hexahedron => 1,
        }
    }

    /// The tetrahedra that the edges at each corner span; a tetrahedron is one itself.
    pub fn spanned(self) -> &'static [[usize; 4]] {
        match self {
            Self::Tetrahedron => &[[0, 1, 2, 3]],
            Self::Hexahedron => &[
                [0, 1, 3, 4],
                [1, 2, 0, 5],
                [2, 3, 1, 6],
                [3, 0, 2, 7],
                [4, 7, 5, 0],
                [5, 4, 6, 1],
                [6, 5, 7, 2],
                [7, 6, 4, 3],
            ],
        }
    }
}
