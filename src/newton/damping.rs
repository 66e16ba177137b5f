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

/// What is minimised: `J`, and what friction with these radii dissipates.
struct Cost<'p, 'a> {
    problem: &'p TornProblem<'a>,
    radii: &'p Radii,
}

impl Cost<'_, '_> {
    /// The slack of a displacement; nothing without friction, where nobody asks for it.
    fn slack(&self, u: &Torn) -> Vec<f64> {
        if self.problem.constraints.has_friction { self.problem.slack(u) } else { Vec::new() }
    }

    /// At a displacement with this slack.
    fn of(&self, state: &State, slack: &[f64]) -> f64 {
        state.energy + self.problem.dissipation(self.radii, slack)
    }

    /// Its slope there along `du`.
    fn slope(&self, state: &State, slack: &[f64], du: &Torn) -> f64 {
        let slope = self.problem.slope(state, du);
        if !self.problem.constraints.has_friction {
            return slope;
        }
        let mut change = vec![0.0; self.problem.gather.rows()];
        self.problem.gather.apply(du, &mut change);
        slope + self.problem.dissipation_slope(self.radii, slack, &change)
    }
}

/// The accepted step.
pub struct Damped {
    /// The new displacement, admissible.
    pub u: Torn,
    /// The problem there.
    pub state: State,
    /// Step length, 1 for the full step.
    pub length: f64,
}

/// Searches from `u` along `du`, with these radii of friction, for a length up to the `longest`, which is at least 1. Where `u` is not `admissible` the energies cannot be compared and the
/// full step is taken.
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
    let cost = Cost { problem, radii };
    let trial = |length: f64| {
        timer.time("internal forces", || {
            let mut v = u.clone();
            for (v, d) in v.iter_mut().zip(du) {
                v.iter_mut().zip(d).for_each(|(v, d)| *v += length * d);
            }
            problem.make_admissible(&mut v);
            let state = problem.evaluate(&v);
            Damped { u: v, state, length }
        })
    };
    let full = trial(1.0);
    if !admissible {
        return Ok(full);
    }
    let slack = cost.slack(u);
    let (first_slope, before) = (cost.slope(state, &slack, du), cost.of(state, &slack));
    // Round-off in the difference of two energies.
    let cancelled = ROUNDING * full.state.terms.energy.sqrt();
    let noise = 1e-12
        * (state.internal_energy.abs() + full.state.internal_energy.abs() + full.state.external_work.abs())
        + cancelled * (cancelled + 2.0 * state.internal_energy.abs().sqrt());
    let lowers = |t: &Damped, slack: &[f64]| {
        cost.of(&t.state, slack) <= before + SUFFICIENT * t.length * first_slope.min(0.0) + noise
    };
    let slack = cost.slack(&full.u);
    if lowers(&full, &slack) {
        return Ok(lengthened(&cost, (full, slack), (du, first_slope.min(0.0), longest), trial));
    }
    // Illinois: the slope changes its sign between low and high, (length, slope) each.
    let mut low = (0.0, first_slope);
    let mut high = (1.0, cost.slope(&full.state, &slack, du));
    for _ in 0..TRIALS {
        let inside = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let length = if inside > low.0 && inside < high.0 { inside } else { 0.5 * (low.0 + high.0) };
        let next = trial(length);
        let slack = cost.slack(&next.u);
        let slope = cost.slope(&next.state, &slack, du);
        if lowers(&next, &slack) && slope.abs() <= FLAT * first_slope.abs() {
            return Ok(next);
        }
        if slope.is_nan() {
            return Err(Box::new(full));
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

/// The step doubled as long as its cost falls, more than [`STEEP`] times as fast as at first; with its slack.
fn lengthened(
    cost: &Cost,
    (mut best, mut slack): (Damped, Vec<f64>),
    (du, first_slope, longest): (&Torn, f64, f64),
    trial: impl Fn(f64) -> Damped,
) -> Damped {
    while 2.0 * best.length <= longest && cost.slope(&best.state, &slack, du) < STEEP * first_slope {
        let next = trial(2.0 * best.length);
        let beyond = cost.slack(&next.u);
        if cost.of(&next.state, &beyond) >= cost.of(&best.state, &slack) {
            break;
        }
        (best, slack) = (next, beyond);
    }
    best
}
