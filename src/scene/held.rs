//! Whether the supports of a body remove all its rigid motions, and which ones they leave.
//!
//! A rigid motion displaces the point `x` by `t + w x x` (cross product), so a component fixed at `x` is one row of
//! `[I, -skew(x)]` on `(t, w)`, and what is held is the rank of these rows over the supported points. They are taken from
//! their centre and in units of their extent, so nothing depends on where or how large a body is.
//!
//! For a brick the corners of the supported faces do: they span the linear functions on a face, so they stand for all its
//! points. The rank is taken on the cube with corners (+-1, +-1, +-1) instead of the true brick: supports on whole faces
//! give the same rank for all edge lengths (each reads "a rotation is zero" or "a translation equals an edge length times
//! a rotation"), so nothing depends on how slender the body is either.
//!
//! Contact is not looked at: it can hold a body, but only a solution tells.

use std::fmt;

use super::Scene;
use super::body::Axis;
use super::surface::{Face, Support};
use crate::span::independent;

/// Shorter arms than this, in units of the extent, hold nothing.
const SHORTEST_ARM: f64 = 1e-6;

/// A rigid motion in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
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

/// What the supports of a body leave free.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Held {
    body: String,
    free: Vec<Motion>,
}

impl Held {
    /// A brick, by its supported faces.
    pub(super) fn brick(scene: &Scene, body: &str) -> Self {
        let supports = scene.support.values().filter(|support| support.surface.body == body);
        Self::new(body, supports.flat_map(rows).collect())
    }

    /// Any body, by its supported points and the components that are fixed there.
    pub fn at(body: &str, supported: &[([f64; 3], &[Axis])]) -> Self {
        let count = supported.len() as f64;
        let centre: [f64; 3] = [0, 1, 2].map(|a| supported.iter().map(|(x, _)| x[a] / count).sum());
        let from_centre = |x: &[f64; 3]| [0, 1, 2].map(|a| x[a] - centre[a]);
        let extent = supported.iter().flat_map(|(x, _)| from_centre(x)).fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let rows = supported.iter().flat_map(|(x, fix)| {
            let x = from_centre(x).map(|x| x / extent);
            fix.iter().map(move |&axis| row(x, axis))
        });
        Self::new(body, rows.collect())
    }

    /// The free motions: as many as 6 minus the rank.
    fn new(body: &str, rows: Vec<[f64; 6]>) -> Self {
        let translations = Axis::ALL.into_iter().map(Motion::Translation);
        let rotations = Axis::ALL.into_iter().map(Motion::Rotation);
        // Translations come first, so a column that depends on those before it is a pure translation, or a rotation with the
        // translation that moves its line to where the supports want it.
        let columns = (0..6).map(|motion| rows.iter().map(|row| row[motion]).collect()).collect();
        let motions = translations.chain(rotations).zip(independent(columns, SHORTEST_ARM));
        Self { body: body.to_owned(), free: motions.filter(|(_, held)| !held).map(|(motion, _)| motion).collect() }
    }

    /// What to tell the user of a body that only contact holds; nothing of a held body.
    pub fn warning(&self) -> Option<String> {
        let Self { body, free } = self;
        let motions = if free.len() == 1 { "rigid motion" } else { "rigid motions" };
        let listed = self.listed();
        (!free.is_empty()).then(|| {
            format!("body {body}: its supports leave {} {motions} that only contact can hold: {listed}", free.len())
        })
    }

    /// What to tell the user of a body that cannot even be held by contact, because it has none; nothing of a held body.
    pub fn refusal(&self) -> Option<String> {
        let listed = self.listed();
        (!self.free.is_empty()).then(|| {
            format!("nothing holds this body against {listed}: add supports, or a contact pair that can hold it")
        })
    }

    fn listed(&self) -> String {
        self.free.iter().map(Motion::to_string).collect::<Vec<_>>().join(", ")
    }
}

fn rows(support: &Support) -> Vec<[f64; 6]> {
    let corners = support.surface.face().into_iter().flat_map(corners);
    corners.flat_map(|x| support.fix.iter().map(move |&axis| row(x, axis))).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: &[Axis] = &Axis::ALL;

    fn free(supported: &[([f64; 3], &[Axis])]) -> String {
        Held::at("body", supported).listed()
    }

    #[test]
    fn far_and_tiny_supports_hold_like_others() {
        for (size, origin) in [(1.0, 0.0), (1e-3, 1e3), (1e6, -1e6)] {
            let at = |x: f64, y: f64, z: f64| [origin + size * x, origin + size * y, origin + size * z];
            let three = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.3, 1.0, 0.0)];
            assert_eq!(free(&three.map(|x| (x, ALL))), "");
            assert_eq!(
                free(&three.map(|x| (x, &ALL[2..]))),
                "translation along x, translation along y, rotation about z"
            );
            let two = [(three[0], ALL), (three[1], ALL)];
            assert_eq!(free(&two), "rotation about x");
            assert_eq!(free(&two[..1]), "rotation about x, rotation about y, rotation about z");
            // A sliding hinge about the line of the two points.
            assert_eq!(free(&two.map(|(x, _)| (x, &ALL[1..]))), "translation along x, rotation about x");
        }
        assert_eq!(Held::at("body", &[]).free.len(), 6);
    }
}
