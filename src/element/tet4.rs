//! The linear tetrahedron: constant gradients, one integration point, volume V as its weight.
//!
//! With g_a the gradient of the shape function of node a, strain = B u where the columns of B for node a are the
//! symmetric parts of e_i x g_a; internal forces are V B' stress and the stiffness is V B' D B (Hughes, The Finite
//! Element Method, 3.A). Displacements are interleaved: (u_x, u_y, u_z) of node 0, then of node 1, and so on.
//! Locks in isochoric flow, as every conforming linear tetrahedron does; nothing here cures that.

use crate::tensor::{COMPONENT, Tangent, Voigt};

/// Volume below this fraction of the cube of the longest edge counts as none: it is lost in the rounding of coordinates.
pub const DEGENERATE: f64 = 1e-13;

/// Six times the signed volume, and the edges from corner 0.
fn edges(corners: &[[f64; 3]; 4]) -> (f64, [[f64; 3]; 3]) {
    let [a, b, c] = [1, 2, 3].map(|n| std::array::from_fn(|i| corners[n][i] - corners[0][i]));
    (dot(&a, &cross(&b, &c)), [a, b, c])
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Six times the signed volume over the cube of the longest edge: at most 1/sqrt(2), for the regular tetrahedron;
/// negative if corners 1, 2, 3 turn clockwise seen from corner 0; not a number for coincident corners.
pub fn relative_volume(corners: &[[f64; 3]; 4]) -> f64 {
    let mut longest = 0.0f64;
    for a in 0..4 {
        for b in 0..a {
            let edge: [f64; 3] = std::array::from_fn(|i| corners[a][i] - corners[b][i]);
            longest = longest.max(dot(&edge, &edge));
        }
    }
    edges(corners).0 / (longest * longest.sqrt())
}

/// Geometry of one linear tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tet4 {
    /// Volume, > 0.
    pub volume: f64,
    /// Gradient of each node's shape function, 1 / length; they add up to zero.
    pub gradients: [[f64; 3]; 4],
}

impl Tet4 {
    /// The element on four corners, or `None` if it is inverted or has no volume (see [`DEGENERATE`]).
    pub fn new(corners: &[[f64; 3]; 4]) -> Option<Self> {
        let sound = relative_volume(corners) > DEGENERATE;
        sound.then(|| {
            let (determinant, [a, b, c]) = edges(corners);
            let [b, c, d] = [cross(&b, &c), cross(&c, &a), cross(&a, &b)].map(|g| g.map(|x| x / determinant));
            let a = std::array::from_fn(|i| -(b[i] + c[i] + d[i]));
            Self { volume: determinant / 6.0, gradients: [a, b, c, d] }
        })
    }

    /// Strain (engineering shears) of the nodal displacements `u`.
    pub fn strain(&self, u: &[f64; 12]) -> Voigt {
        let mut h = [[0.0; 3]; 3];
        for (a, g) in self.gradients.iter().enumerate() {
            for (row, u) in h.iter_mut().zip(&u[3 * a..]) {
                for (entry, g) in row.iter_mut().zip(g) {
                    *entry += u * g;
                }
            }
        }
        [h[0][0], h[1][1], h[2][2], h[0][1] + h[1][0], h[1][2] + h[2][1], h[2][0] + h[0][2]]
    }

    /// Adds the nodal forces V B' stress to `forces`.
    pub fn add_internal(&self, stress: &Voigt, forces: &mut [f64; 12]) {
        for (a, g) in self.gradients.iter().enumerate() {
            for (i, row) in COMPONENT.iter().enumerate() {
                forces[3 * a + i] +=
                    self.volume * (g[0] * stress[row[0]] + g[1] * stress[row[1]] + g[2] * stress[row[2]]);
            }
        }
    }

    /// The stiffness V B' D B for a symmetric tangent D; symmetric to the last bit.
    pub fn stiffness(&self, tangent: &Tangent) -> [[f64; 12]; 12] {
        // Six rows of V D B; then every row of B' is three scaled rows of it, twelve entries wide.
        let mut forces = [[0.0; 12]; 6];
        for (row, d) in forces.iter_mut().zip(tangent) {
            for (b, g) in self.gradients.iter().enumerate() {
                let [x, y, z] = g.map(|g| self.volume * g);
                row[3 * b] = d[0] * x + d[3] * y + d[5] * z;
                row[3 * b + 1] = d[3] * x + d[1] * y + d[4] * z;
                row[3 * b + 2] = d[5] * x + d[4] * y + d[2] * z;
            }
        }
        let mut k = [[0.0; 12]; 12];
        for (a, [x, y, z]) in self.gradients.iter().enumerate() {
            for (i, row) in COMPONENT.iter().enumerate() {
                let [p, q, r] = row.map(|c| &forces[c]);
                for (j, entry) in k[3 * a + i].iter_mut().enumerate() {
                    *entry = x * p[j] + y * q[j] + z * r[j];
                }
            }
        }
        for i in 1..12 {
            let (above, below) = k.split_at_mut(i);
            for (entry, row) in below[0].iter_mut().zip(above) {
                *entry = row[i];
            }
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::samples::STEEL;
    use crate::material::{History, Material};
    use crate::random::Random;
    use crate::tensor::apply;

    const REFERENCE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Distorted tetrahedra of edge about 10, far from the origin.
    fn shapes() -> impl Iterator<Item = [[f64; 3]; 4]> {
        let mut random = Random::new(5);
        (0..50).map(move |_| {
            REFERENCE.map(|x| {
                let shift: [f64; 3] = random.vector(0.15);
                std::array::from_fn(|i| 10.0 * (x[i] + shift[i]) + 100.0)
            })
        })
    }

    fn times(k: &[[f64; 12]; 12], u: &[f64; 12]) -> [f64; 12] {
        k.map(|row| row.iter().zip(u).map(|(k, u)| k * u).sum())
    }

    fn field(corners: &[[f64; 3]; 4], at: impl Fn(&[f64; 3]) -> [f64; 3]) -> [f64; 12] {
        let u = corners.each_ref().map(at);
        std::array::from_fn(|i| u[i / 3][i % 3])
    }

    #[test]
    fn unit_tetrahedron() {
        let tet = Tet4::new(&REFERENCE).expect("it has a volume");
        assert_eq!(tet.volume, 1.0 / 6.0);
        assert_eq!(tet.gradients, [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[test]
    fn linear_displacements_give_their_strain_exactly() {
        let mut random = Random::new(6);
        for corners in shapes() {
            let h: [[f64; 3]; 3] = std::array::from_fn(|_| random.vector(1e-2));
            let u = field(&corners, |x| h.map(|row| dot(&row, x)));
            let strain = Tet4::new(&corners).expect("it has a volume").strain(&u);
            for (c, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
                let expected = if i == j { h[i][i] } else { h[i][j] + h[j][i] };
                assert!((strain[c] - expected).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn stiffness_is_symmetric_positive_and_blind_to_rigid_motion() {
        let mut random = Random::new(8);
        for corners in shapes() {
            let k = Tet4::new(&corners).expect("it has a volume").stiffness(&STEEL.elastic_tangent());
            let scale = k[0][0];
            assert!((0..144).all(|n| k[n / 12][n % 12] == k[n % 12][n / 12]));
            for axis in 0..3 {
                let along = field(&corners, |_| std::array::from_fn(|i| (i == axis) as u8 as f64));
                let around = field(&corners, |x| {
                    let e = std::array::from_fn(|i| (i == axis) as u8 as f64);
                    cross(&e, &std::array::from_fn(|i| x[i] - 100.0))
                });
                assert!(times(&k, &along).iter().all(|f| f.abs() < 1e-12 * scale));
                assert!(times(&k, &around).iter().all(|f| f.abs() < 1e-11 * scale));
            }
            let u: [f64; 12] = random.vector(1.0);
            assert!(times(&k, &u).iter().zip(u).map(|(f, u)| f * u).sum::<f64>() > 0.0);
        }
    }

    #[test]
    fn elastic_internal_forces_are_stiffness_times_displacement() {
        let mut random = Random::new(9);
        for corners in shapes() {
            let tet = Tet4::new(&corners).expect("it has a volume");
            let c = STEEL.elastic_tangent();
            let u: [f64; 12] = random.vector(1.0);
            let mut internal = [0.0; 12];
            tet.add_internal(&apply(&c, &tet.strain(&u)), &mut internal);
            let k = tet.stiffness(&c);
            for (a, b) in internal.iter().zip(times(&k, &u)) {
                assert!((a - b).abs() < 1e-12 * k[0][0]);
            }
        }
    }

    /// Plastic included: forces are the derivative of V Psi, the stiffness that of the forces.
    #[test]
    fn finite_differences() {
        let mut random = Random::new(10);
        let material = Material { hardening: 2e4, ..STEEL };
        let virgin = History::default();
        for corners in shapes() {
            let tet = Tet4::new(&corners).expect("it has a volume");
            let (u, direction): ([f64; 12], [f64; 12]) = (random.vector(0.2), random.vector(1.0));
            let at = |by: f64| {
                let moved: [f64; 12] = std::array::from_fn(|i| u[i] + by * direction[i]);
                let response = material.respond(&tet.strain(&moved), &virgin);
                let mut forces = [0.0; 12];
                tet.add_internal(&response.stress, &mut forces);
                (tet.volume * response.energy, forces)
            };
            let h = 1e-6;
            let (back, here, ahead) = (at(-h), at(0.0), at(h));
            let slope: f64 = here.1.iter().zip(direction).map(|(f, d)| f * d).sum();
            let size: f64 = here.1.iter().map(|f| f.abs()).sum();
            assert!(((ahead.0 - back.0) / (2.0 * h) - slope).abs() < 1e-6 * size);
            let k = tet.stiffness(&material.tangent(&tet.strain(&u), &virgin));
            for (i, f) in times(&k, &direction).iter().enumerate() {
                assert!(((ahead.1[i] - back.1[i]) / (2.0 * h) - f).abs() < 1e-6 * k[0][0]);
            }
        }
    }

    #[test]
    fn flat_and_inverted_and_coincident_corners_are_refused() {
        let [a, b, c, d] = REFERENCE;
        assert_eq!(Tet4::new(&[a, c, b, d]), None);
        assert_eq!(Tet4::new(&[a, b, c, [0.3, 0.3, 0.0]]), None);
        assert_eq!(Tet4::new(&[a, a, a, a]), None);
        assert!(Tet4::new(&[a, b, c, d].map(|x| x.map(|v| 1e-60 * v))).is_some());
        assert!(Tet4::new(&[a, b, c, [0.3, 0.3, 1e-9]]).is_some());
    }
}
