//! The law of a row: which multipliers it admits, and when the row holds.
//!
//! A law is the set `Lambda` of admissible multipliers. At the solution the multiplier is in `Lambda`, and the slack
//! `s = c - B u` is such that `-s` is normal to `Lambda` there:
//!
//! ```text
//! equality      (gluing, support)         Lambda = R           s = 0
//! unilateral    (contact)                 Lambda = [0, inf)    s >= 0,   lambda s = 0
//! friction      (two rows of a pair)      Lambda = a disc      -s = 0 inside, along lambda on its border
//! ```
//!
//! The radius of the disc is the limit of the stress times the area (Tresca), or the coefficient times the multiplier of the
//! pair's contact row (Coulomb).
//!
//! (Hueeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30 (2008), section 2.) A row is *kept* where its multiplier may
//! act: always if it is an equality, where it is closed if it is a contact.
//!
//! This is the only file that knows the sign of a contact's multiplier. Multipliers and slacks are those of the rows, or
//! both in physical units: the scale of a row is positive and changes no answer.
//!
//! [`Law`] answers for one row, [`Laws`] for all rows of a rank: it knows which rows are of one disc, and its radius. Those who
//! ask it for whole vectors do not see the difference.

use super::friction::Slider;
use super::{Constraints, Kind, Row};
use crate::scene::Friction;

/// Which multipliers a row admits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Any multiplier: the row is an equality.
    Equality,
    /// Multipliers that are not negative: surfaces push and do not pull.
    Unilateral,
    /// One of the multipliers in a disc: the row is of friction. Alone it admits any.
    Friction,
}

/// Whether surfaces touch. The numbers are those of the field `contact_status` in result files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// No force.
    Open = 0,
    /// A force. With friction: and no slip.
    Closed = 1,
    /// A force, and slip.
    Slip = 2,
}

impl Status {
    /// Whether the surfaces exert a force on each other.
    pub fn is_closed(self) -> bool {
        self != Self::Open
    }
}

impl Law {
    /// Whether the row is kept whatever its multiplier: an equality. Other rows come and go.
    pub fn always_holds(self) -> bool {
        self == Self::Equality
    }

    /// Whether it is the condition of a contact, which opens and closes.
    pub fn opens(self) -> bool {
        self == Self::Unilateral
    }

    /// Whether a row of this multiplier is kept. Multipliers up to `rounding` are none.
    pub fn is_kept(self, lambda: f64, rounding: f64) -> bool {
        match self {
            Self::Equality | Self::Friction => true,
            Self::Unilateral => lambda > rounding,
        }
    }

    /// Whether a row of this slack is kept. Slacks up to `rounding` are none.
    pub fn is_kept_at(self, slack: f64, rounding: f64) -> bool {
        match self {
            Self::Equality | Self::Friction => true,
            Self::Unilateral => slack <= rounding,
        }
    }

    /// Whether the surfaces touch that exert this multiplier on each other.
    pub fn status(self, lambda: f64) -> Status {
        if self.is_kept(lambda, 0.0) { Status::Closed } else { Status::Open }
    }

    /// The admissible multiplier next to this one.
    pub fn project(self, lambda: f64) -> f64 {
        match self {
            Self::Equality | Self::Friction => lambda,
            Self::Unilateral => lambda.max(0.0),
        }
    }

    /// Distance of a multiplier from the admissible ones.
    pub fn distance(self, lambda: f64) -> f64 {
        match self {
            Self::Equality | Self::Friction => 0.0,
            Self::Unilateral => (-lambda).max(0.0),
        }
    }

    /// Lower bound of `lambda - start`; minus infinity if there is none.
    pub fn lower_bound(self, start: f64) -> f64 {
        match self {
            Self::Equality | Self::Friction => f64::NEG_INFINITY,
            Self::Unilateral => -start,
        }
    }

    /// The part of the slack that violates the row: all of an equality's, a contact's penetration (negative); surfaces may slide.
    pub fn violation(self, slack: f64) -> f64 {
        match self {
            Self::Equality => slack,
            Self::Unilateral => slack.min(0.0),
            Self::Friction => 0.0,
        }
    }

    /// Whether the row resists a motion that changes `B u` by `moved`. Changes up to `rounding` are none.
    pub fn resists(self, moved: f64, rounding: f64) -> bool {
        match self {
            Self::Equality | Self::Friction => moved.abs() > rounding,
            Self::Unilateral => moved > rounding,
        }
    }
}

impl Row {
    /// Its law.
    pub fn law(&self) -> Law {
        match self.kind {
            Kind::Gluing | Kind::Support { .. } => Law::Equality,
            Kind::Contact { .. } => Law::Unilateral,
            Kind::Friction { .. } => Law::Friction,
        }
    }
}

impl Constraints {
    /// The laws of all rows of this rank, under these laws of friction of the scene's contacts.
    pub fn laws<'a>(&'a self, friction: &'a [Option<Friction>]) -> Laws<'a> {
        Laws { rows: &self.rows, sliders: &self.sliders, friction }
    }

    /// Leaves of slacks what violates the rows.
    pub fn violation(&self, slack: &mut [f64]) {
        self.rows.iter().zip(slack).for_each(|(row, slack)| *slack = row.law().violation(*slack));
    }

    /// Rows that come and go with their multipliers.
    pub fn may_open(&self) -> Vec<bool> {
        self.rows.iter().map(|row| row.law().opens()).collect()
    }
}

/// The laws of all rows of a rank. Vectors are as long as there are rows.
#[derive(Clone, Copy)]
pub struct Laws<'a> {
    rows: &'a [Row],
    sliders: &'a [Slider],
    friction: &'a [Option<Friction>],
}

impl<'a> Laws<'a> {
    /// The largest multiplier of a slider's friction rows, where that of its contact row is `normal`.
    pub fn radius(self, slider: &Slider, normal: f64) -> f64 {
        let scale = self.rows[slider.tangents[0].row].scale;
        match self.friction[slider.contact] {
            None => 0.0,
            Some(Friction::Tresca(limit)) => limit * slider.limit_area / scale,
            Some(Friction::Coulomb(coefficient)) => {
                coefficient * self.rows[slider.normal].scale * Law::Unilateral.project(normal) / scale
            }
        }
    }

    /// The sliders, each with its radius as that of the contact row's multiplier has it: constant, and factor.
    pub fn radii(self) -> impl Iterator<Item = (&'a Slider, [f64; 2])> {
        self.sliders.iter().map(move |slider| {
            let constant = self.radius(slider, 0.0);
            (slider, [constant, self.radius(slider, 1.0) - constant])
        })
    }

    /// Rows that are kept at these multipliers. Multipliers up to `rounding` are none. Friction acts where there is any.
    pub fn kept(self, lambda: &[f64], rounding: f64) -> Vec<bool> {
        self.with_friction(self.rows.iter().zip(lambda).map(|(row, &lambda)| row.law().is_kept(lambda, rounding)))
    }

    /// Rows that are kept at these slacks. Slacks up to `rounding` are none.
    pub fn kept_at(self, slack: &[f64], rounding: f64) -> Vec<bool> {
        self.with_friction(self.rows.iter().zip(slack).map(|(row, &slack)| row.law().is_kept_at(slack, rounding)))
    }

    /// Friction rows are kept where something presses, or where that does not matter.
    fn with_friction(self, kept: impl Iterator<Item = bool>) -> Vec<bool> {
        let mut kept: Vec<bool> = kept.collect();
        for (slider, [constant, factor]) in self.radii() {
            let acts = constant > 0.0 || (factor > 0.0 && kept[slider.normal]);
            slider.tangents.iter().for_each(|tangent| kept[tangent.row] = acts);
        }
        kept
    }

    /// Makes multipliers admissible, each the next one; those of a contact row first.
    pub fn project(self, lambda: &mut [f64]) {
        self.rows.iter().zip(&mut *lambda).for_each(|(row, lambda)| *lambda = row.law().project(*lambda));
        self.project_discs(lambda);
    }

    /// Makes multipliers admissible where rows are kept, and zero elsewhere.
    pub fn project_onto(self, kept: &[bool], lambda: &mut [f64]) {
        for ((row, lambda), &kept) in self.rows.iter().zip(&mut *lambda).zip(kept) {
            *lambda = if kept { row.law().project(*lambda) } else { 0.0 };
        }
        self.project_discs(lambda);
    }

    fn project_discs(self, lambda: &mut [f64]) {
        for slider in self.sliders {
            let (size, radius) = (slider.size(lambda), self.radius(slider, lambda[slider.normal]));
            if size > radius {
                slider.tangents.iter().for_each(|tangent| lambda[tangent.row] *= radius / size);
            }
        }
    }

    /// The largest distance of a multiplier from the admissible ones, on this rank.
    pub fn distance(self, lambda: &[f64]) -> f64 {
        let rows = self.rows.iter().zip(lambda).map(|(row, &lambda)| row.law().distance(lambda));
        let beyond = |slider: &Slider| slider.size(lambda) - self.radius(slider, lambda[slider.normal]);
        rows.chain(self.sliders.iter().map(beyond)).fold(0.0, f64::max)
    }

    /// Lower bounds of `lambda - start`, minus infinity where there is none.
    pub fn lower_bounds(self, start: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(start).map(|(row, &start)| row.law().lower_bound(start)).collect()
    }
}

impl Slider {
    /// Length of the vector that friction rows have of values of the rows.
    pub fn size(&self, rows: &[f64]) -> f64 {
        self.tangents.iter().map(|tangent| rows[tangent.row] * rows[tangent.row]).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::extension::sources;

    const LAWS: [Law; 2] = [Law::Equality, Law::Unilateral];
    const NUMBERS: [f64; 7] = [-2.0, -0.5, -0.0, 0.0, 1e-9, 0.75, 3.0];

    #[test]
    fn the_projection_is_the_nearest_admissible_multiplier() {
        for law in LAWS {
            for lambda in NUMBERS {
                let nearest = law.project(lambda);
                assert_eq!((law.distance(nearest), law.project(nearest)), (0.0, nearest), "it is admissible");
                assert_eq!((nearest - lambda).abs(), law.distance(lambda));
                let nearer =
                    |other: &f64| law.distance(*other) == 0.0 && (other - lambda).abs() < (nearest - lambda).abs();
                assert!(!NUMBERS.iter().any(nearer), "{law:?} {lambda}");
                // In terms of `lambda - start` the bound is the admissible set's.
                let bound = law.lower_bound(0.25);
                assert_eq!(lambda - 0.25 >= bound, law.distance(lambda) == 0.0, "{law:?} {lambda}");
            }
        }
    }

    /// `lambda = project(lambda - s)` says the same as the conditions of complementarity, in one equation.
    #[test]
    fn multiplier_and_slack_of_a_solution_are_a_fixed_point_of_the_projection() {
        for law in LAWS {
            for lambda in NUMBERS {
                for slack in NUMBERS {
                    let solves = law.project(lambda - slack) == lambda;
                    let expected = law.distance(lambda) == 0.0
                        && law.violation(slack) == 0.0
                        && (law.always_holds() || lambda * slack == 0.0);
                    assert_eq!(solves, expected, "{law:?} {lambda} {slack}");
                    // What is kept by its multiplier is so by its slack.
                    assert!(!solves || !law.is_kept(lambda, 0.0) || law.is_kept_at(slack, 0.0));
                }
            }
        }
    }

    #[test]
    fn contact_is_closed_by_pushes_and_resists_what_closes_it() {
        assert_eq!([-1.0, 0.0, 1.0].map(|l| Law::Unilateral.status(l)), [Status::Open, Status::Open, Status::Closed]);
        assert_eq!([-1.0, 0.0, 1.0].map(|m| Law::Unilateral.resists(m, 0.5)), [false, false, true]);
        assert_eq!([-1.0, 0.0, 1.0].map(|m| Law::Equality.resists(m, 0.5)), [true, false, true]);
        assert!(Status::Open < Status::Closed, "a node of several contacts shows the larger");
    }

    #[test]
    fn rounding_neither_closes_nor_opens() {
        assert!(Law::Unilateral.is_kept(2.0, 1.0) && !Law::Unilateral.is_kept(0.5, 1.0));
        assert!(Law::Unilateral.is_kept_at(0.5, 1.0) && !Law::Unilateral.is_kept_at(2.0, 1.0));
        assert!(Law::Equality.is_kept(-3.0, 1.0) && Law::Equality.is_kept_at(2.0, 1.0));
    }

    /// The files that CONTRIBUTING.md names in its section on contact laws.
    fn listed() -> BTreeSet<String> {
        let text = include_str!("../../CONTRIBUTING.md");
        let section = text.split_once("### A contact law\n").expect("there is such a section").1;
        let section = section.split("\n#").next().unwrap_or_default();
        section.split('`').filter(|word| word.starts_with("src/")).map(str::to_owned).collect()
    }

    #[test]
    fn contributing_lists_the_files_that_a_contact_law_touches() {
        let asks = |code: &str| {
            let words = [".law()", ".laws()", "constraint::law", "is_contact()", "Kind::Contact"];
            words.iter().any(|word| code.contains(word))
        };
        let asking: BTreeSet<String> =
            sources().into_iter().filter(|(_, code)| asks(code)).map(|(name, _)| name).collect();
        let solvers = [
            "src/constraint/mod.rs",
            "src/constraint/friction.rs",
            "src/constraint/blocks.rs",
            "src/qp/feasible.rs",
            "src/qp/active_set.rs",
            "src/newton/damping.rs",
            "src/newton/friction.rs",
            "src/study/contact.rs",
        ]
        .map(str::to_owned);
        let expected: BTreeSet<String> = asking.into_iter().chain(solvers).collect();
        assert_eq!(listed(), expected, "left: CONTRIBUTING.md, right: the sources");
    }

    /// The usual ways to write it down a second time.
    #[test]
    fn the_sign_of_contact_is_known_here_only() {
        let words = [
            "is_inequality",
            "Law::Unilateral",
            "lambda > 0.0",
            "lambda >= 0.0",
            "lambda.max(0.0)",
            "l > 0.0",
            "l.max(0.0)",
            "force > 0.0",
            "slack < 0.0",
            "slack <= 0.0",
            "slack[row] < 0.0",
            "slack.min(0.0)",
            "gap.min(0.0)",
            "(-gap).max(0.0)",
        ];
        let elsewhere = sources().into_iter().filter(|(name, _)| name != "src/constraint/law.rs");
        for (name, code) in elsewhere {
            for line in code.lines() {
                assert!(!words.iter().any(|word| contains(line, word)), "{name}: {line}");
            }
        }
    }

    /// Whether a line has this text, which begins with a whole word.
    fn contains(line: &str, text: &str) -> bool {
        let part_of_name = |c: char| c.is_alphanumeric() || c == '_';
        line.match_indices(text).any(|(at, _)| !line[..at].ends_with(part_of_name))
    }
}
