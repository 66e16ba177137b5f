//! What the program asks of an element. An element is a file with a type that answers all of it.

use super::{Cell, Nodal, Point, Sample};

/// How Gmsh knows an element (Gmsh reference manual, "MSH file format").
#[derive(Clone, Copy, Debug)]
pub struct Gmsh {
    /// Number of the type of its cells.
    pub cell: i32,
    /// Number of the type of their faces.
    pub face: i32,
    /// Gmsh's place of each node of the element.
    pub order: &'static [usize],
    /// Which cells it needs, and how to get them. `None` if all cells of first order are split into the element.
    pub needs: Option<&'static str>,
}

impl Gmsh {
    /// Whether all cells of first order are split into the element.
    pub fn is_split(&self) -> bool {
        self.needs.is_none()
    }
}

/// An element of `N` nodes and `P` integration points. Nodes and faces are numbered as in VTK.
pub trait Element<const N: usize, const P: usize> {
    /// Number of nodes.
    const NODES: usize = N;
    /// Number of integration points.
    const POINTS: usize = P;
    /// The cell that it maps into space.
    const CELL: Cell;
    /// Degree of the shape functions along an edge.
    const DEGREE: usize;
    /// Local nodes of each face, counter-clockwise from outside: corners, then the middles of the edges between them.
    const FACES: &'static [&'static [usize]];
    /// Corners of the edge of each node that is no corner. These nodes come behind the corners.
    const MIDDLES: &'static [(usize, usize)];
    /// Linear tetrahedra with as many nodes: what an element costs to solve for.
    const TETRAHEDRA: u64;
    /// Whether stresses are most accurate at the centre, rather than at the integration points.
    const BEST_AT_CENTRE: bool;
    /// VTK's number of the cell.
    const VTK: u8;
    /// How Gmsh knows it.
    const GMSH: Gmsh;

    /// The integration points of the element on these nodes. They mean nothing if its [shape](Self::shape) is
    /// [`DEGENERATE`](super::DEGENERATE), which a mesh is checked for once.
    fn points(nodes: &Nodal<N>) -> [Point<N>; P];

    /// Values of the shape functions at the integration points.
    fn values_at_points() -> [[f64; N]; P];

    /// How good the shape is: at most 1, negative if the element is inverted.
    fn shape(nodes: &Nodal<N>) -> f64;

    /// Values of the shape functions at a place of the [cell](Self::CELL).
    fn values(at: &[f64]) -> [f64; N];

    /// What is known at the integration points is, at a place of the cell, this combination of it.
    fn extrapolation(at: &[f64]) -> [f64; P];

    /// A place of the cell with a weight there.
    fn sample(nodes: &Nodal<N>, at: &[f64], weight: f64) -> Sample;
}
