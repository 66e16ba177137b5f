//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.

use std::rc::Rc;

use super::dual::Dual;
use super::forcing::{Forcing, TIGHTEST};
use super::motion;
use super::problem::{State, TornProblem};
use super::program::{Found, ProgramSettings, Programs};
use super::recover;
use crate::assembly::stiffness;
use crate::feti::Torn;
use crate::feti::cholesky::Precision;
use crate::feti::factor::NotDefinite;
use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::Preconditioner;
use crate::feti::projector::Projector;
use crate::feti::scaling::Scaling;
use crate::monitor::timing::Timer;
use crate::qp::{Outcome, Statistics};

/// Change of a tangent's entries, relative to its diagonal, that the preconditioner does not follow. (On the benchmark at
/// level 2, 0.1 saves a quarter of its factorisations and costs no iteration; 0.3 saves three fifths, and costs a tenth
/// more iterations.)
const DRIFT: f64 = 0.1;

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
    /// Subdomains with a new factor, over all ranks; those that share one count, too.
    pub factorisations: usize,
}

/// What is kept from step to step: factors, projector, multipliers.
pub struct StepSolver<'a> {
    pub(super) operator: DualOperator<'a>,
    pub(super) projector: Projector<'a>,
    preconditioner: Option<Preconditioner<'a>>,
    pub(super) programs: Programs,
    /// Congruent subdomains have the same number.
    twins: Vec<Option<usize>>,
    /// Lower values of each own subdomain's tangent, as it was factorised.
    tangents: Vec<Rc<Vec<f64>>>,
    /// How many of its elements yield; none if there is no factor to go on with.
    yielding: Vec<Option<usize>>,
    /// By how much each tangent has changed since the preconditioner took it.
    drift: Vec<f64>,
    /// Scratch: a tangent that may be worth factorising.
    assembled: Vec<f64>,
}

impl<'a> StepSolver<'a> {
    /// On factors and a projector set up for the problem's subdomains; `twins` numbers those that have congruent ones.
    pub fn new(
        operator: DualOperator<'a>,
        projector: Projector<'a>,
        preconditioner: Option<Preconditioner<'a>>,
        settings: ProgramSettings,
        twins: Vec<Option<usize>>,
    ) -> Self {
        let (tangents, yielding) = (vec![Rc::default(); twins.len()], vec![None; twins.len()]);
        let (programs, drift, assembled) = (Programs::new(settings), vec![0.0; twins.len()], Vec::new());
        Self { operator, projector, preconditioner, programs, twins, tangents, yielding, drift, assembled }
    }

    /// Starts from the multipliers that a displacement and the rows that hold there suggest; returns them. They are
    /// `(B B')^-1 B (f - F(u))` on these rows. Collective.
    pub fn expect(&mut self, problem: &TornProblem, state: &State, held: Vec<bool>) -> Vec<f64> {
        let mut lambda = vec![0.0; held.len()];
        problem.gather.apply(&problem.unbalance(state), &mut lambda);
        problem.coupling.borrow_mut().solve(&mut lambda, |row| held[row]);
        for ((l, row), &held) in lambda.iter_mut().zip(&problem.constraints.rows).zip(&held) {
            *l = if !held {
                0.0
            } else if row.is_inequality() {
                l.max(0.0)
            } else {
                *l
            };
        }
        self.programs.expect(&self.projector.coarse, &lambda, held);
        lambda
    }

    /// Forgets the multipliers and factors of a solve that failed.
    pub fn forget(&mut self) {
        self.programs.forget();
        self.yielding.fill(None);
    }

    /// Another solve follows: its tolerances refer to its own first residual where that is larger than earlier ones.
    pub fn begin(&mut self) {
        self.programs.begin();
    }

    /// From now on factorises in double precision; false if that was so before.
    pub fn sharpen(&mut self) -> bool {
        let before = self.operator.factors.precision();
        self.operator.factors.set_precision(Precision::Double);
        self.yielding.fill(None);
        before == Precision::Single
    }

    /// How far one step of a linear problem may reduce the gradient.
    pub fn linear_drop(&self) -> f64 {
        match self.operator.factors.precision() {
            Precision::Single => TIGHTEST,
            Precision::Double => 0.0,
        }
    }

    /// Solves for the step at `u`; `alive` is told the applications of F so far. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent or the coarse problem is singular.
    pub fn solve(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        forcing: Forcing,
        timer: &Timer,
        alive: &dyn Fn(usize),
    ) -> Result<Step, String> {
        let before = self.operator.applications();
        let factorisations = self.update_tangents(problem, u, state, forcing.left, timer)?;
        let rows = problem.gather.rows();

        let forces = problem.unbalance(state);
        let coarse = &self.projector.coarse;
        let warm = timer.time("coarse problem", || {
            self.programs.start(&self.projector, rows, recover::resultants(problem, coarse, &forces))
        });
        let slack = problem.slack(u);
        let mut b = vec![0.0; rows];
        let mut torn = forces.clone();
        self.respond(&warm.lambda, &mut torn, &mut b, timer);
        b.iter_mut().zip(&slack).for_each(|(b, s)| *b -= s);

        let dual = Dual {
            operator: &mut self.operator,
            projector: &self.projector,
            preconditioner: self.preconditioner.as_mut(),
            space: problem.space,
            timer,
            alive: &|applications| alive(applications - before),
        };
        let found = self.programs.solve(problem, dual, warm, b, forcing).map_err(|floating| floating.to_string())?;
        let Found { lambda, balanced, outcome, statistics, at_floor } = found;

        let mut du = forces;
        let mut defect = vec![0.0; rows];
        self.respond(&balanced, &mut du, &mut defect, timer);
        defect.iter_mut().zip(&slack).for_each(|(d, s)| *d -= s);
        if let Some(held) = self.programs.held() {
            let coarse = &self.projector.coarse;
            let back = timer.time("coarse problem", || motion::amplitudes(held, coarse, problem.space, &defect));
            recover::add_rigid_motion(problem, -1.0, &back, &mut du);
        }
        self.mend(problem, &slack, &mut du, timer);
        let applications = self.operator.applications() - before;
        Ok(Step { du, lambda, outcome, statistics, at_floor, applications, factorisations })
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`.
    fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64], timer: &Timer) {
        timer.time("dual operator", || self.operator.respond(x, torn, y));
        timer.count("dual operator", 0.0, self.operator.factors.bytes_per_solve());
    }

    /// Closes what the dual solver's tolerance left open in the held and the violated rows, at the least cost in energy
    /// that the preconditioner knows.
    fn mend(&mut self, problem: &TornProblem, slack: &[f64], du: &mut Torn, timer: &Timer) {
        let (Some(preconditioner), Some(held)) = (&mut self.preconditioner, self.programs.held()) else { return };
        let mut defect = vec![0.0; slack.len()];
        problem.gather.apply(du, &mut defect);
        for ((d, s), row) in defect.iter_mut().zip(slack).zip(&problem.constraints.rows) {
            *d = if row.is_inequality() { (s - *d).min(0.0) } else { s - *d };
        }
        let kept = |row: usize| held.kept()[row] || defect[row] < 0.0;
        timer.time("scaling", || preconditioner.scaling.restrict(problem.constraints, kept));
        timer.time("preconditioner", || preconditioner.mend(&defect, du));
    }

    /// Gives an elastic subdomain what an elastic twin has already; `None` if there is none.
    fn adopt(&mut self, own: usize, id: usize, timer: &Timer) -> Option<Result<(), NotDefinite>> {
        let class = self.twins[own]?;
        let elastic = |k: &usize| self.twins[*k] == Some(class) && self.yielding[*k] == Some(0);
        let mut twins = (0..self.twins.len()).filter(elastic);
        let twin = twins.clone().next()?;
        let alike = self.preconditioner.as_ref().and_then(|p| twins.find(|&k| p.schur.alike(own, k)));
        self.operator.factors.share(own, twin);
        self.tangents[own] = Rc::clone(&self.tangents[twin]);
        self.yielding[own] = Some(0);
        self.drift[own] = 0.0;
        let Some(Preconditioner { schur, .. }) = &mut self.preconditioner else { return Some(Ok(())) };
        if let Some(alike) = alike {
            schur.share(own, alike);
            return Some(Ok(()));
        }
        timer.count("factorisation of the interior", schur.flops(own), 0.0);
        Some(timer.time("factorisation of the interior", || schur.update(own, id, &self.tangents[own], true)))
    }

    /// Assembles the tangents at `u` and factorises those that changed by more than `left`; returns how many, over all
    /// ranks.
    fn update_tangents(
        &mut self,
        problem: &TornProblem,
        u: &Torn,
        state: &State,
        left: f64,
        timer: &Timer,
    ) -> Result<usize, String> {
        let mut failure: Option<NotDefinite> = None;
        let mut factorised = Vec::with_capacity(u.len());
        for (own, subdomain) in problem.subdomains.iter().enumerate() {
            // An elastic tangent that was elastic before is the same matrix.
            let unchanged = self.yielding[own] == Some(0) && state.yielding[own] == 0;
            if unchanged || failure.is_some() {
                factorised.push(0.0);
                continue;
            }
            let elastic = state.yielding[own] == 0;
            if elastic && let Some(outcome) = self.adopt(own, subdomain.id, timer) {
                factorised.push(1.0);
                failure = outcome.err();
                continue;
            }
            let pattern = &self.operator.factors.symbolic(own).pattern;
            let (material, history) = (&problem.materials[own], problem.committed.history(own));
            self.assembled.resize(pattern.rows.len(), 0.0);
            let assembled = &mut self.assembled;
            timer.time("assembly", || stiffness::assemble(subdomain, material, history, &u[own], pattern, assembled));
            let known = self.yielding[own].is_some();
            let change = if known { pattern.difference(&self.tangents[own], assembled) } else { f64::INFINITY };
            // Where twins are elastic on other ranks only, it gets what it would get from one of them here.
            let common = elastic && self.twins[own].is_some();
            if change <= left && !common {
                factorised.push(0.0);
                continue;
            }
            factorised.push(1.0);
            self.drift[own] += change;
            self.yielding[own] = Some(state.yielding[own]);
            self.tangents[own] = Rc::new(assembled.clone());
            let values = &self.tangents[own];
            let factors = &mut self.operator.factors;
            let outcome = timer.time("factorisation", || factors.factorise(own, subdomain, values, common));
            timer.count("factorisation", factors.symbolic(own).analysis().flops(), 0.0);
            let drift = &mut self.drift[own];
            let outcome = outcome.and_then(|()| match &mut self.preconditioner {
                Some(Preconditioner { schur, .. }) if common || drift.is_nan() || *drift > DRIFT => {
                    *drift = 0.0;
                    timer.count("factorisation of the interior", schur.flops(own), 0.0);
                    let update = || schur.update(own, subdomain.id, values, common);
                    timer.time("factorisation of the interior", update)
                }
                _ => Ok(()),
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
                timer.time("scaling", || Scaling::new(problem.constraints, problem.gather, &diagonals));
        }
        Ok(problem.space.sum(&factorised, 1)[0] as usize)
    }
}
