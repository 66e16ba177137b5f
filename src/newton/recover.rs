//! `du = K^+ (f_k - B'lambda) + R a` (paper, section 4).
//!
//! The amplitudes satisfy the equalities and the active contacts in the least-squares sense,
//! `a = (G G')^-1 G (c - B K^+ (f_k - B'lambda))` with `G` restricted to those rows; at the solution exactly.

use super::problem::TornProblem;
use crate::feti::Torn;
use crate::feti::coarse::{Coarse, CoarseFactor, Floating, MODES};

/// The coarse problem of the equalities and some contacts.
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

    /// The amplitudes `a` that make `rows - G'a` smallest on the kept rows. One all-gather.
    pub fn amplitudes(&self, coarse: &Coarse, rows: &[f64]) -> Vec<f64> {
        let masked: Vec<f64> = rows.iter().zip(&self.kept).map(|(r, &k)| if k { *r } else { 0.0 }).collect();
        let mut a = coarse.apply(&masked);
        self.factor.solve(&mut a);
        a
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

/// Adds `R a` to a torn displacement.
pub fn add_rigid_motion(problem: &TornProblem, amplitudes: &[f64], torn: &mut Torn) {
    for ((subdomain, modes), local) in problem.subdomains.iter().zip(problem.modes).zip(torn) {
        modes.add_motion(&subdomain.points, &amplitudes[MODES * subdomain.id..][..MODES], local);
    }
}
