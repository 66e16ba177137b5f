//! Points of an element that its own integration does not know: for loads and errors that vary inside of it.
//!
//! 27 Gauss points, on tetrahedra folded towards the last corners: exact for polynomials of degree three and more.

use super::{Cell, Kind};

/// A point of an element. Mean dilatation is left out: gradients are those of the displacement.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Volume that it stands for.
    pub weight: f64,
    /// Value of each node's shape function.
    pub values: Vec<f64>,
    /// Gradient of each node's shape function (1 / length).
    pub gradients: Vec<[f64; 3]>,
}

/// Coordinates in [-1, 1] and weights, which add up to two.
pub const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// The points of an element with these nodes.
///
/// # Panics
/// If it has another number of nodes.
pub fn samples(kind: Kind, nodes: &[[f64; 3]]) -> Vec<Sample> {
    (0..27).map(|k| sample(kind, nodes, [GAUSS[k % 3], GAUSS[k / 3 % 3], GAUSS[k / 9]])).collect()
}

fn sample(kind: Kind, nodes: &[[f64; 3]], [(r, a), (s, b), (t, c)]: [(f64, f64); 3]) -> Sample {
    match kind.cell() {
        Cell::Hexahedron => kind.sample(nodes, &[r, s, t], a * b * c),
        Cell::Tetrahedron => {
            let [r, s, t] = [r, s, t].map(|x| 0.5 * (1.0 + x));
            let at = [r * (1.0 - s) * (1.0 - t), s * (1.0 - t), t];
            let folded = a * b * c / 8.0 * (1.0 - s) * (1.0 - t) * (1.0 - t);
            kind.sample(nodes, &[1.0 - at[0] - at[1] - at[2], at[0], at[1], at[2]], folded)
        }
    }
}

impl Sample {
    /// What the shape functions make of vectors at the nodes: a place, a displacement.
    pub fn value(&self, of_nodes: &[[f64; 3]]) -> [f64; 3] {
        std::array::from_fn(|i| self.values.iter().zip(of_nodes).map(|(value, v)| value * v[i]).sum())
    }

    /// Strain (engineering shears) of displacements of the nodes.
    pub fn strain(&self, u: &[[f64; 3]]) -> [f64; 6] {
        let slope = |i: usize, j: usize| self.gradients.iter().zip(u).map(|(g, u)| g[j] * u[i]).sum::<f64>();
        let shear = |i: usize, j: usize| slope(i, j) + slope(j, i);
        [slope(0, 0), slope(1, 1), slope(2, 2), shear(0, 1), shear(1, 2), shear(2, 0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{cell, hex8};

    /// Integrals over a box, or a corner of it, of a cubic monomial, and the strain of a linear field.
    #[test]
    fn cubic_functions_and_linear_fields_are_exact() {
        let corners = hex8::CORNERS.map(|c| [1.0 + c[0], 1.5 * (1.0 + c[1]), 0.5 * (1.0 + c[2])]);
        let tet = [corners[0], corners[1], corners[3], corners[4]];
        let middle = |a: usize, b: usize| std::array::from_fn(|i| 0.5 * (tet[a][i] + tet[b][i]));
        let middles = cell::EDGES.map(|(a, b)| middle(a, b));
        let quadratic: Vec<[f64; 3]> = tet.iter().chain(&middles).copied().collect();
        // x y z over the box is the product of squares of the edges over 8; over the corner (2 3 1)^2 1!1!1!/6!.
        let cases = [(Kind::Hex8, corners.to_vec(), 36.0 / 8.0), (Kind::Tet4, tet.to_vec(), 36.0 / 720.0)];
        for (kind, nodes, expected) in cases.into_iter().chain([(Kind::Tet10, quadratic, 36.0 / 720.0)]) {
            let samples = samples(kind, &nodes);
            let product = |s: &Sample| s.weight * s.value(&nodes).iter().product::<f64>();
            let integral: f64 = samples.iter().map(product).sum();
            assert!((integral / expected - 1.0).abs() < 1e-13, "{kind:?}: {integral}");
            let u: Vec<[f64; 3]> = nodes.iter().map(|x| [2.0 * x[0] + x[1], 3.0 * x[2], x[2] - x[0]]).collect();
            for (found, expected) in samples[5].strain(&u).iter().zip([2.0, 0.0, 1.0, 1.0, 3.0, -1.0]) {
                assert!((found - expected).abs() < 1e-13, "{kind:?}");
            }
        }
    }
}
