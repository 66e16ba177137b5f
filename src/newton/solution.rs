//! What a quadratic program of the dual ends with, and what solving on goes on from.

use crate::qp::pcpg::Directions;
use crate::qp::{Outcome, Statistics};

/// The multipliers that solve a program.
pub struct DualSolution {
    /// Admissible multipliers (the laws of the rows hold exactly, `G l = e` to the tolerance).
    pub lambda: Vec<f64>,
    /// Multipliers with `G l = e` to round-off, admissible to the tolerance.
    pub balanced: Vec<f64>,
    /// How it ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
    /// Norm of the projected residual that it began with.
    pub first_norm: f64,
    /// What solving on goes on from; SMALSE-M does not.
    pub rest: Option<Rest>,
}

/// A solution to be made more exact.
pub struct Rest {
    /// Multipliers with `G l = e`, zero where contacts are open.
    pub(super) start: Vec<f64>,
    /// `d - F l`.
    pub(super) residual: Vec<f64>,
    pub(super) directions: Directions,
    /// Products that it took so far.
    pub(super) spent: usize,
}

impl Rest {
    /// Of multipliers `start` with `G l = e`, where the residual of the program is `residual`.
    pub fn new(start: Vec<f64>, residual: Vec<f64>) -> Self {
        Self { start, residual, directions: Directions::default(), spent: 0 }
    }

    /// The directions that it knows.
    pub fn into_directions(self) -> Directions {
        self.directions
    }
}
