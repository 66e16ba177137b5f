//! The coarse problem of some rows only: the equalities and the contacts that are closed.
//!
//! It is built on the factor of a base `B` of kept rows ([`super::base`]), all equalities among them. The base balances all but the
//! motions `N` of whole bodies that it leaves free; these the other kept contacts `X` balance. With `G_A` the columns of all kept
//! rows, `Z` a generalised inverse of `N'G_X G_X'N` and `S^+` that of `G_B G_B'`,
//!
//! ```text
//! L  = I_B G_B' S^+ (I - G_X G_X' N Z N') + I_X G_X' N Z N'      G_A L = I on forces that the kept rows can balance
//! P  = I_A - L G_A                                               P x:   in balance, and zero where contacts are open
//! P' = I_A - G_A' L'                                             P' r:  without the rigid motions that r tells
//! ```
//!
//! `P` is a projector onto the vectors `x` of the face with `G_A x = 0`, and an orthogonal one where all kept rows are in the base;
//! gradients are projected by its transpose. The base of all kept rows takes the fewest iterations, by a tenth to a quarter. A
//! base that is there already takes no factor. So where there are few clusters every set of rows is a base. Where there are many,
//! the rows that a Newton step begins with are one, and once a contact of them opens the equalities are the base. Rows that give way
//! across slips ([`super::sliding`]) are never in the base: balance that hangs on soft springs moves them far, at many times the
//! iterations.

use std::rc::Rc;

use faer::prelude::Solve;
use faer::{ColRef, Mat};

use super::Coarse;
use super::base::Base;
use super::sliding::Sliding;
use crate::feti::dual::blocks::{Block, Blocks};
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::kernel::MODES;
use crate::span::complement;
use crate::vector::{dot, length};
use crate::work;

/// So many clusters are few: a factor for each set of contacts takes less time than the iterations that oblique projectors take more.
const FEW: usize = 1000;

/// The kept rows.
pub struct CoarseFace {
    kept: Vec<bool>,
    /// Of which of them only a combination is.
    sliding: Sliding,
    /// Rows that are not.
    dropped: Vec<u32>,
    base: Rc<Base>,
    /// `G_X G_X'`.
    contacts: Blocks,
    /// What contacts outside the base hold of whole bodies; `None` where the base holds all.
    held: Option<Held>,
    /// Motions of whole bodies that nothing holds, six numbers a cluster.
    free: Vec<Vec<f64>>,
}

/// Motions `N` of whole bodies that the base leaves free, of which other contacts hold some.
struct Held {
    /// `G_X G_X' N`, six numbers a cluster.
    pressed: Vec<Vec<f64>>,
    /// `Z`.
    inverse: Mat<f64>,
}

impl CoarseFace {
    /// Of the rows that are kept, all equalities among them; all are in the base. Collective.
    pub fn new(coarse: &Coarse, kept: Vec<bool>) -> Self {
        Self::sliding(coarse, kept, Sliding::default())
    }

    /// The same, where of some pairs of rows only a combination is kept. Collective.
    pub fn sliding(coarse: &Coarse, kept: Vec<bool>, sliding: Sliding) -> Self {
        let base = match coarse.has_contacts(&kept) {
            // Parts of a body may hang on equalities and contacts that the base as a whole does not hold.
            true => {
                Base::new(coarse, &sliding.firm(&kept), &sliding).map_or_else(|_| Rc::clone(coarse.base()), Rc::new)
            }
            false => Rc::clone(coarse.base()),
        };
        Self::on(coarse, base, kept, sliding)
    }

    /// Of the rows that are kept, only the equalities being in the base. Collective.
    pub fn loose(coarse: &Coarse, kept: Vec<bool>) -> Self {
        Self::on(coarse, Rc::clone(coarse.base()), kept, Sliding::default())
    }

    /// Of other rows, for a short while: on the base that is there, or, if that has lost a row, on that of the equalities. Collective.
    pub fn with(&self, coarse: &Coarse, space: &RowSpace, kept: Vec<bool>, sliding: Sliding) -> Self {
        if coarse.clusters() <= FEW {
            return Self::sliding(coarse, kept, sliding);
        }
        let lost = !self.base.is_part_of(&sliding.firm(&kept), &sliding);
        let base = if space.maximum(f64::from(lost)) > 0.0 { coarse.base() } else { &self.base };
        Self::on(coarse, Rc::clone(base), kept, sliding)
    }

    /// Of the same rows, all in the base. Collective.
    pub fn settled(self, coarse: &Coarse) -> Self {
        if self.contacts.is_empty() { self } else { Self::sliding(coarse, self.kept, self.sliding) }
    }

    fn on(coarse: &Coarse, base: Rc<Base>, kept: Vec<bool>, sliding: Sliding) -> Self {
        let weight = |row: usize| match kept[row] && !base.has_contact(row) {
            true => sliding.weight(row),
            false => 0.0.into(),
        };
        let [contacts, unit] = coarse.contact_blocks(weight);
        let (held, free) = match base.free() {
            [] => (None, Vec::new()),
            motions => {
                let (held, free) = Held::new(motions, &contacts, &unit);
                (Some(held), free)
            }
        };
        let dropped = (0..).zip(&kept).filter(|(_, kept)| !**kept).map(|(row, _)| row).collect();
        Self { kept, sliding, dropped, base, contacts, held, free }
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
        real.then(|| combination(&self.free, &along))
    }

    /// Which rows are kept.
    pub fn kept(&self) -> &[bool] {
        &self.kept
    }

    /// Of which pairs of them only a combination is kept.
    pub fn slides(&self) -> &Sliding {
        &self.sliding
    }

    /// Sets the other rows to zero.
    pub fn mask(&self, rows: &mut [f64]) {
        self.dropped.iter().for_each(|&row| rows[row as usize] = 0.0);
        self.sliding.mask(rows);
    }

    /// `rows = P rows`. One all-gather.
    pub fn project(&self, coarse: &Coarse, rows: &mut [f64]) {
        self.mask(rows);
        let e = coarse.apply(rows);
        self.subtract_balance(coarse, e, rows);
    }

    /// `rows = P' rows`; returns `L'rows`. One all-gather.
    pub fn reduce(&self, coarse: &Coarse, rows: &mut [f64]) -> Vec<f64> {
        self.mask(rows);
        let motion = self.told(coarse, rows);
        coarse.add_transpose(-1.0, &motion, rows);
        self.mask(rows);
        motion
    }

    /// As [`CoarseFace::reduce`] of rows `x` that are masked already. Returns `|P'x|^2` and `r'P'x` for an `r = P'r`, and sums over
    /// all subdomains of `width` numbers for each own one, given and returned behind those of `x'x` and `x'r`. One all-gather.
    pub fn reduce_with_sums(
        &self,
        coarse: &Coarse,
        (x, r): (&mut [f64], &[f64]),
        partial: &[f64],
        width: usize,
    ) -> ([f64; 2], Vec<f64>) {
        let (parts, sums) = coarse.apply_each(&self.base, (x, r), partial, width);
        let motion = self.motion(coarse, &parts);
        coarse.add_transpose(-1.0, &motion, x);
        self.mask(x);
        // With v = L'x: |x - G_A'v|^2 = x'x - 2 v'G_A x + v'G_A G_A'v, where G_B G_B'v = G_B x; and G_B r = 0.
        let [inside, contacts, beside] = &parts;
        let resisted = dot(&motion, multiply(&self.contacts, &motion));
        work::each(motion.len(), 6, size_of::<f64>());
        let square = sums[0] - dot(&motion, inside) - 2.0 * dot(&motion, contacts) + resisted;
        let product = sums[1] - dot(&motion, beside);
        // Not `max`: NaN must stay NaN.
        ([if square < 0.0 { 0.0 } else { square }, product], sums[2..].to_vec())
    }

    /// The rigid motions `L'rows`, six numbers a cluster, that the kept rows themselves tell. One all-gather.
    pub fn amplitudes(&self, coarse: &Coarse, rows: &[f64]) -> Vec<f64> {
        let mut masked = rows.to_vec();
        self.mask(&mut masked);
        self.told(coarse, &masked)
    }

    /// `L'rows` of rows that are masked already. One all-gather.
    fn told(&self, coarse: &Coarse, masked: &[f64]) -> Vec<f64> {
        let (parts, _) = coarse.apply_each(&self.base, (masked, &[]), &[], 0);
        self.motion(coarse, &parts)
    }

    /// Changes `G rows` by `e` with the kept rows: `rows += L e`. Collective.
    pub fn add_balance(&self, coarse: &Coarse, mut e: Vec<f64>, rows: &mut [f64]) {
        e.iter_mut().for_each(|e| *e = -*e);
        self.subtract_balance(coarse, e, rows);
    }

    /// `rows -= L e`. Collective.
    fn subtract_balance(&self, coarse: &Coarse, e: Vec<f64>, rows: &mut [f64]) {
        if self.sliding.is_empty() && self.held.is_none() {
            return self.subtract_unmasked(coarse, e, rows);
        }
        // Other rows keep what they have.
        let mut balance = vec![0.0; rows.len()];
        self.subtract_unmasked(coarse, e, &mut balance);
        self.mask(&mut balance);
        rows.iter_mut().zip(balance).for_each(|(row, balance)| *row += balance);
    }

    fn subtract_unmasked(&self, coarse: &Coarse, mut e: Vec<f64>, rows: &mut [f64]) {
        if let Some(held) = &self.held {
            let motions = self.base.free();
            let shares = held.solve(&products(motions, &e));
            let motion = combination(motions, &shares);
            coarse.add_transpose_outside(&self.base, -1.0, &motion, rows);
            self.mask(rows);
            held.pressed.iter().zip(&shares).for_each(|(forces, share)| subtract(*share, forces, &mut e));
        }
        self.base.solve(coarse.comm(), &mut e);
        coarse.add_transpose_in(&self.base, -1.0, &e, rows);
    }

    /// `L'r` from `G_B r` and `G_X r`. Collective.
    fn motion(&self, coarse: &Coarse, [inside, contacts, _]: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut motion = inside.clone();
        self.base.solve(coarse.comm(), &mut motion);
        let Some(held) = &self.held else { return motion };
        let motions = self.base.free();
        let left: Vec<f64> =
            motions.iter().zip(&held.pressed).map(|(n, forces)| dot(n, contacts) - dot(forces, &motion)).collect();
        let whole = combination(motions, &held.solve(&left));
        motion.iter_mut().zip(whole).for_each(|(m, w)| *m += w);
        motion
    }
}

impl Held {
    /// Of motions and the blocks of the contacts, and those if all rows were unit vectors; also the motions that contacts do not hold.
    fn new(motions: &[Vec<f64>], contacts: &Blocks, unit: &Blocks) -> (Self, Vec<Vec<f64>>) {
        let k = motions.len();
        // What contacts hold is a matter of directions, not of how long rows are.
        let resisted: Vec<Vec<f64>> = motions.iter().map(|motion| products(motions, &multiply(unit, motion))).collect();
        // Beside what the contacts resist most, in any direction, rounding is nothing.
        let most = unit.values().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let rounding = NOTHING * most * motions.iter().map(|motion| dot(motion, motion)).fold(0.0, f64::max);
        let real = |x: f64| if x.abs() > rounding { x } else { 0.0 };
        let resisted: Vec<Vec<f64>> = resisted.iter().map(|row| row.iter().copied().map(real).collect()).collect();
        let loose = complement(&resisted, k);
        let firm = complement(&loose, k);
        let pressed: Vec<Vec<f64>> = motions.iter().map(|motion| multiply(contacts, motion)).collect();
        let basis = Mat::from_fn(k, firm.len(), |i, j| firm[j][i]);
        let gram = Mat::from_fn(k, k, |i, j| dot(&motions[i], &pressed[j]));
        let inner = basis.transpose() * gram * &basis;
        let inverse = &basis * inner.partial_piv_lu().solve(basis.transpose());
        let free = loose.iter().map(|shares| combination(motions, shares)).collect();
        (Self { pressed, inverse }, free)
    }

    /// `Z x`.
    fn solve(&self, x: &[f64]) -> Vec<f64> {
        let shares = &self.inverse * ColRef::from_slice(x);
        shares.iter().copied().collect()
    }
}

/// Resistance smaller than this share of the most that rows of this length can do is rounding.
const NOTHING: f64 = 1e-10;

/// Forces along a free motion smaller than this share of all are rounding.
const BALANCED: f64 = 1e-10;

/// The products of `x` with some vectors.
fn products(vectors: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    work::each(vectors.len() * x.len(), 2, size_of::<f64>());
    vectors.iter().map(|vector| dot(vector, x)).collect()
}

/// The sum of some vectors, each times its share.
fn combination(vectors: &[Vec<f64>], shares: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; vectors.first().map_or(0, Vec::len)];
    vectors.iter().zip(shares).for_each(|(vector, share)| subtract(-share, vector, &mut sum));
    sum
}

/// `y -= factor x`.
fn subtract(factor: f64, x: &[f64], y: &mut [f64]) {
    work::each(x.len(), 2, size_of::<f64>());
    y.iter_mut().zip(x).for_each(|(y, x)| *y -= factor * x);
}

/// The product of lower blocks and a vector.
fn multiply(blocks: &Blocks, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    work::each(blocks.len(), 4 * MODES * MODES, size_of::<Block>());
    for (&(row, column), block) in blocks {
        for i in 0..MODES {
            for j in 0..MODES {
                let value = block[MODES * i + j];
                y[MODES * row + i] += value * x[MODES * column + j];
                if row != column {
                    y[MODES * column + j] += value * x[MODES * row + i];
                }
            }
        }
    }
    y
}

#[cfg(test)]
mod tests;
