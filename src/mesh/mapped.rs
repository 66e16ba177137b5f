//! Bodies of blocks of cells that a formula puts in place: an octant of a hollow sphere, a quarter of a hollow cylinder,
//! a box with unequal cells.
//!
//! Blocks are lattices of half cells: even positions are corners, the others middles of edges of quadratic elements, which
//! are so put on the curve too. A lattice point has a key that is the same from every block, so that blocks share their
//! nodes. Directions on the sphere are those of the far faces of a cube, at equal angles (Ronchi, Iacono and Paolucci,
//! "The cubed sphere", 1996): three blocks.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::f64::consts::FRAC_PI_4;

use super::brick::{HEXAHEDRON, indices};
use super::faces::Neighbours;
use super::solid::NamedSurface;
use super::{Elements, SolidMesh, split};
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

impl Mapped {
    /// The mesh, of elements of a kind.
    pub fn mesh(&self, kind: Kind) -> SolidMesh {
        let mut nodes = Nodes::default();
        let (mut elements, mut cells) = (Vec::new(), 0);
        for (block, size) in self.blocks().into_iter().enumerate() {
            for cell in indices(&size.map(|n| 0..n)) {
                let corner = |v: usize| std::array::from_fn(|a| 2 * (cell[a] + (v >> a & 1)));
                let corners = HEXAHEDRON.map(|v| nodes.number(self.key(block, corner(v))));
                cells += 1;
                let mut add = |corners: &[u32]| {
                    elements.extend(corners);
                    elements.extend(kind.middles().iter().map(|&(a, b)| nodes.middle(corners[a], corners[b])));
                };
                match kind.cell() {
                    Cell::Hexahedron => add(&corners),
                    Cell::Tetrahedron => split::tetrahedra(&corners, |tet| add(&tet)),
                }
            }
        }
        let points = nodes.keys.iter().map(|&key| self.place(key)).collect();
        let elements = Elements::new(kind, elements);
        let outer: Vec<Vec<u32>> = Neighbours::new(nodes.keys.len(), &elements).outer(&elements).collect();
        let surface = |(name, axis, at): (&str, usize, usize)| {
            let on = |face: &&Vec<u32>| face.iter().all(|&n| nodes.keys[n as usize][axis] == at);
            NamedSurface { name: name.to_owned(), faces: outer.iter().filter(on).cloned().collect() }
        };
        let surfaces = self.surfaces().into_iter().map(surface).collect();
        SolidMesh { points, elements, cells, surfaces, regions: Vec::new(), pieces: Vec::new() }
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

/// Nodes in the order in which elements ask for them.
#[derive(Default)]
struct Nodes {
    keys: Vec<Key>,
    numbers: HashMap<Key, u32>,
}

impl Nodes {
    fn number(&mut self, key: Key) -> u32 {
        let next = self.keys.len() as u32;
        let number = *self.numbers.entry(key).or_insert(next);
        if number == next {
            self.keys.push(key);
        }
        number
    }

    /// Between two corners of a cell.
    fn middle(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.keys[a as usize], self.keys[b as usize]);
        self.number(std::array::from_fn(|k| (a[k] + b[k]) / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::sample::samples;
    use crate::mesh::quality::Quality;
    use crate::mesh::surface::areas;
    use crate::vector::length;
    use std::f64::consts::PI;

    const SPHERE: Mapped = Mapped::Sphere { radii: [100.0, 200.0], cells: [4, 4] };
    const CYLINDER: Mapped = Mapped::Cylinder { radii: [100.0, 200.0], height: 30.0, cells: [8, 4, 2] };
    const KINDS: [Kind; 3] = [Kind::Tet4, Kind::Hex8, Kind::Tet10];

    fn grid() -> Mapped {
        Mapped::Grid { planes: [vec![0.0, 1.0, 3.0], vec![-1.0, 0.0], vec![2.0, 2.5, 4.0, 8.0]] }
    }

    fn volume(mesh: &SolidMesh) -> f64 {
        let of = |nodes: &[u32]| {
            let places: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n as usize]).collect();
            samples(mesh.elements.kind(), &places).iter().map(|s| s.weight).sum::<f64>()
        };
        mesh.elements.iter().map(of).sum()
    }

    fn area(mesh: &SolidMesh, surface: &str) -> f64 {
        let of = |face: &Vec<u32>| {
            let places: Vec<[f64; 3]> = face.iter().map(|&n| mesh.points[n as usize]).collect();
            areas(&places).iter().sum::<f64>()
        };
        mesh.surface(surface).iter().map(of).sum()
    }

    /// Sound, without holes, with surfaces that cover the boundary; volumes and areas are those of the body, up to facets.
    #[test]
    fn meshes_are_sound_and_fill_their_bodies() {
        let curved = 10.0 * PI;
        let areas_of = |radius: f64| 0.5 * PI * radius * radius;
        for kind in KINDS {
            let facets = if kind == Kind::Tet10 { 1e-3 } else { 0.02 };
            for (body, exact, inner) in [
                (&SPHERE, PI / 6.0 * 7e6, areas_of(100.0)),
                (&CYLINDER, 0.25 * PI * 3e4 * 30.0, 50.0 * PI * 30.0),
                (&grid(), 18.0, 0.0),
            ] {
                let mesh = body.mesh(kind);
                let quality = Quality::of(&mesh);
                assert!(quality.is_sound() && quality.worst_shape > 0.05, "{kind:?} {quality:?}");
                assert_eq!(mesh.elements.len() as u64, kind.cell().per_hexahedron() * mesh.cells);
                let neighbours = Neighbours::new(mesh.points.len(), &mesh.elements);
                assert_eq!(neighbours.overlapping, 0);
                let named: usize = mesh.surfaces.iter().map(|s| s.faces.len()).sum();
                assert_eq!(named, neighbours.outer(&mesh.elements).count(), "every outer face is on one surface");
                assert!((volume(&mesh) / exact - 1.0).abs() < facets, "{kind:?} {}", volume(&mesh) / exact);
                if inner > 0.0 {
                    assert!((area(&mesh, "inner") / inner - 1.0).abs() < facets, "{kind:?} {curved}");
                }
            }
        }
    }

    #[test]
    fn nodes_are_on_the_surfaces_that_they_are_named_for() {
        for kind in KINDS {
            for body in [SPHERE, CYLINDER] {
                let mesh = body.mesh(kind);
                let is_sphere = matches!(body, Mapped::Sphere { .. });
                let on = |name: &str, holds: &dyn Fn([f64; 3]) -> bool| {
                    let mut nodes = mesh.surface(name).iter().flatten();
                    assert!(!mesh.surface(name).is_empty() && nodes.all(|&n| holds(mesh.points[n as usize])), "{name}");
                };
                let radius = |[x, y, z]: [f64; 3]| length([x, y, if is_sphere { z } else { 0.0 }]);
                on("inner", &|x| (radius(x) - 100.0).abs() < 1e-12);
                on("outer", &|x| (radius(x) - 200.0).abs() < 1e-12);
                on("x0", &|x| x[0] == 0.0);
                on("y0", &|x| x[1] == 0.0);
                let (name, end) = if is_sphere { ("z0", 0.0) } else { ("top", 30.0) };
                on(name, &|x| x[2] == end);
            }
            let (mesh, origin) = (grid().mesh(kind), [0.0, -1.0, 2.0]);
            for axis in 0..3 {
                let nodes = mesh.surface(["xmin", "ymin", "zmin"][axis]).iter().flatten();
                assert!(nodes.map(|&n| mesh.points[n as usize][axis]).all(|x| x == origin[axis]));
            }
        }
    }
}
