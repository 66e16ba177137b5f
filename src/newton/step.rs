//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.
//!
//! The dual is `min 1/2 l'F l - l'd` over `l_I >= 0`, `G l = e` with `e = R'f_k`, `d = B K^+ f_k - c_k` (paper, section 4).
//! It is shifted by the last step's multipliers `l0`, corrected so that `G l0 = e`: what is left is homogeneous, starts at
//! zero and its right-hand side `B K^+ (f_k - B'l0) - c_k` costs one application of F.

use super::dual::{Dual, Multipliers};
use super::forcing::Forcing;
use super::problem::{State, TornProblem};
use super::recover::{self, CoarseFace};
use crate::assembly::stiffness;
use crate::feti::Torn;
use crate::feti::factor::NotDefinite;
use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::Preconditioner;
use crate::feti::projector::Projector;
use crate::feti::scaling::Scaling;
use crate::monitor::timing::Timer;
use crate::qp::bounds::Bounds;
use crate::qp::mprgp::Expansion;
use crate::qp::pcpg::Pcpg;
use crate::qp::quadratic::Space;
use crate::qp::{Limits, Outcome, Statistics, power, smalse};

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
    /// Whether it was solved to the tolerance of the scene.
    pub at_floor: bool,
    /// Applications of F, those around the quadratic program included.
    pub applications: usize,
    /// Subdomains factorised, over all ranks.
    pub factorisations: usize,
}

/// What is kept from step to step: factors, projector, multipliers.
pub struct StepSolver<'a> {
    operator: DualOperator<'a>,
    projector: Projector<'a>,
    preconditioner: Option<Preconditioner<'a>>,
    settings: StepSettings,
    /// Lower values of each own subdomain's tangent.
    tangents: Vec<Vec<f64>>,
    /// How many elements of each own subdomain yield; none before the first step.
    yielding: Vec<Option<usize>>,
    /// Multipliers of the last step, and the coarse problem of the rows that it held.
    last: Option<(Vec<f64>, CoarseFace)>,
    reference: Option<f64>,
    norm: Option<f64>,
}

impl<'a> StepSolver<'a> {
    /// On factors and a projector set up for the problem's subdomains.
    pub fn new(
        operator: DualOperator<'a>,
        projector: Projector<'a>,
        preconditioner: Option<Preconditioner<'a>>,
        settings: StepSettings,
        own: usize,
    ) -> Self {
        let (tangents, yielding) = (vec![Vec::new(); own], vec![None; own]);
        Self {
            operator,
            projector,
            preconditioner,
            settings,
            tangents,
            yielding,
            last: None,
            reference: None,
            norm: None,
        }
    }

    /// Solves for the step at `u`. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent or the coarse problem is singular.
    pub fn solve(
        &mut self,
        problem: &TornProblem,
        u: &Torn,
        state: &State,
        forcing: Forcing,
        timer: &Timer,
    ) -> Result<Step, String> {
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

        let Inner { mut x, outcome, statistics, at_floor } = self.solve_dual(problem, &start, &b, forcing, timer);
        let lambda: Vec<f64> = start.iter().zip(&x).map(|(s, x)| s + x).collect();

        timer.time("coarse problem", || self.projector.project(&mut x));
        x.iter_mut().zip(&start).for_each(|(x, s)| *x += s);
        let mut du = forces;
        let mut defect = vec![0.0; rows];
        timer.time("dual operator", || self.operator.respond(&x, &mut du, &mut defect));
        defect.iter_mut().zip(&slack).for_each(|(d, s)| *d = s - *d);
        let held = problem.constraints.rows.iter().zip(&lambda).map(|(row, &l)| !row.is_inequality() || l > 0.0);
        let coarse = &self.projector.coarse;
        let face = timer
            .time("coarse problem", || CoarseFace::new(coarse, held.collect()))
            .map_err(|floating| floating.to_string())?;
        recover::add_rigid_motion(problem, &face.amplitudes(coarse, &defect), &mut du);
        self.mend(problem, &slack, &mut du, timer);
        self.last = Some((lambda.clone(), face));
        let applications = self.operator.applications() - before;
        Ok(Step { du, lambda, outcome, statistics, at_floor, applications, factorisations })
    }

    /// Closes what the dual solver's tolerance left open, at the least cost in energy that the preconditioner knows.
    fn mend(&mut self, problem: &TornProblem, slack: &[f64], du: &mut Torn, timer: &Timer) {
        let Some(preconditioner) = &mut self.preconditioner else { return };
        let mut defect = vec![0.0; slack.len()];
        problem.gather.apply(du, &mut defect);
        for ((d, s), row) in defect.iter_mut().zip(slack).zip(&problem.constraints.rows) {
            *d = if row.is_inequality() { (s - *d).min(0.0) } else { s - *d };
        }
        let factors = &self.operator.factors;
        let stiffness = |own: usize| (&factors.symbolic(own).pattern, &self.tangents[own][..]);
        timer.time("preconditioner", || preconditioner.mend(stiffness, &defect, du));
    }

    /// Multipliers with `G l = e` next to the last ones: the smallest such if there are none.
    fn balanced_start(&self, problem: &TornProblem, forces: &Torn) -> Vec<f64> {
        let coarse = &self.projector.coarse;
        let mut mine = Vec::new();
        for ((subdomain, modes), f) in problem.subdomains.iter().zip(problem.modes).zip(forces) {
            mine.extend(modes.resultants(&subdomain.points, f));
        }
        let mut imbalance = coarse.share(&mine);
        let mut start = self.last.as_ref().map_or_else(|| vec![0.0; problem.gather.rows()], |(l, _)| l.clone());
        let balance = coarse.apply(&start);
        imbalance.iter_mut().zip(balance).for_each(|(e, b)| *e -= b);
        match &self.last {
            // Open contacts stay open.
            Some((_, face)) => face.add_balance(coarse, imbalance, &mut start),
            None => {
                coarse.solve(&mut imbalance);
                coarse.add_transpose(1.0, &imbalance, &mut start);
            }
        }
        start
    }

    /// Assembles the tangents at `u` and factorises those that changed; returns how many, over all ranks.
    fn update_tangents(&mut self, problem: &TornProblem, u: &Torn, timer: &Timer) -> Result<usize, String> {
        let mut failure: Option<NotDefinite> = None;
        let mut factorised = Vec::with_capacity(u.len());
        for (own, subdomain) in problem.subdomains.iter().enumerate() {
            let pattern = &self.operator.factors.symbolic(own).pattern;
            let values = &mut self.tangents[own];
            values.resize(pattern.rows.len(), 0.0);
            let material = &problem.materials[own];
            let plastic = timer.time("assembly", || stiffness::assemble(subdomain, material, &u[own], pattern, values));
            // An elastic tangent that was elastic before is the same matrix.
            let unchanged = self.yielding[own] == Some(0) && plastic == 0;
            self.yielding[own] = Some(plastic);
            factorised.push(f64::from(!unchanged));
            if unchanged || failure.is_some() {
                continue;
            }
            let outcome = timer.time("factorisation", || self.operator.factors.factorise(own, subdomain, values));
            let interior = self.preconditioner.as_mut().and_then(|p| p.interior.as_mut());
            let outcome = outcome.and_then(|()| match interior {
                Some(factors) => {
                    timer.time("factorisation of the interior", || factors.factorise(own, subdomain.id, values))
                }
                None => Ok(()),
            });
            failure = outcome.err();
        }
        // The lowest failing subdomain speaks; ranks that see no failure repeat its number.
        let failed = failure.as_ref().map_or(f64::NEG_INFINITY, |f| -(f.subdomain as f64));
        let lowest = problem.space.maximum(failed);
        if lowest > f64::NEG_INFINITY {
            let subdomain = -lowest as usize;
            let unknown = NotDefinite { subdomain, pivot: 0, dofs: 0 };
            return Err(failure.filter(|f| f.subdomain == subdomain).unwrap_or(unknown).to_string());
        }
        if let Some(preconditioner) = &mut self.preconditioner {
            let diagonals: Vec<Vec<f64>> = self
                .tangents
                .iter()
                .enumerate()
                .map(|(own, values)| self.operator.factors.symbolic(own).pattern.diagonal(values))
                .collect();
            preconditioner.scaling =
                timer.time("scaling", || Scaling::new(problem.constraints, problem.gather, &diagonals, |_| true));
        }
        Ok(problem.space.sum(&factorised, 1)[0] as usize)
    }

    /// Solves the shifted program from zero.
    fn solve_dual(
        &mut self,
        problem: &TornProblem,
        start: &[f64],
        b: &[f64],
        forcing: Forcing,
        timer: &Timer,
    ) -> Inner {
        let space = Multipliers(problem.space, timer);
        let mut dual = Dual {
            operator: &mut self.operator,
            projector: &self.projector,
            preconditioner: self.preconditioner.as_mut(),
            tangents: &self.tangents,
            timer,
        };
        let mut projected = b.to_vec();
        let mean = timer.time("coarse problem", || self.projector.project(&mut projected));
        let mut x = vec![0.0; b.len()];
        if space.norm(&projected) == 0.0 {
            return Inner { x, outcome: Outcome::Converged, statistics: Statistics::default(), at_floor: true };
        }
        let limits = Limits {
            relative: self.settings.tolerance * forcing.floor,
            reference: self.reference,
            absolute: 0.0,
            drop: if problem.is_linear() { 0.0 } else { forcing.drop },
            products: self.settings.products,
        };
        let at_floor = |first: f64| limits.relative * self.reference.unwrap_or(first) >= limits.drop * first;
        if !problem.constraints.has_inequalities {
            let report = Pcpg::new(&space).solve(&mut dual, &mut x, &mut projected, &limits);
            let at_floor = at_floor(report.first_norm);
            self.reference.get_or_insert(report.first_norm);
            return Inner { x, outcome: report.outcome, statistics: report.statistics, at_floor };
        }
        let mut statistics = Statistics::default();
        if self.norm.is_none() {
            let Some(estimate) = power::norm(&space, &mut dual, &projected) else {
                return Inner { x, outcome: Outcome::NotFinite, statistics, at_floor: false };
            };
            statistics.hessian += estimate.products;
            self.norm = Some(estimate.norm);
        }
        // Open contacts are part of b, but not of the rigid motion: the last step's set tells them apart.
        let multiplier = self.last.as_ref().map(|(_, face)| {
            let mut a = face.amplitudes(&self.projector.coarse, b);
            a.iter_mut().zip(&mean).for_each(|(a, m)| *a -= m);
            let mut multiplier = vec![0.0; b.len()];
            self.projector.coarse.add_transpose(1.0, &a, &mut multiplier);
            multiplier
        });
        let contacts = problem.constraints.rows.iter().zip(start);
        let lower = contacts.map(|(row, l)| if row.is_inequality() { -l } else { f64::NEG_INFINITY }).collect();
        let norm = self.norm.unwrap_or(f64::NAN);
        let solution = smalse::solve(
            smalse::Problem { space: &space, function: &mut dual, b: &projected, bounds: &Bounds::new(lower) },
            &smalse::Settings { limits, norm, expansion: self.settings.expansion },
            smalse::Start { x, multiplier },
        );
        let at_floor = at_floor(solution.first_norm);
        self.reference.get_or_insert(solution.first_norm);
        statistics += solution.statistics;
        Inner { x: solution.x, outcome: solution.outcome, statistics, at_floor }
    }
}

/// Solution of the shifted program.
struct Inner {
    x: Vec<f64>,
    outcome: Outcome,
    statistics: Statistics,
    at_floor: bool,
}
