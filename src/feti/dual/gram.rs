//! `B W B'` on some rows, and its sparse Cholesky factor. `W` is diagonal, or has blocks for nodes that are tied together.

use crate::constraint::{Constraints, Term};
use crate::sparse::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
use crate::work;

/// The lower triangle of `B W B'` on some rows, column by column.
pub struct Products {
    rows: Vec<usize>,
    column_begin: Vec<u32>,
    /// Place of the row of each entry; the diagonal comes first in its column.
    row_index: Vec<u32>,
    values: Vec<f64>,
}

/// The inverse of such a matrix on rows that are kept. Others take no part.
pub struct Gram {
    products: Products,
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

impl Products {
    /// Of these rows, ascending; `tied` says that `W` has blocks, and `weight` is `W` between two unknowns of a block.
    pub fn new(
        constraints: &Constraints,
        rows: Vec<usize>,
        tied: bool,
        weight: impl Fn(SlotUnknown, SlotUnknown) -> f64,
    ) -> Self {
        let coefficients = coefficients(constraints, rows.iter().copied().enumerate(), tied);
        let mut products: Vec<([u32; 2], f64)> = (0..rows.len() as u32).map(|k| ([k, k], 0.0)).collect();
        for same in coefficients.chunk_by(Coefficient::share_block) {
            for (k, a) in same.iter().enumerate() {
                for (j, b) in same[..=k].iter().enumerate() {
                    // One stands for two, of two coefficients of one row.
                    let times = if j < k && a.place == b.place { 2.0 } else { 1.0 };
                    let value = times * a.value * b.value * weight(a.site, b.site);
                    products.push(([b.place as u32, a.place as u32], value));
                }
            }
        }
        work::each(products.len(), 4, size_of::<([u32; 2], f64)>());
        // Stable: sums are in the order of the unknowns, whatever other rows there are.
        products.sort_by_key(|product| product.0);
        let mut entries: Vec<([u32; 2], f64)> = Vec::new();
        for same in products.chunk_by(|a, b| a.0 == b.0) {
            entries.push((same[0].0, same.iter().fold(0.0, |sum, product| sum + product.1)));
        }
        let begin = |column: u32| entries.partition_point(|entry| entry.0[0] < column) as u32;
        let column_begin = (0..=rows.len() as u32).map(begin).collect();
        let (row_index, values) = entries.into_iter().map(|([_, row], value)| (row, value)).unzip();
        Self { rows, column_begin, row_index, values }
    }

    /// Of some of the rows, by their places, ascending.
    pub fn principal(&self, places: &[u32]) -> Self {
        let rows = places.iter().map(|&place| self.rows[place as usize]).collect();
        let (mut column_begin, mut row_index, mut values) = (vec![0], Vec::new(), Vec::new());
        for &column in places {
            for entry in self.column(column as usize) {
                if let Ok(place) = places.binary_search(&self.row_index[entry]) {
                    row_index.push(place as u32);
                    values.push(self.values[entry]);
                }
            }
            column_begin.push(row_index.len() as u32);
        }
        Self { rows, column_begin, row_index, values }
    }

    /// Whether any two rows share an unknown.
    pub fn is_coupled(&self) -> bool {
        self.row_index.len() > self.rows.len()
    }

    fn column(&self, column: usize) -> std::ops::Range<usize> {
        self.column_begin[column] as usize..self.column_begin[column + 1] as usize
    }

    /// Each entry with the places of its column and its row.
    fn entries(&self) -> impl Iterator<Item = (usize, [usize; 2])> {
        let of = move |column| self.column(column).map(move |entry| (entry, [column, self.row_index[entry] as usize]));
        (0..self.rows.len()).flat_map(of)
    }
}

impl Gram {
    /// Analyses a matrix; there is no factor before [`Gram::factorise`].
    pub fn new(products: Products) -> Self {
        let Products { rows, column_begin, row_index, values } = &products;
        let analysis = Analysis::minimum_degree(Lower { column_begin, rows: row_index });
        Self {
            workspace: Workspace::new([&analysis]),
            factor: analysis.factor(Precision::Double),
            analysis,
            definite: false,
            kept: vec![false; rows.len()],
            values: vec![0.0; values.len()],
            unknowns: vec![0.0; rows.len()],
            products,
        }
    }

    /// Of another matrix on the same rows, whose entries are in the same places.
    pub fn renew(self, products: Products) -> Self {
        debug_assert!(self.products.rows == products.rows && self.products.row_index == products.row_index);
        Self { products, ..self }
    }

    /// The rows.
    pub fn rows(&self) -> &[usize] {
        &self.products.rows
    }

    /// Factorises on the kept rows. Where rows depend on each other, as friction rows do where supports hold the slave's side of many of
    /// them, the diagonal is made larger by some rounding: what this adds to the inverse is nearly in the kernel of `B'`.
    pub fn factorise(&mut self, kept: impl Fn(usize) -> bool) {
        let products = &self.products;
        self.kept.iter_mut().zip(&products.rows).for_each(|(k, &row)| *k = kept(row));
        for (entry, [column, row]) in products.entries() {
            // The identity fills the place of the others: one analysis serves all sets.
            let other = if row == column { 1.0 } else { 0.0 };
            self.values[entry] = if self.kept[row] && self.kept[column] { products.values[entry] } else { other };
        }
        self.definite = self.factorises();
        for shift in SHIFTS {
            if self.definite {
                break;
            }
            let diagonal = &self.products.column_begin[..self.products.rows.len()];
            diagonal.iter().for_each(|&entry| self.values[entry as usize] *= 1.0 + shift);
            self.definite = self.factorises();
        }
    }

    /// Factorises the values. False if they are not definite, to rounding.
    fn factorises(&mut self) -> bool {
        let Products { column_begin, row_index, .. } = &self.products;
        let lower = Lower { column_begin, rows: row_index };
        let diagonal = |unknown: usize| self.values[column_begin[unknown] as usize];
        let found = self.workspace.factorise(&self.analysis, lower, &self.values, &mut self.factor);
        found.is_ok() && self.analysis.least_pivot(&self.factor, diagonal) > ROUNDING
    }

    /// `y = (B W B')^-1 x` on its rows; zero on those that are not kept. Not a number if there is no inverse.
    pub fn solve(&mut self, x: &[f64], y: &mut [f64]) {
        let rows = &self.products.rows;
        for ((unknown, &row), &kept) in self.unknowns.iter_mut().zip(rows).zip(&self.kept) {
            *unknown = if kept { x[row] } else { 0.0 };
        }
        if self.definite {
            self.workspace.solve(&self.analysis, &self.factor, &mut self.unknowns);
        } else {
            self.unknowns.fill(f64::NAN);
        }
        for ((&unknown, &row), &kept) in self.unknowns.iter().zip(rows).zip(&self.kept) {
            y[row] = if kept { unknown } else { 0.0 };
        }
    }

    /// `y -= B W B' x` on its rows, kept or not; `y` is by place.
    pub fn subtract_product(&self, x: &[f64], y: &mut [f64]) {
        let Products { rows, values, .. } = &self.products;
        work::each(values.len(), 4, size_of::<f64>());
        for (entry, [a, b]) in self.products.entries() {
            y[a] -= values[entry] * x[rows[b]];
            if a != b {
                y[b] -= values[entry] * x[rows[a]];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::prelude::Solve;

    use super::*;
    use crate::fixture::{assert_close, column, long_contact, on_ranks};

    /// Weights that depend on the unknown alone.
    fn weight(term: &Term) -> f64 {
        1.0 + ((7 * u64::from(term.subdomain) + 3 * term.node + term.axis as u64) % 5) as f64
    }

    #[test]
    fn solves_and_multiplies_as_dense_matrices_do_on_all_rows_and_on_some() {
        on_ranks(&long_contact(), 1, |setup| {
            let constraints = &setup.discrete.constraints;
            let parts = constraints.blocks.iter().zip(&constraints.is_part).filter(|(_, part)| **part);
            let large: Vec<usize> = parts.flat_map(|(rows, _)| rows.clone()).collect();
            let n = large.len();
            let products = |weight: &dyn Fn(SlotUnknown) -> f64| {
                Products::new(constraints, large.clone(), false, |site, _| weight(site))
            };
            let plain = products(&|_| 1.0);
            assert!(plain.is_coupled() && n > 100, "{n}");
            // Dense, by the rows' own terms.
            let product = |weighted: bool| {
                Mat::from_fn(n, n, |i, j| {
                    let [one, other] = [i, j].map(|k| &constraints.rows[large[k]].terms);
                    let same = |a: &Term, b: &Term| (a.subdomain, a.node, a.axis) == (b.subdomain, b.node, b.axis);
                    let factor = |a: &Term| if weighted { weight(a) } else { 1.0 };
                    let pairs = one.iter().flat_map(|a| other.iter().filter(move |b| same(a, b)).map(move |b| (a, b)));
                    pairs.map(|(a, b)| a.value * b.value * factor(a)).sum::<f64>()
                })
            };
            let mut weights = vec![[0.0; 3]; constraints.slot_subdomain.len()];
            for &row in &large {
                let parts = constraints.rows[row].terms.chunk_by(Term::share_slot);
                for (slot, part) in constraints.slots(row).zip(parts) {
                    part.iter().for_each(|term| weights[slot][term.axis] = weight(term));
                }
            }
            let x = setup.multipliers(1);
            let weighted = products(&|site| weights[site.slot as usize][site.axis as usize]);
            // Every other row alone.
            let places: Vec<u32> = (0..n as u32).step_by(2).collect();
            let half = weighted.principal(&places);
            assert_eq!(half.rows, places.iter().map(|&k| large[k as usize]).collect::<Vec<_>>());
            let dense = product(true);
            for (entry, [column, row]) in half.entries() {
                let expected = dense[(places[row] as usize, places[column] as usize)];
                assert!((half.values[entry] - expected).abs() < 1e-14 * dense[(0, 0)], "{row}, {column}");
            }
            let mut gram = Gram::new(weighted);
            for some in [false, true] {
                let kept = |row: usize| !some || !row.is_multiple_of(3);
                gram.factorise(kept);
                let mut y = vec![f64::NAN; x.len()];
                gram.solve(&x, &mut y);
                let list: Vec<usize> = (0..n).filter(|&k| kept(large[k])).collect();
                let dense = product(true);
                let dense = Mat::from_fn(list.len(), list.len(), |i, j| dense[(list[i], list[j])]);
                let rhs: Vec<f64> = list.iter().map(|&k| x[large[k]]).collect();
                let found: Vec<f64> = list.iter().map(|&k| y[large[k]]).collect();
                assert_close(&column(&found), &dense.partial_piv_lu().solve(column(&rhs)), 1e-11);
                assert!(large.iter().all(|&row| kept(row) || y[row] == 0.0));
            }
            let mut y = vec![0.0; n];
            Gram::new(plain).subtract_product(&x, &mut y);
            let of_rows: Vec<f64> = large.iter().map(|&row| x[row]).collect();
            assert_close(&column(&y), &(-product(false) * column(&of_rows)), 1e-12);
        });
    }
}
