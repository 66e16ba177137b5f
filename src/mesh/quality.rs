//! Counts the tetrahedra of a mesh that no computation could use, before anything is computed with them.
//!
//! The shape of a tetrahedron is six times its signed volume over the cube of its longest edge, scaled to 1 for the
//! regular one. Only solvability is judged here: a small positive shape costs accuracy and is merely reported.

use crate::element::tet4::{DEGENERATE, relative_volume};

/// What is wrong with a mesh, if anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Tetrahedra looked at.
    pub elements: u64,
    /// Tetrahedra with negative volume: their corners are listed in the wrong sense.
    pub inverted: u64,
    /// Tetrahedra without volume: flat, or with coincident corners.
    pub degenerate: u64,
    /// Least shape among the sound tetrahedra, in (0, 1]; 1 if there is none.
    pub worst_shape: f64,
}

impl Quality {
    /// Judges tetrahedra given by the coordinates of their corners.
    pub fn of(tets: impl IntoIterator<Item = [[f64; 3]; 4]>) -> Self {
        let mut quality = Self { elements: 0, inverted: 0, degenerate: 0, worst_shape: 1.0 };
        for corners in tets {
            quality.elements += 1;
            let ratio = relative_volume(&corners);
            if ratio > DEGENERATE {
                quality.worst_shape = quality.worst_shape.min(std::f64::consts::SQRT_2 * ratio);
            } else if ratio < -DEGENERATE {
                quality.inverted += 1;
            } else {
                quality.degenerate += 1;
            }
        }
        quality
    }

    /// Whether every tetrahedron has a positive volume.
    pub fn is_sound(&self) -> bool {
        self.inverted == 0 && self.degenerate == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverted_and_flat_tetrahedra_are_counted() {
        let [a, b, c, d] = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let regular = Quality::of([[a, b, c, d]]);
        assert!(regular.is_sound() && (regular.worst_shape - 1.0).abs() < 1e-14);
        let bad = Quality::of([[a, b, c, d], [a, c, b, d], [a, b, c, [0.0, 0.5, -0.5]], [a, a, b, c], [a; 4]]);
        assert_eq!((bad.elements, bad.inverted, bad.degenerate, bad.is_sound()), (5, 1, 3, false));
    }
}
