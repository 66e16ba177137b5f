//! Blocks of a subdomain's stiffness matrix: where their entries stand among the values of the whole.

use super::cholesky::{Analysis, Factor, Lower, Precision};
use super::pattern::Pattern;

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

    /// Overwrites `values` by those of the block, given those of the whole matrix.
    pub fn take(&self, stiffness: &[f64], values: &mut Vec<f64>) {
        values.clear();
        values.extend(self.positions.iter().map(|&at| stiffness[at as usize]));
    }

    /// Other index and value of each entry of a line.
    pub fn line<'a>(&'a self, line: usize, values: &'a [f64]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let range = self.begin[line] as usize..self.begin[line + 1] as usize;
        self.others[range.clone()].iter().map(|&other| other as usize).zip(values[range].iter().copied())
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
        Factor::new(&self.cholesky, precision)
    }

    /// The least pivot of its factor, relative to the diagonal entry that it began as, given the block's values: how much
    /// easier the matrix gives way somewhere than its unknowns do one by one.
    pub fn least_pivot(&self, factor: &Factor, values: &[f64]) -> f64 {
        self.cholesky.least_pivot(factor, |k| values[self.block.begin[k] as usize])
    }
}
