//! Bodies of blocks of cells that a formula puts in place: an octant of a hollow sphere, a quarter of a hollow cylinder,
//! a box with unequal cells.
//!
//! Blocks are lattices of half cells: even positions are corners, the others middles of edges of quadratic elements, which
//! are so put on the curve too. A lattice point has a key that is the same from every block, so that blocks share their
//! nodes. Directions on the sphere are those of the far faces of a cube, at equal angles (Ronchi, Iacono and Paolucci,
//! "The cubed sphere", 1996): three blocks.
//!
//! Each rank makes its share of the cells and the nodes that these need. Nodes are numbered as if one had gone from cell to
//! cell, for each to its corners and then along its elements, and numbered what was new. The first cell that has a lattice
//! point, and how many points are in cells before, have closed forms; so every rank knows the number of any node.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::f64::consts::FRAC_PI_4;

use super::brick::HEXAHEDRON;
use super::faces::key;
use super::form::{Form, Forms};
use super::portion::Portion;
use super::solid::{Counts, NamedSurface};
use super::{SolidMesh, split};
use crate::comm::Comm;
use crate::comm::words::share;
use crate::element::{Cell, Kind};

/// A body.
#[derive(Clone, Debug, PartialEq)]
pub enum Mapped {
    /// Where all coordinates are positive, between two spheres about the origin. Surfaces: `inner`, `outer`, and the planes
    /// `x0`, `y0`, `z0`.
    Sphere {
        /// Radii, 0 < inner < outer.
        radii: [f64; 2],
        /// Cells along half a quarter of a great circle, and through the wall.
        cells: [usize; 2],
    },
    /// Where x and y are positive, between two cylinders about the z axis. Surfaces: `inner`, `outer`, the planes `x0`,
    /// `y0`, and `bottom`, `top`.
    Cylinder {
        /// Radii, 0 < inner < outer.
        radii: [f64; 2],
        /// From z = 0 up.
        height: f64,
        /// Cells along the quarter of a circle, through the wall, and along the axis.
        cells: [usize; 3],
    },
    /// A box cut by planes across the axes. Surfaces: as of a brick.
    Grid {
        /// Where the planes are, ascending, along each axis.
        planes: [Vec<f64>; 3],
    },
}

/// A lattice point of a body, in half cells: for a sphere its place on the cube and through the wall, else along the axes
/// of the block.
type Key = [usize; 4];

/// A cell: its block, and its place there.
type Place = (usize, [usize; 3]);

impl Mapped {
    /// The mesh, of elements of a kind; each rank makes its share of the cells.
    pub fn mesh(&self, comm: &dyn Comm, kind: Kind) -> SolidMesh {
        let cells: u64 = self.blocks().iter().map(|size| size.iter().product::<usize>() as u64).sum();
        let nodes: u64 = (0..self.blocks().len()).map(|block| self.lattice(block, kind).iter().product::<u64>()).sum();
        let (per_cell, own) = (kind.cell().per_hexahedron(), share(cells, comm));
        let mut surfaces: Vec<NamedSurface> = Vec::new();
        surfaces.extend(self.surfaces().iter().map(|s| NamedSurface { name: s.0.to_owned(), faces: Vec::new() }));
        let (mut known, mut of_elements) = (HashMap::new(), Vec::new());
        for cell in own.clone().map(|cell| self.cell(cell)) {
            let keys = self.elements(cell, kind);
            let begin = of_elements.len();
            of_elements.extend(keys.iter().map(|key| self.number(*key, kind, &mut known)));
            if !self.is_at_end(cell) {
                continue;
            }
            for (nodes, keys) in of_elements[begin..].chunks(kind.nodes()).zip(keys.chunks(kind.nodes())) {
                for face in kind.faces() {
                    for (surface, (_, axis, at)) in surfaces.iter_mut().zip(self.surfaces()) {
                        if face.iter().all(|&k| keys[k][axis] == at) {
                            surface.faces.push(face.iter().map(|&k| nodes[k]).collect());
                        }
                    }
                }
            }
        }
        let keys: HashMap<u32, Key> = known.into_iter().map(|(key, number)| (number, key)).collect();
        let portion = Portion::new(kind, (per_cell * own.start) as u32, &of_elements, |node| self.place(keys[&node]));
        let counts = Counts { nodes, cells, elements: per_cell * cells };
        SolidMesh { pieces: vec![0; portion.len()], portion, surfaces, piece_count: 1, counts }
    }

    /// The sphere or cylinder that each of its curved surfaces is on, with own faces (corners, ascending). Collective.
    pub fn forms(&self, comm: &dyn Comm, mesh: &SolidMesh) -> Forms {
        let (point, axis) = ([0.0; 3], [0.0, 0.0, 1.0]);
        let all = match *self {
            Self::Sphere { radii, .. } => radii.map(|radius| Form::Sphere { centre: point, radius }).to_vec(),
            Self::Cylinder { radii, .. } => {
                radii.map(|radius| Form::Cone { point, axis, radius, opening: 0.0 }).to_vec()
            }
            Self::Grid { .. } => Vec::new(),
        };
        let of_surface = |(form, name): (u32, &str)| {
            mesh.surface(name).iter().map(|face| (key(&face[..3]), form)).collect::<Vec<_>>()
        };
        let faces =
            if all.is_empty() { Vec::new() } else { (0..).zip(["inner", "outer"]).flat_map(of_surface).collect() };
        Forms::new(comm, &mesh.portion.nodes, all, faces.into_iter().collect())
    }

    /// A cell by its number, x fastest, block after block.
    fn cell(&self, number: u64) -> Place {
        let mut rest = number as usize;
        for (block, size) in self.blocks().into_iter().enumerate() {
            let cells: usize = size.iter().product();
            if rest < cells {
                return (block, [rest % size[0], rest / size[0] % size[1], rest / (size[0] * size[1])]);
            }
            rest -= cells;
        }
        panic!("there is no cell {number}")
    }

    fn is_at_end(&self, (block, cell): Place) -> bool {
        let size = self.blocks()[block];
        (0..3).any(|a| cell[a] == 0 || cell[a] + 1 == size[a])
    }

    /// Corners of a cell.
    fn corners(&self, (block, cell): Place) -> [Key; 8] {
        HEXAHEDRON.map(|v| self.key(block, std::array::from_fn(|a| 2 * (cell[a] + (v >> a & 1)))))
    }

    /// Nodes of the elements of a cell, element after element.
    fn elements(&self, cell: Place, kind: Kind) -> Vec<Key> {
        let corners = self.corners(cell);
        let mut nodes = Vec::new();
        let mut add = |corners: &[Key]| {
            nodes.extend(corners);
            let middle =
                |&(a, b): &(usize, usize)| -> Key { std::array::from_fn(|k| (corners[a][k] + corners[b][k]) / 2) };
            nodes.extend(kind.middles().iter().map(middle));
        };
        match kind.cell() {
            Cell::Hexahedron => add(&corners),
            Cell::Tetrahedron => {
                let numbers = corners.map(|key| self.number_of_corner(key, kind));
                let key = |number: u32| corners[numbers.iter().position(|&n| n == number).expect("it is a corner")];
                split::tetrahedra(&numbers, |tet| add(&tet.map(key)));
            }
        }
        nodes
    }

    /// The number of a node. `known` has some, and then also those of all nodes that are first in the same cell.
    fn number(&self, key: Key, kind: Kind, known: &mut HashMap<Key, u32>) -> u32 {
        if let Some(&number) = known.get(&key) {
            return number;
        }
        let cell = self.first_cell(key);
        let mut next = self.nodes_before(cell, kind) as u32;
        for key in self.corners(cell).into_iter().chain(self.elements(cell, kind)) {
            if self.first_cell(key) == cell && !known.contains_key(&key) {
                known.insert(key, next);
                next += 1;
            }
        }
        known[&key]
    }

    /// The number of a corner.
    fn number_of_corner(&self, key: Key, kind: Kind) -> u32 {
        let cell = self.first_cell(key);
        let new = self.corners(cell).into_iter().filter(|&other| self.first_cell(other) == cell);
        self.nodes_before(cell, kind) as u32 + new.take_while(|&other| other != key).count() as u32
    }

    /// The first cell that has a lattice point.
    fn first_cell(&self, key: Key) -> Place {
        let (block, at) = match self {
            Self::Sphere { cells: [around, _], .. } => {
                let block = (0..3).find(|&block| key[block] == 2 * around).expect("it is on a far face of the cube");
                (block, [key[(block + 1) % 3], key[(block + 2) % 3], key[3]])
            }
            _ => (0, [key[0], key[1], key[2]]),
        };
        (block, at.map(|position| position.saturating_sub(1) / 2))
    }

    /// Whether the last nodes along an axis of a block are those of a block before.
    fn is_shared(&self, block: usize, axis: usize) -> bool {
        matches!((block, axis), (1, 1) | (2, 0 | 1))
    }

    /// Nodes along each axis of a block that no block before has.
    fn lattice(&self, block: usize, kind: Kind) -> [u64; 3] {
        let size = self.blocks()[block];
        [0, 1, 2].map(|a| (kind.degree() * size[a] + 1 - usize::from(self.is_shared(block, a))) as u64)
    }

    /// Nodes whose first cell is before this one.
    fn nodes_before(&self, (block, cell): Place, kind: Kind) -> u64 {
        let (degree, size, all) = (kind.degree(), self.blocks()[block], self.lattice(block, kind));
        let before = |a: usize| if cell[a] == 0 { 0 } else { (degree * cell[a] + 1) as u64 };
        let here = |a: usize| {
            let is_shared = cell[a] + 1 == size[a] && self.is_shared(block, a);
            (degree + usize::from(cell[a] == 0) - usize::from(is_shared)) as u64
        };
        let of_blocks: u64 = (0..block).map(|block| self.lattice(block, kind).iter().product::<u64>()).sum();
        of_blocks + all[0] * all[1] * before(2) + here(2) * (all[0] * before(1) + here(1) * before(0))
    }

    /// Cells of each block along its axes.
    fn blocks(&self) -> Vec<[usize; 3]> {
        match self {
            Self::Sphere { cells: [around, through], .. } => vec![[*around, *around, *through]; 3],
            Self::Cylinder { cells: [around, through, along], .. } => vec![[*through, *around, *along]],
            Self::Grid { planes } => vec![[0, 1, 2].map(|a| planes[a].len() - 1)],
        }
    }

    /// Of a lattice point of a block. Axes turn right: on the sphere the block's own two, then outwards.
    fn key(&self, block: usize, [i, j, k]: [usize; 3]) -> Key {
        let Self::Sphere { cells: [around, _], .. } = self else { return [i, j, k, 0] };
        let mut key = [2 * around, 0, 0, k];
        key[block] = 2 * around;
        key[(block + 1) % 3] = i;
        key[(block + 2) % 3] = j;
        key
    }

    fn place(&self, key: Key) -> [f64; 3] {
        let share = |k: usize, cells: usize| key[k] as f64 / (2 * cells) as f64;
        match self {
            Self::Sphere { radii, cells: [around, through] } => {
                let on_cube = [0, 1, 2].map(|a| (FRAC_PI_4 * share(a, *around)).tan());
                let length = on_cube.iter().map(|x| x * x).sum::<f64>().sqrt();
                let radius = between(radii, share(3, *through));
                on_cube.map(|x| radius * (x / length))
            }
            Self::Cylinder { radii, height, cells: [around, through, along] } => {
                let (radius, turned) = (between(radii, share(0, *through)), share(1, *around));
                let (sin, cos) = if turned == 1.0 { (1.0, 0.0) } else { (FRAC_PI_2 * turned).sin_cos() };
                [radius * cos, radius * sin, height * share(2, *along)]
            }
            Self::Grid { planes } => [0, 1, 2].map(|a| {
                let plane = planes[a][key[a] / 2];
                if key[a].is_multiple_of(2) { plane } else { 0.5 * (plane + planes[a][key[a] / 2 + 1]) }
            }),
        }
    }

    /// Names, and the place in the key with its value there.
    fn surfaces(&self) -> Vec<(&'static str, usize, usize)> {
        match self {
            Self::Sphere { cells: [_, through], .. } => {
                vec![("inner", 3, 0), ("outer", 3, 2 * through), ("x0", 0, 0), ("y0", 1, 0), ("z0", 2, 0)]
            }
            Self::Cylinder { cells: [around, through, along], .. } => vec![
                ("inner", 0, 0),
                ("outer", 0, 2 * through),
                ("x0", 1, 2 * around),
                ("y0", 1, 0),
                ("bottom", 2, 0),
                ("top", 2, 2 * along),
            ],
            Self::Grid { planes } => {
                let ends = |a: usize| {
                    [(["xmin", "ymin", "zmin"][a], a, 0), (["xmax", "ymax", "zmax"][a], a, 2 * planes[a].len() - 2)]
                };
                (0..3).flat_map(ends).collect()
            }
        }
    }
}

/// Radius at a share of the wall.
fn between([inner, outer]: &[f64; 2], share: f64) -> f64 {
    if share == 1.0 { *outer } else { inner + share * (outer - inner) }
}

#[cfg(test)]
mod tests;
