//! Rigid motion of the bodies at given forces between them: what closes the rows that hold, and where these leave motions
//! of whole bodies free, the least of them that opens all others.
//!
//! Such motions change no force: nothing drives them. They are found as a least distance, see [`nnls::least_distance`].

use super::face::CoarseFace;
use super::nnls;
use crate::constraint::Constraints;
use crate::feti::coarse::Coarse;
use crate::feti::dual::space::RowSpace;

/// The amplitudes `a` of all clusters' modes that make `residual - G'a` smallest on the kept rows and, if that leaves a
/// choice, nowhere positive on the other contacts, where that is possible. Collective.
pub fn amplitudes(
    face: &CoarseFace,
    coarse: &Coarse,
    space: &RowSpace,
    constraints: &Constraints,
    residual: &[f64],
) -> Vec<f64> {
    let mut a = face.amplitudes(coarse, residual);
    if face.free().is_empty() {
        return a;
    }
    let (held, motions) = (coarse.moved(&a), face.free());
    let moved: Vec<Vec<f64>> = motions.iter().map(|motion| coarse.moved(motion)).collect();
    let condition = |row: usize| moved.iter().map(|m| -m[row]).chain([held[row] - residual[row]]).collect();
    let opens = |row: usize| !face.kept()[row] && constraints.rows[row].law().opens();
    let mut rows = space.gather(motions.len() + 1, |row| opens(row).then(|| condition(row)));
    let bounds: Vec<f64> = rows.iter_mut().filter_map(Vec::pop).collect();
    for (motion, share) in motions.iter().zip(nnls::least_distance(&rows, &bounds).unwrap_or_default()) {
        a.iter_mut().zip(motion).for_each(|(a, m)| *a += share * m);
    }
    a
}
