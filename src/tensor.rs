//! Symmetric 3x3 tensors as vectors of six components: the one place where their order and their factors are fixed.
//!
//! The order is (xx, yy, zz, xy, yz, zx). Stress-like tensors are stored plain. Strain-like tensors carry *engineering*
//! shears, gamma_xy = 2 eps_xy, so that stress : strain is the plain dot product and a tangent maps strain to stress as
//! a plain symmetric matrix. Nothing here knows a material, and nothing rotates a tensor.

/// Six components (xx, yy, zz, xy, yz, zx); whether the shears are doubled is said by the name: stress no, strain yes.
pub type Voigt = [f64; 6];

/// d stress / d strain, symmetric, 6 x 6, rows of stress and columns of strain.
pub type Tangent = [[f64; 6]; 6];

/// Position of the component (i, j) in a six-vector.
pub const COMPONENT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// Sum of the normal components, of a stress or of a strain.
pub fn trace(t: &Voigt) -> f64 {
    t[0] + t[1] + t[2]
}

/// The tensor less a third of its trace on the diagonal; a strain stays a strain, a stress a stress.
pub fn deviator(t: &Voigt) -> Voigt {
    let mean = trace(t) / 3.0;
    [t[0] - mean, t[1] - mean, t[2] - mean, t[3], t[4], t[5]]
}

/// The double contraction stress : strain.
pub fn contract(stress: &Voigt, strain: &Voigt) -> f64 {
    stress.iter().zip(strain).map(|(s, e)| s * e).sum()
}

/// Frobenius norm of a stress-like tensor.
pub fn stress_norm(s: &Voigt) -> f64 {
    (s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])).sqrt()
}

/// Von Mises equivalent stress sqrt(3/2) |dev stress|: the axial stress in uniaxial tension.
pub fn von_mises(stress: &Voigt) -> f64 {
    1.5f64.sqrt() * stress_norm(&deviator(stress))
}

/// Stress that a tangent gives to a strain.
pub fn apply(tangent: &Tangent, strain: &Voigt) -> Voigt {
    tangent.map(|row| contract(&row, strain))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn von_mises_is_the_axial_stress_and_root_three_times_the_shear() {
        assert!((von_mises(&[-7.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - 7.0).abs() < 1e-14);
        for shear in 3..6 {
            let mut stress = [2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
            stress[shear] = 5.0;
            assert!((von_mises(&stress) - 5.0 * 3f64.sqrt()).abs() < 1e-14);
        }
    }

    #[test]
    fn contraction_equals_the_full_double_sum() {
        let (stress, strain) = ([1.0, -2.0, 3.0, 4.0, -5.0, 6.0], [0.5, 0.25, -1.0, 2.0, 3.0, -4.0]);
        let mut full = 0.0;
        for (i, row) in COMPONENT.iter().enumerate() {
            for (j, &c) in row.iter().enumerate() {
                full += stress[c] * strain[c] * if i == j { 1.0 } else { 0.5 };
            }
        }
        assert_eq!(contract(&stress, &strain), full);
        assert_eq!(trace(&deviator(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])), 0.0);
    }
}
