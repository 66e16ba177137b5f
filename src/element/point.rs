//! An integration point of an element of `N` nodes: strain = B u there, forces w B' stress, stiffness w B' D B.
//!
//! The columns of B for node a are the symmetric parts of e_i x g_a, with g_a the gradient of the node's shape function
//! (Hughes, The Finite Element Method, 2.8 and 3.10). With mean dilatation, m_a the mean of g_a over the element, a
//! third of (m_a - g_a) . u_a is added to each normal strain: the trace is that of the means. Nodal vectors have three
//! components a node.

use crate::tensor::{COMPONENT, Tangent, Voigt, trace};

/// A vector at each node.
pub type Nodal<const N: usize> = [[f64; 3]; N];

/// A matrix on nodal vectors: `[a][i][b][j]` is row (node a, component i), column (node b, component j).
pub type Stiffness<const N: usize> = [[Nodal<N>; 3]; N];

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

    /// Adds the stiffness w B' D B for a symmetric tangent D. Only what [`mirror`] keeps is of use.
    #[inline]
    pub fn add_stiffness(&self, tangent: &Tangent, k: &mut Stiffness<N>) {
        // Six rows of w D B; then every row of B' is three scaled rows of it.
        let mut stresses = [[[0.0; 3]; N]; 6];
        for (row, d) in stresses.iter_mut().zip(tangent) {
            for (column, g) in row.iter_mut().zip(&self.gradients) {
                let [x, y, z] = g.map(|g| self.weight * g);
                column[0] = d[0] * x + d[3] * y + d[5] * z;
                column[1] = d[3] * x + d[1] * y + d[4] * z;
                column[2] = d[5] * x + d[4] * y + d[2] * z;
            }
            if let Some(dilatation) = &self.dilatation {
                let mean = self.weight * (d[0] + d[1] + d[2]) / 3.0;
                for (entry, d) in row.as_flattened_mut().iter_mut().zip(dilatation.as_flattened()) {
                    *entry += mean * d;
                }
            }
        }
        for (block, [x, y, z]) in k.iter_mut().zip(&self.gradients) {
            for (entries, row) in block.iter_mut().zip(COMPONENT) {
                let [p, q, r] = row.map(|c| stresses[c].as_flattened());
                for (j, entry) in entries.as_flattened_mut().iter_mut().enumerate() {
                    *entry += x * p[j] + y * q[j] + z * r[j];
                }
            }
        }
        if let Some(dilatation) = &self.dilatation {
            let [p, q, r] = [0, 1, 2].map(|c| stresses[c].as_flattened());
            let rows = k.as_flattened_mut().iter_mut().zip(dilatation.as_flattened());
            for (entries, d) in rows.map(|(entries, d)| (entries.as_flattened_mut(), d / 3.0)) {
                for (j, entry) in entries.iter_mut().enumerate() {
                    *entry += d * (p[j] + q[j] + r[j]);
                }
            }
        }
    }
}

/// Copies the upper triangle to the lower one: the matrix is symmetric to the last bit.
#[inline]
pub fn mirror<const N: usize>(k: &mut Stiffness<N>) {
    let rows = k.as_flattened_mut();
    for i in 1..rows.len() {
        let (above, below) = rows.split_at_mut(i);
        for (entry, row) in below[0].as_flattened_mut().iter_mut().zip(above) {
            *entry = row.as_flattened()[i];
        }
    }
}
