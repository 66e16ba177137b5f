//! Sums of numbers in any order and on any ranks: the same bits.
//!
//! A double is an integer times a power of two. So a sum is kept as one long integer, from the least double to beyond the largest, in
//! limbs of 44 bits with room for carries; limbs of all ranks are added up as integers, and the sum is rounded once, to the nearest
//! double. A sum of what is not finite is not a number.
//!
//! Kulisch, "Computer arithmetic and validity" (2008), the long accumulator. One number costs a message of 400 bytes whatever the
//! scene, so partial sums of subdomains are added up so, not the terms of inner products.

use super::{Comm, Reduction};
use crate::work;

/// Bits of a limb.
const BITS: usize = 44;
/// Limbs from the least bit of a double to some more than the largest double.
const LIMBS: usize = 49;
/// Numbers after which carries are taken on: a limb has room for as many of them, times so many ranks.
const ROOM: usize = 1 << 16;
/// Exponent of the least bit of a double.
const LEAST: i32 = -1074;

/// The sums of columns over the rows of all ranks, `width` numbers a row. Collective.
pub fn sum(comm: &dyn Comm, mine: &[f64], width: usize) -> Vec<f64> {
    let mut sums = vec![Long::default(); width];
    work::each(mine.len(), 1, size_of::<f64>());
    for rows in mine.chunks(width.max(1) * ROOM) {
        for row in rows.chunks_exact(width.max(1)) {
            sums.iter_mut().zip(row).for_each(|(sum, x)| sum.add(*x));
        }
        sums.iter_mut().for_each(Long::carry);
    }
    let mut limbs: Vec<i64> = sums.iter().flat_map(|sum| sum.limbs).collect();
    // What is not finite is counted behind the limbs.
    limbs.extend(sums.iter().map(|sum| sum.faults));
    comm.reduce(Reduction::Sum, &mut limbs);
    let (limbs, faults) = limbs.split_at(LIMBS * width);
    limbs
        .as_chunks()
        .0
        .iter()
        .zip(faults)
        .map(|(limbs, faults)| Long { limbs: *limbs, faults: *faults }.round())
        .collect()
}

/// As [`sum`], of so many columns.
pub fn exact_sums<const N: usize>(comm: &dyn Comm, mine: &[[f64; N]]) -> [f64; N] {
    let sums = sum(comm, mine.as_flattened(), N);
    std::array::from_fn(|k| sums[k])
}

/// A sum as a long integer.
#[derive(Clone)]
struct Long {
    limbs: [i64; LIMBS],
    /// Numbers that are not finite.
    faults: i64,
}

impl Default for Long {
    fn default() -> Self {
        Self { limbs: [0; LIMBS], faults: 0 }
    }
}

impl Long {
    fn add(&mut self, x: f64) {
        if !x.is_finite() {
            self.faults += 1;
            return;
        }
        let bits = x.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7ff) as usize, bits & ((1 << 52) - 1));
        // Those below the least exponent have no leading one.
        let (place, whole) = if exponent == 0 { (0, fraction) } else { (exponent - 1, fraction | 1 << 52) };
        let (limb, shifted) = (place / BITS, u128::from(whole) << (place % BITS));
        let part = |k: usize| (shifted >> (k * BITS)) as i64 & ((1 << BITS) - 1);
        let sign = if bits >> 63 == 0 { 1 } else { -1 };
        (0..3).for_each(|k| self.limbs[limb + k] += sign * part(k));
    }

    /// Brings all limbs but the highest to 44 bits.
    fn carry(&mut self) {
        for k in 1..LIMBS {
            self.limbs[k] += self.limbs[k - 1] >> BITS;
            self.limbs[k - 1] &= (1 << BITS) - 1;
        }
    }

    /// The nearest double.
    fn round(mut self) -> f64 {
        if self.faults > 0 {
            return f64::NAN;
        }
        self.carry();
        let is_negative = self.limbs[LIMBS - 1] < 0;
        if is_negative {
            self.limbs.iter_mut().for_each(|limb| *limb = -*limb);
            self.carry();
        }
        let Some(highest) = self.limbs.iter().rposition(|limb| *limb != 0) else { return 0.0 };
        let limb = |below: usize| highest.checked_sub(below).map_or(0, |k| self.limbs[k] as u128);
        // 84 bits or more; what is below cannot be seen but that it is there.
        let is_more = self.limbs[..highest.saturating_sub(1)].iter().any(|limb| *limb != 0);
        let leading = (limb(0) << BITS | limb(1)) << 1 | u128::from(is_more);
        let exponent = (BITS * highest) as i32 - BITS as i32 - 1 + LEAST;
        // In two steps: neither power is beyond a double's.
        let size = leading as f64 * 2.0_f64.powi(exponent / 2) * 2.0_f64.powi(exponent - exponent / 2);
        if is_negative { -size } else { size }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
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
        assert!(sum(&Solo, &[], 0).is_empty());
    }

    /// Integers of 128 bits are exact where numbers are of about one size.
    #[test]
    fn sums_are_rounded_to_the_nearest_double() {
        let mut random = Random::new(9);
        for scale in [1.0, 2.0_f64.powi(-1000), 2.0_f64.powi(900)] {
            for _ in 0..200 {
                let numbers: Vec<f64> = (0..9).map(|k| random.number() * 2.0_f64.powi(-5 * k)).collect();
                let whole: i128 = numbers.iter().map(|x| (x * 2.0_f64.powi(105)) as i128).sum();
                let expected = whole as f64 * 2.0_f64.powi(-105) * scale;
                let scaled: Vec<f64> = numbers.iter().map(|x| x * scale).collect();
                assert_eq!(sum(&Solo, &scaled, 1), [expected]);
            }
        }
    }

    #[test]
    fn the_whole_range_of_doubles_is_added_up() {
        let least = f64::from_bits(1);
        for (numbers, expected) in [
            (vec![1e308, 1.0, -1e308], 1.0),
            (vec![f64::MAX, least, -f64::MAX], least),
            (vec![f64::MAX; 3], f64::INFINITY),
            (vec![-f64::MIN_POSITIVE, f64::MIN_POSITIVE / 2.0], -f64::MIN_POSITIVE / 2.0),
            (vec![1e16, 1.0, 1.0, -1e-30], 1e16 + 2.0),
            (vec![1.0, f64::EPSILON / 2.0, least], 1.0 + f64::EPSILON),
            (vec![1.0, f64::EPSILON / 2.0], 1.0),
            (vec![-0.0], 0.0),
        ] {
            assert_eq!(sum(&Solo, &numbers, 1), [expected], "{numbers:?}");
        }
        for fault in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let sums = threads::run(3, |comm| sum(comm, &[if comm.rank() == 1 { fault } else { 1.0 }, 2.0], 2));
            assert!(sums.iter().all(|sum| sum[0].is_nan() && sum[1] == 6.0));
        }
        let many = vec![-0.1; 3 * ROOM + 7];
        assert_eq!(sum(&Solo, &many, 1), [-(many.len() as f64 * 0.1)]);
    }
}
