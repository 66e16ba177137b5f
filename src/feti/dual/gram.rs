//! `B W B'` on some rows, and its sparse Cholesky factor. `W` is diagonal, or has blocks for nodes that are tied together.

use crate::constraint::{Constraints, Term};
use crate::sparse::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
use crate::work;

/// The matrix of some rows that share nodes. Rows that are not kept take no part.
pub struct Gram {
    rows: Vec<usize>,
    column_begin: Vec<u32>,
    /// Row and column of each entry of the lower triangle, column by column.
    row_index: Vec<u32>,
    column_index: Vec<u32>,
    /// Unknowns of all coefficients.
    sites: Vec<SlotUnknown>,
    products: Vec<Product>,
    analysis: Analysis,
    workspace: Workspace,
    factor: Factor,
    /// Whether there is a factor.
    definite: bool,
    kept: Vec<bool>,
    values: Vec<f64>,
    unknowns: Vec<f64>,
}

/// Pivots below this share of the diagonal are rounding.
const ROUNDING: f64 = 1e-12;

/// By how much the diagonal grows where there is no factor.
const SHIFTS: [f64; 3] = [1e-10, 1e-8, 1e-6];

/// Product of two coefficients of one block of `W`.
struct Product {
    /// Where it belongs in the matrix.
    entry: u32,
    /// Numbers of the coefficients.
    factors: [u32; 2],
    /// Twice where it stands for two, of two coefficients of one row.
    value: f64,
}

/// Where a coefficient's unknown is.
#[derive(Clone, Copy)]
pub struct SlotUnknown {
    /// The slot of its node.
    pub slot: u32,
    /// Component.
    pub axis: u32,
    /// Place of its node in the group of tied ones, if it is in one.
    pub tied: Option<u32>,
}

/// A coefficient of B.
pub struct Coefficient {
    /// Which of some rows.
    pub place: usize,
    /// Itself.
    pub value: f64,
    /// Its unknown.
    pub site: SlotUnknown,
    /// The block of `W` that it belongs to.
    block: Block,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Block {
    /// One unknown: subdomain, node and component.
    Unknown(u32, u64, usize),
    /// The number of a group.
    Group(u32),
}

impl Coefficient {
    /// Whether two belong to one block of `W`.
    pub fn share_block(&self, other: &Self) -> bool {
        self.block == other.block
    }
}

/// Coefficients of some rows, given by their places and numbers, sorted by blocks of `W`, then by row. `W` has blocks for tied
/// nodes, or is diagonal.
pub fn coefficients(
    constraints: &Constraints,
    rows: impl Iterator<Item = (usize, usize)>,
    tied: bool,
) -> Vec<Coefficient> {
    let mut all = Vec::new();
    for (place, row) in rows {
        let parts = constraints.rows[row].terms.chunk_by(Term::share_slot);
        for (slot, part) in constraints.slots(row).zip(parts) {
            let group = constraints.ties.place(part[0].subdomain, part[0].node).filter(|_| tied);
            all.extend(part.iter().map(|term| {
                let alone = Block::Unknown(term.subdomain, term.node, term.axis);
                let block = group.map_or(alone, |(number, _)| Block::Group(number));
                let tied = group.map(|(_, place)| place);
                Coefficient {
                    place,
                    value: term.value,
                    site: SlotUnknown { slot: slot as u32, axis: term.axis as u32, tied },
                    block,
                }
            }));
        }
    }
    all.sort_by_key(|c| (c.block, c.place));
    all
}

impl Gram {
    /// Of these rows, ascending; `tied` says that `W` has blocks.
    pub fn new(constraints: &Constraints, rows: Vec<usize>, tied: bool) -> Self {
        let coefficients = coefficients(constraints, rows.iter().copied().enumerate(), tied);
        let mut products = Vec::new();
        let mut places: Vec<[u32; 2]> = (0..rows.len() as u32).map(|k| [k, k]).collect();
        let mut first = 0;
        for same in coefficients.chunk_by(Coefficient::share_block) {
            for (k, a) in same.iter().enumerate() {
                for (j, b) in same[..=k].iter().enumerate() {
                    let times = if j < k && a.place == b.place { 2.0 } else { 1.0 };
                    let factors = [first + k as u32, first + j as u32];
                    products.push(Product { entry: 0, factors, value: times * a.value * b.value });
                    places.push([b.place as u32, a.place as u32]);
                }
            }
            first += same.len() as u32;
        }
        places.sort_unstable();
        places.dedup();
        for product in &mut products {
            let [row, column] = product.factors.map(|k| coefficients[k as usize].place as u32);
            product.entry = places.binary_search(&[column, row]).expect("every product has its place") as u32;
        }
        let column_begin: Vec<u32> =
            (0..=rows.len() as u32).map(|column| places.partition_point(|place| place[0] < column) as u32).collect();
        let [column_index, row_index] = [0, 1].map(|k| places.iter().map(|place| place[k]).collect::<Vec<u32>>());
        let analysis = Analysis::minimum_degree(Lower { column_begin: &column_begin, rows: &row_index });
        Self {
            column_begin,
            sites: coefficients.iter().map(|c| c.site).collect(),
            products,
            workspace: Workspace::new([&analysis]),
            factor: analysis.factor(Precision::Double),
            analysis,
            definite: false,
            kept: vec![false; rows.len()],
            values: vec![0.0; row_index.len()],
            unknowns: vec![0.0; rows.len()],
            row_index,
            column_index,
            rows,
        }
    }

    /// Frees what only another [`Gram::factorise`] would need: the factor is final.
    pub fn settle(&mut self) {
        (self.sites, self.products) = Default::default();
    }

    /// The rows.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// Whether any two rows share an unknown.
    pub fn is_coupled(&self) -> bool {
        self.row_index.len() > self.rows.len()
    }

    /// Factorises on the kept rows, `weight` being `W` between two unknowns of a block. Where rows depend on each other, as friction
    /// rows do where supports hold the slave's side of many of them, the diagonal is made larger by some rounding: what this adds to
    /// the inverse is nearly in the kernel of `B'`.
    pub fn factorise(&mut self, weight: impl Fn(SlotUnknown, SlotUnknown) -> f64, kept: impl Fn(usize) -> bool) {
        self.kept.iter_mut().zip(&self.rows).for_each(|(k, &row)| *k = kept(row));
        self.values.fill(0.0);
        work::each(self.products.len(), 2, size_of::<Product>());
        for Product { entry, factors, value } in &self.products {
            let [a, b] = factors.map(|k| self.sites[k as usize]);
            self.values[*entry as usize] += value * weight(a, b);
        }
        for ((value, &row), &column) in self.values.iter_mut().zip(&self.row_index).zip(&self.column_index) {
            if !(self.kept[row as usize] && self.kept[column as usize]) {
                *value = 0.0;
            }
        }
        // The identity fills the place of the others: one analysis serves all sets.
        for (column, _) in self.kept.iter().enumerate().filter(|(_, kept)| !**kept) {
            self.values[self.column_begin[column] as usize] = 1.0;
        }
        self.definite = self.factorises();
        for shift in SHIFTS {
            if self.definite {
                break;
            }
            let diagonal = &self.column_begin[..self.rows.len()];
            diagonal.iter().for_each(|&entry| self.values[entry as usize] *= 1.0 + shift);
            self.definite = self.factorises();
        }
    }

    /// Factorises the values. False if they are not definite, to rounding.
    fn factorises(&mut self) -> bool {
        let lower = Lower { column_begin: &self.column_begin, rows: &self.row_index };
        let diagonal = |unknown: usize| self.values[self.column_begin[unknown] as usize];
        let found = self.workspace.factorise(&self.analysis, lower, &self.values, &mut self.factor);
        found.is_ok() && self.analysis.least_pivot(&self.factor, diagonal) > ROUNDING
    }

    /// `y = (B W B')^-1 x` on its rows; zero on those that are not kept. Not a number if there is no inverse.
    pub fn solve(&mut self, x: &[f64], y: &mut [f64]) {
        for ((unknown, &row), &kept) in self.unknowns.iter_mut().zip(&self.rows).zip(&self.kept) {
            *unknown = if kept { x[row] } else { 0.0 };
        }
        if self.definite {
            self.workspace.solve(&self.analysis, &self.factor, &mut self.unknowns);
        } else {
            self.unknowns.fill(f64::NAN);
        }
        for ((&unknown, &row), &kept) in self.unknowns.iter().zip(&self.rows).zip(&self.kept) {
            y[row] = if kept { unknown } else { 0.0 };
        }
    }

    /// `y -= B B' x` on its rows, kept or not, where `W` has no blocks; `y` is by place.
    pub fn subtract_product(&self, x: &[f64], y: &mut [f64]) {
        work::each(self.products.len(), 4, size_of::<Product>());
        for Product { entry, value, .. } in &self.products {
            let [a, b] = [&self.row_index, &self.column_index].map(|index| index[*entry as usize] as usize);
            y[a] -= value * x[self.rows[b]];
            if a != b {
                y[b] -= value * x[self.rows[a]];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::prelude::Solve;

    use super::*;
    use crate::fixture::{assert_close, column, not_matching, on_ranks};

    /// Weights that depend on the unknown alone.
    fn weight(term: &Term) -> f64 {
        1.0 + ((7 * u64::from(term.subdomain) + 3 * term.node + term.axis as u64) % 5) as f64
    }

    #[test]
    fn solves_and_multiplies_as_dense_matrices_do_on_all_rows_and_on_some() {
        on_ranks(&not_matching(&[]), 1, |setup| {
            let constraints = &setup.discrete.constraints;
            let largest = constraints.blocks.iter().max_by_key(|rows| rows.len()).expect("there are rows").clone();
            let n = largest.len();
            let mut gram = Gram::new(constraints, largest.clone().collect(), false);
            assert!(gram.is_coupled() && n > 100, "{n}");
            // Dense, by the rows' own terms.
            let product = |weighted: bool| {
                Mat::from_fn(n, n, |i, j| {
                    let [one, other] = [i, j].map(|k| &constraints.rows[largest.start + k].terms);
                    let same = |a: &Term, b: &Term| (a.subdomain, a.node, a.axis) == (b.subdomain, b.node, b.axis);
                    let factor = |a: &Term| if weighted { weight(a) } else { 1.0 };
                    let pairs = one.iter().flat_map(|a| other.iter().filter(move |b| same(a, b)).map(move |b| (a, b)));
                    pairs.map(|(a, b)| a.value * b.value * factor(a)).sum::<f64>()
                })
            };
            let mut weights = vec![[0.0; 3]; constraints.slot_subdomain.len()];
            for row in largest.clone() {
                let parts = constraints.rows[row].terms.chunk_by(Term::share_slot);
                for (slot, part) in constraints.slots(row).zip(parts) {
                    part.iter().for_each(|term| weights[slot][term.axis] = weight(term));
                }
            }
            let x = setup.multipliers(1);
            for some in [false, true] {
                let kept = |row: usize| !some || !row.is_multiple_of(3);
                gram.factorise(|site, _| weights[site.slot as usize][site.axis as usize], kept);
                let mut y = vec![f64::NAN; x.len()];
                gram.solve(&x, &mut y);
                let list: Vec<usize> = (0..n).filter(|k| kept(largest.start + k)).collect();
                let dense = product(true);
                let dense = Mat::from_fn(list.len(), list.len(), |i, j| dense[(list[i], list[j])]);
                let rhs: Vec<f64> = list.iter().map(|k| x[largest.start + k]).collect();
                let found: Vec<f64> = list.iter().map(|k| y[largest.start + k]).collect();
                assert_close(&column(&found), &dense.partial_piv_lu().solve(column(&rhs)), 1e-11);
                assert!(largest.clone().all(|row| kept(row) || y[row] == 0.0));
            }
            let mut y = vec![0.0; n];
            gram.subtract_product(&x, &mut y);
            assert_close(&column(&y), &(-product(false) * column(&x[largest.clone()])), 1e-12);
        });
    }
}
