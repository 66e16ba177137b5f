//! Hooke's law: stress = lambda tr(strain) 1 + 2 mu strain.

use super::Material;
use crate::tensor::{Tangent, Voigt, deviator, stress_norm, trace};

impl Material {
    /// The elastic stiffness C; with engineering shears its shear diagonal is mu.
    pub fn elastic_tangent(&self) -> Tangent {
        let (lambda, mu) = (self.lambda(), self.shear_modulus());
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            c[i][..3].fill(lambda);
            c[i][i] += 2.0 * mu;
            c[i + 3][i + 3] = mu;
        }
        c
    }

    /// strain : C : strain (energy per volume).
    #[inline]
    pub fn elastic_square(&self, strain: &Voigt) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = strain.map(|e| e * e);
        let (volume, mu) = (trace(strain), self.shear_modulus());
        self.lambda() * volume * volume + mu * (2.0 * (xx + yy + zz) + (xy + yz + zx))
    }

    /// stress : C^-1 : stress (energy per volume).
    pub fn complementary_square(&self, stress: &Voigt) -> f64 {
        let (shear, mean) = (stress_norm(&deviator(stress)), trace(stress) / 3.0);
        shear * shear / (2.0 * self.shear_modulus()) + mean * mean / self.bulk_modulus()
    }
}

#[cfg(test)]
mod tests {
    use crate::material::samples::STEEL;
    use crate::tensor::{apply, contract};

    #[test]
    fn uniaxial_strain_state_gives_uniaxial_stress() {
        let (e, nu) = (1e-3, STEEL.poisson);
        let stress = apply(&STEEL.elastic_tangent(), &[e, -nu * e, -nu * e, 0.0, 0.0, 0.0]);
        assert!((stress[0] - STEEL.young * e).abs() < 1e-10);
        assert!(stress[1..].iter().all(|s| s.abs() < 1e-10));
    }

    #[test]
    fn the_squares_of_a_strain_and_of_its_stress_are_their_double_contraction() {
        let strain = [1e-3, -2e-3, 0.5e-3, 0.7e-3, -1.1e-3, 0.3e-3];
        let stress = apply(&STEEL.elastic_tangent(), &strain);
        let expected = contract(&stress, &strain);
        assert!((STEEL.complementary_square(&stress) - expected).abs() < 1e-14 * expected);
        assert!((STEEL.elastic_square(&strain) - expected).abs() < 1e-14 * expected);
    }

    #[test]
    fn hydrostatic_strain_meets_the_bulk_modulus_and_shear_the_shear_modulus() {
        let stress = apply(&STEEL.elastic_tangent(), &[1e-3, 1e-3, 1e-3, 1e-3, 0.0, 0.0]);
        assert!((stress[0] - 3e-3 * STEEL.bulk_modulus()).abs() < 1e-10);
        assert!((stress[3] - 1e-3 * STEEL.shear_modulus()).abs() < 1e-12);
    }
}
