//! `R`: the six rigid body modes of a subdomain, orthonormal, from its coordinates alone.
//!
//! Translations and rotations about the centroid are orthogonal over the nodes; the rotations are orthonormalised by
//! the Cholesky factor of their 3x3 Gram matrix (the inertia tensor of the nodes). Pivots play no part: a face-connected
//! set of tetrahedra has exactly these modes.

use std::ops::Range;

use crate::decomposition::Subdomain;
use crate::vector::{cross, difference, dot};
use crate::work;

/// Rigid modes of a subdomain, or of a cluster.
pub const MODES: usize = 6;

/// Operations at a point: 30 for the modes there, and 2 for each of their 18 numbers.
const OF_POINT: usize = 66;

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
        let (centre, gram) = inertia(points);
        Self { centre, translation: 1.0 / (points.len() as f64).sqrt(), axes: inverse_cholesky(gram) }
    }

    /// The modes' displacements at a point, `[component][mode]`.
    pub fn at(&self, point: [f64; 3]) -> [[f64; 6]; 3] {
        let arm = difference(point, self.centre);
        let turned = self.axes.map(|axis| cross(axis, arm));
        let mut modes = [[0.0; 6]; 3];
        for (a, row) in modes.iter_mut().enumerate() {
            row[a] = self.translation;
            turned.iter().enumerate().for_each(|(k, turned)| row[3 + k] = turned[a]);
        }
        modes
    }

    /// `R'v` over the given nodes; `v` has three entries a node.
    pub fn resultants(&self, points: &[[f64; 3]], v: &[f64]) -> [f64; 6] {
        work::each(points.len(), OF_POINT, 2 * size_of::<[f64; 3]>());
        let mut sum = [0.0; 6];
        for (point, force) in points.iter().zip(v.chunks_exact(3)) {
            for (row, f) in self.at(*point).iter().zip(force) {
                sum.iter_mut().zip(row).for_each(|(s, r)| *s += r * f);
            }
        }
        sum
    }

    /// `v += R amplitudes` over the given nodes.
    pub fn add_motion(&self, points: &[[f64; 3]], amplitudes: &[f64], v: &mut [f64]) {
        work::each(points.len(), OF_POINT, 2 * size_of::<[f64; 3]>());
        for (point, u) in points.iter().zip(v.chunks_exact_mut(3)) {
            for (row, u) in self.at(*point).iter().zip(u) {
                *u += row.iter().zip(amplitudes).map(|(r, a)| r * a).sum::<f64>();
            }
        }
    }
}

/// The modes of each cluster, given by its range of own subdomains, for each of its members: orthonormal over all of them.
pub fn of_clusters(clusters: impl Iterator<Item = Range<usize>>, subdomains: &[Subdomain]) -> Vec<RigidModes> {
    let mut modes = Vec::with_capacity(subdomains.len());
    for members in clusters {
        let points: Vec<[f64; 3]> = subdomains[members.clone()].iter().flat_map(|s| s.points.iter().copied()).collect();
        modes.resize(members.end, RigidModes::new(&points));
    }
    modes
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
    fn modes_are_orthonormal_rigid_motions() {
        let points = [[1.0, 2.0, 3.0], [4.0, 2.5, 3.0], [1.0, 7.0, 3.5], [1.5, 2.0, 9.0], [-3.0, 0.0, 1.0]];
        let modes = RigidModes::new(&points);
        for k in 0..6 {
            let mut unit = [0.0; 6];
            unit[k] = 1.0;
            let mut v = vec![0.0; 15];
            modes.add_motion(&points, &unit, &mut v);
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
