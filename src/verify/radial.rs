//! Fields that depend on the distance from the origin, or from the z axis, alone.

use super::run::Exact;
use crate::tensor::Voigt;

/// Displacement along the radius, and strains: along the radius, around, along the axis.
pub struct Radial<F> {
    /// Whether distances are those from the z axis, not from the origin.
    pub about_axis: bool,
    /// Displacement outwards, strain along the radius, strain around; of a body at a distance.
    pub state: F,
}

impl<F: Fn(usize, f64) -> (f64, [f64; 2])> Radial<F> {
    fn arm(&self, [x, y, z]: [f64; 3]) -> ([f64; 3], f64) {
        let arm = [x, y, if self.about_axis { 0.0 } else { z }];
        let length = arm.iter().map(|x| x * x).sum::<f64>().sqrt();
        (arm.map(|x| x / length), length)
    }
}

impl<F: Fn(usize, f64) -> (f64, [f64; 2])> Exact for Radial<F> {
    fn displacement(&self, body: usize, x: [f64; 3]) -> [f64; 3] {
        let (n, r) = self.arm(x);
        let (outwards, _) = (self.state)(body, r);
        n.map(|n| outwards * n)
    }

    fn strain(&self, body: usize, x: [f64; 3]) -> Voigt {
        let (n, r) = self.arm(x);
        let (_, [radial, around]) = (self.state)(body, r);
        let more = radial - around;
        let along_axis = if self.about_axis { 0.0 } else { around };
        [
            around + more * n[0] * n[0],
            around + more * n[1] * n[1],
            along_axis + more * n[2] * n[2],
            2.0 * more * n[0] * n[1],
            2.0 * more * n[1] * n[2],
            2.0 * more * n[2] * n[0],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By differences of the displacement.
    #[test]
    fn strains_are_those_of_the_displacement() {
        for about_axis in [false, true] {
            let field = Radial { about_axis, state: |_, r: f64| (r * r, [2.0 * r, r]) };
            for x in [[1.0, 2.0, 3.0], [0.5, -0.2, 0.1]] {
                let at = |axis: usize, step: f64| {
                    field.displacement(0, std::array::from_fn(|i| x[i] + if i == axis { step } else { 0.0 }))
                };
                let slope = |i: usize, j: usize| (at(j, 1e-5)[i] - at(j, -1e-5)[i]) / 2e-5;
                let shear = |i: usize, j: usize| slope(i, j) + slope(j, i);
                let expected = [slope(0, 0), slope(1, 1), slope(2, 2), shear(0, 1), shear(1, 2), shear(2, 0)];
                for (a, b) in field.strain(0, x).iter().zip(expected) {
                    assert!((a - b).abs() < 1e-8, "{a} {b}");
                }
            }
        }
    }
}
