//! Sparse Cholesky factors of `G G'`, whole on every rank; ranks share in the solves.
//!
//! Each set of rows has a factor of its own. Every block of some rows is a block of all rows too. So all sets are factorised in the
//! pattern of all rows, which is ordered and analysed once.

use std::cell::RefCell;
use std::rc::Rc;

use crate::comm::Comm;
use crate::feti::dual::blocks::Blocks;
use crate::feti::inverse::kernel::MODES;
use crate::sparse::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
use crate::sparse::fronts::Fronts;
use crate::sparse::ordering::nested_dissection;

/// The clusters that each one has a block with, as METIS wants it: begins and neighbours.
fn adjacency(blocks: &Blocks, clusters: usize) -> (Vec<i32>, Vec<i32>) {
    let mut pairs: Vec<(usize, usize)> =
        blocks.keys().filter(|(a, b)| a != b).flat_map(|&(a, b)| [(a, b), (b, a)]).collect();
    pairs.sort_unstable();
    let begins = (0..=clusters).map(|c| pairs.partition_point(|pair| pair.0 < c) as i32).collect();
    (begins, pairs.into_iter().map(|pair| pair.1 as i32).collect())
}

/// Where `G G'` has blocks, and the elimination that goes with it.
pub struct CoarseAnalysis {
    /// The blocks by column, then row.
    places: Vec<(usize, usize)>,
    /// Lower triangle by columns.
    begins: Vec<u32>,
    rows: Vec<u32>,
    cholesky: Analysis,
}

impl CoarseAnalysis {
    /// For these blocks; their values do not count.
    pub fn new(blocks: &Blocks, clusters: usize) -> Self {
        // A cluster that no row touches has a block of zeros.
        let mut places: Vec<(usize, usize)> = (0..clusters).map(|c| (c, c)).collect();
        places.extend(blocks.keys().map(|&(row, column)| (column, row)));
        places.sort_unstable();
        places.dedup();
        let (mut begins, mut rows) = (vec![0], Vec::new());
        for of_column in places.chunk_by(|a, b| a.0 == b.0) {
            for j in 0..MODES {
                let of_block = |&(column, row): &(usize, usize)| {
                    (0..MODES).filter(move |&i| row != column || i >= j).map(move |i| (MODES * row + i) as u32)
                };
                rows.extend(of_column.iter().flat_map(of_block));
                begins.push(rows.len() as u32);
            }
        }
        let order = nested_dissection(&adjacency(blocks, clusters), MODES as u32);
        let cholesky = Analysis::ordered(Lower { column_begin: &begins, rows: &rows }, &order);
        Self { places, begins, rows, cholesky }
    }

    /// Whether it has a place for each of these blocks.
    pub fn holds(&self, blocks: &Blocks) -> bool {
        blocks.keys().all(|&(row, column)| self.places.binary_search(&(column, row)).is_ok())
    }

    /// The values of these blocks in the order of [`CoarseAnalysis::rows`]; zero where there is none.
    fn values(&self, blocks: &Blocks) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.rows.len());
        for of_column in self.places.chunk_by(|a, b| a.0 == b.0) {
            let found: Vec<_> =
                of_column.iter().map(|&(column, row)| (row, column, blocks.get(&(row, column)))).collect();
            for j in 0..MODES {
                for (row, column, block) in &found {
                    let first = if row == column { j } else { 0 };
                    values.extend((first..MODES).map(|i| block.map_or(0.0, |block| block[MODES * i + j])));
                }
            }
        }
        values
    }
}

/// The factor for a set of rows.
pub struct CoarseFactor {
    symbolic: Rc<CoarseAnalysis>,
    factor: Factor,
    fronts: RefCell<Fronts>,
    /// Of the entries of the matrix.
    largest: f64,
}

impl CoarseFactor {
    /// Of these blocks, for which `symbolic` has to have places.
    ///
    /// # Errors
    /// If they are not positive definite, the cluster where that shows.
    pub fn new(comm: &dyn Comm, symbolic: &Rc<CoarseAnalysis>, blocks: &Blocks) -> Result<Self, usize> {
        let CoarseAnalysis { begins, rows, cholesky, .. } = &**symbolic;
        let (lower, values) = (Lower { column_begin: begins, rows }, symbolic.values(blocks));
        let mut workspace = Workspace::new([cholesky]);
        let mut factor = cholesky.factor(Precision::Double);
        workspace.factorise(cholesky, lower, &values, &mut factor).map_err(|breakdown| breakdown.unknown / MODES)?;
        let largest = values.iter().copied().fold(0.0, f64::max);
        let fronts = RefCell::new(Fronts::new(cholesky, comm.size()));
        Ok(Self { symbolic: Rc::clone(symbolic), factor, fronts, largest })
    }

    /// Round-off can hide a free motion: the factor then answers far beyond the size of the matrix. Inverse iteration from a
    /// fixed vector without a pattern. Collective.
    ///
    /// # Errors
    /// The cluster that answers most.
    pub fn check_rank(&self, comm: &dyn Comm) -> Result<(), usize> {
        let (n, largest) = (self.symbolic.begins.len() - 1, self.largest);
        let sound = |response: f64| response.abs() * largest < (n as f64).sqrt() / SINGULAR;
        // Multiples of an irrational number: no motion of a few clusters is orthogonal to them.
        let mut x: Vec<f64> = (1..=n).map(|k| (k as f64 * std::f64::consts::SQRT_2).fract() - 0.5).collect();
        self.solve(comm, &mut x);
        let worst = x.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        match worst {
            Some((at, response)) if !sound(*response) => Err(at / MODES),
            _ => Ok(()),
        }
    }

    /// Numbers in the factor.
    pub fn length(&self) -> usize {
        self.symbolic.cholesky.factor_length()
    }

    /// `a = (G G')^-1 a`, six numbers a cluster, for equal `a` on all ranks. Collective.
    pub fn solve(&self, comm: &dyn Comm, a: &mut [f64]) {
        let all_gather = |mine: &[f64], counts: &[usize]| comm.all_gather(mine, counts);
        let of = (&self.symbolic.cholesky, &self.factor);
        self.fronts.borrow_mut().solve(of, comm.rank(), all_gather, a);
    }
}

/// A coarse problem conditioned worse than the inverse of this leaves a motion free.
const SINGULAR: f64 = 1e-12;
