use super::*;
use crate::element::Element;
use crate::element::tet4::Tet4;
use crate::mesh::surface;
use std::collections::HashMap;

const SMALL: Brick = Brick { origin: [600.0, -1.0, 1000.0], size: [3.0, 5.0, 0.7], cells: [4, 3, 2] };

/// What only tests ask.
impl Brick {
    /// Number of tetrahedra.
    pub fn element_count(&self) -> u64 {
        6 * self.cell_count()
    }

    /// Number of triangles on a face of the body.
    pub fn triangle_count(&self, face: Face) -> u64 {
        2 * self.cell_count() / self.cells[face.axis()] as u64
    }
}

impl Face {
    /// Outward unit normal.
    pub fn normal(self) -> [f64; 3] {
        let mut normal = [0.0; 3];
        normal[self.axis()] = if self.is_upper() { 1.0 } else { -1.0 };
        normal
    }
}

fn lower(level: usize) -> Brick {
    Brick { origin: [0.0; 3], size: [3000.0, 1000.0, 1000.0], cells: [30, 10, 10] }.refined(level)
}

fn place<const N: usize>(brick: &Brick, nodes: [u64; N]) -> [[f64; 3]; N] {
    nodes.map(|node| brick.coordinates(brick.node_position(node)))
}

/// A triangle as a sorted triple, and the sign of the permutation that sorts it.
fn sorted(mut triangle: [u64; 3]) -> ([u64; 3], i32) {
    let mut sign = 1;
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        if triangle[a] > triangle[b] {
            triangle.swap(a, b);
            sign = -sign;
        }
    }
    (triangle, sign)
}

#[test]
fn counts_are_those_of_the_papers_table_2() {
    for (level, nodes, cells) in [(1, 7502, 6000), (2, 53802, 48000), (3, 174902, 162000), (4, 406802, 384000)] {
        let brick = lower(level);
        assert_eq!(2 * brick.node_count(), nodes);
        assert_eq!(2 * brick.cell_count(), cells);
        assert_eq!(brick.element_count(), 3 * cells);
        let support = indices(&brick.nodes_on(Face::XMin)).count();
        assert_eq!(6 * support, [726, 2646, 5766, 10086][level - 1]);
    }
}

#[test]
fn numbers_and_positions_are_inverse_and_in_order() {
    for (number, at) in indices(&SMALL.all_nodes()).enumerate() {
        assert_eq!(SMALL.node(at), number as u64);
        assert_eq!(SMALL.node_position(number as u64), at);
    }
    for (number, at) in indices(&SMALL.all_cells()).enumerate() {
        assert_eq!(SMALL.cell(at), number as u64);
        assert_eq!(SMALL.cell_position(number as u64), at);
        assert_eq!(SMALL.element(at, 5), 6 * number as u64 + 5);
    }
    assert_eq!(indices(&SMALL.all_nodes()).count() as u64, SMALL.node_count());
}

#[test]
fn tetrahedra_are_positive_equal_and_fill_the_brick() {
    let mut total = 0.0;
    for cell in indices(&SMALL.all_cells()) {
        for tet in SMALL.tets(cell) {
            let volume = Tet4::points(&place(&SMALL, tet))[0].weight;
            assert!((volume * SMALL.element_count() as f64 / 10.5 - 1.0).abs() < 1e-11);
            total += volume;
        }
    }
    assert!((total - 10.5).abs() < 1e-11);
}

#[test]
fn every_cell_has_the_diagonal_of_the_benchmark_in_all_its_tetrahedra() {
    for cell @ [i, j, k] in indices(&SMALL.all_cells()) {
        let ends = [SMALL.node([i, j + 1, k]), SMALL.node([i + 1, j, k + 1])];
        assert!(SMALL.tets(cell).iter().all(|tet| ends.iter().all(|end| tet.contains(end))));
    }
}

/// Inner triangles belong to two tetrahedra with opposite sense, the others are exactly the triangles of the faces.
#[test]
fn mesh_is_conforming_and_its_boundary_is_the_faces() {
    let mut seen: HashMap<[u64; 3], (usize, i32)> = HashMap::new();
    for cell in indices(&SMALL.all_cells()) {
        for [a, b, c, d] in SMALL.tets(cell) {
            for triangle in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
                let (key, sign) = sorted(triangle);
                let entry = seen.entry(key).or_default();
                *entry = (entry.0 + 1, entry.1 + sign);
            }
        }
    }
    let mut boundary = 0;
    for face in Face::ALL {
        assert_eq!(SMALL.triangles_on(face).count() as u64, SMALL.triangle_count(face));
        for triangle in SMALL.triangles_on(face) {
            let (key, sign) = sorted(triangle);
            assert_eq!(seen.remove(&key), Some((1, sign)), "a face of one tetrahedron, oriented like it");
            boundary += 1;
        }
    }
    assert_eq!(boundary, 4 * (4 * 3 + 3 * 2 + 4 * 2));
    assert!(seen.values().all(|&(count, sign)| count == 2 && sign == 0));
}

#[test]
fn faces_have_their_area_normal_and_nodes() {
    let [x, y, z] = SMALL.size;
    for (face, area) in Face::ALL.into_iter().zip([y * z, y * z, x * z, x * z, x * y, x * y]) {
        let mut total = 0.0;
        for triangle in SMALL.triangles_on(face) {
            let corners = place(&SMALL, triangle);
            total += surface::area(&corners);
            let normal = surface::normal(&corners).expect("it has an area");
            assert!(normal.iter().zip(face.normal()).all(|(a, b)| (a - b).abs() < 1e-12));
            assert!(triangle.iter().all(|&node| SMALL.is_on(face, SMALL.node_position(node))));
        }
        assert!((total - area).abs() < 1e-11);
        assert!(indices(&SMALL.nodes_on(face)).all(|at| SMALL.is_on(face, at)));
    }
}

#[test]
fn ends_are_exact_and_coincident_bodies_have_coincident_nodes() {
    let (lower, upper) = (lower(3), Brick { origin: [600.0, 0.0, 1000.0], ..lower(3) });
    assert_eq!(lower.coordinates([90, 30, 30]), [3000.0, 1000.0, 1000.0]);
    for i in 18..=90 {
        let (below, above) = (lower.coordinates([i, 7, 30]), upper.coordinates([i - 18, 7, 0]));
        assert!(below.iter().zip(above).all(|(a, b)| (a - b).abs() < 1e-12 * 3000.0));
    }
}
