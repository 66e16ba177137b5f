//! Boundary faces: areas and normals, shared out to their nodes as the shape functions do.
//!
//! Corners turn counter-clockwise seen from outside. Linear shape functions of a triangle integrate to a third of the area
//! each. On a quadrilateral the normal, times the size of a surface element, is bilinear; so the integral for a corner is a
//! sixth of the whole area and of that of the triangle of the corner and its neighbours: the mean of both ways to cut the
//! face into triangles.

/// Half the cross product of two edges: area times unit normal.
pub fn area_vector(corners: &[[f64; 3]; 3]) -> [f64; 3] {
    let [a, b]: [[f64; 3]; 2] = [1, 2].map(|n| std::array::from_fn(|i| corners[n][i] - corners[0][i]));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]].map(|c| 0.5 * c)
}

/// Area of a triangle.
pub fn area(corners: &[[f64; 3]; 3]) -> f64 {
    length(&area_vector(corners))
}

/// Outward unit normal, or `None` if the triangle has no area.
pub fn normal(corners: &[[f64; 3]; 3]) -> Option<[f64; 3]> {
    let vector = area_vector(corners);
    let area = length(&vector);
    (area > 0.0).then(|| vector.map(|c| c / area))
}

/// Integral of each node's shape function over a face, times its direction if the face is flat (area): what a unit
/// pressure inwards takes from the nodes.
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
        _ => panic!("no face has {} nodes", face.len()),
    }
}

/// Length of a vector.
pub fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
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
    fn area_normal_and_thirds() {
        let corners = [[1.0, 1.0, 2.0], [3.0, 1.0, 2.0], [1.0, 4.0, 2.0]];
        assert_eq!(area(&corners), 3.0);
        assert_eq!(normal(&corners), Some([0.0, 0.0, 1.0]));
        assert_eq!(shares(&corners), [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(normal(&[[1.0; 3]; 3]), None);
    }
}
