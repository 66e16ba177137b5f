//! Stiffness scaling of the constraint rows: `B_D = (B D^-1 B')^-1 B D^-1` with `D^-1` the [`Flexibility`] of the stiffness.
//!
//! `B D^-1 B'` is block diagonal over the blocks of rows, so unequal stiffness on both sides of an interface, or of a
//! contact, is weighted exactly (Rixen and Farhat 1999; Klawonn, Rheinbach 2007 in matrix form). Inverses of small blocks
//! are kept dense, of larger ones as sparse factors. Of large components of conditions, whose blocks are parts, each subdomain has one near
//! it ([`super::patches`]).

use std::ops::Range;

use super::flexibility::Flexibility;
use super::patches::Patches;
use crate::constraint::Constraints;
use crate::feti::dual::gather::Gather;
use crate::feti::dual::gram::{Coefficient, Gram, Products, coefficients};
use crate::sparse::pattern::Pattern;
use crate::work;

/// Most rows of a small block.
const SMALL: usize = 64;

/// `D^-1` and the inverses of the blocks of `B D^-1 B'`.
#[derive(Default)]
pub struct Scaling {
    /// `D^-1`.
    flexibility: Flexibility,
    /// Rows of the small blocks.
    blocks: Vec<Range<usize>>,
    /// Inverses of the small blocks, row by row, one behind the other.
    inverses: Vec<f64>,
    large: Vec<Gram>,
    /// Of own subdomains that hold parts of large components.
    patches: Vec<Option<Gram>>,
}

impl Scaling {
    /// From patterns and lower values of the own subdomains' stiffness matrices, on all rows; `patches` with what was before, if there are any. Takes the neighbour exchanges of
    /// [`Flexibility::new`].
    pub fn new<'s>(
        constraints: &Constraints,
        gather: &Gather,
        patches: Option<(&Patches, Self)>,
        stiffness: impl Iterator<Item = (&'s Pattern, &'s [f64])>,
    ) -> Self {
        let flexibility = Flexibility::new(constraints, gather, stiffness);
        let whole = constraints.blocks.iter().zip(&constraints.is_part).filter(|(_, part)| !**part);
        let (small, large): (Vec<_>, Vec<_>) =
            whole.map(|(rows, _)| rows.clone()).partition(|rows| rows.len() <= SMALL);
        let mut inverses = Vec::new();
        for rows in &small {
            inverses.extend(invert(block_matrix(constraints, rows.clone(), &flexibility, |_| true), rows.len()));
        }
        let products =
            |rows: Range<usize>| Products::new(constraints, rows.collect(), true, |a, b| flexibility.between(a, b));
        let large = large.into_iter().map(|rows| Gram::new(products(rows))).collect();
        let patches =
            patches.map_or_else(Vec::new, |(patches, before)| patches.grams(constraints, &flexibility, before.patches));
        let mut result = Self { flexibility, blocks: small, inverses, large, patches };
        result.grams().for_each(|gram| gram.factorise(|_| true));
        result
    }

    fn grams(&mut self) -> impl Iterator<Item = &mut Gram> {
        self.large.iter_mut().chain(self.patches.iter_mut().flatten())
    }

    /// From now on only the kept rows count, the others get zero. Only rows of inequalities may come and go. Local.
    pub fn restrict(&mut self, constraints: &Constraints, kept: impl Fn(usize) -> bool) {
        let mut at = 0;
        for rows in &self.blocks {
            let end = at + rows.len() * rows.len();
            if changes(constraints, rows.clone()) {
                let block = block_matrix(constraints, rows.clone(), &self.flexibility, &kept);
                self.inverses[at..end].copy_from_slice(&invert(block, rows.len()));
            }
            at = end;
        }
        for gram in self.grams() {
            if changes(constraints, gram.rows()[0]..gram.rows()[gram.rows().len() - 1] + 1) {
                gram.factorise(&kept);
            }
        }
    }

    /// `D^-1`.
    pub fn flexibility(&self) -> &Flexibility {
        &self.flexibility
    }

    /// The inverses of [`Patches::grams`].
    pub fn patches(&mut self) -> &mut [Option<Gram>] {
        &mut self.patches
    }

    /// `y = A_s^-1 R_s x` in the rows of parts that an own subdomain holds, if it holds any. Local.
    pub fn solve_near(&mut self, own: usize, x: &[f64], y: &mut [f64]) {
        if let Some(gram) = self.patches.get_mut(own).and_then(Option::as_mut) {
            gram.solve(x, y);
        }
    }

    /// `y = (B D^-1 B')^-1 x` in the rows that are not of parts. Local.
    pub fn solve(&mut self, x: &[f64], y: &mut [f64]) {
        let mut at = 0;
        work::each(self.inverses.len(), 2, size_of::<f64>());
        for rows in &self.blocks {
            let (x, n) = (&x[rows.clone()], rows.len());
            for (y, row) in y[rows.clone()].iter_mut().zip(self.inverses[at..at + n * n].chunks_exact(n)) {
                *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
            }
            at += n * n;
        }
        self.large.iter_mut().for_each(|gram| gram.solve(x, y));
    }
}

/// Whether rows of a block may come and go.
fn changes(constraints: &Constraints, rows: Range<usize>) -> bool {
    constraints.rows[rows].iter().any(|row| !row.law().always_holds())
}

/// `B D^-1 B'` of one block, zero in the rows that are not kept.
fn block_matrix(
    constraints: &Constraints,
    rows: Range<usize>,
    flexibility: &Flexibility,
    kept: impl Fn(usize) -> bool,
) -> Vec<f64> {
    let n = rows.len();
    let kept = rows.clone().filter(|&row| kept(row)).map(|row| (row - rows.start, row));
    let coefficients = coefficients(constraints, kept, true);
    let mut matrix = vec![0.0; n * n];
    for same in coefficients.chunk_by(Coefficient::share_block) {
        for a in same {
            for b in same {
                matrix[n * a.place + b.place] += a.value * b.value * flexibility.between(a.site, b.site);
            }
        }
    }
    matrix
}

/// Inverse of a symmetric matrix that is positive definite but for zero rows, which stay zero (Gauss-Jordan; definite
/// blocks of a few rows need no pivoting).
fn invert(mut a: Vec<f64>, n: usize) -> Vec<f64> {
    work::add(2 * n * n * n, size_of_val(&a[..]));
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
