//! Right-hand sides of the rows: all of them that changes over the load history.
//!
//! A support row's is `sqrt(m) d` with the prescribed displacement `d` at a node of `m` copies. A contact row's is what
//! is left of the gap `g` where supports move nodes of the condition, `scale (g - sum of weight d)`. Both are as long as the
//! row (see [`Row::length`]). A friction row's is what supports and obstacles slide by themselves. A gluing row's is zero.

use std::collections::HashMap;

use super::{Constraints, Fixed, Kind, Row};

/// What supports and contacts prescribe at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Prescribed {
    /// Displacement of each support (length).
    pub displacements: Vec<[f64; 3]>,
    /// Gap of each contact pair that is known here, by its number, along its normal (length); the motion of an obstacle is part of it.
    pub gaps: HashMap<usize, f64>,
    /// How far the obstacle of each contact pair with friction is moved (length).
    pub drags: HashMap<usize, [f64; 3]>,
}

impl Prescribed {
    /// What is left of a pair's gap where supports fix components of its condition (length).
    pub(super) fn distance(&self, pair: usize, fixed: &[Fixed]) -> f64 {
        self.left(self.gaps[&pair], fixed)
    }

    /// What is left of a distance where supports fix components of a condition (length).
    fn left(&self, distance: f64, fixed: &[Fixed]) -> f64 {
        let left = |left: f64, h: &Fixed| left - h.weight * self.displacements[h.support][h.axis];
        fixed.iter().fold(distance, left)
    }
}

/// A contact condition along the direction of a row's own, at the same node: at any time the tightest of them counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Parallel {
    /// Index of the contact pair.
    pub pair: usize,
    /// As of a row: [`Row::scale`].
    pub scale: f64,
    /// As of a row: [`Row::fixed`].
    pub fixed: Vec<Fixed>,
}

impl Row {
    /// Right-hand side (length, times `scale`).
    pub fn right_hand_side(&self, at: &Prescribed) -> f64 {
        match self.kind {
            Kind::Gluing => 0.0,
            Kind::Support { support, axis } => {
                (self.terms.len() as f64).sqrt() * at.displacements[support][axis] * self.length
            }
            Kind::Contact { pair } => {
                let own = self.scale * at.distance(pair, &self.fixed);
                let others = self.parallel.iter().map(|p| p.scale * at.distance(p.pair, &p.fixed));
                others.fold(own, |tightest, other| if other < tightest { other } else { tightest })
            }
            Kind::Friction { .. } => self.scale * at.left(0.0, &self.fixed),
        }
    }
}

impl Constraints {
    /// Adds to right-hand sides what the `gap` of each contact pair is wider by (length); for rows without parallel conditions.
    pub fn add_gaps(&self, gap: impl Fn(usize) -> f64, rhs: &mut [f64]) {
        for (row, rhs) in self.rows.iter().zip(rhs) {
            if let Kind::Contact { pair } = row.kind {
                *rhs += row.scale * gap(pair);
            }
        }
    }

    /// Right-hand sides of all rows.
    pub fn right_hand_sides(&self, at: &Prescribed) -> Vec<f64> {
        let mut rhs: Vec<f64> = self.rows.iter().map(|row| row.right_hand_side(at)).collect();
        self.add_drags(at, &mut rhs);
        rhs
    }

    /// Pairs of own nodes with friction along which supports hold both sides, and how far these slide by themselves (length).
    pub fn guided_slides(&self, at: &Prescribed) -> Vec<(usize, f64)> {
        self.guided.iter().map(|guided| (guided.pair, guided.slide(at))).collect()
    }

    /// Contact pairs of own nodes without a row, and the distance that supports leave them (length).
    pub fn idle_distances(&self, at: &Prescribed) -> Vec<(usize, f64)> {
        self.idle.iter().map(|(pair, fixed)| (*pair, at.distance(*pair, fixed))).collect()
    }
}
