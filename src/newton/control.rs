//! Loads that follow the work they do: indirect control by compliance.
//!
//! ```text
//! f = f_0 + zeta f_1   with   f_1'u = alpha
//! ```
//!
//! Bodies without hardening bear `f_1` up to a limit factor. Up to there displacements follow from `zeta`; beyond it nothing does. For
//! the work `alpha` there is an equilibrium each time, whose `zeta` rises with it to the limit (Cermak, Haslinger, Kozubek and
//! Sysala, ZAMM 95 (2015), 1348-1371). A Newton step has two parts: the step `du` under the present loads, and the response `v` of
//! its tangents to `f_1`:
//!
//! ```text
//! d zeta = (alpha - f_1'(u + du)) / f_1'v,   du + d zeta v
//! ```
//!
//! The second part takes the contacts as the first left them; the next step corrects them. Where bodies flow `v` is a mechanism.

use std::mem::take;

use serde::{Deserialize, Serialize};

use super::outcome::Outcome;
use super::path::At;
use super::problem::{State, TornProblem};
use super::response::Response;
use super::step::{Step, StepSolver};
use crate::assembly::dissipation;
use crate::feti::Torn;
use crate::material::{Law, Material};
use crate::monitor::timing::Timer;
use crate::vector::dot;

/// The first work is that of [`strength`], on an elastic body, times this.
const FIRST: f64 = 6.0;
/// Loads are lowered before the first step if they are so many times what is wanted: their displacement is no more exact than that.
const FAR: f64 = 100.0;
/// A step leaves so much of the factor at least, but for the first, which chooses the work.
const LEFT: f64 = 0.1;
/// What tangents are of the elastic stiffness at least: a mechanism is not free then, and what holds it tells how far it goes.
const LEAST: f64 = 1e-4;
/// Steps are up to so many times those that such tangents tell.
pub const LONGEST: f64 = 64.0;

/// Where the loads are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// `alpha` (energy); `None` until the first step has told a good one.
    pub work: Option<f64>,
    /// What it is without `f_1`, as the first step told: overlaps and loads that stay may do as much, of any sign.
    pub rest: f64,
    /// `zeta`.
    pub factor: f64,
    /// How often `alpha` was chosen.
    pub number: usize,
    /// What the response of the last step's tangents is as a mechanism: an upper bound of the limit factor.
    pub upper: Option<f64>,
}

impl Reach {
    /// Where loads of this factor do this work, if one is known, and without them the work of `rest`.
    pub fn at(work: Option<f64>, rest: f64, factor: f64) -> Self {
        Self { work, rest, factor, number: 1, upper: None }
    }
}

/// The loads, and where they are.
#[derive(Clone)]
pub struct Control {
    /// `f_0`, torn (force).
    permanent: Torn,
    /// `f_1`, torn (force).
    along: Torn,
    /// Where they are.
    pub reach: Reach,
}

impl Control {
    /// From the loads `f_0 + f_1` that are at hand: `zeta` is 1, or what it was `before`.
    pub fn new(loads: &Torn, along: Torn, before: Option<Reach>) -> Self {
        let mut permanent = loads.clone();
        add(-1.0, &along, &mut permanent);
        Self { permanent, along, reach: before.unwrap_or(Reach::at(None, 0.0, 1.0)) }
    }

    /// `f_0 + zeta f_1`.
    pub fn loads(&self) -> Torn {
        let mut loads = self.permanent.clone();
        add(self.reach.factor, &self.along, &mut loads);
        loads
    }

    /// Where it stands, in the words of a path: equilibria are its increments, and times their numbers.
    pub fn at(&self) -> At {
        let number = self.reach.number;
        At { stage: 0, increment: number, number, fraction: number as f64, halvings: 0 }
    }

    /// `f_1'u` of each displacement. One collective.
    pub fn works<const N: usize>(&self, problem: &TornProblem, displacements: [&Torn; N]) -> Vec<f64> {
        let of = |own: usize| displacements.map(|u| dot(&self.along[own], &u[own]));
        problem.space.sum((0..self.along.len()).map(of).collect::<Vec<_>>().as_flattened(), N)
    }

    /// The upper bound of the limit factor by a mechanism ([`super::limit`]), with the stress at `u`; `None` if loads do no work on it.
    /// Collective.
    pub fn upper(&self, problem: &TornProblem, u: &Torn, mut mechanism: Torn) -> Option<f64> {
        let v = &mut mechanism;
        problem.make_admissible_velocity(v);
        let along = self.works(problem, [v])[0];
        let of =
            |own: usize| dissipation::most(&problem.region(own), &u[own], &v[own]) - dot(&self.permanent[own], &v[own]);
        let taken = problem.space.sum(&(0..v.len()).map(of).collect::<Vec<_>>(), 1)[0];
        Some(taken / along).filter(|upper| along > 0.0 && upper.is_finite())
    }

    /// Changes `zeta`, with the loads of the problem and the energies at a displacement that does the work `before`.
    fn change(&mut self, problem: &mut TornProblem, change: f64, before: f64, state: &mut State) {
        self.reach.factor += change;
        problem.loads = self.loads();
        state.external_work += change * before;
        state.energy -= change * before;
    }

    /// Completes a step at `u` under the present loads, whose gradient was reduced by `drop`. Returns whether it is one: if loads were much
    /// too large, they are lowered with its multipliers, and it is to be solved again. Collective.
    ///
    /// # Errors
    /// The outcome of the iteration, if there is no response to go along.
    pub fn steer(
        &mut self,
        problem: &mut TornProblem,
        solver: &mut StepSolver,
        (u, state): (&Torn, &mut State),
        (step, drop): (&mut Step, f64),
        timer: &Timer,
    ) -> Result<bool, Outcome> {
        let (directions, closed) = (take(&mut step.directions), vec![0.0; step.lambda.len()]);
        let Response { v, lambda, outcome, statistics, applications } =
            solver.response(problem, (&self.along, &closed), drop, directions, timer);
        step.statistics += statistics;
        step.applications += applications;
        Outcome::of_program(outcome)?;
        let [compliance, before, added] = self.works(problem, [&v, u, &step.du])[..] else { unreachable!() };
        let (work, least) = match self.reach.work {
            Some(work) => (work, (LEFT - 1.0) * self.reach.factor),
            // From where the body is without `f_1`; loads of the scene may be of any size.
            None => {
                let (wanted, factor) = (FIRST * strength(problem, &v), self.reach.factor);
                if FAR * wanted < factor {
                    self.change(problem, wanted - factor, before, state);
                    step.lambda.iter_mut().for_each(|l| *l *= wanted / factor);
                    return Ok(false);
                }
                self.reach.rest = before + added - factor * compliance;
                (self.reach.rest + wanted * compliance, f64::NEG_INFINITY)
            }
        };
        self.reach.work = Some(work);
        if !(compliance > 0.0 && work.is_finite()) {
            return Err(Outcome::Idle);
        }
        let change = (work - before - added) / compliance;
        self.reach.upper = self.upper(problem, u, v.clone());
        add(change, &v, &mut step.du);
        step.lambda.iter_mut().zip(&lambda).for_each(|(l, of_v)| *l += change * of_v);
        problem.laws().project(&mut step.lambda);
        // Displacements need this change. Loads only tell where the next step goes from, and turned round they leave contacts unheld.
        self.change(problem, change.max(least), before, state);
        step.is_exact = false;
        Ok(true)
    }
}

/// A factor of loads with the elastic response `v`: where stresses are their limit on average, those that do more work count more. Not
/// a number where no stress is limited. One collective.
fn strength(problem: &TornProblem, v: &Torn) -> f64 {
    let of = |own: usize| dissipation::use_of_strength(&problem.region(own), &v[own]);
    let sums = problem.space.sum((0..v.len()).map(of).collect::<Vec<_>>().as_flattened(), 2);
    sums[0] / sums[1]
}

/// Materials as tangents take them near a limit.
pub(super) fn firm(materials: &[Material]) -> Vec<Material> {
    materials.iter().map(|material| material.firmer(LEAST)).collect()
}

/// `y += a x`.
pub(super) fn add(a: f64, x: &Torn, y: &mut Torn) {
    y.iter_mut().zip(x).for_each(|(y, x)| y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x));
}
