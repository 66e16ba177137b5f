//! Blocks of a subdomain's stiffness matrix: where their entries stand among the values of the whole.

use super::cholesky::{Analysis, Factor, Lower, Precision};
use super::number::Numbers;
use super::pattern::Pattern;
use crate::simd::vectorised;

/// Calls a kernel on the block's values, whatever their precision.
macro_rules! dispatch {
    ($kernel:ident($block:expr, $values:expr, $x:expr, $y:expr)) => {
        match $values {
            Numbers::Single(values) => vectorised(
                ($block, values, $x, $y),
                #[inline(always)]
                |(a, values, x, y)| $kernel(a, values, x, y),
            ),
            Numbers::Double(values) => vectorised(
                ($block, values, $x, $y),
                #[inline(always)]
                |(a, values, x, y)| $kernel(a, values, x, y),
            ),
        }
    };
}

/// Entries of one block, line by line.
#[derive(Default)]
pub struct Entries {
    /// First entry of each line, and the end.
    pub begin: Vec<u32>,
    /// The other index of each entry, in the numbering of its kind.
    pub others: Vec<u32>,
    /// Where each entry stands among the values of the whole matrix.
    positions: Vec<u32>,
}

impl Entries {
    /// From lists of (other index, position).
    pub fn new(lines: impl IntoIterator<Item = Vec<(u32, u32)>>) -> Self {
        let mut entries = Self { begin: vec![0], ..Self::default() };
        for line in lines {
            for (other, position) in line {
                entries.others.push(other);
                entries.positions.push(position);
            }
            entries.begin.push(entries.others.len() as u32);
        }
        entries
    }

    /// The values of the block, given those of the whole matrix.
    pub fn values(&self, stiffness: &[f64]) -> impl Iterator<Item = f64> {
        self.positions.iter().map(|&at| stiffness[at as usize])
    }

    /// `y += A x`, `W` vectors side by side, the block having these values.
    pub fn add_product<const W: usize>(&self, values: &Numbers, x: &[[f64; W]], y: &mut [[f64; W]]) {
        dispatch!(add_product(self, values, x, y));
    }

    /// `y -= A' x`.
    pub fn subtract_transpose<const W: usize>(&self, values: &Numbers, x: &[[f64; W]], y: &mut [[f64; W]]) {
        dispatch!(subtract_transpose(self, values, x, y));
    }

    /// `y += A x` from the lower triangle of a symmetric block by columns, diagonal first.
    pub fn add_symmetric<const W: usize>(&self, values: &Numbers, x: &[[f64; W]], y: &mut [[f64; W]]) {
        dispatch!(add_symmetric(self, values, x, y));
    }

    /// Other index and value of each entry of a line.
    #[inline(always)]
    fn line<'a, T: Copy + Into<f64>>(
        &'a self,
        line: usize,
        values: &'a [T],
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let range = self.begin[line] as usize..self.begin[line + 1] as usize;
        self.others[range.clone()].iter().map(|&other| other as usize).zip(values[range].iter().map(|&x| x.into()))
    }
}

#[inline(always)]
fn add_product<const W: usize>(a: &Entries, values: &[impl Copy + Into<f64>], x: &[[f64; W]], y: &mut [[f64; W]]) {
    for (line, y) in y.iter_mut().enumerate() {
        for (other, value) in a.line(line, values) {
            let x = &x[other];
            (0..W).for_each(|l| y[l] += value * x[l]);
        }
    }
}

#[inline(always)]
fn subtract_transpose<const W: usize>(
    a: &Entries,
    values: &[impl Copy + Into<f64>],
    x: &[[f64; W]],
    y: &mut [[f64; W]],
) {
    for (line, x) in x.iter().enumerate() {
        for (other, value) in a.line(line, values) {
            let y = &mut y[other];
            (0..W).for_each(|l| y[l] -= value * x[l]);
        }
    }
}

#[inline(always)]
fn add_symmetric<const W: usize>(a: &Entries, values: &[impl Copy + Into<f64>], x: &[[f64; W]], y: &mut [[f64; W]]) {
    for column in 0..x.len() {
        let (of_column, mut sum) = (x[column], [0.0; W]);
        for (k, (row, value)) in a.line(column, values).enumerate() {
            let of_row = x[row];
            (0..W).for_each(|l| sum[l] += value * of_row[l]);
            if k > 0 {
                let y = &mut y[row];
                (0..W).for_each(|l| y[l] += value * of_column[l]);
            }
        }
        (0..W).for_each(|l| y[column][l] += sum[l]);
    }
}

/// A diagonal block, analysed: lower triangle by columns, diagonal first.
pub struct Submatrix {
    /// Local unknowns, ascending.
    pub unknowns: Vec<u32>,
    /// Its entries.
    pub block: Entries,
    /// Order and sparsity of its factor.
    pub cholesky: Analysis,
}

impl Submatrix {
    /// On some unknowns of a matrix, eliminated in this order.
    pub fn new(pattern: &Pattern, order: &[u32]) -> Self {
        let mut unknowns = order.to_vec();
        unknowns.sort_unstable();
        let mut place = vec![u32::MAX; pattern.dofs()];
        unknowns.iter().enumerate().for_each(|(k, &dof)| place[dof as usize] = k as u32);
        let column = |&dof: &u32| {
            let range = pattern.column_begin[dof as usize]..pattern.column_begin[dof as usize + 1];
            let entries = range.map(|at| (place[pattern.rows[at as usize] as usize], at));
            entries.filter(|(row, _)| *row != u32::MAX).collect()
        };
        let block = Entries::new(unknowns.iter().map(column));
        let order: Vec<u32> = order.iter().map(|&dof| place[dof as usize]).collect();
        let cholesky = Analysis::ordered(Lower { column_begin: &block.begin, rows: &block.others }, &order);
        Self { unknowns, block, cholesky }
    }

    /// Its lower triangle.
    pub fn lower(&self) -> Lower<'_> {
        Lower { column_begin: &self.block.begin, rows: &self.block.others }
    }

    /// Space for its factor.
    pub fn factor(&self, precision: Precision) -> Factor {
        self.cholesky.factor(precision)
    }

    /// The least pivot of its factor, relative to the diagonal entry that it began as, given the block's values: how much
    /// easier the matrix gives way somewhere than its unknowns do one by one.
    pub fn least_pivot(&self, factor: &Factor, values: &[f64]) -> f64 {
        self.cholesky.least_pivot(factor, |k| values[self.block.begin[k] as usize])
    }
}
