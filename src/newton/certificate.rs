//! How far a displacement is from the minimum of `J` on its mesh: a bound from the duality gap.
//!
//! For any torn `v` and any `lambda` with `lambda_I >= 0`, `R'(f - B'lambda) = 0`, weak duality and the strong convexity of
//! `Psi` on each subdomain (`r` times the elastic energy, [`crate::material::Material::least_tangent`]) give, with the forces
//! `rho = f - B'lambda - F(v)` that are not in equilibrium,
//!
//! ```text
//! min J >= inf_w Psi(w) - f'w + lambda'(B w - c) >= Psi(v) - f'v + lambda'(B v - c) - sum_s rho_s'K_e,s^+ rho_s / 2 r_s.
//! ```
//!
//! Subtracted from `J(u)` of an admissible `u`, that is
//!
//! ```text
//! J(u) - min J <= gap = lambda_I'(c - B u)_I  +  [Psi(u) - Psi(v) - F(v)'(u - v)]  +  max(0, rho'(v - u))
//!                       +  sum_s rho_s'K_s^+ rho_s / 2 r_s
//! ```
//!
//! where every term is positive and is computed without cancellation, and where `K_s` may be any tangent, as tangents are at
//! most `K_e` and so `K_e^+` is at most `K_s^+` on forces in balance. (Where supports hold a subdomain still,
//! [`crate::feti::inverse::pins`], `w` is taken among those that they allow, which gives no less.) We start from `v = u`, where only the first and the last
//! are not zero, and let `v = v + K^+ rho`: Newton's method for the torn bodies under the forces `lambda`, whose `rho` vanishes
//! quadratically, so that the gap tends to the true duality gap of `u` and `lambda`. In linear elasticity (`r = 1`, `K = K_e`)
//! the first value is that already. Each turn costs one `K^+` and no conjugate gradients; there are four at most, and the least
//! value counts.
//!
//! With friction `J` has the term `sum r |s|` and the gap `sum (r |s| - lambda_t's)`, which is not negative where `|lambda_t| <= r`
//! ([`super::friction`]). Under Coulomb's law that is the bound for the program with the radii `r` of the multipliers; whether these are
//! the right ones the residual of friction tells.
//!
//! The gap bounds the error of the stress without a constant, and that of the displacement with one:
//!
//! ```text
//! int (sigma - sigma_min) : C^-1 : (sigma - sigma_min) <= 2 gap,      r |u - u_min|_e^2 <= 2 gap,   r the least of all bodies
//! ```
//!
//! as `J(u) - min J >= Psi(u) - Psi(u_min) - F(u_min)'(u - u_min)`, see [`crate::material::von_mises`]. Under perfect
//! plasticity `r = 0`: what is left of `rho` is weighted as if the tangent stayed, and the value is an estimate. All is up to
//! rounding: of `B u`, and of the factors, for which a hundredth is added.

use super::StepSolver;
use super::problem::{State, TornProblem};
use crate::assembly::internal;
use crate::feti::Torn;
use crate::feti::coarse::face::CoarseFace;
use crate::feti::coarse::recover;
use crate::material::Law;
use crate::monitor::timing::Timer;
use crate::vector::dot;

/// Turns of Newton's method for the torn bodies.
const TURNS: usize = 4;
/// It ends when perfect knowledge of `r` could lower the bound by no more than this share.
const SHARP: f64 = 0.05;
/// Or when the bound is so many times less than what is wanted, or what perfect knowledge of `r` could make of it so many times more:
/// turns lowered that by 2.3 at most.
const CLEAR: f64 = 5.0;
/// Relative error of `rho'K^+ rho`: ten times what a factor in single precision may fail its probe by.
const FACTORS: f64 = 0.01;
/// Contact forces below this share of the largest, and forces out of balance below this share of all, are rounding.
const ROUNDING: f64 = 1e-12;
/// Attempts to find multipliers that are admissible and in balance.
const BALANCINGS: usize = 10;

/// A bound on `J(u) - min J`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate {
    /// The bound (energy).
    pub gap: f64,
    /// Whether it is one: with hardening, or without plastic material.
    pub is_bound: bool,
    /// Applications of `K^+` that it took.
    pub solves: usize,
}

impl Certificate {
    /// Bound on the error of the stress, `sqrt(int (sigma - sigma_min) : C^-1 : (sigma - sigma_min))` (root of energy).
    pub fn stress_error(&self) -> f64 {
        (2.0 * self.gap).sqrt()
    }
}

/// The displacement `v` that the bound is computed from, and what belongs to it.
struct Trial {
    /// `v`.
    v: Torn,
    /// `u - v`.
    change: Torn,
    /// `rho = f - B'lambda - F(v)`.
    rho: Torn,
}

impl Trial {
    /// `v = u`.
    fn at(problem: &TornProblem, (u, state): (&Torn, &State), lambda: &[f64]) -> Self {
        let mut rho = problem.unbalance(state);
        problem.gather.add_transpose(-1.0, lambda, &mut rho);
        Self { v: u.clone(), change: problem.gather.zeros(), rho }
    }

    /// For each own subdomain: `Psi(u) - Psi(v) - F(v)'(u - v)` (zero at `v = u`), `rho'(v - u)`, `rho'K^+ rho`, and this over
    /// `r`. `correction` is `K^+ rho`.
    fn terms(&self, problem: &TornProblem, correction: &Torn, is_at_u: bool) -> Vec<f64> {
        let Self { v, change, rho } = self;
        let mut terms = Vec::with_capacity(4 * v.len());
        for (own, region) in problem.regions().iter().enumerate() {
            let moved = if is_at_u { 0.0 } else { internal::divergence(region, &v[own], &change[own]) };
            let worked = -dot(&rho[own], &change[own]);
            let square = (1.0 + FACTORS) * dot(&rho[own], &correction[own]);
            let weighted = if square > 0.0 { square / region.material.least_tangent() } else { 0.0 };
            terms.extend([moved, worked, square, weighted]);
        }
        terms
    }

    /// Goes on to `v + correction`.
    fn advance(&mut self, problem: &TornProblem, lambda: &[f64], correction: &Torn) {
        let Self { v, change, rho } = self;
        for (own, region) in problem.regions().iter().enumerate() {
            v[own].iter_mut().zip(&correction[own]).for_each(|(v, c)| *v += c);
            change[own].iter_mut().zip(&correction[own]).for_each(|(d, c)| *d -= c);
            let mut forces = vec![0.0; v[own].len()];
            internal::add_forces(region, &v[own], &mut forces);
            rho[own].clone_from(&problem.loads[own]);
            rho[own].iter_mut().zip(forces).for_each(|(r, f)| *r -= f);
        }
        problem.gather.add_transpose(-1.0, lambda, rho);
    }
}

impl StepSolver<'_> {
    /// Bounds `J(u) - min J` for an admissible `u`, by the multipliers of the last step and its factors: as sharply as it takes to see
    /// whether the bound is what is `wanted`. Collective.
    pub fn certify(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        lambda: &[f64],
        wanted: Option<f64>,
        timer: &Timer,
    ) -> Certificate {
        // Admissible multipliers that balance the loads on every subdomain.
        let (mut lambda, balanced) = timer.time("coarse problem", || self.equilibrate(problem, lambda));
        if self.operator.is_hybrid() {
            let mut torn = problem.unbalance(state);
            problem.gather.add_transpose(-1.0, &lambda, &mut torn);
            timer.time("certificate", || self.operator.solve(&mut torn));
            self.operator.add_bonds([&mut lambda]);
        }
        // lambda_I'(c - B u)_I, and what friction dissipates.
        let slack = problem.slack(u);
        let open = problem.space.dots(&[(&problem.of_contact(&lambda), &slack)])[0];
        let open = (open + problem.dissipation(&problem.radii(&lambda), &slack)).max(0.0);

        let mut trial = Trial::at(problem, (u, state), &lambda);
        let mut best = Certificate { gap: f64::INFINITY, is_bound: balanced, solves: 0 };
        let mut estimate = f64::INFINITY;
        for solves in 1..=TURNS {
            // The other three terms at v; the last one with r = 1 is the least that knowing r could make of it.
            let mut correction = trial.rho.clone();
            timer.time("certificate", || self.operator.inverse.solve(&mut correction));
            let terms = timer.time("certificate", || trial.terms(problem, &correction, solves == 1));
            let sum = problem.space.sum(&terms, 4);
            let known = open + sum[0] + sum[1].max(0.0);
            let (least, most) = (known + 0.5 * sum[2], known + 0.5 * sum[3]);
            best.solves = solves;
            best.gap = best.gap.min(most);
            estimate = least;
            let is_clear = wanted.is_some_and(|wanted| CLEAR * best.gap <= wanted || least > CLEAR * wanted);
            if most - least <= SHARP * most || is_clear || !least.is_finite() {
                break;
            }
            // v = v + K^+ rho.
            timer.time("certificate", || trial.advance(problem, &lambda, &correction));
        }
        if !best.gap.is_finite() {
            (best.gap, best.is_bound) = (estimate, false);
        }
        best
    }

    /// Admissible multipliers near the given ones that balance the loads on every subdomain (`R'(f - B'lambda) = 0`), and
    /// whether they are both, up to rounding. Alternates between the two conditions.
    fn equilibrate(&self, problem: &TornProblem, lambda: &[f64]) -> (Vec<f64>, bool) {
        let coarse = &self.coarse;
        let wanted = recover::resultants(problem.subdomains, problem.modes, coarse, &problem.loads);
        let laws = problem.laws();
        let largest = |mine: f64| problem.space.maximum(mine);
        let mut lambda = lambda.to_vec();
        for _ in 0..BALANCINGS {
            laws.project(&mut lambda);
            let most = largest(problem.of_contact(&lambda).iter().fold(0.0, |most, l| most.max(l.abs())));
            let missing: Vec<f64> = wanted.iter().zip(coarse.apply(&lambda)).map(|(e, g)| e - g).collect();
            // The equalities balance what they can.
            let face = CoarseFace::loose(coarse, laws.kept(&lambda, ROUNDING * most));
            face.add_balance(coarse, missing, &mut lambda);
            if largest(laws.distance(&lambda)) <= ROUNDING * most {
                let norm = |squares: f64| squares.sqrt();
                let left = norm(wanted.iter().zip(coarse.apply(&lambda)).map(|(e, g)| (e - g).powi(2)).sum());
                let size = norm(problem.space.dots(&[(&lambda, &lambda)])[0]).max(norm(dot(&wanted, &wanted)));
                return (lambda, left <= ROUNDING * size);
            }
        }
        (lambda, false)
    }
}

#[cfg(test)]
mod tests;
