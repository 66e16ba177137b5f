//! Sums of numbers in any order and on any ranks: the same bits.
//!
//! Numbers are rounded to a multiple of `2^-80` of the largest one and added as integers. Of `2^40` numbers of one sign the sum is as
//! near as rounding each to a double would leave it; it is for what is told or compared, not for what is solved.

use super::{Comm, all_gather_u64, maximum};

/// Bits of the largest number.
const BITS: i32 = 80;

/// The sums of columns over all ranks' rows. Collective.
pub fn exact_sums<const N: usize>(comm: &dyn Comm, mine: &[[f64; N]]) -> [f64; N] {
    let mut largest = [0.0_f64; N];
    for row in mine {
        largest.iter_mut().zip(row).for_each(|(most, x)| *most = most.max(x.abs()));
    }
    let largest = maximum(comm, &largest);
    // A power of two: scaling is exact.
    let scale: [i32; N] = std::array::from_fn(|k| if largest[k] > 0.0 { largest[k].log2().ceil() as i32 } else { 0 });
    let mut sums = [0_i128; N];
    for row in mine {
        for ((sum, x), scale) in sums.iter_mut().zip(row).zip(scale) {
            // In two steps: neither power is beyond a double's.
            *sum += (x * 2.0_f64.powi(BITS / 2) * 2.0_f64.powi(BITS / 2 - scale)).round() as i128;
        }
    }
    let words: Vec<u64> = sums.iter().flat_map(|sum| [*sum as u64, (*sum >> 64) as u64]).collect();
    let mut all = [0_i128; N];
    for (k, &[low, high]) in all_gather_u64(comm, &words).as_chunks::<2>().0.iter().enumerate() {
        all[k % N] += i128::from(low) | (i128::from(high.cast_signed()) << 64);
    }
    std::array::from_fn(|k| all[k] as f64 * 2.0_f64.powi(scale[k] - BITS / 2) * 2.0_f64.powi(-BITS / 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::random::Random;

    #[test]
    fn neither_order_nor_ranks_change_a_bit_and_the_sum_is_right() {
        let mut random = Random::new(4);
        let rows: Vec<[f64; 2]> = (0..997).map(|_| [random.number(), 1e-30 * random.number().abs()]).collect();
        let plain: f64 = rows.iter().map(|row| row[0]).sum();
        let turned: Vec<[f64; 2]> = rows.iter().rev().copied().collect();
        let mut bits = Vec::new();
        for (ranks, rows) in [(1, &rows), (3, &rows), (5, &turned)] {
            bits.extend(threads::run(ranks, |comm| {
                let mine = rows.chunks(rows.len().div_ceil(ranks)).nth(comm.rank()).unwrap_or_default();
                let sums = exact_sums(comm, mine);
                assert!((sums[0] - plain).abs() < 1e-12);
                sums.map(f64::to_bits)
            }));
        }
        assert!(bits.iter().all(|b| *b == bits[0]));
        assert_eq!(threads::run(2, |comm| exact_sums::<1>(comm, &[])), [[0.0]; 2]);
        assert_eq!(threads::run(2, |comm| exact_sums(comm, &[[-3.0], [0.5]])), [[-5.0]; 2]);
    }
}
