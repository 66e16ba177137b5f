//! Fields that depend on the distance from the origin, or from the z axis, alone.

use super::run::Exact;
use crate::tensor::Voigt;

/// A field about the origin or the z axis.
pub struct Radial<F> {
    /// Whether distances are those from the z axis, not from the origin.
    pub about_axis: bool,
    /// What is in a body at a distance.
    pub state: F,
}

/// What is at a distance.
pub struct State {
    /// Outwards.
    pub displacement: f64,
    /// Along the radius, and around; none along the z axis.
    pub strain: [f64; 2],
    /// Along the radius, around, and along the z axis if the field is about it.
    pub stress: [f64; 3],
}

/// A symmetric tensor with these components along the radius, around, and along the rest, its shears once.
fn tensor(n: [f64; 3], [radial, around, rest]: [f64; 3]) -> Voigt {
    let more = radial - around;
    [
        around + more * n[0] * n[0],
        around + more * n[1] * n[1],
        rest + more * n[2] * n[2],
        more * n[0] * n[1],
        more * n[1] * n[2],
        more * n[2] * n[0],
    ]
}

impl<F: Fn(usize, f64) -> State> Radial<F> {
    fn arm(&self, [x, y, z]: [f64; 3]) -> ([f64; 3], f64) {
        let arm = [x, y, if self.about_axis { 0.0 } else { z }];
        let length = arm.iter().map(|x| x * x).sum::<f64>().sqrt();
        (arm.map(|x| x / length), length)
    }
}

impl<F: Fn(usize, f64) -> State> Exact for Radial<F> {
    fn displacement(&self, body: usize, x: [f64; 3]) -> [f64; 3] {
        let (n, r) = self.arm(x);
        let State { displacement, .. } = (self.state)(body, r);
        n.map(|n| displacement * n)
    }

    fn strain(&self, body: usize, x: [f64; 3]) -> Voigt {
        let (n, r) = self.arm(x);
        let State { strain: [radial, around], .. } = (self.state)(body, r);
        let [x, y, z, xy, yz, zx] = tensor(n, [radial, around, if self.about_axis { 0.0 } else { around }]);
        [x, y, z, 2.0 * xy, 2.0 * yz, 2.0 * zx]
    }

    fn stress(&self, body: usize, x: [f64; 3]) -> Voigt {
        let (n, r) = self.arm(x);
        tensor(n, (self.state)(body, r).stress)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::von_mises::{PlasticState, VonMises};
    use crate::material::{Law, Variables};

    const STEEL: VonMises = VonMises::elastic(1.0, 0.3);

    /// Moves by the square of the distance; with Hooke's stress.
    fn state(r: f64, about_axis: bool) -> State {
        let strain = [2.0 * r, r, if about_axis { 0.0 } else { r }];
        let along = |k: usize| {
            STEEL.hooke().lambda() * strain.iter().sum::<f64>() + 2.0 * STEEL.hooke().shear_modulus() * strain[k]
        };
        State { displacement: r * r, strain: [2.0 * r, r], stress: [along(0), along(1), along(2)] }
    }

    /// Turned with the strain.
    #[test]
    fn stresses_are_those_of_the_strain() {
        for about_axis in [false, true] {
            let field = Radial { about_axis, state: |_, r: f64| state(r, about_axis) };
            for x in [[1.0, 2.0, 3.0], [0.5, -0.2, 0.1]] {
                let expected = STEEL.respond(&field.strain(0, x), &PlasticState::VIRGIN).stress;
                for (a, b) in field.stress(0, x).iter().zip(expected) {
                    assert!((a - b).abs() < 1e-13, "{a} {b}");
                }
            }
        }
    }

    /// By differences of the displacement.
    #[test]
    fn strains_are_those_of_the_displacement() {
        for about_axis in [false, true] {
            let field = Radial { about_axis, state: |_, r: f64| state(r, about_axis) };
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
