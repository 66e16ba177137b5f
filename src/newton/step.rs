//! One Newton step: tangents, factors, the dual quadratic program, and back to a displacement.

use crate::vector::dot;
use std::sync::Arc;

use super::dual::Dual;
use super::forcing::{Forcing, TIGHTEST};
use super::problem::{State, TornProblem};
use super::program::{Found, ProgramSettings, ProgramState, Programs};
use crate::assembly::flow::{self, Flow};
use crate::constraint::Kind;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::feti::coarse::motion;
use crate::feti::coarse::projector::Projector;
use crate::feti::coarse::recover;
use crate::feti::dual::held::Held;
use crate::feti::dual::operator::DualOperator;
use crate::feti::inverse::basis::Bases;
use crate::feti::inverse::factor::NotDefinite;
use crate::feti::inverse::refine::refine;
use crate::feti::inverse::tangents::{Factorising, Tangents};
use crate::feti::preconditioner::Preconditioner;
use crate::feti::preconditioner::scaling::Scaling;
use crate::monitor::timing::Timer;
use crate::qp::{Outcome, Statistics};
use crate::sparse::cholesky::Precision;

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

/// What is kept from step to step: factors, projector, the rows that the last program kept.
pub struct StepSolver<'a> {
    pub(super) operator: DualOperator<'a>,
    pub(super) projector: Projector<'a>,
    preconditioner: Option<Preconditioner<'a>>,
    pub(super) programs: Programs,
    /// Directions of flow in each own subdomain.
    flows: Vec<Flow>,
    tangents: Tangents,
    /// For each own subdomain, unknowns that supports may keep at zero ([`crate::feti::dual::supported`]).
    supported: Vec<Vec<u32>>,
}

impl<'a> StepSolver<'a> {
    /// On factors and a projector set up for the problem's subdomains; `twins` numbers those that have congruent ones, `supported`
    /// tells what their supports may keep at zero ([`crate::feti::dual::supported`]).
    pub fn new(
        operator: DualOperator<'a>,
        projector: Projector<'a>,
        preconditioner: Option<Preconditioner<'a>>,
        settings: ProgramSettings,
        twins: Vec<Option<usize>>,
        supported: Vec<Vec<u32>>,
    ) -> Self {
        let flows = vec![Flow::default(); twins.len()];
        let (programs, tangents) = (Programs::new(settings), Tangents::new(twins));
        Self { operator, projector, preconditioner, programs, flows, tangents, supported }
    }

    /// What the next steps depend on.
    pub fn state(&self) -> SolverState {
        let precision = self.operator.factors.precision();
        let (flows, bases) = (self.flows.clone(), self.tangents.bases().to_vec());
        SolverState { programs: self.programs.state(), flows, precision, bases }
    }

    /// Goes on from such a state: makes the factors again, to the same bits. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent is singular.
    pub fn resume(&mut self, problem: &TornProblem, state: SolverState, timer: &Timer) -> Result<(), String> {
        let SolverState { programs, flows, precision, bases } = state;
        self.flows = flows;
        self.programs.resume(&self.projector.coarse, programs);
        self.operator.factors.set_precision(precision);
        let mut on = factorising(&mut self.operator, &mut self.preconditioner, timer);
        let outcome = self.tangents.remake(&problem.regions(), bases, &mut on);
        agree_on(outcome.err(), problem)
    }

    /// Starts from the multipliers that a displacement and the rows that hold there suggest; returns them. They are
    /// `(B B')^-1 B (f - F(u))` on these rows. Collective.
    pub fn expect(&mut self, problem: &TornProblem, state: &State, held: Vec<bool>) -> Vec<f64> {
        let mut lambda = vec![0.0; held.len()];
        problem.gather.apply(&problem.unbalance(state), &mut lambda);
        problem.coupling.borrow_mut().solve(&mut lambda, |row| held[row]);
        problem.constraints.laws().project_onto(&held, &mut lambda);
        self.programs.expect(&self.projector.coarse, held);
        lambda
    }

    /// Forgets the multipliers and factors of a solve that failed.
    pub fn forget(&mut self) {
        self.programs.forget();
        self.tangents.drop_factors();
    }

    /// Another solve follows, from what is committed now: its tolerances refer to its own first residual where that is
    /// larger than earlier ones.
    pub fn begin(&mut self) {
        self.programs.begin();
        self.flows.fill(Flow::default());
        self.tangents.commit();
    }

    /// From now on factorises in double precision; false if that was so before.
    pub fn sharpen(&mut self) -> bool {
        let before = self.operator.factors.precision();
        self.operator.factors.set_precision(Precision::Double);
        self.tangents.drop_factors();
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
            *flow = Arc::new(flow::follow(&problem.region(own), flow, &u[own], (&change, length)));
        }
    }

    /// Solves for the step at `u` from the `last` multipliers, those of the step before or of the last attempt at this one;
    /// `alive` is told the applications of F so far. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent or the coarse problem is singular.
    pub fn solve(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        last: &[f64],
        forcing: Forcing,
        timer: &Timer,
        alive: &dyn Fn(usize),
    ) -> Result<Step, String> {
        let before = self.operator.applications();
        let factorisations = self.update_tangents(problem, (u, state), forcing.left, timer)?;
        let rows = problem.gather.rows();

        let mut forces = problem.unbalance(state);
        let slack = problem.slack(u);
        let mut open = slack.clone();
        let lifted = self.held(problem).map(|held| held.lift(&mut forces, &mut open));
        let coarse = &self.projector.coarse;
        let warm = timer.time("coarse problem", || {
            let balance = recover::resultants(problem.subdomains, problem.modes, coarse, &forces);
            self.programs.start(&self.projector, last, balance)
        });
        let mut b = vec![0.0; rows];
        let mut torn = forces.clone();
        self.respond(&warm.lambda, &mut torn, &mut b, timer);
        b.iter_mut().zip(&open).for_each(|(b, s)| *b -= s);

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
        self.add_hidden(problem, (&forces, &du), [&mut lambda, &mut balanced]);
        let mut local = forces.clone();
        problem.gather.add_transpose(-1.0, &balanced, &mut local);
        let wanted = forcing.drop.max(EXACT);
        let norm = |x: &Torn| {
            let squares: Vec<f64> = x.iter().map(|x| dot(x, x)).collect();
            problem.space.sum(&squares, 1)[0].sqrt()
        };
        let (local_residual, refined) = timer.time("refinement", || {
            refine(&mut self.operator.factors, self.tangents.values(), &norm, (&local, &mut du), wanted)
        });
        if refined > 0 {
            self.operator.rejoin(&mut du);
            self.add_hidden(problem, (&forces, &du), [&mut lambda, &mut balanced]);
            problem.gather.apply(&du, &mut defect);
        }
        defect.iter_mut().zip(&open).for_each(|(d, s)| *d -= s);
        if let Some(face) = self.programs.face() {
            let coarse = &self.projector.coarse;
            let back = timer.time("coarse problem", || motion::amplitudes(face, coarse, problem.space, &defect));
            recover::add_rigid_motion(problem.subdomains, problem.modes, coarse, -1.0, &back, &mut du);
        }
        for (du, lifted) in du.iter_mut().flatten().zip(lifted.iter().flatten().flatten()) {
            *du += lifted;
        }
        self.mend(problem, &slack, &mut du, timer);
        let applications = self.operator.applications() - before + refined;
        Ok(Step { du, lambda, outcome, statistics, at_floor, local_residual, applications, factorisations })
    }

    /// Adds to multipliers, the last of which are in balance, what the quadratic program does not see: what balances each member
    /// of a cluster, and what supports carry that hold subdomains still.
    fn add_hidden(&self, problem: &TornProblem, state: (&Torn, &Torn), [lambda, balanced]: [&mut Vec<f64>; 2]) {
        self.add_bonds(problem, [&mut *lambda, &mut *balanced]);
        if let Some(held) = self.held(problem) {
            held.add_reactions(state, [lambda, balanced]);
        }
    }

    /// Adds to multipliers what balances each member of a cluster.
    pub(super) fn add_bonds<const N: usize>(&self, problem: &TornProblem, multipliers: [&mut Vec<f64>; N]) {
        if let Some(bonds) = self.operator.bonds() {
            multipliers
                .into_iter()
                .for_each(|lambda| problem.constraints.add_forces(&bonds, |kind| kind == Kind::Gluing, lambda));
        }
    }

    /// The subdomains that supports hold still; `None` if no rank has any.
    fn held<'s>(&'s self, problem: &'s TornProblem) -> Option<Held<'s>> {
        let is_active = self.preconditioner.as_ref().is_some_and(|preconditioner| preconditioner.deluxe.is_active());
        (is_active && !self.operator.is_hybrid()).then(|| Held {
            factors: &self.operator.factors,
            tangents: self.tangents.values(),
            constraints: problem.constraints,
            gather: problem.gather,
        })
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`.
    fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64], timer: &Timer) {
        timer.time("dual operator", || self.operator.respond(x, torn, y));
        timer.count("dual operator", 0.0, self.operator.factors.bytes_per_solve());
    }

    /// Closes what the dual solver's tolerance left open in the held and the violated rows, at the least cost in energy
    /// that the preconditioner knows.
    fn mend(&mut self, problem: &TornProblem, slack: &[f64], du: &mut Torn, timer: &Timer) {
        let (Some(preconditioner), Some(face)) = (&mut self.preconditioner, self.programs.face()) else { return };
        let mut defect = vec![0.0; slack.len()];
        problem.gather.apply(du, &mut defect);
        defect.iter_mut().zip(slack).for_each(|(d, s)| *d = s - *d);
        problem.constraints.laws().violation(&mut defect);
        let kept = |row: usize| face.kept()[row] || defect[row] != 0.0;
        timer.time("scaling", || preconditioner.scaling.restrict(problem.constraints, kept));
        timer.time("preconditioner", || preconditioner.mend(&defect, du));
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
        let mut on = factorising(&mut self.operator, &mut self.preconditioner, timer);
        let (factorised, failure) =
            self.tangents.update(&problem.regions(), (u, &state.yielding, &self.flows), left, &mut on);
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
        let is_weak =
            |own| self.preconditioner.as_ref().is_some_and(|preconditioner| preconditioner.schur.is_weak(own));
        let mine = factorised.iter().enumerate().flat_map(|(own, &fresh)| [fresh, f64::from(is_weak(own))]);
        let all = problem.space.of_all(&mine.collect::<Vec<f64>>(), 2);
        let (fresh, weak): (Vec<bool>, Vec<bool>) = all.as_chunks().0.iter().map(|[f, w]| (*f > 0.0, *w > 0.0)).unzip();
        self.scale(problem, timer);
        self.strengthen(problem, &weak, &fresh, timer)?;
        Ok(fresh.into_iter().filter(|fresh| *fresh).count())
    }

    /// Scales the rows by the stiffness of the tangents.
    fn scale(&mut self, problem: &TornProblem, timer: &Timer) {
        let Some(preconditioner) = &mut self.preconditioner else { return };
        let (factors, values) = (&self.operator.factors, self.tangents.values().iter().enumerate());
        let stiffness = values.map(|(own, values)| (&factors.symbolic(own).pattern, &values[..]));
        preconditioner.scaling = timer.time("scaling", || Scaling::new(problem.constraints, problem.gather, stiffness));
    }

    /// Deluxe scaling of faces beside weak subdomains, which supports hold still where they can; the preconditioner takes the
    /// stiffness of both sides as it is now. Whether subdomains are `weak`, and their tangents `fresh`, is told of all.
    fn strengthen(
        &mut self,
        problem: &TornProblem,
        weak: &[bool],
        fresh: &[bool],
        timer: &Timer,
    ) -> Result<(), String> {
        let is_active = |preconditioner: &Preconditioner| preconditioner.deluxe.is_active();
        if !weak.contains(&true) && !self.preconditioner.as_ref().is_some_and(is_active) {
            return Ok(());
        }
        let may_hold = !self.operator.is_hybrid();
        let Some(Preconditioner { deluxe, schur, .. }) = &self.preconditioner else { return Ok(()) };
        let holds: Vec<bool> = (0..problem.subdomains.len()).map(|own| may_hold && schur.is_weak(own)).collect();
        let beside: Vec<usize> = (0..problem.subdomains.len()).filter(|&own| deluxe.is_beside(own, weak)).collect();
        let mut on = factorising(&mut self.operator, &mut self.preconditioner, timer);
        let follow = |own: usize| self.tangents.follow(own, problem.subdomains[own].id, &mut on);
        let followed = beside.into_iter().try_for_each(follow);
        let hold = |(own, subdomain): (usize, &Subdomain)| {
            let held = if holds[own] { &self.supported[own][..] } else { &[] };
            self.tangents.hold(own, subdomain, held, &mut on)
        };
        let outcome = followed.and_then(|()| problem.subdomains.iter().enumerate().try_for_each(hold));
        agree_on(outcome.err(), problem)?;
        let Some(Preconditioner { deluxe, schur, .. }) = &mut self.preconditioner else { return Ok(()) };
        let (factors, values) = (&self.operator.factors, self.tangents.values());
        let stiffness = |own: usize| (&**factors.symbolic(own), &values[own][..]);
        timer.time("faces", || deluxe.update(weak, fresh, schur, stiffness));
        Ok(())
    }
}

fn factorising<'s>(
    operator: &'s mut DualOperator,
    preconditioner: &'s mut Option<Preconditioner>,
    timer: &'s Timer,
) -> Factorising<'s> {
    let schur = preconditioner.as_mut().map(|preconditioner| &mut preconditioner.schur);
    Factorising { factors: &mut operator.factors, schur, timer }
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
