//! Inner products of dual vectors and sums over subdomains, the same bits on any number of ranks.
//!
//! Each row counts for the lowest subdomain of its block; these rows are one behind the other. Products are summed per
//! subdomain, every [`LANES`]th row in one sum, then over all subdomains, exactly ([`exact`]).

use std::ops::Range;

use crate::comm::{Comm, Reduction, Shares, all_gather_u64, exact, maximum, sums};
use crate::constraint::Constraints;
use crate::feti::Torn;
use crate::simd::vectorised;
use crate::vector::dot;
use crate::work;

/// Sums of an inner product side by side.
const LANES: usize = 8;
/// Inner products that are found together.
const TOGETHER: usize = 4;

/// Inner products over all rows of all ranks.
pub struct RowSpace<'a> {
    comm: &'a dyn Comm,
    /// For each own subdomain, the rows that count for it.
    owned: Vec<Range<usize>>,
}

impl<'a> RowSpace<'a> {
    /// Over the rows of `constraints`.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints) -> Self {
        let first = shares.begin(comm.rank());
        let mut owned = vec![0..0; shares.0[comm.rank()]];
        for (rows, subdomains) in constraints.blocks.iter().zip(&constraints.block_subdomains) {
            let own = (subdomains[0] as usize).checked_sub(first).and_then(|k| owned.get_mut(k));
            if let Some(owned) = own {
                let goes_on = owned.end == rows.start;
                debug_assert!(goes_on || *owned == (0..0), "blocks are in the order of subdomains");
                *owned = if goes_on { owned.start } else { rows.start }..rows.end;
            }
        }
        Self { comm, owned }
    }

    /// For each own subdomain, the rows that count for it: every row counts exactly once over all ranks.
    pub fn owned(&self) -> &[Range<usize>] {
        &self.owned
    }

    /// `x'y` of each pair; one reduction.
    pub fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        self.sum(&self.partial(pairs), pairs.len())
    }

    /// The parts of `x'y` that count for each own subdomain, pair by pair.
    pub fn partial(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        let mut partial = Vec::with_capacity(self.owned.len() * pairs.len());
        let (groups, others) = pairs.as_chunks::<TOGETHER>();
        for rows in &self.owned {
            work::each(rows.len() * pairs.len(), 2, 2 * size_of::<f64>());
            groups.iter().for_each(|group| partial.extend(products(rows, group)));
            others.iter().for_each(|pair| partial.extend(products(rows, &[*pair])));
        }
        partial
    }

    /// Sums of `width` values per own subdomain over all subdomains.
    pub fn sum(&self, partial: &[f64], width: usize) -> Vec<f64> {
        exact::sum(self.comm, partial, width)
    }

    /// What `of` gives for rows, `width` numbers each, of all ranks in one order, on every rank. Collective.
    pub fn gather(&self, width: usize, of: impl Fn(usize) -> Option<Vec<f64>>) -> Vec<Vec<f64>> {
        let mine: Vec<u64> = self
            .owned
            .iter()
            .flat_map(Range::clone)
            .filter_map(of)
            .flat_map(|numbers| numbers.into_iter().map(f64::to_bits))
            .collect();
        let numbers: Vec<f64> = all_gather_u64(self.comm, &mine).into_iter().map(f64::from_bits).collect();
        numbers.chunks_exact(width).map(<[f64]>::to_vec).collect()
    }

    /// Euclidean norm of a torn vector. Collective.
    pub fn norm(&self, x: &Torn) -> f64 {
        x.iter().for_each(|x| work::each(x.len(), 2, size_of::<f64>()));
        let squares: Vec<f64> = x.iter().map(|x| dot(x, x)).collect();
        self.sum(&squares, 1)[0].sqrt()
    }

    /// The lowest number that any rank names. Collective.
    pub fn lowest(&self, mine: Option<usize>) -> Option<usize> {
        let mut lowest = [mine.map_or(i64::MIN, |number| -(number as i64))];
        self.comm.reduce(Reduction::Largest, &mut lowest);
        (lowest[0] != i64::MIN).then_some(-lowest[0] as usize)
    }

    /// Sums of counts over the ranks. Collective.
    pub fn counts<const N: usize>(&self, mine: [u64; N]) -> [u64; N] {
        sums(self.comm, mine)
    }

    /// Largest value over the ranks; NaN if any is.
    pub fn maximum(&self, mine: f64) -> f64 {
        maximum(self.comm, &[mine])[0]
    }
}

/// `x'y` of each pair over some rows.
fn products<const N: usize>(rows: &Range<usize>, pairs: &[(&[f64], &[f64]); N]) -> [f64; N] {
    let of_rows = pairs.map(|(x, y)| (&x[rows.clone()], &y[rows.clone()]));
    let mut sums = [[0.0; LANES]; N];
    vectorised(
        (&mut sums, &of_rows),
        #[inline(always)]
        |(sums, pairs)| {
            for (sums, (x, y)) in sums.iter_mut().zip(pairs) {
                let ((x, of_x), (y, of_y)) = (x.as_chunks::<LANES>(), y.as_chunks::<LANES>());
                for (x, y) in x.iter().zip(y) {
                    (0..LANES).for_each(|l| sums[l] += x[l] * y[l]);
                }
                sums.iter_mut().zip(of_x.iter().zip(of_y)).for_each(|(sum, (x, y))| *sum += x * y);
            }
        },
    );
    sums.map(|sums| sums.iter().sum())
}

#[cfg(test)]
mod tests {
    use crate::fixture::{RANKS, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis};

    #[test]
    fn products_count_every_row_once_and_are_the_same_bits_on_every_rank() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(9)] {
            let [x, y] = [1, 2].map(|seed| same_on_any_ranks(&scene, |setup| setup.owned(&setup.multipliers(seed))));
            let plain: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
            let square: f64 = x.iter().map(|x| x * x).sum();
            let mut bits = Vec::new();
            for ranks in RANKS {
                bits.extend(on_ranks(&scene, ranks, |setup| {
                    let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                    let products = setup.space.dots(&[(&x, &y), (&x, &x)]);
                    assert!(
                        (products[0] - plain).abs() < 1e-14 * square && (products[1] - square).abs() < 1e-14 * square
                    );
                    products.iter().map(|p| p.to_bits()).collect::<Vec<_>>()
                }));
            }
            assert!(bits.iter().all(|b| *b == bits[0]));
        }
    }

    #[test]
    fn the_largest_value_over_the_ranks_is_known_to_all_and_nan_wins() {
        for ranks in RANKS {
            on_ranks(&two_bricks(&[]), ranks, |setup| {
                assert_eq!(setup.space.maximum(-1.0 - setup.comm.rank() as f64), -1.0);
                let fault = if setup.comm.rank() + 1 == ranks { f64::NAN } else { 1.0 };
                assert!(setup.space.maximum(fault).is_nan());
            });
        }
    }
}
