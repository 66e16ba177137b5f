//! The coarse problem of some rows only: the equalities and the contacts that are closed.
//!
//! With `I_A` the mask of these rows it knows `G_A = G I_A`, the factor of `G_A G_A'` and the projector
//! `P_A = I_A - G_A'(G_A G_A')^-1 G_A` onto what keeps the balance and leaves open contacts without force.
//!
//! These rows may leave rigid motions `N` of whole bodies free (`G_A'N = 0`). Then the first cluster of each body is
//! tied: with `C` the rows of `N` there, scaled by body, `(G_A G_A' + C C')^-1` is a generalised inverse of `G_A G_A'`, exact for all
//! right-hand sides orthogonal to `N`, since `N'C C'a = 0` leaves `C'a = 0`.

use super::bodies::BodyMotions;
use super::factor::{Blocks, CoarseFactor};
use super::{Coarse, Floating};
use crate::feti::inverse::kernel::MODES;
use crate::vector::{dot, length};

/// The kept rows with their factor.
pub struct CoarseFace {
    kept: Vec<bool>,
    /// Rows that are not.
    dropped: Vec<u32>,
    factor: CoarseFactor,
    /// `N`, six numbers a cluster.
    free: Vec<Vec<f64>>,
}

impl CoarseFace {
    /// Of the rows that are kept. Collective.
    ///
    /// # Errors
    /// If these rows leave a motion free that is not one of whole bodies.
    pub fn new(coarse: &Coarse, kept: Vec<bool>) -> Result<Self, Floating> {
        let motions = coarse.motions();
        coarse
            .restricted(|row| kept[row])
            .map(|factor| (factor, Vec::new()))
            .or_else(|floating| {
                let free = coarse.free(|row| kept[row]);
                if free.is_empty() {
                    return Err(floating);
                }
                let free: Vec<Vec<f64>> = free.iter().map(|motion| motions.amplitudes(motion)).collect();
                let tied = |blocks| tied(motions, &free, blocks);
                let factor = coarse
                    .factor_of(&tied(coarse.blocks(|row| kept[row])), || tied(coarse.unit_blocks(|row| kept[row])));
                factor.map(|factor| (factor, free))
            })
            .map(|(factor, free)| {
                let dropped = (0..).zip(&kept).filter(|(_, kept)| !**kept).map(|(row, _)| row).collect();
                Self { kept, dropped, factor, free }
            })
    }

    /// Rigid motions of whole bodies that the kept rows leave free, six numbers a cluster.
    pub fn free(&self) -> &[Vec<f64>] {
        &self.free
    }

    /// The part of the forces `e` on all clusters that the kept rows cannot balance, as a motion. Nothing if it is rounding
    /// beside forces of this size.
    pub fn unbalanced(&self, e: &[f64], size: f64) -> Option<Vec<f64>> {
        let along: Vec<f64> = self.free.iter().map(|motion| dot(motion, e)).collect();
        let real = self.free.iter().zip(&along).any(|(motion, along)| along.abs() > BALANCED * size * length(motion));
        real.then(|| {
            let mut motion = vec![0.0; e.len()];
            for (mode, along) in self.free.iter().zip(along) {
                motion.iter_mut().zip(mode).for_each(|(m, x)| *m += along * x);
            }
            motion
        })
    }

    /// Which rows are kept.
    pub fn kept(&self) -> &[bool] {
        &self.kept
    }

    /// Sets the other rows to zero.
    pub fn mask(&self, rows: &mut [f64]) {
        self.dropped.iter().for_each(|&row| rows[row as usize] = 0.0);
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

    /// As [`CoarseFace::project`] of rows that are masked already; returns the squared norm of `P_A rows`, and the sums over all
    /// subdomains of `width` numbers for each own one, given and returned behind those of the square of `rows`. One all-gather.
    pub fn project_with_sums(
        &self,
        coarse: &Coarse,
        rows: &mut [f64],
        partial: &[f64],
        width: usize,
    ) -> (f64, Vec<f64>) {
        let (mut a, mut sums) = coarse.apply_with_sums(rows, partial, width);
        let e = a.clone();
        self.factor.solve(&mut a);
        coarse.add_transpose(-1.0, &a, rows);
        self.mask(rows);
        (without(sums.remove(0), &e, &a), sums)
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
    let rest = square - dot(e, a);
    // Not `max`: NaN must stay NaN.
    if rest < 0.0 { 0.0 } else { rest }
}

/// Forces along a free motion smaller than this share of all are rounding.
const BALANCED: f64 = 1e-10;

/// Adds `C C'` to the blocks. The rows of `N` at a body are scaled by the root of the largest entry of its block, so that `C'N` stays
/// regular.
fn tied(motions: &BodyMotions, free: &[Vec<f64>], mut blocks: Blocks) -> Blocks {
    let first = motions.first_clusters();
    let largest = |x: &[f64]| x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let any = blocks.values().map(|block| largest(block)).fold(0.0, f64::max);
    // Nothing may hold a body.
    let own =
        |cluster: &usize| blocks.get(&(*cluster, *cluster)).map(|block| largest(block)).filter(|size| *size > 0.0);
    let root = |cluster: &usize| own(cluster).unwrap_or(any).sqrt();
    let roots: Vec<f64> = first.iter().map(root).collect();
    for motion in free {
        let of = |cluster: usize| &motion[MODES * cluster..][..MODES];
        let scale = 1.0 / first.iter().map(|&cluster| largest(of(cluster))).fold(0.0, f64::max);
        let parts = || first.iter().zip(&roots).filter(|(cluster, _)| of(**cluster).iter().any(|x| *x != 0.0));
        for (&row, of_row) in parts() {
            for (&column, of_column) in parts().filter(|(column, _)| **column <= row) {
                let block = blocks.entry((row, column)).or_insert([0.0; MODES * MODES]);
                for (i, a) in of(row).iter().enumerate() {
                    for (j, b) in of(column).iter().enumerate() {
                        block[MODES * i + j] += (of_row * scale * a) * (of_column * scale * b);
                    }
                }
            }
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::prelude::Solve;

    use super::*;
    use crate::fixture::{Setup, assert_close, column, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis};
    use crate::scene::Scene;

    /// Every other contact row is kept.
    fn some(setup: &Setup) -> Vec<bool> {
        setup.rows().iter().map(|row| row.law().always_holds() || row.terms[0].node % 2 == 0).collect()
    }

    #[test]
    fn knows_the_balance_of_the_kept_rows() {
        for scene in [two_bricks(&[]), two_bricks(&["decomposition.cluster=2"]), two_bricks_by_metis(7)] {
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

    /// The upper brick hangs on contact alone, of which nothing is kept.
    fn hanging() -> Scene {
        two_bricks(&["support.right.surface=lower.xmax", "support.right.displacement=[0.0, 0.0, 0.0]"])
    }

    fn equalities(setup: &Setup) -> Vec<bool> {
        setup.rows().iter().map(|row| row.law().always_holds()).collect()
    }

    #[test]
    fn motions_that_the_kept_rows_leave_free_are_left_alone() {
        for (scene, freedoms) in
            [(hanging(), 6), (two_bricks(&["support.right.fix=[\"y\", \"z\"]", "support.right.surface=upper.zmax"]), 1)]
        {
            on_ranks(&scene, 1, |setup| {
                let (coarse, kept) = (setup.bare_coarse(), equalities(setup));
                let mask = Mat::from_fn(kept.len(), kept.len(), |i, j| f64::from(i == j && kept[i]));
                let g = setup.dense_modes().transpose() * setup.dense_rows().transpose() * &mask;
                let face = CoarseFace::new(&coarse, kept).expect("only whole bodies are free");
                assert_eq!(face.free().len(), freedoms);
                let mut gram = &g * g.transpose();
                for motion in face.free() {
                    let n = column(motion);
                    let resistance = (g.transpose() * &n).norm_l2() / n.norm_l2();
                    assert!(resistance < 1e-12, "{resistance:e}");
                    // Of full rank, and the same on all that is balanced.
                    gram += &n * n.transpose();
                }
                let inverse = |e: Mat<f64>| gram.partial_piv_lu().solve(e);

                let x = setup.multipliers(1);
                let mut projected = x.clone();
                face.project(&coarse, &mut projected);
                let expected = &mask * column(&x) - g.transpose() * inverse(&g * column(&x));
                assert_close(&column(&projected), &expected, 1e-9);

                let mut masked = setup.multipliers(2);
                face.mask(&mut masked);
                let balanced = coarse.apply(&masked);
                let size = column(&balanced).norm_l2();
                assert_eq!(face.unbalanced(&balanced, size), None);
                let mut rows = vec![0.0; x.len()];
                face.add_balance(&coarse, balanced.clone(), &mut rows);
                assert_close(&column(&coarse.apply(&rows)), &column(&balanced), 1e-9);

                let push: Vec<f64> = balanced.iter().zip(&face.free()[0]).map(|(b, m)| b + 1e-3 * m).collect();
                let motion = face.unbalanced(&push, size).expect("it is pushed where it is free");
                assert!((g.transpose() * column(&motion)).norm_l2() < 1e-12 * column(&motion).norm_l2());
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
        same_on_any_ranks(&hanging(), |setup| {
            let coarse = setup.bare_coarse();
            let face = CoarseFace::new(&coarse, equalities(setup)).expect("only whole bodies are free");
            let mut x = setup.multipliers(1);
            face.project(&coarse, &mut x);
            setup.owned(&x)
        });
    }
}
