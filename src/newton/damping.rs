//! Step length along the Newton direction by the energy `J`.
//!
//! The full step is taken where it lowers `J` enough. Otherwise the slope of the convex function `J(u + t du)` is
//! brought near zero by regula falsi (Illinois variant), which the convexity makes safe. With friction that is `J` and what friction
//! dissipates, with the radii of the new multipliers ([`super::friction`]).
//!
//! Tangents that are stiffer than the body ([`super::control`]) tell of steps that are too short. There the step is doubled as long as
//! `J` falls at more than 0.8 of its first slope.

use super::friction::Radii;
use super::problem::{State, TornProblem};
use crate::feti::Torn;
use crate::monitor::timing::Timer;

/// Share of the first-order decrease that is asked for (Armijo; Nocedal and Wright 2006, chapter 3).
const SUFFICIENT: f64 = 1e-4;
/// The slope is near zero when it is below this share of its first value.
const FLAT: f64 = 0.1;
/// A step ends too early where the slope is above this share of its first value.
const STEEP: f64 = 0.8;
/// Relative error of strains that are sums of cancelling terms.
const ROUNDING: f64 = 1e-15;
/// Evaluations of `J` before the direction is given up.
const TRIALS: usize = 30;

/// The accepted step.
pub struct Damped {
    /// The new displacement, admissible.
    pub u: Torn,
    /// The problem there.
    pub state: State,
    /// Step length, 1 for the full step.
    pub length: f64,
}

/// Searches from `u` along `du`, with these radii of friction, for a length up to the `longest`, which is at least 1. Where `u` is not
/// `admissible` the energies cannot be compared and the full step is taken.
///
/// # Errors
/// The full step if no length lowers the energy.
pub fn search(
    problem: &TornProblem,
    (u, state): (&Torn, &State),
    (du, radii, longest): (&Torn, &Radii, f64),
    admissible: bool,
    timer: &Timer,
) -> Result<Damped, Box<Damped>> {
    let line = Line { problem, radii, u, du, timer };
    let full = line.at(1.0);
    if !admissible {
        return Ok(full.step);
    }
    let slack = line.slack(u);
    let (before, first_slope) = (line.cost(state, &slack), line.slope(state, &slack));
    let noise = noise(state, &full.step.state);
    let lowers = |point: &Point| point.cost <= before + SUFFICIENT * point.step.length * first_slope.min(0.0) + noise;
    if lowers(&full) {
        Ok(line.lengthened(full, first_slope.min(0.0), longest))
    } else {
        line.shortened(full, first_slope, lowers)
    }
}

/// Round-off in the difference of two energies.
fn noise(one: &State, other: &State) -> f64 {
    let cancelled = ROUNDING * other.terms.energy.sqrt();
    1e-12 * (one.internal_energy.abs() + other.internal_energy.abs() + one.external_work.abs())
        + cancelled * (cancelled + 2.0 * one.internal_energy.abs().sqrt())
}

/// The line `u + t du`, and what is minimised on it: `J`, and what friction with these radii dissipates.
struct Line<'s, 'a> {
    problem: &'s TornProblem<'a>,
    radii: &'s Radii,
    u: &'s Torn,
    du: &'s Torn,
    timer: &'s Timer,
}

/// A point of it.
struct Point {
    step: Damped,
    slack: Vec<f64>,
    cost: f64,
}

impl Line<'_, '_> {
    /// The point of this length. Collective.
    fn at(&self, length: f64) -> Point {
        let step = self.timer.time("internal forces", || {
            let mut u = self.u.clone();
            for (u, du) in u.iter_mut().flatten().zip(self.du.iter().flatten()) {
                *u += length * du;
            }
            self.problem.make_admissible(&mut u);
            let state = self.problem.evaluate(&u);
            Damped { u, state, length }
        });
        let slack = self.slack(&step.u);
        Point { cost: self.cost(&step.state, &slack), step, slack }
    }

    /// The slack of a displacement; nothing without friction, where nobody asks for it.
    fn slack(&self, u: &Torn) -> Vec<f64> {
        if self.problem.constraints.has_friction { self.problem.slack(u) } else { Vec::new() }
    }

    fn cost(&self, state: &State, slack: &[f64]) -> f64 {
        state.energy + self.problem.dissipation(self.radii, slack)
    }

    /// Derivative of the cost by the length.
    fn slope(&self, state: &State, slack: &[f64]) -> f64 {
        let slope = self.problem.slope(state, self.du);
        if !self.problem.constraints.has_friction {
            return slope;
        }
        let mut change = vec![0.0; self.problem.gather.rows()];
        self.problem.gather.apply(self.du, &mut change);
        slope + self.problem.dissipation_slope(self.radii, slack, &change)
    }

    /// The step doubled as long as its cost falls, more than [`STEEP`] times as fast as at first.
    fn lengthened(&self, mut best: Point, first_slope: f64, longest: f64) -> Damped {
        while 2.0 * best.step.length <= longest && self.slope(&best.step.state, &best.slack) < STEEP * first_slope {
            let next = self.at(2.0 * best.step.length);
            if next.cost >= best.cost {
                break;
            }
            best = next;
        }
        best.step
    }

    /// A shorter step than the full one, where the cost is flat: regula falsi, Illinois variant.
    fn shortened(
        &self,
        Point { step: full, slack, .. }: Point,
        first_slope: f64,
        lowers: impl Fn(&Point) -> bool,
    ) -> Result<Damped, Box<Damped>> {
        // Length and slope, which changes its sign between low and high.
        let (mut low, mut high) = ((0.0, first_slope), (1.0, self.slope(&full.state, &slack)));
        for _ in 0..TRIALS {
            let inside = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
            let length = if inside > low.0 && inside < high.0 { inside } else { 0.5 * (low.0 + high.0) };
            let next = self.at(length);
            let slope = self.slope(&next.step.state, &next.slack);
            if lowers(&next) && slope.abs() <= FLAT * first_slope.abs() {
                return Ok(next.step);
            }
            if slope.is_nan() {
                break;
            }
            if slope < 0.0 {
                low = (length, slope);
                high.1 *= 0.5;
            } else {
                high = (length, slope);
                low.1 *= 0.5;
            }
        }
        Err(Box::new(full))
    }
}
