//! The linear response of the tangents at hand to other forces and openings:
//!
//! ```text
//! min 1/2 v'K_k v - g'v   over   B v = c in the rows that the last program kept,
//! ```
//!
//! with its multipliers. The factors of the last step serve again, and so do the directions of its program: these are conjugate in
//! `F`, so that what the solution has along them costs no application of it.

use super::dual::Dual;
use super::forcing::TIGHTEST;
use super::iteration::Newton;
use super::problem::TornProblem;
use super::solution::Rest;
use super::step::{Recovered, StepSolver};
use crate::feti::Torn;
use crate::feti::coarse::recover;
use crate::monitor::timing::Timer;
use crate::qp::pcpg::Directions;
use crate::qp::{Limits, Outcome, Statistics};

/// Share of a gradient that its rigid motions may leave by rounding.
const ROUNDING: f64 = 1e-7;

/// A response.
pub struct Response {
    /// Torn displacement.
    pub v: Torn,
    /// Multipliers of this rank's rows.
    pub lambda: Vec<f64>,
    /// How its program ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
    /// Applications of F.
    pub applications: usize,
}

impl StepSolver<'_> {
    /// The response to the forces `g` (force, torn) and to right-hand sides `c` of the rows. Its program reduces its gradient by the
    /// factor `drop`; `known` are directions of the last program. Collective.
    pub fn response(
        &mut self,
        problem: &TornProblem,
        (g, c): (&Torn, &[f64]),
        drop: f64,
        known: Directions,
        timer: &Timer,
    ) -> Response {
        let before = self.operator.applications();
        let rows = problem.gather.rows();
        let (mut forces, mut open) = (g.clone(), c.to_vec());
        let lifted = self.operator.lift(problem.constraints, &mut forces, &mut open);
        let e = recover::resultants(problem.subdomains, problem.modes, &self.coarse, &forces);
        let lambda = self.programs.start(&self.coarse, &vec![0.0; rows], &e);
        let mut residual = vec![0.0; rows];
        self.respond(&lambda, &mut forces.clone(), &mut residual, timer);
        residual.iter_mut().zip(&open).for_each(|(r, c)| *r -= c);

        // What rigid motions close leaves nothing but rounding.
        let absolute = ROUNDING * problem.space.dots(&[(&residual, &residual)])[0].sqrt();
        let limits = Limits {
            relative: drop,
            reference: None,
            absolute,
            rounding: 0.0,
            drop: 0.0,
            products: self.programs.products(),
        };
        let dual = Dual {
            operator: &mut self.operator,
            coarse: &self.coarse,
            preconditioner: self.preconditioner.as_mut(),
            space: problem.space,
            timer,
            alive: &|_| {},
        };
        let mut found = self.programs.on_face((problem, dual, &e), Rest::new(lambda, residual), Some(known), limits);
        let Recovered { mut du, refined, .. } =
            self.recover(problem, (&forces, &open), &mut found, drop.max(TIGHTEST), timer);
        for (du, lifted) in du.iter_mut().flatten().zip(lifted.iter().flatten().flatten()) {
            *du += lifted;
        }
        if let (Some(preconditioner), Some(face)) = (&mut self.preconditioner, self.programs.face()) {
            // Rows that are not kept may open or close.
            let kept = face.kept();
            let mut defect = vec![0.0; rows];
            problem.gather.apply(&du, &mut defect);
            let left = |d: f64, c: f64, kept: bool| if kept { c - d } else { 0.0 };
            defect.iter_mut().zip(c).zip(kept).for_each(|((d, c), kept)| *d = left(*d, *c, *kept));
            timer.time("scaling", || preconditioner.restrict(problem.constraints, |row| kept[row]));
            timer.time("preconditioner", || preconditioner.mend(&defect, &mut du));
        }
        let applications = self.operator.applications() - before + refined;
        Response { v: du, lambda: found.lambda, outcome: found.outcome, statistics: found.statistics, applications }
    }
}

impl Newton<'_> {
    /// The response of the tangents of the last step, on the rows that are kept where it ended, to forces `g` (force, torn) and
    /// right-hand sides `c` of the rows. Collective.
    pub fn response(&mut self, (g, c): (&Torn, &[f64]), drop: f64, timer: &Timer) -> Response {
        self.solver.response(&self.problem, (g, c), drop, Directions::default(), timer)
    }
}
