//! Dual shape functions of a slave triangle on the part of it that faces the master surface.
//!
//! Some corners carry no multiplier (supports hold them); the others are active. With linear functions `phi` on the covered part
//! that add up to one, and `phi~_k = phi_k + equal shares of those of corners that are not active`, the dual functions are
//! `psi = W N^-1 phi~` with `N_kl = integral of phi~_k phi_l` over the covered part and `W` the diagonal of the integrals
//! of `phi_l` (Wohlmuth 2011, section 4; on covered parts Cichosz and Bischoff 2011). So `integral of psi_j phi_l` is zero
//! for two active corners, and the `psi` add up to one, which passes the patch test.
//!
//! A mean with dual functions is the value at the node where something is linear on the faces around it. Of something quadratic, such as
//! the distance of a ball, that has no slope at the node it is too small: on each whole face by as much as means with `phi` are too
//! large. So the functions [`even`](DualFunctions::even), half of `psi` and half of `phi~`, give the value at the node then, too. They are
//! for faces whose conditions share nodes anyway.
//!
//! On narrow parts `N^-1` is large and amplifies what differs from linear. There `psi = phi~`, which is dual to nothing but as
//! exact: only that conditions of neighbours share nodes then.

/// What the covered part of a triangle gives to the rows of its active corners. Rows of others are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualFunctions {
    /// `psi_j = sum of functions[j][k] phi_k`.
    pub functions: [[f64; 3]; 3],
    /// `integral of psi_j phi_l` (area).
    pub slave: [[f64; 3]; 3],
}

impl DualFunctions {
    /// The mean of these and others.
    pub fn even(self, others: Self) -> Self {
        let mean = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| {
            std::array::from_fn(|j| std::array::from_fn(|k| 0.5 * (a[j][k] + b[j][k])))
        };
        Self { functions: mean(self.functions, others.functions), slave: mean(self.slave, others.slave) }
    }
}

/// Coefficients of `W N^-1` from which it is too large; on a whole triangle they are 3 and -1.
const STEEP: f64 = 30.0;

/// Of the integrals of `phi_k phi_l` over the covered part, and which corners are active: at least one. `None` if the part is too
/// narrow; [`positive`] has functions then.
pub fn functions(mass: &[[f64; 3]; 3], active: [bool; 3]) -> Option<DualFunctions> {
    let areas = mass.map(|row| row.iter().sum::<f64>());
    let spread = spread(active);
    // The identity fills the place of corners that are not active.
    let product = multiply(&spread, mass);
    let n = std::array::from_fn(|k| {
        std::array::from_fn(|l| if active[k] && active[l] { product[k][l] } else { f64::from(k == l) })
    });
    let inverse = invert(&n);
    let scaled: [[f64; 3]; 3] = std::array::from_fn(|j| std::array::from_fn(|k| areas[j] * inverse[j][k]));
    let tame = (0..3).all(|j| !active[j] || (0..3).all(|k| !active[k] || scaled[j][k].abs() <= STEEP));
    if !tame {
        return None;
    }
    let masked = std::array::from_fn(|j| if active[j] { scaled[j] } else { [0.0; 3] });
    let functions = multiply(&masked, &spread);
    let integrals = multiply(&functions, mass);
    // What is zero but for round-off is zero.
    let slave = std::array::from_fn(|j| {
        std::array::from_fn(|l| match (active[j], active[l]) {
            (true, true) if j == l => areas[j],
            (true, false) => integrals[j][l],
            _ => 0.0,
        })
    });
    Some(DualFunctions { functions, slave })
}

/// As [`functions`], but `psi = phi~`.
pub fn positive(mass: &[[f64; 3]; 3], active: [bool; 3]) -> DualFunctions {
    let functions = spread(active);
    DualFunctions { functions, slave: multiply(&functions, mass) }
}

/// `phi~_k = sum of spread[k][r] phi_r`.
fn spread(active: [bool; 3]) -> [[f64; 3]; 3] {
    let share = 1.0 / active.iter().filter(|a| **a).count() as f64;
    std::array::from_fn(|k| {
        std::array::from_fn(|r| match (active[k], active[r]) {
            (true, true) => f64::from(k == r),
            (true, false) => share,
            (false, _) => 0.0,
        })
    })
}

pub(super) fn multiply(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub(super) fn transpose(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Inverse by cross products; not finite, or wild, where there is none.
pub(super) fn invert(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cross =
        |u: [f64; 3], v: [f64; 3]| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let columns = [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])];
    let determinant: f64 = (0..3).map(|k| a[0][k] * columns[0][k]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i] / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a part of the triangle `(0, 0), (1, 0), (0, 1)`: the triangle of these corners. Exact by the middles of edges.
    fn mass(corners: [[f64; 2]; 3]) -> [[f64; 3]; 3] {
        let phi = |[x, y]: [f64; 2]| [1.0 - x - y, x, y];
        let area = 0.5 * super::super::clip::turn(corners[0], corners[1], corners[2]);
        let mut mass = [[0.0; 3]; 3];
        for k in 0..3 {
            let [p, q] = [corners[k], corners[(k + 1) % 3]];
            let at = phi([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
            for (row, a) in mass.iter_mut().zip(at) {
                row.iter_mut().zip(at).for_each(|(m, b)| *m += a * b * area / 3.0);
            }
        }
        mass
    }

    const PARTS: [[[f64; 2]; 3]; 4] = [
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [0.3, 0.4]],
        [[0.2, 0.1], [0.7, 0.2], [0.3, 0.6]],
        // Too narrow for dual functions.
        [[0.0, 0.0], [1.0, 0.0], [0.5, 1e-3]],
    ];

    const ACTIVE: [[bool; 3]; 4] = [[true; 3], [true, false, true], [false, true, true], [false, false, true]];

    #[test]
    fn they_are_dual_and_both_sums_are_those_of_the_triangle() {
        for part in PARTS {
            let mass = mass(part);
            let areas = mass.map(|row| row.iter().sum::<f64>());
            let size: f64 = areas.iter().sum();
            for active in ACTIVE {
                let dual = functions(&mass, active);
                assert!(dual.is_some() || part == PARTS[3], "{part:?} {active:?}");
                assert!(dual.is_none() || part != PARTS[3] || active != ACTIVE[0]);
                for found in [positive(&mass, active)].into_iter().chain(dual) {
                    let integrals = multiply(&found.functions, &mass);
                    for j in 0..3 {
                        // Sum of the functions is one: at every corner of the triangle.
                        let sum: f64 = (0..3).map(|k| found.functions[k][j]).sum();
                        assert!((sum - 1.0).abs() < 1e-11, "{part:?} {active:?}: {sum}");
                        // Constant pressure acts on the corners as it does without dual functions.
                        let on_corner: f64 = (0..3).map(|k| found.slave[k][j]).sum();
                        assert!((on_corner - areas[j]).abs() < 1e-12 * size);
                        for l in 0..3 {
                            assert!((found.slave[j][l] - integrals[j][l]).abs() < 1e-12 * size, "{part:?} {active:?}");
                            let other = l != j && active[j] && active[l];
                            assert!(dual != Some(found) || !other || found.slave[j][l] == 0.0);
                        }
                    }
                }
            }
        }
    }

    /// A gap `(x a + y b)^2` that touches the corner `(0, 0)`, along several directions.
    #[test]
    fn even_functions_find_no_distance_at_a_corner_that_is_touched() {
        let mass = mass(PARTS[0]);
        let dual = functions(&mass, [true; 3]).expect("it is wide");
        let even = dual.even(positive(&mass, [true; 3]));
        // Exact for cubes (Strang and Fix 1973).
        let points = [[0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]].map(|at| (25.0 / 96.0, at));
        let rule: Vec<(f64, [f64; 3])> = points.into_iter().chain([(-9.0 / 32.0, [1.0 / 3.0; 3])]).collect();
        let of_corner = |of: &DualFunctions, gap: &dyn Fn([f64; 3]) -> f64| -> f64 {
            let value = |at: [f64; 3]| (0..3).map(|k| of.functions[0][k] * at[k]).sum::<f64>() * gap(at);
            rule.iter().map(|(weight, at)| weight * value(*at)).sum()
        };
        for [a, b] in [[1.0, 0.0], [1.0, 1.0], [0.3, -0.8]] {
            let gap = |at: [f64; 3]| (a * at[1] + b * at[2]).powi(2);
            assert!(of_corner(&even, &gap).abs() < 1e-16);
            assert!(of_corner(&dual, &gap) < -1e-3);
        }
        assert!((of_corner(&even, &|_| 1.0) - 1.0 / 6.0).abs() < 1e-16);
    }

    #[test]
    fn a_whole_triangle_has_the_known_ones() {
        let found = functions(&mass(PARTS[0]), [true; 3]).expect("it is wide").functions;
        for (j, row) in found.iter().enumerate() {
            for (k, value) in row.iter().enumerate() {
                assert!((value - if j == k { 3.0 } else { -1.0 }).abs() < 1e-14);
            }
        }
    }
}
