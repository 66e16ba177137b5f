//! Cells with up to eight corners as tetrahedra, so that neighbouring cells cut their common face alike.
//!
//! A quadrilateral is cut by the diagonal through its smallest corner, and a cell is the cone from its smallest corner
//! over the faces that do not have it (Dompierre, Labbe, Vallet and Camarero, "How to subdivide pyramids, prisms and
//! hexahedra into tetrahedra", 1999). Corners are compared by number, so both sides of a face agree whatever lies there.
//! Corners are in Gmsh's order.

/// Faces of a hexahedron, counter-clockwise from outside.
const HEXAHEDRON: [&[usize]; 6] =
    [&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
/// Faces of a prism: corners 0, 1, 2 below 3, 4, 5.
const PRISM: [&[usize]; 5] = [&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
/// Faces of a pyramid with apex 4.
const PYRAMID: [&[usize]; 5] = [&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

/// Tetrahedra that fill a cell of 4 (tetrahedron), 5 (pyramid), 6 (prism) or 8 (hexahedron) corners: 1, 2, 3 or 6.
///
/// # Panics
/// If there is no cell of so many corners.
pub fn tetrahedra(corners: &[u32], mut give: impl FnMut([u32; 4])) {
    let faces: &[&[usize]] = match corners.len() {
        4 => return give([corners[0], corners[1], corners[2], corners[3]]),
        5 => &PYRAMID,
        6 => &PRISM,
        8 => &HEXAHEDRON,
        n => panic!("no cell has {n} corners"),
    };
    let apex = *corners.iter().min().expect("a cell has corners");
    let mut face_corners = Vec::with_capacity(4);
    for face in faces {
        face_corners.clear();
        face_corners.extend(face.iter().map(|&c| corners[c]));
        if !face_corners.contains(&apex) {
            triangles(&face_corners, |[a, b, c]| give([apex, a, b, c]));
        }
    }
}

/// Tetrahedra that fill a cell of so many corners.
pub fn tetrahedra_of(corners: usize) -> u64 {
    match corners {
        8 => 6,
        corners => corners as u64 - 3,
    }
}

/// Triangles that fill a face of 3 or 4 corners.
pub fn triangles(corners: &[u32], mut give: impl FnMut([u32; 3])) {
    let first = (0..corners.len()).min_by_key(|&k| corners[k]).expect("a face has corners");
    let at = |k: usize| corners[(first + k) % corners.len()];
    (2..corners.len()).for_each(|k| give([at(0), at(k - 1), at(k)]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tet4::Tet4;
    use crate::element::{Element, Kind};
    use crate::mesh::Elements;
    use crate::mesh::faces::{Neighbours, key};
    use crate::random::Random;

    /// Corners of a cell in the unit cube, its faces, its volume, and the number of tetrahedra.
    type Cell = (&'static [[f64; 3]], &'static [&'static [usize]], f64, usize);

    const CELLS: [Cell; 4] = [
        (&[A, B, D, E], &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]], 1.0 / 6.0, 1),
        (&[A, B, C, D, [0.5, 0.5, 1.0]], &PYRAMID, 1.0 / 3.0, 2),
        (&[A, B, D, E, F, H], &PRISM, 0.5, 3),
        (&[A, B, C, D, E, F, G, H], &HEXAHEDRON, 1.0, 6),
    ];
    const A: [f64; 3] = [0.0, 0.0, 0.0];
    const B: [f64; 3] = [1.0, 0.0, 0.0];
    const C: [f64; 3] = [1.0, 1.0, 0.0];
    const D: [f64; 3] = [0.0, 1.0, 0.0];
    const E: [f64; 3] = [0.0, 0.0, 1.0];
    const F: [f64; 3] = [1.0, 0.0, 1.0];
    const G: [f64; 3] = [1.0, 1.0, 1.0];
    const H: [f64; 3] = [0.0, 1.0, 1.0];

    /// Whatever the numbers of the corners, the tetrahedra are positive, fill the cell, and leave on each face the
    /// triangles that the face's own corners prescribe.
    #[test]
    fn cells_are_filled_and_faces_cut_by_their_own_corners() {
        let mut random = Random::new(3);
        for (points, faces, volume, count) in CELLS {
            for _ in 0..200 {
                let mut numbers: Vec<u32> = (0..points.len() as u32).map(|k| 10 * k).collect();
                for k in (1..numbers.len()).rev() {
                    let other = ((random.number().abs() * 1e6) as usize) % (k + 1);
                    numbers.swap(k, other);
                }
                let place = |n: u32| points[numbers.iter().position(|&m| m == n).unwrap()];
                let mut tets = Vec::new();
                tetrahedra(&numbers, |tet| tets.push(tet));
                let volume_of = |tet: &[u32; 4]| Tet4::points(&tet.map(place))[0].weight;
                assert!(tets.iter().all(|tet| volume_of(tet) > 0.0));
                let total: f64 = tets.iter().map(volume_of).sum();
                assert!((total - volume).abs() < 1e-14);
                assert_eq!((tets.len(), tetrahedra_of(points.len())), (count, count as u64));

                let tets = Elements::new(Kind::Tet4, tets.concat());
                let neighbours = Neighbours::new(100, &tets);
                assert!(neighbours.overlapping.is_empty());
                let mut outer: Vec<_> = neighbours.outer(&tets).map(|face| key(&face)).collect();
                let mut expected = Vec::new();
                for face in faces {
                    let corners: Vec<u32> = face.iter().map(|&c| numbers[c]).collect();
                    triangles(&corners, |t| expected.push(key(&t)));
                }
                outer.sort();
                expected.sort();
                assert_eq!(outer, expected);
            }
        }
    }
}
