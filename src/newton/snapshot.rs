//! Where a history of loads stands between two Newton steps: all that the rest of it depends on, beside the problem.

use super::committed::Committed;
use super::control::Reach;
use super::forcing::Forcing;
use super::outcome::StepRecord;
use super::path::Attempt;
use super::step::SolverState;
use crate::feti::Torn;

/// The state of a [`super::Newton`], which goes on from it to the same bits.
#[derive(Clone)]
pub struct Snapshot {
    /// The attempt that is under way.
    pub attempt: Attempt,
    /// What is committed.
    pub committed: Committed,
    /// The last increment that was reached.
    pub reached: Option<Reached>,
    /// The displacement of an earlier run that the history goes on from.
    pub origin: Option<Torn>,
    /// All Newton steps so far, with the number of the increment.
    pub steps: Vec<(usize, StepRecord)>,
    /// How many of them belong to attempts before this one.
    pub before: usize,
    /// Torn displacement of the iterate.
    pub u: Torn,
    /// Its multipliers, of this rank's rows.
    pub lambda: Vec<f64>,
    /// The rows that are kept at the iterate; `None` in a snapshot of the same subdomains. Where bodies have been cut otherwise,
    /// the multipliers and factors of the old subdomains are useless: both are made anew from `u` and these rows.
    pub kept: Option<Vec<bool>>,
    /// How exactly the next quadratic program is solved.
    pub forcing: Forcing,
    /// What the solver of the steps keeps.
    pub solver: SolverState,
    /// Where loads are that follow the work they do.
    pub reach: Option<Reach>,
}

/// The end of an increment.
#[derive(Clone)]
pub struct Reached {
    /// Torn displacement.
    pub u: Torn,
    /// Multipliers of this rank's rows.
    pub lambda: Vec<f64>,
}

/// How a history begins.
pub enum Begin {
    /// From rest.
    Rest,
    /// Near the solution of the first increment.
    Near(Start),
    /// Where another one stood, whose conditions it shares.
    At(Box<Snapshot>),
}

/// Where to start from.
pub struct Start {
    /// Torn displacement.
    pub u: Torn,
    /// Rows that are kept there: all equalities and the closed contacts.
    pub kept: Vec<bool>,
    /// Whether it is the end of an earlier run that the history goes on from.
    pub is_origin: bool,
    /// Where loads are that follow the work they do.
    pub reach: Option<Reach>,
}
