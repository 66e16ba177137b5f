//! Boundary faces: areas and normals, shared out to their nodes as the shape functions do.
//!
//! Corners turn counter-clockwise seen from outside. Linear shape functions of a triangle integrate to a third of the area
//! each, which is exact for constant tractions only.

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

    #[test]
    fn area_normal_and_thirds() {
        let corners = [[1.0, 1.0, 2.0], [3.0, 1.0, 2.0], [1.0, 4.0, 2.0]];
        assert_eq!(area(&corners), 3.0);
        assert_eq!(normal(&corners), Some([0.0, 0.0, 1.0]));
        assert_eq!(shares(&corners), [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(normal(&[[1.0; 3]; 3]), None);
    }
}
