//! The coarse problem of some rows only: the equalities and the contacts that are closed.
//!
//! With `I_A` the mask of these rows it knows `G_A = G I_A`, the factor of `G_A G_A'` and the projector
//! `P_A = I_A - G_A'(G_A G_A')^-1 G_A` onto what keeps the balance and leaves open contacts without force.

use super::coarse::{Coarse, CoarseFactor, Floating};
use super::space::RowSpace;

/// The kept rows with their factor.
pub struct CoarseFace {
    kept: Vec<bool>,
    factor: CoarseFactor,
}

impl CoarseFace {
    /// Of the rows that are kept. Collective.
    ///
    /// # Errors
    /// If these rows leave a rigid motion free.
    pub fn new(coarse: &Coarse, kept: Vec<bool>) -> Result<Self, Floating> {
        let factor = coarse.restricted(|row| kept[row])?;
        Ok(Self { kept, factor })
    }

    /// Which rows are kept.
    pub fn kept(&self) -> &[bool] {
        &self.kept
    }

    /// Sets the other rows to zero.
    pub fn mask(&self, rows: &mut [f64]) {
        rows.iter_mut().zip(&self.kept).filter(|(_, kept)| !**kept).for_each(|(r, _)| *r = 0.0);
    }

    /// The amplitudes `a` that make `rows - G'a` smallest on the kept rows. One all-gather.
    pub fn amplitudes(&self, coarse: &Coarse, rows: &[f64]) -> Vec<f64> {
        let mut masked = rows.to_vec();
        self.mask(&mut masked);
        let mut a = coarse.apply(&masked);
        self.factor.solve(&mut a);
        a
    }

    /// `rows = P_A rows`. One all-gather.
    pub fn project(&self, coarse: &Coarse, rows: &mut [f64]) {
        self.mask(rows);
        let mut a = coarse.apply(rows);
        self.factor.solve(&mut a);
        coarse.add_transpose(-1.0, &a, rows);
        self.mask(rows);
    }

    /// As [`CoarseFace::project`]; returns the squared norm of `P_A rows`, and inner products of `I_A rows` with each of
    /// `against`, then of `pairs`. One all-gather.
    pub fn project_with_products(
        &self,
        coarse: &Coarse,
        space: &RowSpace,
        rows: &mut [f64],
        against: &[&[f64]],
        pairs: &[(&[f64], &[f64])],
    ) -> (f64, Vec<f64>) {
        self.mask(rows);
        let (mut a, square, products) = coarse.apply_with_products(space, rows, against, pairs);
        let e = a.clone();
        self.factor.solve(&mut a);
        coarse.add_transpose(-1.0, &a, rows);
        self.mask(rows);
        (without(square, &e, &a), products)
    }

    /// Adds to the kept rows the least that changes `G rows` by `e`. Local.
    pub fn add_balance(&self, coarse: &Coarse, mut e: Vec<f64>, rows: &mut [f64]) {
        self.factor.solve(&mut e);
        let mut change = vec![0.0; rows.len()];
        coarse.add_transpose(1.0, &e, &mut change);
        for ((r, c), _) in rows.iter_mut().zip(change).zip(&self.kept).filter(|(_, kept)| **kept) {
            *r += c;
        }
    }
}

/// `|P x|^2 = x'x - e'a` with `e = G x` and `a = (G G')^-1 e`.
pub(super) fn without(square: f64, e: &[f64], a: &[f64]) -> f64 {
    let rest = square - e.iter().zip(a).map(|(e, a)| e * a).sum::<f64>();
    // What is not a number stays so.
    if rest < 0.0 { 0.0 } else { rest }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::prelude::Solve;

    use super::*;
    use crate::fixture::{Setup, assert_close, column, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis};

    /// Every other contact row is kept.
    fn some(setup: &Setup) -> Vec<bool> {
        setup.rows().iter().map(|row| !row.is_inequality() || row.terms[0].node % 2 == 0).collect()
    }

    #[test]
    fn knows_the_balance_of_the_kept_rows() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(7)] {
            on_ranks(&scene, 1, |setup| {
                let (coarse, kept) = (setup.coarse().expect("the bodies are held"), some(setup));
                assert!(kept.contains(&false));
                let mask = Mat::from_fn(kept.len(), kept.len(), |i, j| f64::from(i == j && kept[i]));
                let g = setup.dense_modes().transpose() * setup.dense_rows().transpose() * &mask;
                let inverse = |e: Mat<f64>| (&g * g.transpose()).partial_piv_lu().solve(e);
                let face = CoarseFace::new(&coarse, kept).expect("supports hold both bodies");

                let x = setup.multipliers(1);
                let amplitudes = inverse(&g * column(&x));
                assert_close(&column(&face.amplitudes(&coarse, &x)), &amplitudes, 1e-9);
                let mut projected = x.clone();
                face.project(&coarse, &mut projected);
                assert_close(&column(&projected), &(&mask * column(&x) - g.transpose() * &amplitudes), 1e-9);
                let mut balanced = x.clone();
                let e = coarse.apply(&setup.multipliers(2));
                face.add_balance(&coarse, e.clone(), &mut balanced);
                assert_close(&column(&balanced), &(column(&x) + g.transpose() * inverse(column(&e))), 1e-9);
            });
        }
    }

    #[test]
    fn projections_are_the_same_bits_on_any_ranks() {
        same_on_any_ranks(&two_bricks_by_metis(7), |setup| {
            let coarse = setup.coarse().expect("the bodies are held");
            let mut x = setup.multipliers(1);
            CoarseFace::new(&coarse, some(setup)).expect("supports hold both bodies").project(&coarse, &mut x);
            setup.owned(&x)
        });
    }
}
