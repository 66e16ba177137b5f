//! Stiffness scaling of the constraint rows: `B_D = (B D^-1 B')^-1 B D^-1` with `D` the diagonal of the stiffness.
//!
//! `B D^-1 B'` is block diagonal over the blocks of rows, so unequal stiffness on both sides of an interface, or of a
//! contact, is weighted exactly (Rixen and Farhat 1999; Klawonn, Rheinbach 2007 in matrix form). The inverses of the
//! blocks are kept dense.

use std::ops::Range;

use super::gather::Gather;
use crate::constraint::Constraints;

/// `D^-1` of own subdomains and the inverses of the blocks of `B D^-1 B'`.
#[derive(Default)]
pub struct Scaling {
    /// Inverse diagonal of each own subdomain.
    pub flexibility: Vec<Vec<f64>>,
    /// The three components' flexibility at the node of each slot.
    of_slot: Vec<[f64; 3]>,
    blocks: Vec<Range<usize>>,
    /// Inverses of the blocks, row by row, one behind the other.
    inverses: Vec<f64>,
}

impl Scaling {
    /// From the diagonals of the own subdomains' stiffness matrices, on all rows. One neighbour exchange.
    pub fn new(constraints: &Constraints, gather: &Gather, diagonals: &[Vec<f64>]) -> Self {
        let flexibility: Vec<Vec<f64>> = diagonals.iter().map(|d| d.iter().map(|x| 1.0 / x).collect()).collect();
        // Every slot belongs to one node of its subdomain: three numbers tell the flexibility there.
        let mut of_slot = vec![[0.0; 3]; constraints.slot_subdomain.len()];
        gather.exchange(
            3,
            |own, slots| {
                for entry in gather.entries(own) {
                    let node = 3 * (entry.dof as usize / 3);
                    slots[3 * entry.slot as usize..][..3].copy_from_slice(&flexibility[own][node..node + 3]);
                }
            },
            |row, values| {
                for (slot, three) in constraints.slots(row).zip(values.chunks_exact(3)) {
                    of_slot[slot].copy_from_slice(three);
                }
            },
        );
        let mut inverses = Vec::new();
        for rows in &constraints.blocks {
            inverses.extend(invert(block_matrix(constraints, rows.clone(), &of_slot, |_| true), rows.len()));
        }
        Self { flexibility, of_slot, blocks: constraints.blocks.clone(), inverses }
    }

    /// From now on only the kept rows count, the others get zero. Only rows of inequalities may come and go. Local.
    pub fn restrict(&mut self, constraints: &Constraints, kept: impl Fn(usize) -> bool) {
        let mut at = 0;
        for rows in &self.blocks {
            let end = at + rows.len() * rows.len();
            if constraints.rows[rows.clone()].iter().any(|row| row.is_inequality()) {
                let block = block_matrix(constraints, rows.clone(), &self.of_slot, &kept);
                self.inverses[at..end].copy_from_slice(&invert(block, rows.len()));
            }
            at = end;
        }
    }

    /// `y = (B D^-1 B')^-1 x`. Local.
    pub fn solve(&self, x: &[f64], y: &mut [f64]) {
        let mut at = 0;
        for rows in &self.blocks {
            let (x, n) = (&x[rows.clone()], rows.len());
            for (y, row) in y[rows.clone()].iter_mut().zip(self.inverses[at..at + n * n].chunks_exact(n)) {
                *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
            }
            at += n * n;
        }
    }
}

/// `B D^-1 B'` of one block, zero in the rows that are not kept.
fn block_matrix(
    constraints: &Constraints,
    rows: Range<usize>,
    of_slot: &[[f64; 3]],
    kept: impl Fn(usize) -> bool,
) -> Vec<f64> {
    let n = rows.len();
    let mut terms = Vec::new();
    for row in rows.clone().filter(|&row| kept(row)) {
        let mut slot = constraints.slots(row).start;
        let all = &constraints.rows[row].terms;
        for (k, term) in all.iter().enumerate() {
            slot += usize::from(k > 0 && all[k - 1].subdomain != term.subdomain);
            let key = (term.subdomain, term.node, term.axis);
            terms.push((key, row - rows.start, term.value, of_slot[slot][term.axis]));
        }
    }
    terms.sort_by_key(|t| (t.0, t.1));
    let mut matrix = vec![0.0; n * n];
    for same in terms.chunk_by(|a, b| a.0 == b.0) {
        for a in same {
            for b in same {
                matrix[n * a.1 + b.1] += a.2 * b.2 * a.3;
            }
        }
    }
    matrix
}

/// Inverse of a symmetric matrix that is positive definite but for zero rows, which stay zero (Gauss-Jordan; definite
/// blocks of a few rows need no pivoting).
fn invert(mut a: Vec<f64>, n: usize) -> Vec<f64> {
    for k in 0..n {
        let pivot = a[n * k + k];
        if pivot == 0.0 {
            continue;
        }
        let inverse = 1.0 / pivot;
        for i in (0..n).filter(|&i| i != k) {
            let factor = a[n * i + k] * inverse;
            for j in 0..n {
                if j != k {
                    a[n * i + j] -= factor * a[n * k + j];
                }
            }
            a[n * i + k] = factor;
        }
        for j in 0..n {
            a[n * k + j] *= if j == k { 0.0 } else { -inverse };
        }
        a[n * k + k] = inverse;
    }
    a
}

#[cfg(test)]
mod tests {
    use super::invert;
    use crate::random::Random;

    #[test]
    fn inverts_a_definite_matrix_and_leaves_zero_rows() {
        let mut random = Random::new(3);
        let n = 5;
        let g: Vec<f64> = (0..n * n).map(|_| random.number()).collect();
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                if i != 2 && j != 2 {
                    a[n * i + j] = (0..n).map(|k| g[n * i + k] * g[n * j + k]).sum::<f64>() + f64::from(i == j);
                }
            }
        }
        let inverse = invert(a.clone(), n);
        for i in 0..n {
            for j in 0..n {
                let product: f64 = (0..n).map(|k| a[n * i + k] * inverse[n * k + j]).sum();
                let unit = f64::from(i == j && i != 2);
                assert!((product - unit).abs() < 1e-13, "({i}, {j}): {product}");
            }
        }
    }
}
