//! Manufactured solutions on the unit cube, for one step of von Mises material from the virgin state.
//!
//! ```text
//! u_i = a_i x_i + c_i sin(pi x_i) cos(pi x_j) cos(pi x_k),   f = -div sigma(eps(u))
//! ```
//!
//! On a face x_i = 0 or 1 the displacement along i is constant and all shears vanish: supports along the normals of the six
//! faces and the body force f are all that it takes. One step is Hencky's material, sigma = K tr(eps) 1 + 2 mu share(q) dev
//! eps with q = 3 mu times the equivalent strain and share = 1 - 3 mu (q - sigma_y)+ / ((3 mu + H) q), so that f is a closed
//! form too. It is smooth where all of the cube yields, or none; at a plastic front it has a kink.
//! The recipe is that of Kamojjala et al., "Verification tests in solid mechanics", 2015.

use std::f64::consts::PI;

use crate::material::{Law, VonMises};
use crate::tensor::{COMPONENT, Voigt, deviator, trace};

/// A solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manufactured {
    pub material: VonMises,
    /// a: homogeneous strain along each axis.
    pub stretch: [f64; 3],
    /// c: amplitude of the wave in each component (length).
    pub wave: [f64; 3],
}

impl Manufactured {
    /// Displacement at a point.
    pub fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.stretch[i] * x[i] + self.wave[i] * wave(x, |j| i == j))
    }

    /// Strain (engineering shears) at a point.
    pub fn strain(&self, x: [f64; 3]) -> Voigt {
        self.strain_of(|wanted| wave(x, wanted), self.stretch)
    }

    /// Derivative of the strain along an axis.
    fn strain_slope(&self, x: [f64; 3], axis: usize) -> Voigt {
        // A sine becomes a cosine, a cosine a sine with the other sign.
        let slope = |is_sine: &dyn Fn(usize) -> bool| {
            let sign = if is_sine(axis) { 1.0 } else { -1.0 };
            sign * PI * wave(x, |j| is_sine(j) != (j == axis))
        };
        self.strain_of(|wanted| slope(&wanted), [0.0; 3])
    }

    /// From the products of sines (where told) and cosines, which all strains are made of.
    fn strain_of(&self, product: impl Fn(fn(usize) -> bool) -> f64, stretch: [f64; 3]) -> Voigt {
        let c = self.wave;
        let normal = PI * product(|_| false);
        let shear = |i: usize, j: usize, product: f64| -PI * (c[i] + c[j]) * product;
        [
            stretch[0] + c[0] * normal,
            stretch[1] + c[1] * normal,
            stretch[2] + c[2] * normal,
            shear(0, 1, product(|j| j != 2)),
            shear(1, 2, product(|j| j != 0)),
            shear(2, 0, product(|j| j != 1)),
        ]
    }

    /// Stress at a point.
    pub fn stress(&self, x: [f64; 3]) -> Voigt {
        let (m, strain) = (&self.material, self.strain(x));
        let share = self.share(equivalent(m, &strain)).0;
        hooke(m.hooke().bulk_modulus(), share * m.hooke().shear_modulus(), &strain)
    }

    /// Accumulated plastic strain at a point.
    pub fn kappa(&self, x: [f64; 3]) -> f64 {
        let m = &self.material;
        let q = equivalent(m, &self.strain(x));
        m.yield_stress.map_or(0.0, |limit| (q - limit).max(0.0)) / (3.0 * m.hooke().shear_modulus() + m.hardening)
    }

    /// Body force at a point.
    pub fn force(&self, x: [f64; 3]) -> [f64; 3] {
        let (m, strain) = (&self.material, self.strain(x));
        let q = equivalent(m, &strain);
        let (share, slope) = self.share(q);
        let mut force = [0.0; 3];
        for axis in 0..3 {
            let along = self.strain_slope(x, axis);
            let mut stress = hooke(m.hooke().bulk_modulus(), share * m.hooke().shear_modulus(), &along);
            if slope != 0.0 {
                // q dq = (3 mu)^2 2/3 (dev eps : deps).
                let change = 6.0 * m.hooke().shear_modulus().powi(2) * inner(&deviator(&strain), &along) / q;
                let more = hooke(0.0, slope * change * m.hooke().shear_modulus(), &strain);
                (0..6).for_each(|k| stress[k] += more[k]);
            }
            (0..3).for_each(|i| force[i] -= stress[COMPONENT[i][axis]]);
        }
        force
    }

    /// What is left of the elastic deviator, and the derivative of that share by the elastic equivalent stress.
    fn share(&self, q: f64) -> (f64, f64) {
        let m = &self.material;
        match m.yield_stress {
            Some(limit) if q > limit => {
                let rate = 3.0 * m.hooke().shear_modulus() / (3.0 * m.hooke().shear_modulus() + m.hardening);
                (1.0 - rate * (q - limit) / q, -rate * limit / (q * q))
            }
            _ => (1.0, 0.0),
        }
    }
}

/// Product over the axes of sin(pi x_j) where it is wanted and of cos(pi x_j) elsewhere.
fn wave(x: [f64; 3], is_sine: impl Fn(usize) -> bool) -> f64 {
    (0..3).map(|j| if is_sine(j) { (PI * x[j]).sin() } else { (PI * x[j]).cos() }).product()
}

/// Double contraction of two strains.
fn inner(a: &Voigt, b: &Voigt) -> f64 {
    (0..3).map(|k| a[k] * b[k] + 0.5 * a[3 + k] * b[3 + k]).sum()
}

/// Equivalent stress if all strain were elastic.
fn equivalent(material: &VonMises, strain: &Voigt) -> f64 {
    let deviator = deviator(strain);
    material.hooke().shear_modulus() * (6.0 * inner(&deviator, &deviator)).sqrt()
}

/// Stress by Hooke's law.
fn hooke(bulk: f64, shear: f64, strain: &Voigt) -> Voigt {
    let (deviator, mean) = (deviator(strain), bulk * trace(strain));
    std::array::from_fn(|k| if k < 3 { mean + 2.0 * shear * deviator[k] } else { shear * deviator[k] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::samples::STEEL;
    use crate::material::von_mises::PlasticState;
    use crate::material::{Law, Variables};
    use crate::random::Random;

    const STATES: [Manufactured; 3] = [
        Manufactured {
            material: VonMises::elastic(210_000.0, 0.29),
            stretch: [1e-3, 0.0, -2e-3],
            wave: [1e-3, 3e-3, 0.0],
        },
        Manufactured { material: STEEL, stretch: [0.0; 3], wave: [1e-3, -4e-4, 7e-4] },
        Manufactured { material: STEEL, stretch: [0.02, -0.01, -0.01], wave: [2e-3, -1e-3, 1.5e-3] },
    ];

    fn points() -> impl Iterator<Item = [f64; 3]> {
        let mut random = Random::new(7);
        (0..50).map(move |_| random.vector::<3>(0.5).map(|x| 0.5 + x))
    }

    fn difference<const N: usize>(f: impl Fn([f64; 3]) -> [f64; N], x: [f64; 3], axis: usize) -> [f64; N] {
        let h = 1e-5;
        let at = |step: f64| f(std::array::from_fn(|j| x[j] + if j == axis { step } else { 0.0 }));
        let (left, right) = (at(-h), at(h));
        std::array::from_fn(|k| (right[k] - left[k]) / (2.0 * h))
    }

    /// The strain is that of the displacement, the stress and the plastic strain are the material's own, and the force is
    /// what they leave: all by differences.
    #[test]
    fn balanced_and_compatible_everywhere() {
        let mut yielding = [0; 3];
        for (state, yielding) in STATES.iter().zip(&mut yielding) {
            for x in points() {
                let slopes = [0, 1, 2].map(|axis| difference(|x| state.displacement(x), x, axis));
                let shear = |i: usize, j: usize| slopes[i][j] + slopes[j][i];
                let expected = [slopes[0][0], slopes[1][1], slopes[2][2], shear(0, 1), shear(1, 2), shear(2, 0)];
                let (strain, stress) = (state.strain(x), state.stress(x));
                assert!(strain.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{strain:?} {expected:?}");
                let response = state.material.respond(&strain, &PlasticState::VIRGIN);
                assert!(stress.iter().zip(response.stress).all(|(a, b)| (a - b).abs() < 1e-8));
                assert!((response.equivalent_plastic_strain - state.kappa(x)).abs() < 1e-14);
                *yielding += usize::from(response.plastic);
                let slopes = [0, 1, 2].map(|axis| difference(|x| state.stress(x), x, axis));
                let force = state.force(x);
                for i in 0..3 {
                    let expected: f64 = -(0..3).map(|j| slopes[j][COMPONENT[i][j]]).sum::<f64>();
                    assert!((force[i] - expected).abs() < 1e-3, "{force:?} at {x:?}: {expected}");
                }
            }
        }
        assert!(yielding[0] == 0 && (10..40).contains(&yielding[1]) && yielding[2] == 50, "{yielding:?}");
    }

    #[test]
    fn faces_move_as_a_whole_and_carry_no_shear() {
        for (state, axis) in STATES.iter().flat_map(|state| [0, 1, 2].map(|axis| (state, axis))) {
            for (mut x, end) in points().zip([0.0, 1.0].into_iter().cycle()) {
                x[axis] = end;
                assert!((state.displacement(x)[axis] - end * state.stretch[axis]).abs() < 1e-17);
                let stress = state.stress(x);
                (0..3).filter(|&j| j != axis).for_each(|j| assert!(stress[COMPONENT[axis][j]].abs() < 1e-11));
            }
        }
    }
}
