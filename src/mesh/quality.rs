//! Counts the elements of a mesh that no computation could use, before anything is computed with them.
//!
//! Only solvability is judged here: a small positive shape (`Kind::shape`) costs accuracy
//! and is merely reported.

use super::SolidMesh;
use crate::element::DEGENERATE;

/// What is wrong with a mesh, if anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Elements looked at.
    pub elements: u64,
    /// Elements with negative volume: their corners are listed in the wrong sense.
    pub inverted: u64,
    /// Elements without volume: flat, or with coincident corners.
    pub degenerate: u64,
    /// Least shape among the sound elements, in (0, 1]; 1 if there is none.
    pub worst_shape: f64,
    /// Centre of the first element that is not sound.
    pub first: Option<[f64; 3]>,
}

impl Quality {
    /// Judges the elements of a mesh.
    pub fn of(mesh: &SolidMesh) -> Self {
        let mut quality = Self { elements: 0, inverted: 0, degenerate: 0, worst_shape: 1.0, first: None };
        for nodes in &mesh.elements {
            quality.elements += 1;
            let places: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n as usize]).collect();
            let shape = mesh.elements.kind().shape(&places);
            if shape > DEGENERATE {
                quality.worst_shape = quality.worst_shape.min(shape);
                continue;
            }
            if shape < -DEGENERATE {
                quality.inverted += 1;
            } else {
                quality.degenerate += 1;
            }
            let count = places.len() as f64;
            let centre = || std::array::from_fn(|a| places.iter().map(|place| place[a] / count).sum());
            quality.first.get_or_insert_with(centre);
        }
        quality
    }

    /// Whether every element has a positive volume.
    pub fn is_sound(&self) -> bool {
        self.inverted == 0 && self.degenerate == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Kind;
    use crate::mesh::Elements;

    fn of_tets(tets: &[[[f64; 3]; 4]]) -> Quality {
        let elements = Elements::new(Kind::Tet4, (0..4 * tets.len() as u32).collect());
        let (points, surfaces, regions, pieces) = (tets.concat(), Vec::new(), Vec::new(), Vec::new());
        Quality::of(&SolidMesh { points, elements, cells: 0, surfaces, regions, pieces })
    }

    #[test]
    fn inverted_and_flat_tetrahedra_are_counted() {
        let [a, b, c, d] = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let regular = of_tets(&[[a, b, c, d]]);
        assert!(regular.is_sound() && (regular.worst_shape - 1.0).abs() < 1e-14 && regular.first.is_none());
        let bad = of_tets(&[[a, b, c, d], [a, c, b, d], [a, b, c, [0.0, 0.5, -0.5]], [a, a, b, c], [a; 4]]);
        assert_eq!((bad.elements, bad.inverted, bad.degenerate, bad.is_sound()), (5, 1, 3, false));
        assert_eq!(bad.first, Some([0.0; 3]));
    }
}
