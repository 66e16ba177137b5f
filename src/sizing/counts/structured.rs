//! Cells and nodes of structured bodies by closed forms: in all, and on some of their surfaces.
//!
//! A brick, a grid and a part of a cylinder are one lattice; a lattice's nodes that are on none of some of its faces are a
//! lattice again. An octant of a sphere is layers of three squares that meet in a corner: with `a` edges along a square
//! `3 a (a + 1) + 1` nodes, of which each of the three planes has `2 a + 1`, any two planes one in common.

use crate::decomposition::Counts;
use crate::element::Kind;
use crate::scene::{self, Cylinder, Face, Grid, Sphere};

/// A structured body's cells.
#[derive(Clone, Copy, Debug)]
enum Cells {
    /// Along each axis of a lattice.
    Lattice([u64; 3]),
    /// Along half an edge, and through the wall.
    Sphere([u64; 2]),
    /// Those of a mesh from a file.
    Mesh(Counts),
}

/// A body whose nodes can be counted.
pub struct Structured<'a> {
    kind: Kind,
    shape: &'a scene::Shape,
    cells: Cells,
}

impl<'a> Structured<'a> {
    /// Of a body; `None` if its mesh is from a file.
    pub fn new(body: &'a scene::Body) -> Option<Self> {
        let wide = |n: usize| n as u64;
        let cells = match &body.shape {
            scene::Shape::Brick(brick) => Cells::Lattice(brick.cells.map(wide)),
            scene::Shape::Grid(Grid { x, y, z }) => Cells::Lattice([x, y, z].map(|planes| wide(planes.len() - 1))),
            scene::Shape::Cylinder(Cylinder { cells: [around, through, along], .. }) => {
                Cells::Lattice([*through, *around, *along].map(wide))
            }
            scene::Shape::Sphere(Sphere { cells, .. }) => Cells::Sphere(cells.map(wide)),
            scene::Shape::Gmsh(_) => return None,
        };
        Some(Self { kind: body.element, shape: &body.shape, cells })
    }

    /// Of a mesh from a file, whose surfaces are taken for those of a cube.
    pub fn of_mesh(body: &'a scene::Body, counts: Counts) -> Self {
        Self { kind: body.element, shape: &body.shape, cells: Cells::Mesh(counts) }
    }

    /// Sizes of its mesh.
    pub fn counts(&self) -> Counts {
        let cells = match self.cells {
            Cells::Lattice(cells) => cells.iter().product(),
            Cells::Sphere([around, through]) => 3 * around * around * through,
            Cells::Mesh(counts) => return counts,
        };
        Counts { nodes: self.nodes(), cells, elements: self.kind.cell().per_hexahedron() * cells }
    }

    /// Nodes along each axis of a lattice with as many as the body has, or about as many.
    pub fn extent(&self) -> [f64; 3] {
        let degree = self.kind.degree() as u64;
        match self.cells {
            Cells::Lattice(cells) => cells.map(|n| (degree * n + 1) as f64),
            Cells::Sphere([around, through]) => {
                let edge = (layer(degree * around) as f64).sqrt();
                [edge, edge, (degree * through + 1) as f64]
            }
            Cells::Mesh(counts) => [(counts.nodes as f64).cbrt(); 3],
        }
    }

    fn nodes(&self) -> u64 {
        let degree = self.kind.degree() as u64;
        match self.cells {
            Cells::Lattice(cells) => cells.iter().map(|n| degree * n + 1).product(),
            Cells::Sphere([around, through]) => layer(degree * around) * (degree * through + 1),
            Cells::Mesh(counts) => counts.nodes,
        }
    }

    /// Boxes of so many cells, which divide those of a brick, at at least one of these faces.
    pub fn boxes_on(&self, cells: [usize; 3], faces: &[&str]) -> u64 {
        let Cells::Lattice(all) = self.cells else { return 0 };
        let ends = self.ends(faces);
        let along = [0, 1, 2].map(|a| all[a] / cells[a] as u64);
        let beside: u64 = [0, 1, 2].iter().map(|&a| along[a].saturating_sub(ends(a))).product();
        along.iter().product::<u64>() - beside
    }

    /// How many of its two ends along an axis are among these surfaces.
    fn ends(&self, surfaces: &[&str]) -> impl Fn(usize) -> u64 {
        let ends: Vec<(usize, bool)> = surfaces.iter().filter_map(|name| self.end(name)).collect();
        move |axis| [false, true].iter().filter(|upper| ends.contains(&(axis, **upper))).count() as u64
    }

    /// Nodes on at least one of these surfaces.
    pub fn on(&self, surfaces: &[&str]) -> u64 {
        let degree = self.kind.degree() as u64;
        let named = self.ends(surfaces);
        let beside: u64 = match self.cells {
            Cells::Lattice(cells) => [0, 1, 2].iter().map(|&a| degree * cells[a] + 1 - named(a)).product(),
            Cells::Sphere([around, through]) => {
                let edge = degree * around;
                let planes = (1..=3).filter(|&axis| named(axis) > 0).count() as u64;
                let on_planes = planes * (2 * edge + 1) - planes * planes.saturating_sub(1) / 2;
                (degree * through + 1 - named(0)) * (layer(edge) - on_planes)
            }
            Cells::Mesh(counts) => {
                let on = surfaces.len() as f64 * (counts.nodes as f64).powf(2.0 / 3.0);
                counts.nodes.saturating_sub(on as u64)
            }
        };
        self.nodes() - beside
    }

    /// The axis that a surface ends, and whether it is the upper end. On a sphere the first axis is the radius, and each of the
    /// planes has an axis of its own.
    fn end(&self, surface: &str) -> Option<(usize, bool)> {
        let known: &[(&str, (usize, bool))] = match self.shape {
            scene::Shape::Sphere(_) => &[
                ("inner", (0, false)),
                ("outer", (0, true)),
                ("x0", (1, false)),
                ("y0", (2, false)),
                ("z0", (3, false)),
            ],
            scene::Shape::Cylinder(_) => &[
                ("inner", (0, false)),
                ("outer", (0, true)),
                ("y0", (1, false)),
                ("x0", (1, true)),
                ("bottom", (2, false)),
                ("top", (2, true)),
            ],
            _ => {
                let face = Face::ALL.into_iter().find(|face| face.name() == surface)?;
                return Some((face.axis().index(), face.is_max()));
            }
        };
        known.iter().find(|(name, _)| *name == surface).map(|(_, end)| *end)
    }
}

/// Nodes of a layer of a sphere with so many edges along half of a quarter of a circle.
fn layer(edges: u64) -> u64 {
    3 * edges * (edges + 1) + 1
}
