//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.

use std::rc::Rc;
use std::sync::Arc;

use super::basis::{Bases, Basis};
use super::dual::Dual;
use super::forcing::{Forcing, TIGHTEST};
use super::motion;
use super::problem::{State, TornProblem, dot};
use super::program::{Found, ProgramSettings, ProgramState, Programs};
use super::recover;
use super::refine::refine;
use crate::assembly::flow::{self, Flow};
use crate::assembly::stiffness;
use crate::feti::Torn;
use crate::feti::cholesky::Precision;
use crate::feti::factor::NotDefinite;
use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::Preconditioner;
use crate::feti::projector::Projector;
use crate::feti::scaling::Scaling;
use crate::material::Material;
use crate::monitor::timing::Timer;
use crate::qp::{Outcome, Statistics};

/// Change of a tangent's entries, relative to its diagonal, that the preconditioner does not follow. (On the benchmark at
/// level 2, 0.1 saves a quarter of its factorisations and costs no iteration; 0.3 saves three fifths, and costs a tenth
/// more iterations.)
const DRIFT: f64 = 0.1;

/// Residual of the subdomains' problems that is small enough whatever the accuracy of the step.
const EXACT: f64 = 1e-8;

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
    /// Residual of the subdomains' problems `K du = f - F(u) - B'lambda` that rounding leaves, relative to their forces.
    pub local_residual: f64,
    /// Applications of F, those around the quadratic program and of refinement included.
    pub applications: usize,
    /// Subdomains with a new factor, over all ranks; those that share one count, too.
    pub factorisations: usize,
}

/// What later steps depend on, but for the multipliers.
#[derive(Clone, Debug)]
pub struct SolverState {
    /// Of the quadratic programs.
    pub programs: ProgramState,
    /// Directions of flow in each own subdomain.
    pub flows: Vec<Flow>,
    /// What new factors are stored in at least.
    pub precision: Precision,
    /// What the factors of each own subdomain are of.
    pub bases: Vec<Bases>,
}

/// What is kept from step to step: factors, projector, multipliers.
pub struct StepSolver<'a> {
    pub(super) operator: DualOperator<'a>,
    pub(super) projector: Projector<'a>,
    preconditioner: Option<Preconditioner<'a>>,
    pub(super) programs: Programs,
    /// Directions of flow in each own subdomain.
    flows: Vec<Flow>,
    /// Congruent subdomains have the same number.
    twins: Vec<Option<usize>>,
    /// Lower values of each own subdomain's tangent, as it was factorised.
    tangents: Vec<Rc<Vec<f64>>>,
    /// What its factors are of.
    bases: Vec<Bases>,
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
        let (tangents, bases) = (vec![Rc::default(); twins.len()], vec![Bases::default(); twins.len()]);
        let (programs, assembled) = (Programs::new(settings), Vec::new());
        let flows = vec![Flow::default(); twins.len()];
        Self { operator, projector, preconditioner, programs, flows, twins, tangents, bases, assembled }
    }

    /// What the next steps depend on.
    pub fn state(&self) -> SolverState {
        let precision = self.operator.factors.precision();
        let (flows, bases) = (self.flows.clone(), self.bases.clone());
        SolverState { programs: self.programs.state(), flows, precision, bases }
    }

    /// Goes on from such a state, with the multipliers that belong to it: makes the factors again, to the same bits.
    /// Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent is singular.
    pub fn resume(
        &mut self,
        problem: &TornProblem,
        state: SolverState,
        lambda: &[f64],
        timer: &Timer,
    ) -> Result<(), String> {
        let SolverState { programs, flows, precision, bases } = state;
        self.flows = flows;
        self.programs.resume(&self.projector.coarse, programs, lambda);
        self.operator.factors.set_precision(precision);
        let mut failure = None;
        for (own, bases) in bases.into_iter().enumerate() {
            if failure.is_none() && bases.factor.is_some() {
                failure = self.remake(problem, own, &bases, timer).err();
            }
            self.bases[own] = bases;
        }
        agree_on(failure, problem)
    }

    /// Makes the factors of a subdomain again.
    fn remake(&mut self, problem: &TornProblem, own: usize, bases: &Bases, timer: &Timer) -> Result<(), NotDefinite> {
        let subdomain = &problem.subdomains[own];
        let twin = self.twins[own].is_some();
        if bases.is_elastic()
            && let Some(outcome) = self.adopt(own, subdomain.id, timer)
        {
            outcome?;
        } else if let Some(basis) = &bases.factor {
            let common = twin && bases.is_elastic();
            self.tangents[own] = Rc::new(self.tangent(problem, own, basis));
            let (factors, values) = (&mut self.operator.factors, &self.tangents[own]);
            timer.time("factorisation", || factors.factorise(own, subdomain, values, common))?;
        }
        let (Some(basis), Some(_)) = (&bases.interior, &self.preconditioner) else { return Ok(()) };
        if self.bases[own].interior.as_ref() == Some(basis) {
            return Ok(());
        }
        let values = if bases.factor.as_ref() == Some(basis) {
            Rc::clone(&self.tangents[own])
        } else {
            Rc::new(self.tangent(problem, own, basis))
        };
        let common = twin && *basis == Basis::Elastic;
        self.take_interior(own, subdomain.id, &values, basis.clone(), common, timer)
    }

    /// Lower values of the tangent that a factor is of.
    fn tangent(&self, problem: &TornProblem, own: usize, basis: &Basis) -> Vec<f64> {
        let (subdomain, material) = (&problem.subdomains[own], &problem.materials[own]);
        let pattern = &self.operator.factors.symbolic(own).pattern;
        let mut values = vec![0.0; pattern.rows.len()];
        match basis {
            Basis::Elastic => {
                let (material, rest) = (Material { yield_stress: None, ..*material }, vec![0.0; subdomain.dofs()]);
                stiffness::assemble(subdomain, &material, &[], (&rest, &[]), pattern, &mut values)
            }
            Basis::At(u, flow) => stiffness::assemble(
                subdomain,
                material,
                problem.committed.history(own),
                (u, flow),
                pattern,
                &mut values,
            ),
        };
        values
    }

    /// Gives the preconditioner the interior block of these lower values, if there is one.
    fn take_interior(
        &mut self,
        own: usize,
        id: usize,
        values: &[f64],
        basis: Basis,
        common: bool,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        let Some(Preconditioner { schur, .. }) = &mut self.preconditioner else { return Ok(()) };
        (self.bases[own].interior, self.bases[own].drift) = (Some(basis), 0.0);
        timer.count("factorisation of the interior", schur.flops(own), 0.0);
        timer.time("factorisation of the interior", || schur.update(own, id, values, common))
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
        self.drop_factors();
    }

    fn drop_factors(&mut self) {
        self.bases.iter_mut().for_each(|bases| bases.factor = None);
    }

    /// Another solve follows, from what is committed now: its tolerances refer to its own first residual where that is
    /// larger than earlier ones.
    pub fn begin(&mut self) {
        self.programs.begin();
        self.flows.fill(Flow::default());
        self.bases.iter_mut().for_each(Bases::commit);
    }

    /// From now on factorises in double precision; false if that was so before.
    pub fn sharpen(&mut self) -> bool {
        let before = self.operator.factors.precision();
        self.operator.factors.set_precision(Precision::Double);
        self.drop_factors();
        before == Precision::Single
    }

    /// How far one step of a linear problem may reduce the gradient.
    pub fn linear_drop(&self) -> f64 {
        match self.operator.factors.precision() {
            Precision::Single => TIGHTEST,
            Precision::Double => 0.0,
        }
    }

    /// Takes the directions of flow along in a step of this `length` from `u` to `next`.
    pub fn follow(&mut self, problem: &TornProblem, (u, state): (&Torn, &State), next: &Torn, length: f64) {
        for (own, flow) in self.flows.iter_mut().enumerate() {
            if state.yielding[own] == 0 {
                *flow = Flow::default();
                continue;
            }
            let change: Vec<f64> = next[own].iter().zip(&u[own]).map(|(next, u)| next - u).collect();
            let (subdomain, material) = (&problem.subdomains[own], &problem.materials[own]);
            let (history, step) = (problem.committed.history(own), (&change[..], length));
            *flow = Arc::new(flow::follow(subdomain, material, history, flow, &u[own], step));
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
        let factorisations = self.update_tangents(problem, (u, state), forcing.left, timer)?;
        let rows = problem.gather.rows();

        let forces = problem.unbalance(state);
        let coarse = &self.projector.coarse;
        let warm = timer.time("coarse problem", || {
            let balance = recover::resultants(problem.subdomains, problem.modes, coarse, &forces);
            self.programs.start(&self.projector, rows, balance)
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
        let Found { mut lambda, mut balanced, outcome, statistics, at_floor } = found;

        let mut defect = vec![0.0; rows];
        let mut du = forces.clone();
        self.respond(&balanced, &mut du, &mut defect, timer);
        self.add_bonds(problem, [&mut lambda, &mut balanced]);
        let mut local = forces;
        problem.gather.add_transpose(-1.0, &balanced, &mut local);
        let wanted = forcing.drop.max(EXACT);
        let norm = |x: &Torn| {
            let squares: Vec<f64> = x.iter().map(|x| dot(x, x)).collect();
            problem.space.sum(&squares, 1)[0].sqrt()
        };
        let (local_residual, refined) = timer.time("refinement", || {
            refine(&mut self.operator.factors, &self.tangents, &norm, (&local, &mut du), wanted)
        });
        if refined > 0 {
            self.operator.rejoin(&mut du);
            self.add_bonds(problem, [&mut lambda, &mut balanced]);
            problem.gather.apply(&du, &mut defect);
        }
        self.programs.settle(&lambda);
        defect.iter_mut().zip(&slack).for_each(|(d, s)| *d -= s);
        if let Some(held) = self.programs.held() {
            let coarse = &self.projector.coarse;
            let back = timer.time("coarse problem", || motion::amplitudes(held, coarse, problem.space, &defect));
            recover::add_rigid_motion(problem, coarse, -1.0, &back, &mut du);
        }
        self.mend(problem, &slack, &mut du, timer);
        let applications = self.operator.applications() - before + refined;
        Ok(Step { du, lambda, outcome, statistics, at_floor, local_residual, applications, factorisations })
    }

    /// Adds to multipliers what balances each member of a cluster.
    pub(super) fn add_bonds<const N: usize>(&self, problem: &TornProblem, multipliers: [&mut Vec<f64>; N]) {
        if let Some(bonds) = self.operator.bonds() {
            multipliers.into_iter().for_each(|lambda| problem.add_gluing(&bonds, lambda));
        }
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
        let elastic = |k: &usize| self.twins[*k] == Some(class) && self.bases[*k].is_elastic();
        let mut twins = (0..self.twins.len()).filter(elastic);
        let twin = twins.clone().next()?;
        let alike = self.preconditioner.as_ref().and_then(|p| twins.find(|&k| p.schur.alike(own, k)));
        self.operator.factors.share(own, twin);
        self.tangents[own] = Rc::clone(&self.tangents[twin]);
        self.bases[own].factor = Some(Basis::Elastic);
        if let (Some(alike), Some(Preconditioner { schur, .. })) = (alike, &mut self.preconditioner) {
            (self.bases[own].interior, self.bases[own].drift) = (Some(Basis::Elastic), 0.0);
            schur.share(own, alike);
            return Some(Ok(()));
        }
        let values = Rc::clone(&self.tangents[own]);
        Some(self.take_interior(own, id, &values, Basis::Elastic, true, timer))
    }

    /// Assembles the tangents at `u` and factorises those that changed by more than `left`; returns how many, over all
    /// ranks.
    fn update_tangents(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        left: f64,
        timer: &Timer,
    ) -> Result<usize, String> {
        let mut failure: Option<NotDefinite> = None;
        let mut factorised = Vec::with_capacity(u.len());
        for (own, subdomain) in problem.subdomains.iter().enumerate() {
            // An elastic tangent that was elastic before is the same matrix.
            let unchanged = self.bases[own].is_elastic() && state.yielding[own] == 0;
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
            let (assembled, flow) = (&mut self.assembled, &self.flows[own]);
            timer.time("assembly", || {
                stiffness::assemble(subdomain, material, history, (&u[own], flow), pattern, assembled)
            });
            let known = self.bases[own].factor.is_some();
            let change = if known { pattern.difference(&self.tangents[own], assembled) } else { f64::INFINITY };
            // Where twins are elastic on other ranks only, it gets what it would get from one of them here.
            let common = elastic && self.twins[own].is_some();
            if change <= left && !common {
                factorised.push(0.0);
                continue;
            }
            factorised.push(1.0);
            let basis = if elastic {
                Basis::Elastic
            } else {
                Basis::At(Arc::new(u[own].clone()), Flow::clone(&self.flows[own]))
            };
            self.bases[own].drift += change;
            self.bases[own].factor = Some(basis.clone());
            let values = Rc::new(assembled.clone());
            self.tangents[own] = Rc::clone(&values);
            let factors = &mut self.operator.factors;
            let outcome = timer.time("factorisation", || factors.factorise(own, subdomain, &values, common));
            timer.count("factorisation", factors.symbolic(own).analysis().flops(), 0.0);
            let drift = self.bases[own].drift;
            failure = match outcome {
                Ok(()) if common || drift.is_nan() || drift > DRIFT => {
                    self.take_interior(own, subdomain.id, &values, basis, common, timer).err()
                }
                outcome => outcome.err(),
            };
        }
        agree_on(failure, problem)?;
        if self.operator.is_hybrid() {
            let loose = timer.time("clusters", || self.operator.update_clusters()).err();
            let loose = loose.map(|own| problem.subdomains[own].id);
            if let Some(subdomain) = first_of_all(loose, problem) {
                return Err(format!(
                    "the cluster of subdomain {subdomain} has no stiffness: set decomposition.cluster = 1"
                ));
            }
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

/// One outcome for all ranks: the lowest failing subdomain speaks; ranks that see no failure repeat its number.
fn agree_on(failure: Option<NotDefinite>, problem: &TornProblem) -> Result<(), String> {
    let Some(subdomain) = first_of_all(failure.as_ref().map(|f| f.subdomain), problem) else { return Ok(()) };
    let unknown = NotDefinite { subdomain, pivot: 0, dofs: 0 };
    Err(failure.filter(|f| f.subdomain == subdomain).unwrap_or(unknown).to_string())
}

/// The lowest number that any rank names.
fn first_of_all(mine: Option<usize>, problem: &TornProblem) -> Option<usize> {
    let lowest = problem.space.maximum(mine.map_or(f64::NEG_INFINITY, |number| -(number as f64)));
    (lowest != f64::NEG_INFINITY).then_some(-lowest as usize)
}
