//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.
//!
//! The dual is `min 1/2 l'F l - l'd` over `l_I >= 0`, `G l = e` with `e = R'f_k`, `d = B K^+ f_k - c_k` (paper, section 4).
//! It is shifted by the last step's multipliers `l0`, corrected so that `G l0 = e`: what is left is homogeneous, starts at
//! zero and its right-hand side `B K^+ (f_k - B'l0) - c_k` costs one application of F.

use super::dual::{Dual, Multipliers};
use super::problem::{State, TornProblem};
use super::recover;
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
use crate::qp::quadratic::{Projection, Space};
use crate::qp::pcpg::Pcpg;
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
    lambda: Option<Vec<f64>>,
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
        Self { operator, projector, preconditioner, settings, tangents, yielding, lambda: None, reference: None, norm: None }
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

        let (mut x, outcome, statistics) = self.solve_dual(problem, &start, &b, timer);
        let lambda: Vec<f64> = start.iter().zip(&x).map(|(s, x)| s + x).collect();

        timer.time("coarse problem", || self.projector.project(&mut x));
        x.iter_mut().zip(&start).for_each(|(x, s)| *x += s);
        let mut du = forces;
        let mut defect = vec![0.0; rows];
        timer.time("dual operator", || self.operator.respond(&x, &mut du, &mut defect));
        defect.iter_mut().zip(&slack).for_each(|(d, s)| *d = s - *d);
        let kept: Vec<bool> =
            problem.constraints.rows.iter().zip(&lambda).map(|(row, &l)| !row.is_inequality() || l > 0.0).collect();
        timer
            .time("coarse problem", || {
                recover::add_rigid_motion(problem, &self.projector.coarse, &kept, &defect, &mut du)
            })
            .map_err(|floating| floating.to_string())?;
        let nrm=|d: &Torn| { let mut r = vec![0.0; rows]; problem.gather.apply(d, &mut r); let mut e=0.0; let mut c=0.0_f64; for ((r,s),row) in r.iter().zip(&slack).zip(&problem.constraints.rows) { if row.is_inequality() { c=c.max(r-s) } else { e+=(r-s)*(r-s) } } (e.sqrt(),c) };
        let mut kk=0.0; let mut fd=0.0; for own in 0..du.len() { let mut y=vec![0.0;du[own].len()]; self.operator.factors.symbolic(own).pattern.multiply_add(&self.tangents[own],&du[own],&mut y); for i in 0..y.len(){ kk+=y[i]*du[own][i]; fd += (problem.loads[own][i]-state.forces[own][i])*du[own][i]; } }
        eprintln!("before mend {:?} model {:e} {:e} J {:e}", nrm(&du), kk, fd, 0.5*kk-fd);
        self.mend(problem, &slack, &mut du, timer);
        let mut kk=0.0; let mut fd=0.0; for own in 0..du.len() { let mut y=vec![0.0;du[own].len()]; self.operator.factors.symbolic(own).pattern.multiply_add(&self.tangents[own],&du[own],&mut y); for i in 0..y.len(){ kk+=y[i]*du[own][i]; fd += (problem.loads[own][i]-state.forces[own][i])*du[own][i]; } }
        eprintln!("after mend {:?} model {:e} {:e} J {:e}", nrm(&du), kk, fd, 0.5*kk-fd);
        self.lambda = Some(lambda.clone());
        let applications = self.operator.applications() - before;
        Ok(Step { du, lambda, outcome, statistics, applications, factorisations })
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
        let mut start = self.lambda.clone().unwrap_or_else(|| vec![0.0; problem.gather.rows()]);
        let balance = coarse.apply(&start);
        imbalance.iter_mut().zip(balance).for_each(|(e, b)| *e -= b);
        coarse.solve(&mut imbalance);
        coarse.add_transpose(1.0, &imbalance, &mut start);
        if self.lambda.is_some() {
            // The correction was round-off or the last tolerance: it must not push contact forces below zero.
            let contacts = problem.constraints.rows.iter().zip(&mut start).filter(|(row, _)| row.is_inequality());
            contacts.for_each(|(_, l)| *l = l.max(0.0));
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
                Some(factors) => timer.time("factorisation of the interior", || factors.factorise(own, subdomain.id, values)),
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
            preconditioner.scaling = timer
                .time("scaling", || Scaling::new(problem.constraints, problem.gather, &diagonals, |_| true));
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
        let mut dual = Dual {
            operator: &mut self.operator,
            projector: &self.projector,
            preconditioner: self.preconditioner.as_mut(),
            tangents: &self.tangents,
            timer,
        };
        let mut x = vec![0.0; b.len()];
        let mut projected = b.to_vec();
        dual.project(&mut projected);
        let size = space.norm(&projected);
        if size == 0.0 {
            return (x, Outcome::Converged, Statistics::default());
        }
        eprintln!("size {size:e}");
        let limits = Limits {
            relative: self.settings.tolerance,
            reference: Some(*self.reference.get_or_insert(size)),
            absolute: size * std::env::var("ETA").map_or(0.0, |s| s.parse().unwrap()),
            products: self.settings.products,
        };
        if !problem.constraints.has_inequalities {
            let report = Pcpg::new(&space).solve(&mut dual, &mut x, &mut projected, &limits);
            return (x, report.outcome, report.statistics);
        }
        let mut statistics = Statistics::default();
            if self.norm.is_none() || std::env::var("RENORM").is_ok() {
        let Some(estimate) = power::norm(&space, &mut dual, &projected) else {
            return (x, Outcome::NotFinite, Statistics::default());
        };
        statistics.hessian += estimate.products;
        self.norm = Some(estimate.norm);
        }
        let contacts = problem.constraints.rows.iter().zip(start);
        let lower = contacts.map(|(row, l)| if row.is_inequality() { -l } else { f64::NEG_INFINITY }).collect();
        let solution = smalse::solve(
            smalse::Problem { space: &space, function: &mut dual, b: &projected, bounds: &Bounds::new(lower) },
            &smalse::Settings { limits, norm: self.norm.unwrap(), expansion: self.settings.expansion },
            smalse::Start { x, multiplier: None },
        );
        statistics += solution.statistics;
        (solution.x, solution.outcome, statistics)
    }
}
