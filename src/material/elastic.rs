//! Hooke's law: stress = lambda tr(strain) 1 + 2 mu strain.

use super::Material;
use crate::tensor::Tangent;

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
}

#[cfg(test)]
mod tests {
    use crate::material::samples::STEEL;
    use crate::tensor::apply;

    #[test]
    fn uniaxial_strain_state_gives_uniaxial_stress() {
        let (e, nu) = (1e-3, STEEL.poisson);
        let stress = apply(&STEEL.elastic_tangent(), &[e, -nu * e, -nu * e, 0.0, 0.0, 0.0]);
        assert!((stress[0] - STEEL.young * e).abs() < 1e-10);
        assert!(stress[1..].iter().all(|s| s.abs() < 1e-10));
    }

    #[test]
    fn hydrostatic_strain_meets_the_bulk_modulus_and_shear_the_shear_modulus() {
        let stress = apply(&STEEL.elastic_tangent(), &[1e-3, 1e-3, 1e-3, 1e-3, 0.0, 0.0]);
        assert!((stress[0] - 3e-3 * STEEL.bulk_modulus()).abs() < 1e-10);
        assert!((stress[3] - 1e-3 * STEEL.shear_modulus()).abs() < 1e-12);
    }
}
