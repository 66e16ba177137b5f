//! Sparse Cholesky factors: faer's, analysed once and factorised for many values.
//!
//! Several factors share one [`Workspace`], so that neither factorising nor solving allocates. Nothing here pivots.
//! A solve reads the factor twice and does little else: in single precision it takes half the time and the memory.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Mat, Par, Side, Spec};

pub use super::number::{Numbers, Precision, WIDTH};
use super::pattern::Pattern;
use super::supernodes;
use crate::work;

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

/// The numbers of a factor. A solve reads them twice.
pub type Factor = Numbers;

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

    /// Space for a factor.
    pub fn factor(&self, precision: Precision) -> Factor {
        Numbers::new(self.factor_length(), precision)
    }

    /// faer's own analysis.
    pub(super) fn symbolic(&self) -> &SymbolicCholesky<u32> {
        &self.0
    }

    /// The unknown at each place of the elimination.
    pub(super) fn order(&self) -> Option<&[u32]> {
        self.0.perm().map(|order| order.arrays().0)
    }

    /// Numbers in the factor.
    pub fn factor_length(&self) -> usize {
        self.0.len_val()
    }

    /// The least pivot of a factor, relative to what `diagonal` tells of its unknown.
    pub fn least_pivot(&self, factor: &Factor, diagonal: impl Fn(usize) -> f64) -> f64 {
        let pivots = self.columns().map(|column| {
            let pivot = factor.get(column.at);
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
                lower[(i, k)] = factor.get(at);
            }
        }
        work::add(2 * count * count * count, size_of::<f64>() * count * count);
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
        work::add(analysis.flops() as usize, size_of_val(values) + factor.bytes());
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
        book_solve(panels, factor, 1);
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

    /// `x = A^-1 x` for [`WIDTH`] vectors, `WIDTH` numbers an unknown, of which the first `count` matter. Each gets the bits that it
    /// would get beside others.
    pub fn solve_wide(&mut self, Analysis(symbolic): &Analysis, factor: &Factor, x: &mut [f64], count: usize) {
        let (SymbolicCholeskyRaw::Supernodal(panels), Some(order)) = (symbolic.raw(), symbolic.perm()) else { return };
        let (order, (x, _)) = (order.arrays().0, x.as_chunks_mut::<WIDTH>());
        book_solve(panels, factor, count);
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

/// Each entry is multiplied and added on the way forward and on the way back, and all that is stored is read twice.
fn book_solve(panels: &SymbolicSupernodalCholesky<u32>, factor: &Factor, vectors: usize) {
    let entries: usize = (0..panels.n_supernodes()).map(|s| supernodes::entries(panels, s)).sum();
    work::add(4 * entries * vectors, 2 * factor.bytes());
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
mod tests;
