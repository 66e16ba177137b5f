//! Boundary faces: areas and normals, shared out to their nodes as the shape functions do.
//!
//! Corners turn counter-clockwise seen from outside. Linear shape functions of a triangle integrate to a third of the area
//! each. On a quadrilateral the normal, times the size of a surface element, is bilinear; so the integral for a corner is a
//! sixth of the whole area and of that of the triangle of the corner and its neighbours: the mean of both ways to cut the
//! face into triangles.

use crate::vector::length;

/// Angle between faces from which they meet at an edge, in degrees: that of most mesh generators.
pub const SHARPEST: f64 = 40.0;

/// Half the cross product of two edges: area times unit normal.
pub fn area_vector(corners: &[[f64; 3]; 3]) -> [f64; 3] {
    let [a, b]: [[f64; 3]; 2] = [1, 2].map(|n| std::array::from_fn(|i| corners[n][i] - corners[0][i]));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]].map(|c| 0.5 * c)
}

/// Area of a triangle.
pub fn area(corners: &[[f64; 3]; 3]) -> f64 {
    length(area_vector(corners))
}

/// Outward unit normal, or `None` if the triangle has no area.
pub fn normal(corners: &[[f64; 3]; 3]) -> Option<[f64; 3]> {
    let vector = area_vector(corners);
    let area = length(vector);
    (area > 0.0).then(|| vector.map(|c| c / area))
}

/// Integral over a face of each node's shape function times the unit normal (area): what a unit pressure inwards takes
/// from the nodes.
///
/// # Panics
/// If no face has so many nodes.
pub fn shares(face: &[[f64; 3]]) -> Vec<[f64; 3]> {
    match *face {
        [a, b, c] => vec![area_vector(&[a, b, c]).map(|x| x / 3.0); 3],
        [a, b, c, d] => {
            let whole = [[a, b, c], [a, c, d]].map(|t| area_vector(&t));
            let of_corner = [[d, a, b], [a, b, c], [b, c, d], [c, d, a]].map(|t| area_vector(&t));
            of_corner.map(|own| std::array::from_fn(|i| (whole[0][i] + whole[1][i] + own[i]) / 6.0)).to_vec()
        }
        [a, b, c, ab, bc, ca] => {
            let mut shares = vec![[0.0; 3]; 6];
            for (values, normal) in quadratic_points(&[a, b, c, ab, bc, ca]) {
                for (share, value) in shares.iter_mut().zip(values) {
                    (0..3).for_each(|i| share[i] += value * normal[i]);
                }
            }
            shares
        }
        _ => panic!("no face has {} nodes", face.len()),
    }
}

/// Integral over a face of each node's shape function (area): what a unit traction gives to the nodes. A quadrilateral is
/// taken as flat.
///
/// # Panics
/// If no face has so many nodes.
pub fn areas(face: &[[f64; 3]]) -> Vec<f64> {
    match *face {
        [a, b, c] => vec![area(&[a, b, c]) / 3.0; 3],
        [a, b, c, ab, bc, ca] => {
            let mut areas = vec![0.0; 6];
            for (values, normal) in quadratic_points(&[a, b, c, ab, bc, ca]) {
                areas.iter_mut().zip(values).for_each(|(area, value)| *area += value * length(normal));
            }
            areas
        }
        _ => shares(face).iter().map(length).collect(),
    }
}

/// Six points of a triangle with quadratic shape functions, which may be curved: their values, and the normal times the
/// area that the point stands for.
fn quadratic_points(face: &[[f64; 3]; 6]) -> impl Iterator<Item = ([f64; 6], [f64; 3])> {
    quartic().map(move |(weight, [p, q, r])| {
        let corners = [p, q, r].map(|x| x * (2.0 * x - 1.0));
        let values = [corners[0], corners[1], corners[2], 4.0 * p * q, 4.0 * q * r, 4.0 * r * p];
        (values, quadratic_normal(face, [p, q, r]).map(|x| weight * x))
    })
}

/// Normal of a face with quadratic shape functions at a place between its corners, times the area of a flat one.
pub fn quadratic_normal(face: &[[f64; 3]; 6], [p, q, r]: [f64; 3]) -> [f64; 3] {
    let first = [1.0 - 4.0 * p, 4.0 * q - 1.0, 0.0, 4.0 * (p - q), 4.0 * r, -4.0 * r];
    let second = [1.0 - 4.0 * p, 0.0, 4.0 * r - 1.0, -4.0 * q, 4.0 * q, 4.0 * (p - r)];
    let along = |d: [f64; 6]| std::array::from_fn(|i| (0..6).map(|k| d[k] * face[k][i]).sum());
    area_vector(&[[0.0; 3], along(first), along(second)])
}

/// Places in a triangle between its corners, with shares of its area: exact for polynomials of degree four (Dunavant 1985).
pub fn quartic() -> impl Iterator<Item = (f64, [f64; 3])> {
    const RULE: [(f64, f64, f64); 2] = [
        (0.445_948_490_915_965, 0.108_103_018_168_070, 0.223_381_589_678_011),
        (0.091_576_213_509_771, 0.816_847_572_980_459, 0.109_951_743_655_322),
    ];
    (0..6).map(|k| {
        let (twice, once, weight) = RULE[k / 3];
        (weight, std::array::from_fn(|a| if a == k % 3 { once } else { twice }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By Gauss points of the bilinear map, whether the face is flat or not.
    #[test]
    fn quadrilaterals_share_out_as_bilinear_functions_do() {
        for height in [0.0, 0.7] {
            let face = [[0.0, 0.0, 0.0], [2.0, 0.3, 0.0], [1.7, 1.9, height], [-0.4, 1.1, 0.0]];
            let mut expected = [[0.0; 3]; 4];
            let gauss = 1.0 / 3.0_f64.sqrt();
            for (s, t) in [(-gauss, -gauss), (gauss, -gauss), (gauss, gauss), (-gauss, gauss)] {
                let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                let values = signs.map(|(a, b)| 0.25 * (1.0 + a * s) * (1.0 + b * t));
                let along = |d: [f64; 4]| std::array::from_fn(|i| (0..4).map(|k| d[k] * face[k][i]).sum());
                let first = along(signs.map(|(a, b)| 0.25 * a * (1.0 + b * t)));
                let second = along(signs.map(|(a, b)| 0.25 * b * (1.0 + a * s)));
                // Twice the area of the triangle that the two derivatives span.
                let normal = area_vector(&[[0.0; 3], first, second]).map(|x| 2.0 * x);
                for (sum, value) in expected.iter_mut().zip(values) {
                    (0..3).for_each(|i| sum[i] += value * normal[i]);
                }
            }
            for (found, expected) in shares(&face).iter().zip(expected) {
                assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 1e-15), "{found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn middles_of_a_flat_quadratic_triangle_get_a_third_each_and_corners_nothing() {
        let corners = [[1.0, 1.0, 2.0], [3.0, 1.0, 2.0], [1.0, 4.0, 2.0]];
        let middle = |a: usize, b: usize| std::array::from_fn(|i| 0.5 * (corners[a][i] + corners[b][i]));
        let [a, b, c] = corners;
        let face = [a, b, c, middle(0, 1), middle(1, 2), middle(2, 0)];
        for (k, (share, area)) in shares(&face).iter().zip(areas(&face)).enumerate() {
            let expected = if k < 3 { 0.0 } else { 1.0 };
            assert!((share[2] - expected).abs() + share[0].abs() + share[1].abs() < 1e-13, "{share:?}");
            assert!((area - expected).abs() < 1e-13, "{area}");
        }
    }

    /// Area vectors of curved faces depend on their rim alone: that of a pyramid over the same rim.
    #[test]
    fn shares_of_a_curved_triangle_add_up_to_the_vector_of_its_rim() {
        let face = [[0.0; 3], [2.0, 0.0, 0.1], [0.2, 1.5, 0.0], [1.0, -0.2, 0.3], [1.2, 0.9, 0.4], [0.0, 0.7, -0.2]];
        let sum = shares(&face).iter().fold([0.0; 3], |sum, s| std::array::from_fn(|i| sum[i] + s[i]));
        let mut expected = [0.0; 3];
        for (a, b, m) in [(0, 1, 3), (1, 2, 4), (2, 0, 5)] {
            // Half the integral of x cross dx along a parabola, by three points of Simpson's rule on its exact derivative.
            for (t, w) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
                let values = [(1.0 - t) * (1.0 - 2.0 * t), t * (2.0 * t - 1.0), 4.0 * t * (1.0 - t)];
                let slopes = [4.0 * t - 3.0, 4.0 * t - 1.0, 4.0 - 8.0 * t];
                let along = |d: [f64; 3]| -> [f64; 3] {
                    std::array::from_fn(|i| d[0] * face[a][i] + d[1] * face[b][i] + d[2] * face[m][i])
                };
                let part = area_vector(&[[0.0; 3], along(values), along(slopes)]);
                (0..3).for_each(|i| expected[i] += w * part[i]);
            }
        }
        assert!((0..3).all(|i| (sum[i] - expected[i]).abs() < 1e-13), "{sum:?} {expected:?}");
    }

    #[test]
    fn area_normal_and_thirds() {
        let corners = [[1.0, 1.0, 2.0], [3.0, 1.0, 2.0], [1.0, 4.0, 2.0]];
        assert_eq!(area(&corners), 3.0);
        assert_eq!(normal(&corners), Some([0.0, 0.0, 1.0]));
        assert_eq!(shares(&corners), [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(areas(&corners), [1.0; 3]);
        assert_eq!(normal(&[[1.0; 3]; 3]), None);
    }
}
