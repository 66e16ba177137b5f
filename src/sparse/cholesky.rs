//! Sparse Cholesky factors: faer's, analysed once and factorised for many values.
//!
//! Several factors share one [`Workspace`], so that neither factorising nor solving allocates. Nothing here pivots.
//! A solve reads the factor twice and does little else: in single precision it takes half the time and the memory.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Mat, Par, Side, Spec};

use super::pattern::Pattern;
use super::supernodes;
pub use super::supernodes::WIDTH;

/// Sparsity of a symmetric matrix: its lower triangle by columns, rows ascending.
#[derive(Clone, Copy)]
pub struct Lower<'a> {
    /// First entry of each column, and the end.
    pub column_begin: &'a [u32],
    /// Row of each entry.
    pub rows: &'a [u32],
}

impl<'a> From<&'a Pattern> for Lower<'a> {
    fn from(pattern: &'a Pattern) -> Self {
        Self { column_begin: &pattern.column_begin, rows: &pattern.rows }
    }
}

impl<'a> Lower<'a> {
    fn pattern(self) -> SymbolicSparseColMatRef<'a, u32> {
        let n = self.column_begin.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, self.column_begin, None, self.rows)
    }
}

/// Elimination order and sparsity of a factor.
pub struct Analysis(SymbolicCholesky<u32>);

/// What the numbers of a factor are stored in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits: right to about the condition number times 1e-7.
    Single,
    /// 64 bits.
    Double,
}

/// The numbers of a factor.
pub enum Factor {
    /// In single precision.
    Single(Vec<f32>),
    /// In double precision.
    Double(Vec<f64>),
}

impl Factor {
    /// Space for a factor.
    pub fn new(Analysis(symbolic): &Analysis, precision: Precision) -> Self {
        match precision {
            Precision::Single => Self::Single(vec![0.0; symbolic.len_val()]),
            Precision::Double => Self::Double(vec![0.0; symbolic.len_val()]),
        }
    }

    /// What its numbers are stored in.
    pub fn precision(&self) -> Precision {
        match self {
            Self::Single(_) => Precision::Single,
            Self::Double(_) => Precision::Double,
        }
    }

    fn number(&self, at: usize) -> f64 {
        match self {
            Self::Single(numbers) => f64::from(numbers[at]),
            Self::Double(numbers) => numbers[at],
        }
    }

    /// Size of its numbers, in bytes. A solve reads them twice.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Single(numbers) => size_of_val(&numbers[..]),
            Self::Double(numbers) => size_of_val(&numbers[..]),
        }
    }
}

/// The matrix is not positive definite: where the factorisation broke down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Breakdown {
    /// Place in the elimination order.
    pub place: usize,
    /// The unknown at that place.
    pub unknown: usize,
}

impl Analysis {
    /// In a given elimination order (the unknown at each place).
    pub fn ordered(lower: Lower, order: &[u32]) -> Self {
        let mut inverse = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &unknown)| inverse[unknown as usize] = place as u32);
        Self::new(lower, SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, order.len())))
    }

    /// In an approximate minimum degree order.
    pub fn minimum_degree(lower: Lower) -> Self {
        Self::new(lower, SymmetricOrdering::Amd)
    }

    fn new(lower: Lower, ordering: SymmetricOrdering<u32>) -> Self {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(lower.pattern(), Side::Lower, ordering, params);
        Self(symbolic.expect("a factor fits in memory and its index type"))
    }

    /// Numbers in the factor.
    pub fn factor_length(&self) -> usize {
        self.0.len_val()
    }

    /// The least pivot of a factor, relative to what `diagonal` tells of its unknown.
    pub fn least_pivot(&self, factor: &Factor, diagonal: impl Fn(usize) -> f64) -> f64 {
        let pivots = self.columns().map(|column| {
            let pivot = factor.number(column.at);
            pivot * pivot / diagonal(column.unknown)
        });
        pivots.fold(f64::INFINITY, f64::min)
    }

    /// `A_ff - A_fr A_rr^-1 A_rf` with f the last `count` unknowns in the order of elimination and r the others: `place` tells the
    /// line of an unknown of f.
    pub fn complement(&self, factor: &Factor, count: usize, place: impl Fn(usize) -> Option<usize>) -> Mat<f64> {
        let mut lower = Mat::zeros(count, count);
        for column in self.columns() {
            let Some(k) = place(column.unknown) else { continue };
            for (row, at) in column.rows.zip(column.at..) {
                let i = place(row).expect("what is eliminated later is among the last");
                lower[(i, k)] = factor.number(at);
            }
        }
        &lower * lower.transpose()
    }

    /// The columns of a factor.
    fn columns(&self) -> impl Iterator<Item = Column<impl Iterator<Item = usize>>> {
        let order = self.0.perm().map_or(&[][..], |order| order.arrays().0);
        let panels = match self.0.raw() {
            SymbolicCholeskyRaw::Supernodal(panels) => Some(panels),
            // Only a matrix without unknowns.
            SymbolicCholeskyRaw::Simplicial(_) => None,
        };
        panels.into_iter().flat_map(move |panels| {
            (0..panels.n_supernodes()).flat_map(move |s| {
                let (begin, end) = (panels.supernode_begin()[s] as usize, panels.supernode_end()[s] as usize);
                let below = panels.supernode(s).pattern();
                let (first, height) = (panels.col_ptr_for_val()[s] as usize, end - begin + below.len());
                (begin..end).map(move |place| {
                    let rows = (place..end).chain(below.iter().map(|&row| row as usize));
                    let rows = rows.map(move |row| order[row] as usize);
                    Column { unknown: order[place] as usize, at: first + (place - begin) * (height + 1), rows }
                })
            })
        })
    }

    /// Additions and multiplications of a factorisation.
    pub fn flops(&self) -> f64 {
        let SymbolicCholeskyRaw::Supernodal(panels) = self.0.raw() else { return 0.0 };
        let rows = |s: usize, column: usize| {
            let width = (panels.supernode_end()[s] - panels.supernode_begin()[s]) as usize;
            (column < width).then(|| (width - column + panels.supernode(s).pattern().len()) as f64)
        };
        (0..panels.n_supernodes()).flat_map(|s| (0..).map_while(move |column| rows(s, column))).map(|n| n * n).sum()
    }
}

/// One column of a factor.
struct Column<R> {
    unknown: usize,
    /// Where its pivot stands among the numbers; the others follow.
    at: usize,
    /// The unknowns of its numbers, its own first.
    rows: R,
}

/// Scratch memory for some analyses.
pub struct Workspace {
    buffer: MemBuffer,
    single: Scratch<f32>,
    double: Scratch<f64>,
}

/// Scratch in one precision.
#[derive(Default)]
struct Scratch<T> {
    /// The matrix, or the unknowns in the order of elimination.
    numbers: Vec<T>,
    /// The unknowns that one supernode touches.
    panel: Vec<T>,
    /// The unknowns of several right-hand sides, and those that one supernode touches.
    wide: Vec<[T; WIDTH]>,
    wide_panel: Vec<[T; WIDTH]>,
}

impl Workspace {
    /// Large enough for each of these analyses.
    pub fn new<'a>(analyses: impl IntoIterator<Item = &'a Analysis>) -> Self {
        let request =
            |Analysis(symbolic): &Analysis| symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let request = analyses.into_iter().map(request).fold(StackReq::EMPTY, StackReq::or);
        Self { buffer: MemBuffer::new(request), single: Scratch::default(), double: Scratch::default() }
    }

    /// Overwrites `factor` by the factor of the matrix with these lower values.
    ///
    /// # Errors
    /// If a pivot is not positive. A matrix that is not finite may pass or not.
    pub fn factorise(
        &mut self,
        analysis: &Analysis,
        lower: Lower,
        values: &[f64],
        factor: &mut Factor,
    ) -> Result<(), Breakdown> {
        let stack = MemStack::new(&mut self.buffer);
        match factor {
            Factor::Double(factor) => factorise(analysis, lower, values, factor, stack),
            Factor::Single(factor) => {
                let Scratch { numbers, .. } = &mut self.single;
                numbers.clear();
                numbers.extend(values.iter().map(|&v| v as f32));
                factorise(analysis, lower, numbers, factor, stack)
            }
        }
    }

    /// `x = A^-1 x` with the factor of `A`.
    pub fn solve(&mut self, Analysis(symbolic): &Analysis, factor: &Factor, x: &mut [f64]) {
        // Only a matrix without unknowns is not analysed by supernodes.
        let (SymbolicCholeskyRaw::Supernodal(panels), Some(order)) = (symbolic.raw(), symbolic.perm()) else { return };
        let order = order.arrays().0;
        match factor {
            Factor::Double(factor) => {
                let Scratch { numbers, panel, .. } = &mut self.double;
                numbers.clear();
                numbers.extend(order.iter().map(|&k| x[k as usize]));
                supernodes::solve(panels, factor, numbers, panel);
                order.iter().zip(&*numbers).for_each(|(&k, &y)| x[k as usize] = y);
            }
            Factor::Single(factor) => {
                // Scaled, for the range of single precision is small.
                let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let scale = if largest > 0.0 { largest } else { 1.0 };
                let Scratch { numbers, panel, .. } = &mut self.single;
                numbers.clear();
                numbers.extend(order.iter().map(|&k| (x[k as usize] / scale) as f32));
                supernodes::solve(panels, factor, numbers, panel);
                order.iter().zip(&*numbers).for_each(|(&k, &y)| x[k as usize] = scale * f64::from(y));
            }
        }
    }

    /// `x = A^-1 x` for [`WIDTH`] vectors, `WIDTH` numbers an unknown. Each gets the bits that it would get beside others.
    pub fn solve_wide(&mut self, Analysis(symbolic): &Analysis, factor: &Factor, x: &mut [f64]) {
        let (SymbolicCholeskyRaw::Supernodal(panels), Some(order)) = (symbolic.raw(), symbolic.perm()) else { return };
        let (order, (x, _)) = (order.arrays().0, x.as_chunks_mut::<WIDTH>());
        match factor {
            Factor::Double(factor) => {
                let Scratch { wide: unknowns, wide_panel: panel, .. } = &mut self.double;
                unknowns.clear();
                unknowns.extend(order.iter().map(|&k| x[k as usize]));
                supernodes::solve_wide(panels, factor, unknowns, panel);
                order.iter().zip(&*unknowns).for_each(|(&k, y)| x[k as usize] = *y);
            }
            Factor::Single(factor) => {
                let Scratch { wide: unknowns, wide_panel: panel, .. } = &mut self.single;
                let mut largest = [0.0_f64; WIDTH];
                x.iter().for_each(|x| (0..WIDTH).for_each(|l| largest[l] = largest[l].max(x[l].abs())));
                let scale = largest.map(|m| if m > 0.0 { m } else { 1.0 });
                let single = |x: &[f64; WIDTH]| std::array::from_fn(|l| (x[l] / scale[l]) as f32);
                unknowns.clear();
                unknowns.extend(order.iter().map(|&k| single(&x[k as usize])));
                supernodes::solve_wide(panels, factor, unknowns, panel);
                for (&k, y) in order.iter().zip(&*unknowns) {
                    x[k as usize] = std::array::from_fn(|l| scale[l] * f64::from(y[l]));
                }
            }
        }
    }
}

fn factorise<T: RealField + Copy>(
    Analysis(symbolic): &Analysis,
    lower: Lower,
    values: &[T],
    factor: &mut [T],
    stack: &mut MemStack,
) -> Result<(), Breakdown> {
    let matrix = SparseColMatRef::new(lower.pattern(), values);
    let regularization = LltRegularization::default();
    symbolic
        .factorize_numeric_llt(factor, matrix, Side::Lower, regularization, Par::Seq, stack, Spec::default())
        .map(|_| ())
        .map_err(|LltError::NonPositivePivot { index: place }| {
            let unknown = symbolic.perm().map_or(place, |order| order.arrays().0[place] as usize);
            Breakdown { place, unknown }
        })
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
            let order: Vec<u32> = (0..*n).collect();
            let backwards: Vec<u32> = (0..*n).rev().collect();
            [Analysis::ordered(lower, &backwards), Analysis::ordered(lower, &order)]
        });
        let mut workspace = Workspace::new(analyses.iter().flatten());
        for ((n, (column_begin, rows, values)), pair) in [&small, &large].into_iter().zip(&analyses) {
            for analysis in pair {
                for (precision, size, tolerance) in [
                    (Precision::Double, 1.0, 1e-14),
                    (Precision::Double, 1e-60, 1e-14),
                    (Precision::Single, 1.0, 1e-6),
                    (Precision::Single, 1e-60, 1e-6),
                ] {
                    let mut factor = Factor::new(analysis, precision);
                    workspace.factorise(analysis, Lower { column_begin, rows }, values, &mut factor).expect("definite");
                    let n = *n as usize;
                    let mut x: Vec<f64> = (0..n).map(|k| size * (k as f64).sin()).collect();
                    workspace.solve(analysis, &factor, &mut x);
                    for k in 0..n {
                        let beside = if k > 0 { x[k - 1] } else { 0.0 } + x.get(k + 1).unwrap_or(&0.0);
                        assert!((2.5 * x[k] - beside - size * (k as f64).sin()).abs() < tolerance * size);
                    }
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
        for precision in [Precision::Single, Precision::Double] {
            let mut factor = Factor::new(&analysis, precision);
            let outcome = Workspace::new([&analysis]).factorise(&analysis, lower, &values, &mut factor);
            let breakdown = outcome.expect_err("the diagonal is negative");
            assert_eq!(breakdown.unknown, 4);
        }
    }

    #[test]
    fn pivots_and_complements_of_a_chain() {
        let (column_begin, rows, values) = chain(6, 1.0);
        let lower = Lower { column_begin: &column_begin, rows: &rows };
        // The ends meet at the third, then at the fourth unknown.
        let analysis = Analysis::ordered(lower, &[0, 1, 5, 4, 3, 2]);
        for precision in [Precision::Single, Precision::Double] {
            let mut factor = Factor::new(&analysis, precision);
            Workspace::new([&analysis]).factorise(&analysis, lower, &values, &mut factor).expect("definite");
            // The pivots of either half are 3, 3 - 1/3, ..., as of the continued fraction.
            let (second, fourth) = (3.0 - 1.0 / 3.0, 3.0 - 1.0 / (3.0 - 1.0 / 3.0));
            let third = 3.0 - 1.0 / second - 1.0 / fourth;
            assert!((analysis.least_pivot(&factor, |_| 3.0) - third / 3.0).abs() < 1e-6);
            let found = analysis.complement(&factor, 2, |unknown| [2, 3].iter().position(|&k| k == unknown));
            let expected = [[3.0 - 1.0 / second, -1.0], [-1.0, fourth]];
            for (i, line) in expected.iter().enumerate() {
                for (j, value) in line.iter().enumerate() {
                    assert!((found[(i, j)] - value).abs() < 1e-6, "{found:?}");
                }
            }
        }
    }
}
