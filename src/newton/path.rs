//! The way through a load history: increment after increment, each from the state that the one before committed.
//!
//! Loads and right-hand sides go in straight lines from stage to stage. An increment whose Newton iteration fails is halved
//! and tried again from the last committed state, and so are its parts up to a number of halvings. Each part begins and
//! ends at the corners of its halving, so an increment that is reached is reached exactly.

use serde::{Deserialize, Serialize};

use crate::model::history::{Conditions, Stage};

/// What is prescribed at the beginning, and the stages from there: at least one.
pub struct Path {
    /// At the beginning.
    pub begin: Conditions,
    /// The load steps.
    pub stages: Vec<Stage>,
}

impl Path {
    /// What is prescribed where an attempt leads.
    pub fn conditions(&self, attempt: Attempt) -> Conditions {
        self.conditions_at(attempt, attempt.part.end())
    }

    /// What is prescribed where an attempt begins.
    pub fn before(&self, attempt: Attempt) -> Conditions {
        self.conditions_at(attempt, attempt.part.begin())
    }

    /// What is prescribed at a fraction of an increment.
    fn conditions_at(&self, Attempt { stage, increment, .. }: Attempt, of_increment: f64) -> Conditions {
        let from = stage.checked_sub(1).map_or(&self.begin, |before| &self.stages[before].end);
        from.towards(&self.stages[stage].end, self.fraction(stage, increment, of_increment))
    }

    /// The fraction of a stage at a fraction of an increment.
    fn fraction(&self, stage: usize, increment: usize, of_increment: f64) -> f64 {
        (increment as f64 - 1.0 + of_increment) / self.stages[stage].increments as f64
    }

    /// Where an attempt leads.
    pub fn at(&self, Attempt { stage, increment, part, halvings }: Attempt) -> At {
        let number = self.stages[..stage].iter().map(|stage| stage.increments).sum::<usize>() + increment;
        let fraction = self.fraction(stage, increment, part.end());
        At { stage, increment, number, fraction, halvings }
    }

    /// What follows on a success; `None` at the end of the history.
    pub fn next(&self, attempt: Attempt) -> Option<Attempt> {
        if let Some(part) = attempt.part.next() {
            return Some(Attempt { part, ..attempt });
        }
        let whole = Attempt { part: Part::default(), halvings: 0, ..attempt };
        if attempt.increment < self.stages[attempt.stage].increments {
            return Some(Attempt { increment: attempt.increment + 1, ..whole });
        }
        let stage = attempt.stage + 1;
        (stage < self.stages.len()).then_some(Attempt { stage, increment: 1, ..whole })
    }

    /// What is tried after a failure: the first half of the same part; `None` if the limit is reached.
    pub fn halved(&self, attempt: Attempt) -> Option<Attempt> {
        let part = attempt.part.halved(self.stages[attempt.stage].halvings)?;
        Some(Attempt { part, halvings: attempt.halvings + 1, ..attempt })
    }
}

/// Where in the history an attempt leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Stage, from 0.
    pub stage: usize,
    /// Increment in it, from 1.
    pub increment: usize,
    /// Increment since the beginning, from 1.
    pub number: usize,
    /// How much of the stage is done then, in (0, 1].
    pub fraction: f64,
    /// How often parts of this increment were halved before.
    pub halvings: usize,
}

impl At {
    /// The number of stages done, the fraction of the present one included.
    pub fn time(self) -> f64 {
        self.stage as f64 + self.fraction
    }
}

/// A part of an increment, of size `2^-level`, after `done` parts of that size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Part {
    done: u64,
    level: u32,
}

/// An attempt: which stage, which increment of it, which part of that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// From 0.
    pub stage: usize,
    /// From 1.
    pub increment: usize,
    /// The part of the increment.
    pub part: Part,
    /// How often parts of the increment were halved before.
    pub halvings: usize,
}

impl Attempt {
    /// The first increment as a whole.
    pub const FIRST: Self = Self { stage: 0, increment: 1, part: Part { done: 0, level: 0 }, halvings: 0 };
}

impl Part {
    /// Where it begins, as a fraction of the increment.
    fn begin(self) -> f64 {
        self.done as f64 / (1_u64 << self.level) as f64
    }

    /// Where it ends, as a fraction of the increment.
    fn end(self) -> f64 {
        (self.done + 1) as f64 / (1_u64 << self.level) as f64
    }

    /// The next part, as large as fits; `None` at the end of the increment.
    fn next(mut self) -> Option<Self> {
        self.done += 1;
        while self.level > 0 && self.done.is_multiple_of(2) {
            self = Self { done: self.done / 2, level: self.level - 1 };
        }
        (self.level > 0).then_some(self)
    }

    /// Its first half, if the limit allows.
    fn halved(self, limit: u32) -> Option<Self> {
        (self.level < limit).then_some(Self { done: 2 * self.done, level: self.level + 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_an_increment_once_and_grow_again() {
        let mut ends = Vec::new();
        let mut parts = Part::default().halved(3).and_then(|p| p.halved(3)).expect("two halvings are allowed");
        loop {
            ends.push(parts.end());
            match parts.next() {
                // The third part is halved once.
                Some(next) if next == (Part { done: 1, level: 1 }) && ends.len() == 2 => {
                    parts = next.halved(3).expect("one more halving");
                }
                Some(next) => parts = next,
                None => break,
            }
        }
        assert_eq!(ends, [0.25, 0.5, 0.75, 1.0]);
        let alone = Part::default();
        assert_eq!((alone.end(), alone.next(), alone.halved(0)), (1.0, None, None));
        let half = alone.halved(1).expect("one halving is allowed");
        assert_eq!(
            (half.begin(), half.end(), half.next(), half.halved(1)),
            (0.0, 0.5, Some(Part { done: 1, level: 1 }), None)
        );
        assert_eq!(half.next().and_then(Part::next), None);
    }
}
