//! Which elements there are, and their [facts](super::Element) where the kind is known at run time only.

use serde::{Deserialize, Serialize};

use super::{Cell, Element, Gmsh, Nodal, Sample};

/// The enum of all kinds, their names (those of their files), and `by_kind!`.
macro_rules! kinds {
    ($dollar:tt: $($(#[$about:meta])* $kind:ident = $name:ident,)+) => {
        /// A kind of finite element. Scenes call it by the name of its file.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "lowercase")]
        pub enum Kind {
            $($(#[$about])* $kind,)+
        }

        impl Kind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$kind),+];

            /// Its name, as in scene files.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => stringify!($name),)+
                }
            }
        }

        /// `by_kind!(kind, E => expression)`: the expression with `E` as the type of the kind.
        macro_rules! by_kind {
            ($dollar kind:expr, $dollar E:ident => $dollar body:expr) => {
                match $dollar kind {
                    $($crate::element::Kind::$kind => {
                        type $dollar E = $crate::element::$name::$kind;
                        $dollar body
                    })+
                }
            };
        }
    };
}

// The one list of elements.
kinds! { $:
    /// The linear tetrahedron.
    Tet4 = tet4,
    /// The quadratic tetrahedron.
    Tet10 = tet10,
    /// The trilinear hexahedron with mean dilatation.
    Hex8 = hex8,
}
pub(crate) use by_kind;

impl Kind {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        by_kind!(self, E => E::NODES)
    }

    /// Integration points of an element.
    pub fn points(self) -> usize {
        by_kind!(self, E => E::POINTS)
    }

    /// The cell that it maps into space.
    pub fn cell(self) -> Cell {
        by_kind!(self, E => E::CELL)
    }

    /// Local nodes of each face, counter-clockwise from outside: corners, then the middles of the edges between them.
    pub fn faces(self) -> &'static [&'static [usize]] {
        by_kind!(self, E => E::FACES)
    }

    /// Corners of the edge of each node that is no corner. These nodes come behind the corners.
    pub fn middles(self) -> &'static [(usize, usize)] {
        by_kind!(self, E => E::MIDDLES)
    }

    /// Degree of the shape functions along an edge.
    pub fn degree(self) -> usize {
        by_kind!(self, E => E::DEGREE)
    }

    /// Linear tetrahedra with as many nodes: what an element costs to solve for.
    pub fn tetrahedra(self) -> u64 {
        by_kind!(self, E => E::TETRAHEDRA)
    }

    /// Whether stresses are most accurate at the centre, rather than at the integration points.
    pub fn best_at_centre(self) -> bool {
        by_kind!(self, E => E::BEST_AT_CENTRE)
    }

    /// VTK's number of the cell.
    pub fn vtk(self) -> u8 {
        by_kind!(self, E => E::VTK)
    }

    /// How Gmsh knows it.
    pub fn gmsh(self) -> Gmsh {
        by_kind!(self, E => E::GMSH)
    }

    /// How good the shape of an element is: 1 at best, negative if it is inverted.
    ///
    /// # Panics
    /// If it has another number of nodes.
    pub fn shape(self, nodes: &[[f64; 3]]) -> f64 {
        by_kind!(self, E => E::shape(whole(nodes)))
    }

    /// Values of the shape functions at a place of the [cell](Self::cell).
    ///
    /// # Panics
    /// If the place has another number of coordinates.
    pub fn values(self, at: &[f64]) -> Vec<f64> {
        by_kind!(self, E => E::values(at).to_vec())
    }

    /// What is known at the integration points is, at a place of the [cell](Self::cell), this combination of it.
    ///
    /// # Panics
    /// If the place has another number of coordinates.
    pub fn extrapolation(self, at: &[f64]) -> Vec<f64> {
        by_kind!(self, E => E::extrapolation(at).to_vec())
    }

    /// A place of the [cell](Self::cell) of the element on these nodes, with a weight there.
    ///
    /// # Panics
    /// If it has another number of nodes.
    pub fn sample(self, nodes: &[[f64; 3]], at: &[f64], weight: f64) -> Sample {
        by_kind!(self, E => E::sample(whole(nodes), at, weight))
    }
}

fn whole<const N: usize>(nodes: &[[f64; 3]]) -> &Nodal<N> {
    nodes.try_into().expect("an element has all its nodes")
}
