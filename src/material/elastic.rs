//! Hooke's law: stress = lambda tr(strain) 1 + 2 mu strain. Every [law](super::Law) answers like that inside its yield surface.

use crate::tensor::{Tangent, Voigt, deviator, stress_norm, trace};

/// Constants of isotropic elasticity; moduli in one unit of stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hooke {
    /// Young's modulus E > 0.
    pub young: f64,
    /// Poisson's ratio, -1 < nu < 1/2.
    pub poisson: f64,
}

impl Hooke {
    /// Lame's second constant mu = E / (2 (1 + nu)), the shear modulus.
    #[inline]
    pub fn shear_modulus(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Lame's first constant lambda = E nu / ((1 + nu) (1 - 2 nu)).
    #[inline]
    pub fn lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// Bulk modulus E / (3 (1 - 2 nu)).
    #[inline]
    pub fn bulk_modulus(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// The stiffness C; with engineering shears its shear diagonal is mu.
    pub fn tangent(&self) -> Tangent {
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
    pub fn square(&self, strain: &Voigt) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = strain.map(|e| e * e);
        let (volume, mu) = (trace(strain), self.shear_modulus());
        self.lambda() * volume * volume + mu * (2.0 * (xx + yy + zz) + (xy + yz + zx))
    }

    /// stress : C^-1 : stress (energy per volume).
    #[inline]
    pub fn complementary_square(&self, stress: &Voigt) -> f64 {
        let (shear, mean) = (stress_norm(&deviator(stress)), trace(stress) / 3.0);
        shear * shear / (2.0 * self.shear_modulus()) + mean * mean / self.bulk_modulus()
    }
}

#[cfg(test)]
mod tests {
    use super::Hooke;
    use crate::tensor::{apply, contract};

    const STEEL: Hooke = Hooke { young: 210_000.0, poisson: 0.29 };

    #[test]
    fn uniaxial_strain_state_gives_uniaxial_stress() {
        let (e, nu) = (1e-3, STEEL.poisson);
        let stress = apply(&STEEL.tangent(), &[e, -nu * e, -nu * e, 0.0, 0.0, 0.0]);
        assert!((stress[0] - STEEL.young * e).abs() < 1e-10);
        assert!(stress[1..].iter().all(|s| s.abs() < 1e-10));
    }

    #[test]
    fn the_squares_of_a_strain_and_of_its_stress_are_their_double_contraction() {
        let strain = [1e-3, -2e-3, 0.5e-3, 0.7e-3, -1.1e-3, 0.3e-3];
        let stress = apply(&STEEL.tangent(), &strain);
        let expected = contract(&stress, &strain);
        assert!((STEEL.complementary_square(&stress) - expected).abs() < 1e-14 * expected);
        assert!((STEEL.square(&strain) - expected).abs() < 1e-14 * expected);
    }

    #[test]
    fn hydrostatic_strain_meets_the_bulk_modulus_and_shear_the_shear_modulus() {
        let stress = apply(&STEEL.tangent(), &[1e-3, 1e-3, 1e-3, 1e-3, 0.0, 0.0]);
        assert!((stress[0] - 3e-3 * STEEL.bulk_modulus()).abs() < 1e-10);
        assert!((stress[3] - 1e-3 * STEEL.shear_modulus()).abs() < 1e-12);
    }
}
