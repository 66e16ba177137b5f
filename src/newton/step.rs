//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.
//!
//! The dual is `min 1/2 l'F l - l'd` over `l_I >= 0`, `G l = e` with `e = R'f_k`, `d = B K^+ f_k - c_k` (paper, section 4).
//! It is shifted by the last step's multipliers `l0`, corrected so that `G l0 = e`: what is left is homogeneous, starts at
//! zero and its right-hand side `B K^+ (f_k - B'l0) - c_k` costs one application of F.

use super::dual::{Balanced, Flexibility, Multipliers};
use super::problem::{State, TornProblem};
use super::recover;
use crate::assembly::stiffness;
use crate::feti::Torn;
use crate::feti::operator::DualOperator;
use crate::feti::projector::Projector;
use crate::monitor::timing::Timer;
use crate::qp::bounds::Bounds;
use crate::qp::mprgp::Expansion;
use crate::qp::quadratic::{Projection, Space};
use crate::qp::{Limits, Outcome, Statistics, pcpg, power, smalse};

/// How to solve the quadratic programs.
#[derive(Clone, Copy, Debug)]
pub struct StepSettings {
    /// Tolerance relative to the first step's right-hand side, which measures the whole displacement.
    pub tolerance: f64,
    /// Products with the Hessian that one program may take.
    pub products: usize,
    /// Step of MPRGP into bounds.
    pub expansion: Expansion,
}

/// Result of one step.
pub struct Step {
    /// Increment of the displacement.
    pub du: Torn,
    /// Multipliers.
    pub lambda: Vec<f64>,
    /// How the quadratic program ended.
    pub outcome: Outcome,
    /// What it took.
    pub statistics: Statistics,
    /// Applications of F, those around the quadratic program included.
    pub applications: usize,
    /// Subdomains factorised, over all ranks.
    pub factorisations: usize,
}

/// What is kept from step to step: factors, projector, multipliers.
pub struct StepSolver<'a> {
    operator: DualOperator<'a>,
    projector: Projector<'a>,
    settings: StepSettings,
    /// Lower values of each own subdomain's tangent, and how many of its elements yield (none before the first step).
    tangents: Vec<(Vec<f64>, Option<usize>)>,
    lambda: Option<Vec<f64>>,
    reference: Option<f64>,
 norm: Option<f64>,
}

impl<'a> StepSolver<'a> {
    /// On factors and a projector set up for the problem's subdomains.
    pub fn new(operator: DualOperator<'a>, projector: Projector<'a>, settings: StepSettings, own: usize) -> Self {
        Self {
            operator,
            projector,
            settings,
            tangents: vec![(Vec::new(), None); own],
            lambda: None,
            reference: None,
 norm: None,
        }
    }

    /// Solves for the step at `u`. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent or the coarse problem is singular.
    pub fn solve(&mut self, problem: &TornProblem, u: &Torn, state: &State, timer: &Timer) -> Result<Step, String> {
        let before = self.operator.applications();
        let factorisations = self.update_tangents(problem, u, timer)?;
        let rows = problem.gather.rows();

        let mut forces = problem.loads.clone();
        for (f, internal) in forces.iter_mut().zip(&state.forces) {
            f.iter_mut().zip(internal).for_each(|(f, i)| *f -= i);
        }
        let start = timer.time("coarse problem", || self.balanced_start(problem, &forces));
        let slack = problem.slack(u);
        let mut b = vec![0.0; rows];
        let mut torn = forces.clone();
        timer.time("dual operator", || self.operator.respond(&start, &mut torn, &mut b));
        b.iter_mut().zip(&slack).for_each(|(b, s)| *b -= s);

        let (x, outcome, statistics) = self.solve_dual(problem, &start, &b, timer);
        let lambda: Vec<f64> = start.iter().zip(&x).map(|(s, x)| s + x).collect();

        let mut balanced = x;
        Balanced(&mut self.projector, timer).project(&mut balanced);
        balanced.iter_mut().zip(&start).for_each(|(x, s)| *x += s);
        let mut du = forces;
        let mut defect = vec![0.0; rows];
        timer.time("dual operator", || self.operator.respond(&balanced, &mut du, &mut defect));
        defect.iter_mut().zip(&slack).for_each(|(d, s)| *d = s - *d);
        let kept: Vec<bool> =
            problem.constraints.rows.iter().zip(&lambda).map(|(row, &l)| !row.is_inequality() || l > 0.0).collect();
        timer
            .time("coarse problem", || {
                recover::add_rigid_motion(problem, &self.projector.coarse, &kept, &defect, &mut du)
            })
            .map_err(|floating| floating.to_string())?;
        self.lambda = Some(lambda.clone());
        let applications = self.operator.applications() - before;
        Ok(Step { du, lambda, outcome, statistics, applications, factorisations })
    }

    /// Multipliers with `G l = e` next to the last ones: the smallest such if there are none.
    fn balanced_start(&self, problem: &TornProblem, forces: &Torn) -> Vec<f64> {
        let coarse = &self.projector.coarse;
        let mut mine = Vec::new();
        for ((subdomain, modes), f) in problem.subdomains.iter().zip(problem.modes).zip(forces) {
            mine.extend(modes.resultants(&subdomain.points, f));
        }
        let mut imbalance = coarse.share(&mine);
        let mut start = self.lambda.clone().unwrap_or_else(|| vec![0.0; problem.gather.rows()]);
        let balance = coarse.apply(&start);
        imbalance.iter_mut().zip(balance).for_each(|(e, b)| *e -= b);
        coarse.solve(&mut imbalance);
        coarse.add_transpose(1.0, &imbalance, &mut start);
        if self.lambda.is_some() {
            // The correction was round-off or the last tolerance: it must not push contact forces below zero.
            for (l, _) in start.iter_mut().zip(&problem.constraints.rows).filter(|(_, row)| row.is_inequality()) {
                *l = l.max(0.0);
            }
        }
        start
    }

    /// Assembles the tangents at `u` and factorises those that changed; returns how many, over all ranks.
    fn update_tangents(&mut self, problem: &TornProblem, u: &Torn, timer: &Timer) -> Result<usize, String> {
        let mut failure: Option<(usize, String)> = None;
        let mut factorised = Vec::with_capacity(u.len());
        for (own, subdomain) in problem.subdomains.iter().enumerate() {
            let pattern = &self.operator.factors.symbolic(own).pattern;
            let (values, yielding) = &mut self.tangents[own];
            values.resize(pattern.rows.len(), 0.0);
            let material = &problem.materials[own];
            // An elastic tangent that was elastic before is the same matrix.
            let plastic = timer.time("assembly", || stiffness::assemble(subdomain, material, &u[own], pattern, values));
            let unchanged = *yielding == Some(0) && plastic == 0;
            *yielding = Some(plastic);
            factorised.push(f64::from(!unchanged));
            if unchanged || failure.is_some() {
                continue;
            }
            let outcome =
                timer.time("factorisation", || self.operator.factors.factorise(own, subdomain, &self.tangents[own].0));
            if let Err(error) = outcome {
                failure = Some((subdomain.id, error.to_string()));
            }
        }
        // The lowest failing subdomain speaks; ranks that see no failure repeat its number.
        let failed = failure.as_ref().map_or(f64::NEG_INFINITY, |(id, _)| -(*id as f64));
        let lowest = problem.space.maximum(failed);
        if lowest > f64::NEG_INFINITY {
            let own = failure.filter(|(id, _)| -(*id as f64) == lowest).map(|(_, message)| message);
            return Err(own.unwrap_or_else(|| format!("subdomain {}: the stiffness matrix is not positive definite", -lowest)));
        }
        Ok(problem.space.sum(&factorised, 1)[0] as usize)
    }

    /// Solves the shifted program from zero.
    fn solve_dual(
        &mut self,
        problem: &TornProblem,
        start: &[f64],
        b: &[f64],
        timer: &Timer,
    ) -> (Vec<f64>, Outcome, Statistics) {
        let space = Multipliers(problem.space, timer);
        let mut operator = Flexibility(&mut self.operator, timer);
        let mut projection = Balanced(&mut self.projector, timer);
        let mut projected = b.to_vec();
        projection.project(&mut projected);
        let size = space.norm(&projected);
        let reference = *self.reference.get_or_insert(size);
        let limits = Limits {
            relative: self.settings.tolerance,
            reference: Some(reference),
            absolute: size * std::env::var("ETA").map_or(0.0, |s| s.parse().unwrap()),
            products: self.settings.products,
        };
        let mut x = vec![0.0; b.len()];
        if size == 0.0 {
            return (x, Outcome::Converged, Statistics::default());
        }
        if problem.constraints.has_inequalities {
            if self.norm.is_none() || std::env::var("RENORM").is_ok() {
            let Some(estimate) = power::norm(&space, &mut operator, &mut projection, &projected) else {
                return (x, Outcome::NotFinite, Statistics::default());
            };
            self.norm = Some(estimate.norm);
            println!("norm {} {}", estimate.norm, estimate.products);
            }
            let estimate = power::Estimate { norm: self.norm.unwrap(), products: 0 };
            let lower = problem
                .constraints
                .rows
                .iter()
                .zip(start)
                .map(|(row, l)| if row.is_inequality() { -l } else { f64::NEG_INFINITY })
                .collect();
            let solution = smalse::solve(
                smalse::Problem {
                    space: &space,
                    operator: &mut operator,
                    projection: &mut projection,
                    preconditioner: None,
                    b: &projected,
                    bounds: &Bounds::new(lower),
                },
                &smalse::Settings { limits, norm: estimate.norm, expansion: self.settings.expansion },
                smalse::Start { x, multiplier: None },
            );
            let mut statistics = solution.statistics;
            statistics.hessian += estimate.products;
            (solution.x, solution.outcome, statistics)
        } else {
            let report =
                pcpg::solve(&space, &mut operator, &mut projection, None, &mut x, &mut projected, &limits);
            (x, report.outcome, report.statistics)
        }
    }
}
