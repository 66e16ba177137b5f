//! A box of equal cells, each split into six tetrahedra: numbers and coordinates by formula, nothing stored.
//!
//! Nodes, cells and corners count with x fastest, then y, then z; corner v of a cell is x + 2y + 4z with x, y, z in
//! {0, 1}. All six tetrahedra of a cell share the diagonal (0,1,0)-(1,0,1), the same in every cell, so that
//! neighbouring cells cut their common face alike and the mesh is conforming. A node's coordinates come from its
//! indices by one formula: every rank that evaluates them gets the same bits. Grading and curved boxes are not offered.

use super::Face;
use std::ops::Range;

/// A box of node or cell indices, half open along every axis.
pub type Block = [Range<usize>; 3];

/// Corners of the six tetrahedra of a cell, positively oriented.
pub const TETS: [[usize; 4]; 6] = [[0, 1, 2, 5], [0, 2, 4, 5], [2, 4, 5, 6], [1, 3, 2, 5], [3, 5, 7, 2], [2, 5, 7, 6]];

/// Corners of a cell in the order of VTK: around the bottom, then above them.
pub const HEXAHEDRON: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Corners of the two triangles that [`TETS`] leave on each face of a cell, by [`Face`]; their normals point outwards.
const FACE_TRIANGLES: [[[usize; 3]; 2]; 6] = [
    [[0, 4, 2], [2, 4, 6]],
    [[1, 3, 5], [3, 7, 5]],
    [[0, 1, 5], [0, 5, 4]],
    [[2, 6, 7], [2, 7, 3]],
    [[0, 2, 1], [1, 2, 3]],
    [[4, 5, 6], [5, 7, 6]],
];

/// The indices in a block, x fastest: the order of node and cell numbers.
pub fn indices(block: &Block) -> impl Iterator<Item = [usize; 3]> + use<> {
    let [x, y, z] = block.clone();
    z.flat_map(move |k| {
        let x = x.clone();
        y.clone().flat_map(move |j| x.clone().map(move |i| [i, j, k]))
    })
}

/// A structured body, edges along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brick {
    /// Corner with the least coordinates.
    pub origin: [f64; 3],
    /// Edge lengths, > 0.
    pub size: [f64; 3],
    /// Cells along each axis, >= 1.
    pub cells: [usize; 3],
}

impl Brick {
    /// The same body with `level` times the cells along every edge.
    pub fn refined(&self, level: usize) -> Self {
        Self { cells: self.cells.map(|n| level * n), ..*self }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> u64 {
        self.cells.iter().map(|&n| n as u64 + 1).product()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> u64 {
        self.cells.iter().map(|&n| n as u64).product()
    }

    /// All cells, as a block of cell indices.
    pub fn all_cells(&self) -> Block {
        self.cells.map(|n| 0..n)
    }

    /// All nodes, as a block of node indices.
    pub fn all_nodes(&self) -> Block {
        self.cells.map(|n| 0..n + 1)
    }

    /// Number of the node at lattice position `at`.
    pub fn node(&self, at: [usize; 3]) -> u64 {
        number(at, self.cells.map(|n| n + 1))
    }

    /// Lattice position of a node.
    pub fn node_position(&self, node: u64) -> [usize; 3] {
        position(node, self.cells.map(|n| n + 1))
    }

    /// Number of the cell at lattice position `at`.
    pub fn cell(&self, at: [usize; 3]) -> u64 {
        number(at, self.cells)
    }

    /// Lattice position of a cell.
    pub fn cell_position(&self, cell: u64) -> [usize; 3] {
        position(cell, self.cells)
    }

    /// Coordinates of the node at lattice position `at`: origin + (size * at) / cells.
    pub fn coordinates(&self, at: [usize; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.origin[i] + self.size[i] * at[i] as f64 / self.cells[i] as f64)
    }

    /// The way between two nodes, from their lattice positions alone: the same bits wherever the two are.
    pub fn way(&self, from: u64, to: u64) -> [f64; 3] {
        let (from, to) = (self.node_position(from), self.node_position(to));
        std::array::from_fn(|i| self.size[i] * (to[i] as f64 - from[i] as f64) / self.cells[i] as f64)
    }

    /// Node numbers of the eight corners of a cell, by corner v = x + 2y + 4z.
    pub fn corners(&self, cell: [usize; 3]) -> [u64; 8] {
        let [i, j, k] = cell;
        std::array::from_fn(|v| self.node([i + (v & 1), j + (v >> 1 & 1), k + (v >> 2)]))
    }

    /// Node numbers of the six tetrahedra of a cell; tetrahedron t is element 6 cell + t of the body.
    pub fn tets(&self, cell: [usize; 3]) -> [[u64; 4]; 6] {
        let corners = self.corners(cell);
        TETS.map(|tet| tet.map(|v| corners[v]))
    }

    /// Node numbers of a cell as a hexahedron, in the order of VTK.
    pub fn hexahedron(&self, cell: u64) -> [u64; 8] {
        let corners = self.corners(self.cell_position(cell));
        HEXAHEDRON.map(|v| corners[v])
    }

    /// Number of tetrahedron `tet` in 0..6 of a cell.
    pub fn element(&self, cell: [usize; 3], tet: usize) -> u64 {
        6 * self.cell(cell) + tet as u64
    }

    /// Node numbers of an element of the body.
    pub fn tet(&self, element: u64) -> [u64; 4] {
        self.tets(self.cell_position(element / 6))[(element % 6) as usize]
    }

    /// The cell around a point inside the brick, given in cells from its origin, and where in the cell.
    pub fn around(&self, at: [f64; 3]) -> ([usize; 3], [f64; 3]) {
        let cell: [usize; 3] = std::array::from_fn(|a| (at[a] as usize).min(self.cells[a] - 1));
        (cell, std::array::from_fn(|a| at[a] - cell[a] as f64))
    }

    /// The tetrahedron around a point inside the brick, given in cells from its origin: its number, and the barycentric
    /// coordinates of the point.
    pub fn tet_around(&self, at: [f64; 3]) -> (u64, [f64; 4]) {
        let (cell, inside) = self.around(at);
        let corner = |v: usize| [0, 1, 2].map(|a| (v >> a & 1) as f64);
        let least = |weights: &[f64; 4]| weights.iter().copied().fold(f64::INFINITY, f64::min);
        let (weights, tet) = (0..)
            .zip(TETS)
            .map(|(number, tet)| (barycentric(tet.map(corner), inside), number))
            .reduce(|best, other| if least(&other.0) > least(&best.0) { other } else { best })
            .expect("a cell has six elements");
        (self.element(cell, tet), weights)
    }

    /// The layer of nodes on a face.
    pub fn nodes_on(&self, face: Face) -> Block {
        let mut block = self.all_nodes();
        let last = self.cells[face.axis()];
        block[face.axis()] = if face.is_upper() { last..last + 1 } else { 0..1 };
        block
    }

    /// Whether the node at lattice position `at` is on a face.
    pub fn is_on(&self, face: Face, at: [usize; 3]) -> bool {
        at[face.axis()] == if face.is_upper() { self.cells[face.axis()] } else { 0 }
    }

    /// Node numbers of all triangles on a face of the body, normals outwards, in the order of their cells.
    pub fn triangles_on(&self, face: Face) -> impl Iterator<Item = [u64; 3]> {
        let mut cells = self.all_cells();
        let last = self.cells[face.axis()] - 1;
        cells[face.axis()] = if face.is_upper() { last..last + 1 } else { 0..1 };
        indices(&cells).flat_map(move |cell| {
            let corners = self.corners(cell);
            FACE_TRIANGLES[face as usize].map(|triangle| triangle.map(|v| corners[v]))
        })
    }
}

/// Values at a point of the linear functions that are one at a corner of a tetrahedron and zero at the others.
fn barycentric(corners: [[f64; 3]; 4], point: [f64; 3]) -> [f64; 4] {
    let edge = |k: usize| std::array::from_fn::<f64, 3, _>(|a| corners[k][a] - corners[0][a]);
    let volume = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    let to: [f64; 3] = std::array::from_fn(|a| point[a] - corners[0][a]);
    let whole = volume(edge(1), edge(2), edge(3));
    let [b, c, d] = [volume(to, edge(2), edge(3)), volume(edge(1), to, edge(3)), volume(edge(1), edge(2), to)];
    [1.0 - (b + c + d) / whole, b / whole, c / whole, d / whole]
}

fn number(at: [usize; 3], extent: [usize; 3]) -> u64 {
    let [i, j, k] = at.map(|n| n as u64);
    i + extent[0] as u64 * (j + extent[1] as u64 * k)
}

fn position(number: u64, extent: [usize; 3]) -> [usize; 3] {
    let [nx, ny] = [extent[0] as u64, extent[1] as u64];
    [number % nx, number / nx % ny, number / (nx * ny)].map(|n| n as usize)
}

#[cfg(test)]
mod tests;
