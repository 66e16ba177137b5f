//! `R`: the six rigid body modes of a subdomain, orthonormal, from its coordinates alone.
//!
//! Translations and rotations about the centroid are orthogonal over the nodes; the rotations are orthonormalised by
//! the Cholesky factor of their 3x3 Gram matrix (the inertia tensor of the nodes). Pivots play no part: a face-connected
//! set of tetrahedra has exactly these modes.

use crate::vector::{cross, difference, dot};
use crate::work;

/// Rigid modes of a subdomain, or of a cluster.
pub const MODES: usize = 6;

/// Operations at a point: 3 for the arm, 9 for a cross product, and 6 additions.
const OF_POINT: usize = 18;

/// Orthonormal rigid modes: columns 0..3 translations, 3..6 rotations.
#[derive(Clone, Debug)]
pub struct RigidModes {
    centre: [f64; 3],
    translation: f64,
    /// Rotation vectors, as rows.
    axes: [[f64; 3]; 3],
}

impl RigidModes {
    /// Of the given nodes, which do not lie on one line.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let (centre, moments) = inertia(points);
        Self::of_nodes(points.len() as f64, centre, moments)
    }

    /// Of so many nodes with this centroid and inertia tensor about it.
    pub fn of_nodes(count: f64, centre: [f64; 3], moments: [[f64; 3]; 3]) -> Self {
        Self { centre, translation: 1.0 / count.sqrt(), axes: inverse_cholesky(moments) }
    }

    /// These modes as sums of those of some of their nodes, `[mode of the part][mode]`.
    pub fn in_modes_of(&self, part: &Self) -> [[f64; MODES]; MODES] {
        let mut matrix = [[0.0; MODES]; MODES];
        let arm = self.arm(part);
        for (k, axis) in self.axes.iter().enumerate() {
            matrix[k][k] = self.translation / part.translation;
            let way = cross(*axis, arm);
            (0..3).for_each(|a| matrix[a][3 + k] = way[a] / part.translation);
            // The part's axes are a triangular matrix.
            for i in (0..3).rev() {
                let known: f64 = (i + 1..3).map(|j| part.axes[j][i] * matrix[3 + j][3 + k]).sum();
                matrix[3 + i][3 + k] = (axis[i] - known) / part.axes[i][i];
            }
        }
        matrix
    }

    /// Unit translations, and unit rotations about the axes of coordinates through the same centre.
    pub fn plain(&self) -> Self {
        Self { centre: self.centre, translation: 1.0, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// How far the centre of some of their nodes, those of `part`, is from their own.
    pub fn arm(&self, part: &Self) -> [f64; 3] {
        difference(part.centre, self.centre)
    }

    /// `R'v` from the force and the moment of `v`: what the [`RigidModes::plain`] modes make of it.
    pub fn of_force(&self, [x, y, z, moment @ ..]: [f64; MODES]) -> [f64; MODES] {
        let force = [x, y, z].map(|f| self.translation * f);
        let turning = self.axes.map(|axis| dot(axis, moment));
        std::array::from_fn(|k| if k < 3 { force[k] } else { turning[k - 3] })
    }

    /// The transpose: the translation and the rotation of these amplitudes.
    pub fn to_motion(&self, amplitudes: [f64; MODES]) -> [f64; MODES] {
        let rotation = |a: usize| (0..3).map(|k| amplitudes[3 + k] * self.axes[k][a]).sum();
        std::array::from_fn(|k| if k < 3 { self.translation * amplitudes[k] } else { rotation(k - 3) })
    }

    /// As numbers, to be sent.
    pub fn to_numbers(&self) -> [f64; 13] {
        let mut numbers = [0.0; 13];
        let all = self.centre.into_iter().chain([self.translation]).chain(self.axes.into_iter().flatten());
        numbers.iter_mut().zip(all).for_each(|(number, x)| *number = x);
        numbers
    }

    /// From such numbers.
    pub fn from_numbers(numbers: &[f64; 13]) -> Self {
        let [x, y, z, translation, axes @ ..] = *numbers;
        Self { centre: [x, y, z], translation, axes: std::array::from_fn(|i| std::array::from_fn(|j| axes[3 * i + j])) }
    }

    /// The modes' displacements at a point, `[component][mode]`.
    pub fn at(&self, point: [f64; 3]) -> [[f64; 6]; 3] {
        std::array::from_fn(|axis| self.along(axis, point))
    }

    /// One component of the modes' displacements at a point.
    pub fn along(&self, axis: usize, point: [f64; 3]) -> [f64; MODES] {
        let (arm, [first, second]) = (difference(point, self.centre), [(axis + 1) % 3, (axis + 2) % 3]);
        let mut modes = [0.0; MODES];
        modes[axis] = self.translation;
        for (mode, turn) in modes[3..].iter_mut().zip(&self.axes) {
            *mode = turn[first] * arm[second] - turn[second] * arm[first];
        }
        modes
    }

    /// `R'v` over the given nodes; `v` has three entries a node.
    pub fn resultants(&self, points: &[[f64; 3]], v: &[f64]) -> [f64; MODES] {
        work::each(points.len(), OF_POINT, 2 * size_of::<[f64; 3]>());
        let mut sum = [0.0; MODES];
        for (point, force) in points.iter().zip(v.as_chunks().0) {
            let moment = cross(difference(*point, self.centre), *force);
            sum.iter_mut().zip(force.iter().chain(&moment)).for_each(|(s, x)| *s += x);
        }
        self.of_force(sum)
    }

    /// `v += R amplitudes` over the given nodes.
    pub fn add_motion(&self, points: &[[f64; 3]], amplitudes: [f64; MODES], v: &mut [f64]) {
        work::each(points.len(), OF_POINT, 2 * size_of::<[f64; 3]>());
        let [x, y, z, rotation @ ..] = self.to_motion(amplitudes);
        for (point, u) in points.iter().zip(v.as_chunks_mut::<3>().0) {
            let turned = cross(rotation, difference(*point, self.centre));
            u.iter_mut().zip([x, y, z]).zip(turned).for_each(|((u, t), r)| *u += t + r);
        }
    }
}

/// A force and its moment about a point, with the moment about another one that is an `arm` before it.
pub fn moved_force([x, y, z, a, b, c]: [f64; MODES], arm: [f64; 3]) -> [f64; MODES] {
    let turning = cross(arm, [x, y, z]);
    [x, y, z, a + turning[0], b + turning[1], c + turning[2]]
}

/// A translation and a rotation about a point, as those about another one that is an `arm` behind it.
pub fn moved_motion([x, y, z, rotation @ ..]: [f64; MODES], arm: [f64; 3]) -> [f64; MODES] {
    let [a, b, c] = rotation;
    let turned = cross(rotation, arm);
    [x + turned[0], y + turned[1], z + turned[2], a, b, c]
}

/// The centroid of points and their inertia tensor about it.
pub fn inertia(points: &[[f64; 3]]) -> ([f64; 3], [[f64; 3]; 3]) {
    let centre: [f64; 3] = std::array::from_fn(|a| points.iter().map(|p| p[a]).sum::<f64>() / points.len() as f64);
    let mut moments = [[0.0; 3]; 3];
    for point in points {
        let arm = difference(*point, centre);
        let square = dot(arm, arm);
        for a in 0..3 {
            for b in 0..3 {
                moments[a][b] += if a == b { square } else { 0.0 } - arm[a] * arm[b];
            }
        }
    }
    (centre, moments)
}

/// `L^-1` of `gram = L L'`.
fn inverse_cholesky(gram: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut l = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let rest = gram[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
    }
    let mut inverse = [[0.0; 3]; 3];
    for (i, j) in (0..3).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let unit = if i == j { 1.0 } else { 0.0 };
        inverse[i][j] = (unit - (j..i).map(|k| l[i][k] * inverse[k][j]).sum::<f64>()) / l[i][i];
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_of_a_whole_are_sums_of_those_of_a_part() {
        let points = [[1.0, 2.0, 3.0], [4.0, 2.5, 3.0], [1.0, 7.0, 3.5], [1.5, 2.0, 9.0], [-3.0, 0.0, 1.0]];
        let (whole, part) = (RigidModes::new(&points), RigidModes::new(&points[1..]));
        let matrix = RigidModes::from_numbers(&whole.to_numbers()).in_modes_of(&part);
        for (of_whole, of_part) in points.iter().map(|&point| (whole.at(point), part.at(point))) {
            for (a, k) in (0..3).flat_map(|a| (0..6).map(move |k| (a, k))) {
                let sum: f64 = (0..6).map(|j| of_part[a][j] * matrix[j][k]).sum();
                assert!((sum - of_whole[a][k]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn modes_are_orthonormal_rigid_motions() {
        let points = [[1.0, 2.0, 3.0], [4.0, 2.5, 3.0], [1.0, 7.0, 3.5], [1.5, 2.0, 9.0], [-3.0, 0.0, 1.0]];
        let modes = RigidModes::new(&points);
        for k in 0..6 {
            let mut unit = [0.0; 6];
            unit[k] = 1.0;
            let mut v = vec![0.0; 15];
            modes.add_motion(&points, unit, &mut v);
            for (component, moved) in v.iter().enumerate() {
                let (point, axis) = (points[component / 3], component % 3);
                assert!((moved - modes.at(point)[axis][k]).abs() < 1e-14);
            }
            let products = modes.resultants(&points, &v);
            for (l, product) in products.iter().enumerate() {
                assert!((product - unit[l]).abs() < 1e-14, "{k} {l} {product}");
            }
            // Distances between any two points do not change to first order.
            for (i, j) in (0..5).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let change: f64 = (0..3).map(|a| (points[i][a] - points[j][a]) * (v[3 * i + a] - v[3 * j + a])).sum();
                assert!(change.abs() < 1e-13);
            }
        }
    }
}
