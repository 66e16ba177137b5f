//! Coulomb's friction by programs with given radii, one after the other, until these are those of the solution.
//!
//! Each program has discs of constant radius and is one for SMALSE-M ([`smalse`]). Its multipliers give the next radii. The first
//! programs are solved loosely: until radii stand no program is worth its whole tolerance. What slips follows its circle to the next
//! radius. Off the circle its whole slip would count as an error.

use crate::qp::discs::Disc;
use crate::qp::feasible::FeasibleSet;
use crate::qp::quadratic::{Quadratic, Space};
use crate::qp::slides::Slides;
use crate::qp::{Limits, Outcome, Statistics, smalse};

/// Programs at most.
const PROGRAMS: usize = 60;

/// Each lowers the gradient by this factor, until the tolerance is reached.
const LOOSE: f64 = 0.1;

/// The program of `l - l0`, and what it starts from.
pub(super) struct Program<'a> {
    /// Inner products.
    pub space: &'a dyn Space,
    /// F and the projector.
    pub function: &'a mut dyn Quadratic,
    /// `P (d - F l0)`.
    pub b: &'a [f64],
    /// `l0`.
    pub start: &'a [f64],
    /// Lower bounds of `l - l0`.
    pub lower: Vec<f64>,
    /// Whether any rank has friction.
    pub has_friction: bool,
    /// Estimate of the norm of F.
    pub norm: f64,
    /// Multiplier of `G x = 0` to begin with.
    pub multiplier: Option<Vec<f64>>,
}

/// What was found.
pub(super) struct Found {
    /// `l - l0`.
    pub x: Vec<f64>,
    /// Norm of the projected gradient at the start.
    pub first_norm: f64,
    /// How it ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
}

/// Solves the program; `slides` are what is known of friction, and follow. Collective.
pub(super) fn solve(program: Program, slides: &mut Slides, limits: Limits) -> Found {
    let Program { space, function, b, start, lower, has_friction, norm, mut multiplier } = program;
    let set = |discs: Vec<Disc>| match has_friction {
        true => FeasibleSet::with_discs(lower.clone(), discs),
        false => FeasibleSet::above(lower.clone()),
    };
    let (mut x, mut radii) = (vec![0.0; b.len()], slides.radii(start));
    let (mut statistics, mut first_norm) = (Statistics::default(), None);
    let mut now = Limits { drop: if has_friction { limits.drop.max(LOOSE) } else { limits.drop }, ..limits };
    let mut outcome = Outcome::LimitReached;
    for _ in 0..PROGRAMS {
        slides.carry(start, &mut x, &radii);
        now.products = limits.products.saturating_sub(statistics.hessian);
        let solution = smalse::solve(
            smalse::Problem { space, function: &mut *function, b, set: &set(slides.around(start, &radii)) },
            &smalse::Settings { limits: now, norm },
            smalse::Start { x, multiplier },
        );
        let first_norm = *first_norm.get_or_insert(solution.first_norm);
        statistics += solution.statistics;
        x = solution.x;
        let lambda: Vec<f64> = start.iter().zip(&x).map(|(s, x)| s + x).collect();
        slides.settle(&lambda, &radii);
        if !has_friction || solution.outcome != Outcome::Converged {
            outcome = solution.outcome;
            break;
        }
        let target = limits.target(first_norm);
        let next = slides.radii(&lambda);
        let change = space.norm(&slides.change(&radii, &next, lambda.len()));
        if change.max(solution.gradient_norm).max(norm * solution.defect_norm) <= target {
            outcome = Outcome::Converged;
            break;
        }
        (radii, multiplier) = (next, Some(solution.multiplier));
        let absolute = target.max(LOOSE * now.target(solution.first_norm));
        now = Limits { absolute, drop: 0.0, relative: 0.0, ..now };
    }
    Found { x, first_norm: first_norm.unwrap_or(f64::NAN), outcome, statistics }
}
