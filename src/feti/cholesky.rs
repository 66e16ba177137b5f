//! Sparse Cholesky factors: faer's, analysed once and factorised for many values.
//!
//! Several factors share one [`Workspace`], so that neither factorising nor solving allocates. Nothing here pivots.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::prelude::MatMut;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Par, Side, Spec};

/// Sparsity of a symmetric matrix: its lower triangle by columns, rows ascending.
#[derive(Clone, Copy)]
pub struct Lower<'a> {
    /// First entry of each column, and the end.
    pub column_begin: &'a [u32],
    /// Row of each entry.
    pub rows: &'a [u32],
}

impl<'a> Lower<'a> {
    fn pattern(self) -> SymbolicSparseColMatRef<'a, u32> {
        let n = self.column_begin.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, self.column_begin, None, self.rows)
    }
}

/// Elimination order and sparsity of a factor.
pub struct Analysis(SymbolicCholesky<u32>);

/// The matrix is not positive definite: where the factorisation broke down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Breakdown {
    /// Place in the elimination order.
    pub place: usize,
    /// The unknown at that place.
    pub unknown: usize,
}

impl Analysis {
    /// In a given elimination order (the unknown at each place), always by supernodes.
    pub fn ordered(lower: Lower, order: &[u32]) -> Self {
        let mut inverse = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &unknown)| inverse[unknown as usize] = place as u32);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        Self::new(lower, SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, order.len())), params)
    }

    /// In an approximate minimum degree order.
    pub fn minimum_degree(lower: Lower) -> Self {
        Self::new(lower, SymmetricOrdering::Amd, Default::default())
    }

    fn new(lower: Lower, ordering: SymmetricOrdering<u32>, params: CholeskySymbolicParams) -> Self {
        let symbolic = factorize_symbolic_cholesky(lower.pattern(), Side::Lower, ordering, params);
        Self(symbolic.expect("a factor fits in memory and its index type"))
    }

    /// Doubles in the factor.
    pub fn factor_length(&self) -> usize {
        self.0.len_val()
    }
}

/// Scratch memory for some analyses.
pub struct Workspace(MemBuffer);

impl Workspace {
    /// Large enough for each of these analyses.
    pub fn new<'a>(analyses: impl IntoIterator<Item = &'a Analysis>) -> Self {
        let request = |Analysis(symbolic): &Analysis| {
            symbolic
                .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default())
                .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))
        };
        Self(MemBuffer::new(analyses.into_iter().map(request).fold(StackReq::EMPTY, StackReq::or)))
    }

    /// Overwrites `factor` by the factor of the matrix with these lower values.
    ///
    /// # Errors
    /// If a pivot is not positive. A matrix that is not finite may pass or not.
    pub fn factorise(
        &mut self,
        Analysis(symbolic): &Analysis,
        lower: Lower,
        values: &[f64],
        factor: &mut [f64],
    ) -> Result<(), Breakdown> {
        let matrix = SparseColMatRef::new(lower.pattern(), values);
        let (regularization, stack) = (LltRegularization::default(), MemStack::new(&mut self.0));
        match symbolic.factorize_numeric_llt(
            factor,
            matrix,
            Side::Lower,
            regularization,
            Par::Seq,
            stack,
            Spec::default(),
        ) {
            Ok(_) => Ok(()),
            Err(LltError::NonPositivePivot { index: place }) => {
                let unknown = symbolic.perm().map_or(place, |order| order.arrays().0[place] as usize);
                Err(Breakdown { place, unknown })
            }
        }
    }

    /// `x = A^-1 x` with the factor of `A`.
    pub fn solve(&mut self, Analysis(symbolic): &Analysis, factor: &[f64], x: &mut [f64]) {
        let n = x.len();
        LltRef::new(symbolic, factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.0),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The chain with `2 + shift` on the diagonal and -1 beside it.
    fn chain(n: u32, shift: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
        let begins = (0..n).map(|c| 2 * c).chain([2 * n - 1]).collect();
        let rows = (0..n).flat_map(|c| [c, c + 1]).take(2 * n as usize - 1).collect();
        let values = (0..n).flat_map(|_| [2.0 + shift, -1.0]).take(2 * n as usize - 1).collect();
        (begins, rows, values)
    }

    #[test]
    fn solves_in_any_order_and_one_workspace_serves_all() {
        let [small, large] = [5_u32, 40].map(|n| (n, chain(n, 0.5)));
        let analyses = [&small, &large].map(|(n, (column_begin, rows, _))| {
            let lower = Lower { column_begin, rows };
            let backwards: Vec<u32> = (0..*n).rev().collect();
            [Analysis::ordered(lower, &backwards), Analysis::minimum_degree(lower)]
        });
        let mut workspace = Workspace::new(analyses.iter().flatten());
        for ((n, (column_begin, rows, values)), pair) in [&small, &large].into_iter().zip(&analyses) {
            for analysis in pair {
                let mut factor = vec![0.0; analysis.factor_length()];
                workspace.factorise(analysis, Lower { column_begin, rows }, values, &mut factor).expect("definite");
                let n = *n as usize;
                let mut x: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
                workspace.solve(analysis, &factor, &mut x);
                for k in 0..n {
                    let beside = if k > 0 { x[k - 1] } else { 0.0 } + x.get(k + 1).unwrap_or(&0.0);
                    assert!((2.5 * x[k] - beside - (k as f64).sin()).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn a_breakdown_names_the_unknown() {
        let (column_begin, rows, mut values) = chain(6, 1.0);
        values[2 * 4] = -1.0;
        let lower = Lower { column_begin: &column_begin, rows: &rows };
        let analysis = Analysis::ordered(lower, &[0, 1, 4, 2, 3, 5]);
        let mut factor = vec![0.0; analysis.factor_length()];
        let outcome = Workspace::new([&analysis]).factorise(&analysis, lower, &values, &mut factor);
        let breakdown = outcome.expect_err("the diagonal is negative");
        assert_eq!(breakdown.unknown, 4);
    }
}
