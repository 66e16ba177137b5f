//! Whether the supports of a body remove all its rigid motions, and which ones they leave.
//!
//! A rigid motion displaces the point `x` by `t + w x x` (cross product), so a component fixed at `x` is one row of
//! `[I, -skew(x)]` on `(t, w)`, and what is held is the rank of these rows over the corners of the supported faces: the
//! corners span the linear functions on a face, so they stand for all its points. The rank is taken on the cube with
//! corners (+-1, +-1, +-1) instead of the true brick: supports on whole faces give the same rank for all edge lengths
//! (each reads "a rotation is zero" or "a translation equals an edge length times a rotation"), so nothing depends on
//! how slender the body is.
//!
//! Contact is not looked at: it can hold a body, but only a solution tells.

use std::fmt;

use super::Scene;
use super::body::Axis;
use super::surface::{Face, Support};

/// A rigid motion in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    /// Along an axis.
    Translation(Axis),
    /// About some line parallel to an axis.
    Rotation(Axis),
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Motion::Translation(axis) => write!(f, "translation along {axis}"),
            Motion::Rotation(axis) => write!(f, "rotation about {axis}"),
        }
    }
}

/// The motions that the supports leave to a body: as many as 6 minus the rank.
pub(super) fn free_motions(scene: &Scene, body: &str) -> Vec<Motion> {
    let supports = scene.support.values().filter(|support| support.surface.body == body);
    let pivots = pivot_columns(supports.flat_map(rows).collect());
    let translations = Axis::ALL.into_iter().map(Motion::Translation);
    let rotations = Axis::ALL.into_iter().map(Motion::Rotation);
    // Translations come first, so a free column is a pure translation, or a rotation with the translation that moves
    // its line to where the supports want it.
    translations.chain(rotations).zip(pivots).filter(|(_, held)| !held).map(|(motion, _)| motion).collect()
}

/// What to tell the user of a body that only contact holds; nothing of a held body.
pub(super) fn warning(body: &str, free: &[Motion]) -> Option<String> {
    let motions = if free.len() == 1 { "rigid motion" } else { "rigid motions" };
    (!free.is_empty()).then(|| {
        format!("body {body}: its supports leave {} {motions} that only contact can hold: {}", free.len(), listed(free))
    })
}

/// Motions as a list in words.
pub(super) fn listed(motions: &[Motion]) -> String {
    motions.iter().map(Motion::to_string).collect::<Vec<_>>().join(", ")
}

fn rows(support: &Support) -> Vec<[f64; 6]> {
    corners(support.surface.face).flat_map(|x| support.fix.iter().map(move |&axis| row(x, axis))).collect()
}

fn corners(face: Face) -> impl Iterator<Item = [f64; 3]> {
    let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
    (0..8)
        .map(move |corner| Axis::ALL.map(|axis| sign(corner >> axis.index() & 1 == 1)))
        .filter(move |x| x[face.axis().index()] == sign(face.is_max()))
}

fn row(x: [f64; 3], axis: Axis) -> [f64; 6] {
    let a = axis.index();
    let (b, c) = ((a + 1) % 3, (a + 2) % 3);
    let mut row = [0.0; 6];
    row[a] = 1.0;
    row[3 + b] = x[c];
    row[3 + c] = -x[b];
    row
}

/// Gaussian elimination; entries are small integers, so the threshold separates zero from at least about one.
fn pivot_columns(mut rows: Vec<[f64; 6]>) -> [bool; 6] {
    let mut is_pivot = [false; 6];
    for column in 0..6 {
        let Some(found) = rows.iter().position(|row| row[column].abs() > 1e-9) else { continue };
        let pivot = rows.swap_remove(found);
        is_pivot[column] = true;
        for row in &mut rows {
            let factor = row[column] / pivot[column];
            for (entry, above) in row.iter_mut().zip(pivot) {
                *entry -= factor * above;
            }
        }
    }
    is_pivot
}
