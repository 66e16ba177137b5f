//! The linear tetrahedron: constant gradients, one integration point, its volume as weight (Hughes, The Finite Element
//! Method, 3.A). Locks in isochoric flow, as every conforming linear tetrahedron does; nothing here cures that.

use super::cell::barycentric;
use super::{Cell, Element, Gmsh, Nodal, Point, Sample};
use crate::vector::{cross, dot};

/// The element.
pub struct Tet4;

impl Element<4, 1> for Tet4 {
    const CELL: Cell = Cell::Tetrahedron;
    const DEGREE: usize = 1;
    const FACES: &'static [&'static [usize]] = &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]];
    const MIDDLES: &'static [(usize, usize)] = &[];
    const TETRAHEDRA: u64 = 1;
    const BEST_AT_CENTRE: bool = false;
    const VTK: u8 = 10;
    const GMSH: Gmsh = Gmsh { cell: 4, face: 2, order: &[0, 1, 2, 3], needs: None };

    #[inline(always)]
    fn points(corners: &Nodal<4>) -> [Point<4>; 1] {
        let (determinant, [a, b, c]) = edges(corners);
        let [b, c, d] = [cross(b, c), cross(c, a), cross(a, b)].map(|g| g.map(|x| x / determinant));
        let a = std::array::from_fn(|i| -(b[i] + c[i] + d[i]));
        [Point { weight: determinant / 6.0, gradients: [a, b, c, d], dilatation: None }]
    }

    fn values_at_points() -> [[f64; 4]; 1] {
        [[0.25; 4]]
    }

    /// Six times the signed volume over the cube of the longest edge, times the root of two: at most 1, for the regular
    /// tetrahedron; negative if corners 1, 2, 3 turn clockwise seen from corner 0; not a number for coincident corners.
    fn shape(corners: &Nodal<4>) -> f64 {
        let mut longest = 0.0f64;
        for a in 0..4 {
            for b in 0..a {
                let edge: [f64; 3] = std::array::from_fn(|i| corners[a][i] - corners[b][i]);
                longest = longest.max(dot(edge, edge));
            }
        }
        std::f64::consts::SQRT_2 * edges(corners).0 / (longest * longest.sqrt())
    }

    fn values(at: &[f64]) -> [f64; 4] {
        barycentric(at)
    }

    fn extrapolation(_: &[f64]) -> [f64; 1] {
        [1.0]
    }

    fn sample(corners: &Nodal<4>, at: &[f64], weight: f64) -> Sample {
        let [point] = Self::points(corners);
        // The reference tetrahedron has the volume 1/6.
        let weight = weight * 6.0 * point.weight;
        Sample { weight, values: at.to_vec(), gradients: point.gradients.to_vec() }
    }
}

/// Six times the signed volume, and the edges from corner 0.
#[inline(always)]
fn edges(corners: &[[f64; 3]; 4]) -> (f64, [[f64; 3]; 3]) {
    let [a, b, c] = [1, 2, 3].map(|n| std::array::from_fn(|i| corners[n][i] - corners[0][i]));
    (dot(a, cross(b, c)), [a, b, c])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::DEGENERATE;

    const REFERENCE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn unit_tetrahedron() {
        let [point] = Tet4::points(&REFERENCE);
        assert_eq!(point.weight, 1.0 / 6.0);
        assert_eq!(point.gradients, [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[test]
    fn flat_and_inverted_and_coincident_corners_are_refused() {
        let [a, b, c, d] = REFERENCE;
        let is_sound = |corners: &[[f64; 3]; 4]| Tet4::shape(corners) > DEGENERATE;
        assert!(!is_sound(&[a, c, b, d]));
        assert!(!is_sound(&[a, b, c, [0.3, 0.3, 0.0]]));
        assert!(!is_sound(&[a, a, a, a]));
        assert!(is_sound(&[a, b, c, d].map(|x| x.map(|v| 1e-60 * v))));
        assert!(is_sound(&[a, b, c, [0.3, 0.3, 1e-9]]));
    }
}
