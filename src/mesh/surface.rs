//! Flat boundary triangles: area, outward normal, and the nodal forces of a constant traction.
//!
//! Corners turn counterclockwise seen from outside. Linear shape functions integrate to a third of the area each, so a
//! traction t gives t area / 3 to every corner; that is exact for constant tractions only.

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

/// Force on each of the three corners under a constant traction (force per area).
pub fn corner_force(corners: &[[f64; 3]; 3], traction: &[f64; 3]) -> [f64; 3] {
    let third = area(corners) / 3.0;
    traction.map(|t| third * t)
}

fn length(v: &[f64; 3]) -> f64 {
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
        assert_eq!(corner_force(&corners, &[0.0, 6.0, -150.0]), [0.0, 6.0, -150.0]);
        assert_eq!(normal(&[[1.0; 3]; 3]), None);
    }
}
