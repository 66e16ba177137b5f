//! An integration point of an element of `N` nodes: strain = B u there, forces w B' stress, stiffness w B' D B.
//!
//! The columns of B for node a are the symmetric parts of e_i x g_a, with g_a the gradient of the node's shape function
//! (Hughes, The Finite Element Method, 2.8 and 3.10). With mean dilatation, m_a the mean of g_a over the element, a
//! third of (m_a - g_a) . u_a is added to each normal strain: the trace is that of the means. Nodal vectors have three
//! components a node.

use crate::simd::vectorised;
use crate::tensor::{COMPONENT, Tangent, Voigt, trace};

/// A vector at each node.
pub type Nodal<const N: usize> = [[f64; 3]; N];

/// A matrix on nodal vectors: `[a][i][j][b]` is row (node a, component i), column (node b, component j).
pub type Stiffness<const N: usize> = [[[[f64; N]; 3]; 3]; N];

/// An integration point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<const N: usize> {
    /// Volume that it stands for, > 0.
    pub weight: f64,
    /// Gradient of each node's shape function, 1 / length; they add up to zero.
    pub gradients: Nodal<N>,
    /// Their mean over the element less themselves, where the element has mean dilatation.
    pub dilatation: Option<Nodal<N>>,
}

impl<const N: usize> Point<N> {
    /// Strain (engineering shears) of nodal displacements.
    #[inline]
    pub fn strain(&self, u: &Nodal<N>) -> Voigt {
        let mut h = [[0.0; 3]; 3];
        for (g, u) in self.gradients.iter().zip(u) {
            for (row, u) in h.iter_mut().zip(u) {
                for (entry, g) in row.iter_mut().zip(g) {
                    *entry += u * g;
                }
            }
        }
        let mut strain = [h[0][0], h[1][1], h[2][2], h[0][1] + h[1][0], h[1][2] + h[2][1], h[2][0] + h[0][2]];
        if let Some(dilatation) = &self.dilatation {
            let products = dilatation.as_flattened().iter().zip(u.as_flattened()).map(|(d, u)| d * u);
            let third = products.sum::<f64>() / 3.0;
            strain[..3].iter_mut().for_each(|s| *s += third);
        }
        strain
    }

    /// Adds the nodal forces w B' stress.
    #[inline]
    pub fn add_internal(&self, stress: &Voigt, forces: &mut Nodal<N>) {
        for (g, force) in self.gradients.iter().zip(forces.iter_mut()) {
            for (force, row) in force.iter_mut().zip(COMPONENT) {
                *force += self.weight * (g[0] * stress[row[0]] + g[1] * stress[row[1]] + g[2] * stress[row[2]]);
            }
        }
        if let Some(dilatation) = &self.dilatation {
            let mean = self.weight * trace(stress) / 3.0;
            for (force, d) in forces.as_flattened_mut().iter_mut().zip(dilatation.as_flattened()) {
                *force += mean * d;
            }
        }
    }

    /// Adds the stiffness w B' D B for a symmetric tangent D, to be read by [`block`].
    #[inline]
    pub fn add_stiffness(&self, tangent: &Tangent, k: &mut Stiffness<N>) {
        vectorised(
            k,
            #[inline(always)]
            |k| self.add_products(tangent, k),
        );
    }

    #[inline(always)]
    fn add_products(&self, tangent: &Tangent, k: &mut Stiffness<N>) {
        // Nodes come last: sums run over all of them at once.
        let gradients = by_direction(&self.gradients);
        let dilatation = self.dilatation.as_ref().map(by_direction);
        let weighted = gradients.map(|g| g.map(|g| self.weight * g));
        // Six rows of w D B; then every row of B' is three scaled rows of it.
        let mut stresses = [[[0.0; N]; 3]; 6];
        for (row, d) in stresses.iter_mut().zip(tangent) {
            for (entries, column) in row.iter_mut().zip(COMPONENT) {
                *entries = combined(column.map(|c| d[c]), weighted.each_ref());
            }
            if let Some(dilatation) = &dilatation {
                let mean = self.weight * (d[0] + d[1] + d[2]) / 3.0;
                for (entries, d) in row.iter_mut().zip(dilatation) {
                    (0..N).for_each(|b| entries[b] += mean * d[b]);
                }
            }
        }
        for (a, block) in k.iter_mut().enumerate() {
            for (i, (rows, row)) in block.iter_mut().zip(COMPONENT).enumerate() {
                for (j, entries) in rows.iter_mut().enumerate() {
                    let sum = combined(self.gradients[a], row.each_ref().map(|&c| &stresses[c][j]));
                    (0..N).for_each(|b| entries[b] += sum[b]);
                    if let Some(dilatation) = &dilatation {
                        let sum = combined([1.0; 3], [0, 1, 2].map(|c| &stresses[c][j]));
                        (0..N).for_each(|b| entries[b] += dilatation[i][a] / 3.0 * sum[b]);
                    }
                }
            }
        }
    }
}

/// Components of vectors at the nodes, direction by direction.
#[inline(always)]
fn by_direction<const N: usize>(vectors: &Nodal<N>) -> [[f64; N]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|a| vectors[a][i]))
}

/// `x p + y q + z r`.
#[inline(always)]
fn combined<const N: usize>([x, y, z]: [f64; 3], [p, q, r]: [&[f64; N]; 3]) -> [f64; N] {
    std::array::from_fn(|b| x * p[b] + y * q[b] + z * r[b])
}

/// The block `[i][j]` of nodes `(a, b)`: the matrix is symmetric to the last bit.
#[inline]
pub fn block<const N: usize>(k: &Stiffness<N>, a: usize, b: usize) -> [[f64; 3]; 3] {
    let entry = |i: usize, j: usize| if a < b { k[a][i][j][b] } else { k[b][j][i][a] };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}
