//! Where a mesh is put: scaled, then rotated about an axis through the origin, then moved.

/// A similarity of space that keeps orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Factor of all lengths, > 0.
    pub scale: f64,
    /// Axis of rotation, not zero, and angle in degrees, counter-clockwise seen against the axis.
    pub rotation: Option<([f64; 3], f64)>,
    /// What is added in the end.
    pub translation: [f64; 3],
}

impl Placement {
    /// Moves points: Rodrigues' formula. Multiples of 90 degrees about a coordinate axis are exact.
    pub fn apply(&self, points: &mut [[f64; 3]]) {
        let matrix = self.rotation.map(|(axis, degrees)| rotation(axis, degrees));
        for point in points {
            let scaled = point.map(|x| self.scale * x);
            let turned = match &matrix {
                Some(rows) => rows.map(|row| row[0] * scaled[0] + row[1] * scaled[1] + row[2] * scaled[2]),
                None => scaled,
            };
            *point = std::array::from_fn(|a| turned[a] + self.translation[a]);
        }
    }
}

fn rotation(axis: [f64; 3], degrees: f64) -> [[f64; 3]; 3] {
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let n = axis.map(|x| x / length);
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    };
    let cross = [[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { 1.0 } else { 0.0 };
            cos * unit + sin * cross[i][j] + (1.0 - cos) * n[i] * n[j]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaled_then_turned_then_moved() {
        let mut points = [[1.0, 0.0, 0.0], [0.0, 2.0, 3.0]];
        Placement { scale: 10.0, rotation: Some(([0.0, 0.0, 5.0], 90.0)), translation: [1.0, 2.0, 3.0] }
            .apply(&mut points);
        assert_eq!(points, [[1.0, 12.0, 3.0], [-19.0, 2.0, 33.0]]);
    }

    #[test]
    fn a_third_of_a_turn_about_the_diagonal_permutes_the_axes() {
        let mut points = [[1.0, 2.0, 3.0]];
        Placement { scale: 1.0, rotation: Some(([1.0; 3], 120.0)), translation: [0.0; 3] }.apply(&mut points);
        assert!(points[0].iter().zip([3.0, 1.0, 2.0]).all(|(a, b)| (a - b).abs() < 1e-14), "{points:?}");
    }
}
