//! The linear tetrahedron: constant gradients, one integration point, its volume as weight (Hughes, The Finite Element
//! Method, 3.A). Locks in isochoric flow, as every conforming linear tetrahedron does; nothing here cures that.

use super::{DEGENERATE, Nodal, Point};
use crate::vector::{cross, dot};

/// Values of the shape functions at the integration point.
pub const VALUES: [[f64; 4]; 1] = [[0.25; 4]];

/// Six times the signed volume, and the edges from corner 0.
fn edges(corners: &[[f64; 3]; 4]) -> (f64, [[f64; 3]; 3]) {
    let [a, b, c] = [1, 2, 3].map(|n| std::array::from_fn(|i| corners[n][i] - corners[0][i]));
    (dot(a, cross(b, c)), [a, b, c])
}

/// Six times the signed volume over the cube of the longest edge, times the root of two: at most 1, for the regular
/// tetrahedron; negative if corners 1, 2, 3 turn clockwise seen from corner 0; not a number for coincident corners.
pub fn shape(corners: &[[f64; 3]; 4]) -> f64 {
    let mut longest = 0.0f64;
    for a in 0..4 {
        for b in 0..a {
            let edge: [f64; 3] = std::array::from_fn(|i| corners[a][i] - corners[b][i]);
            longest = longest.max(dot(&edge, &edge));
        }
    }
    std::f64::consts::SQRT_2 * edges(corners).0 / (longest * longest.sqrt())
}

/// The integration point of the element on four corners, or `None` if its [`shape`] is [`DEGENERATE`].
#[inline]
pub fn points(corners: &Nodal<4>) -> Option<[Point<4>; 1]> {
    (shape(corners) > DEGENERATE).then(|| {
        let (determinant, [a, b, c]) = edges(corners);
        let [b, c, d] = [cross(b, c), cross(c, a), cross(a, b)].map(|g| g.map(|x| x / determinant));
        let a = std::array::from_fn(|i| -(b[i] + c[i] + d[i]));
        [Point { weight: determinant / 6.0, gradients: [a, b, c, d], dilatation: None }]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn unit_tetrahedron() {
        let [point] = points(&REFERENCE).expect("it has a volume");
        assert_eq!(point.weight, 1.0 / 6.0);
        assert_eq!(point.gradients, [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[test]
    fn flat_and_inverted_and_coincident_corners_are_refused() {
        let [a, b, c, d] = REFERENCE;
        assert_eq!(points(&[a, c, b, d]), None);
        assert_eq!(points(&[a, b, c, [0.3, 0.3, 0.0]]), None);
        assert_eq!(points(&[a, a, a, a]), None);
        assert!(points(&[a, b, c, d].map(|x| x.map(|v| 1e-60 * v))).is_some());
        assert!(points(&[a, b, c, [0.3, 0.3, 1e-9]]).is_some());
    }
}
