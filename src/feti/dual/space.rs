//! Inner products of dual vectors and sums over subdomains, the same bits on any number of ranks.
//!
//! Each row counts for the lowest subdomain of its block. Products are summed per subdomain in row order, then over
//! the subdomains in their order on rank 0.

use crate::comm::{Comm, Shares, all_gather_u64, maximum, ordered_sum};
use crate::constraint::Constraints;
use crate::feti::Torn;
use crate::vector::dot;

/// Inner products over all rows of all ranks.
pub struct RowSpace<'a> {
    comm: &'a dyn Comm,
    shares: Shares,
    /// For each own subdomain, the rows that count for it.
    owned: Vec<Vec<u32>>,
}

impl<'a> RowSpace<'a> {
    /// Over the rows of `constraints`.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints) -> Self {
        let first = shares.begin(comm.rank());
        let mut owned = vec![Vec::new(); shares.0[comm.rank()]];
        for (rows, subdomains) in constraints.blocks.iter().zip(&constraints.block_subdomains) {
            let own = (subdomains[0] as usize).checked_sub(first).and_then(|k| owned.get_mut(k));
            if let Some(list) = own {
                list.extend(rows.clone().map(|row| row as u32));
            }
        }
        Self { comm, shares: shares.clone(), owned }
    }

    /// For each own subdomain, the rows that count for it: every row counts exactly once over all ranks.
    pub fn owned(&self) -> &[Vec<u32>] {
        &self.owned
    }

    /// `x'y` of each pair; one reduction.
    pub fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        self.sum(&self.partial(pairs), pairs.len())
    }

    /// The parts of `x'y` that count for each own subdomain, pair by pair.
    pub fn partial(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        let mut partial = Vec::with_capacity(self.owned.len() * pairs.len());
        // Four sums side by side: each is a chain of additions.
        let (fours, others) = pairs.as_chunks::<4>();
        for rows in &self.owned {
            for four in fours {
                let mut sums = [-0.0; 4];
                for &r in rows {
                    sums.iter_mut().zip(four).for_each(|(sum, (x, y))| *sum += x[r as usize] * y[r as usize]);
                }
                partial.extend(sums);
            }
            for (x, y) in others {
                partial.push(rows.iter().map(|&r| x[r as usize] * y[r as usize]).sum());
            }
        }
        partial
    }

    /// Sums of `width` values per own subdomain over all subdomains.
    pub fn sum(&self, partial: &[f64], width: usize) -> Vec<f64> {
        ordered_sum(self.comm, &self.shares, partial, width)
    }

    /// The `width` values of each subdomain, of all of them, on every rank. Collective.
    pub fn of_all(&self, mine: &[f64], width: usize) -> Vec<f64> {
        self.comm.all_gather(mine, &self.shares.counts(width))
    }

    /// What `of` gives for rows, `width` numbers each, of all ranks in one order, on every rank. Collective.
    pub fn gather(&self, width: usize, of: impl Fn(usize) -> Option<Vec<f64>>) -> Vec<Vec<f64>> {
        let mine: Vec<u64> = self
            .owned
            .iter()
            .flatten()
            .filter_map(|&row| of(row as usize))
            .flat_map(|numbers| numbers.into_iter().map(f64::to_bits))
            .collect();
        let numbers: Vec<f64> = all_gather_u64(self.comm, &mine).into_iter().map(f64::from_bits).collect();
        numbers.chunks_exact(width).map(<[f64]>::to_vec).collect()
    }

    /// Euclidean norm of a torn vector. Collective.
    pub fn norm(&self, x: &Torn) -> f64 {
        let squares: Vec<f64> = x.iter().map(|x| dot(x, x)).collect();
        self.sum(&squares, 1)[0].sqrt()
    }

    /// The lowest number that any rank names. Collective.
    pub fn lowest(&self, mine: Option<usize>) -> Option<usize> {
        let lowest = self.maximum(mine.map_or(f64::NEG_INFINITY, |number| -(number as f64)));
        (lowest != f64::NEG_INFINITY).then_some(-lowest as usize)
    }

    /// Largest value over the ranks; NaN if any is.
    pub fn maximum(&self, mine: f64) -> f64 {
        maximum(self.comm, &[mine])[0]
    }
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
