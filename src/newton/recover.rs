//! `du = K^+ (f_k - B'lambda) + R a` (paper, section 4).
//!
//! The amplitudes satisfy the equalities and the active contacts in the least-squares sense,
//! `a = (G G')^-1 G (c - B K^+ (f_k - B'lambda))` with `G` restricted to those rows; at the solution exactly.

use super::problem::TornProblem;
use crate::feti::Torn;
use crate::feti::coarse::{Coarse, Floating, MODES};

/// Adds `R a` to `torn = K^+ (f_k - B'lambda)`, given the rows `defect = c_k - B torn` and which of them must vanish.
///
/// # Errors
/// If these rows leave a rigid motion free.
pub fn add_rigid_motion(
    problem: &TornProblem,
    coarse: &Coarse,
    kept: &[bool],
    defect: &[f64],
    torn: &mut Torn,
) -> Result<(), Floating> {
    let masked: Vec<f64> = defect.iter().zip(kept).map(|(d, &k)| if k { *d } else { 0.0 }).collect();
    let mut a = coarse.apply(&masked);
    coarse.restricted(|row| kept[row])?.solve(&mut a);
    for ((subdomain, modes), local) in problem.subdomains.iter().zip(problem.modes).zip(torn) {
        modes.add_motion(&subdomain.points, &a[MODES * subdomain.id..][..MODES], local);
    }
    Ok(())
}
