//! One Newton step: the minimiser `du` of the quadratic model `J_k` over the admissible steps (paper, (9) and (10)).
//!
//! ```text
//! f_k = f - F(u_k),   c_k = c - B u_k,   K_k = K(u_k)
//! min 1/2 l'F l - l'd  over  l_I >= 0,  G l = e,   with  F = B K_k^+ B',  d = B K_k^+ f_k - c_k,  e = R'f_k      (14)
//! du = K_k^+ (f_k - B'l) + R alpha
//! ```
//!
//! The operators are those of [`crate::feti`], the program is solved by [`super::program`].

use std::sync::Arc;

use super::dual::Dual;
use super::forcing::{Forcing, TIGHTEST};
use super::problem::{State, TornProblem};
use super::program::{ProgramSettings, ProgramState, Programs};
use super::solution::{DualSolution, Rest};
use crate::assembly::flow::{self, Flow};
use crate::assembly::internal;
use crate::constraint::friction::Slider;
use crate::feti::Torn;
use crate::feti::coarse::Coarse;
use crate::feti::coarse::motion;
use crate::feti::coarse::recover;
use crate::feti::dual::operator::DualOperator;
use crate::feti::inverse::basis::Bases;
use crate::feti::inverse::factor::NotDefinite;
use crate::feti::inverse::tangents::Linearisation;
use crate::feti::preconditioner::Preconditioner;
use crate::feti::preconditioner::flexibility::Flexibility;
use crate::monitor::timing::Timer;
use crate::qp::pcpg::Directions;
use crate::qp::slides::Disc;
use crate::qp::{Outcome, Statistics};
use crate::sparse::cholesky::Precision;

/// Residual of the subdomains' problems that is small enough whatever the accuracy of the step.
const EXACT: f64 = 1e-8;

/// A force on a node moves it this many times as far as if its neighbours stood still. Slides of friction find their sets soonest
/// with 3 to 6.
const NEIGHBOURS: f64 = 3.0;

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
    /// Whether the model of the step was exact: nothing yields, neither before nor behind it.
    pub is_exact: bool,
    /// Residual of the subdomains' problems `K du = f - F(u) - B'lambda` that rounding leaves, relative to their forces.
    pub local_residual: f64,
    /// Applications of F, those around the quadratic program and of refinement included.
    pub applications: usize,
    /// Subdomains with a new factor, over all ranks; those that share one count, too.
    pub factorisations: usize,
    /// What its program knows of F; nothing after SMALSE-M.
    pub directions: Directions,
}

/// What later steps depend on, beside the multipliers.
#[derive(Clone, Debug)]
pub struct SolverState {
    /// Of the quadratic programs.
    pub programs: ProgramState,
    /// Directions of flow in each own subdomain.
    pub flows: Vec<Flow>,
    /// What new factors are stored in at least.
    pub precision: Precision,
    /// The states that the factors of each own subdomain were made from.
    pub bases: Vec<Bases>,
}

/// What is kept from step to step: `F`, `P`, the preconditioner, the last program.
pub struct StepSolver<'a> {
    pub(super) operator: DualOperator<'a>,
    pub(super) coarse: Coarse<'a>,
    pub(super) preconditioner: Option<Preconditioner<'a>>,
    pub(super) programs: Programs,
    /// Directions of flow in each own subdomain.
    flows: Vec<Flow>,
}

impl<'a> StepSolver<'a> {
    /// On operators that are set up for the problem's subdomains; nothing is factorised before the first step.
    pub fn new(
        operator: DualOperator<'a>,
        coarse: Coarse<'a>,
        preconditioner: Option<Preconditioner<'a>>,
        settings: ProgramSettings,
    ) -> Self {
        let flows = vec![Flow::default(); operator.inverse.bases().len()];
        Self { operator, coarse, preconditioner, programs: Programs::new(settings), flows }
    }

    /// What the next steps depend on.
    pub fn state(&self) -> SolverState {
        let inverse = &self.operator.inverse;
        let (precision, bases) = (inverse.precision(), inverse.bases().to_vec());
        SolverState { programs: self.programs.state(), flows: self.flows.clone(), precision, bases }
    }

    /// Goes on from such a state: makes the factors again, to the same bits. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent is singular.
    pub fn resume(&mut self, problem: &TornProblem, state: SolverState, timer: &Timer) -> Result<(), String> {
        let SolverState { programs, flows, precision, bases } = state;
        self.flows = flows;
        self.programs.resume(&self.coarse, programs);
        let interiors = self.preconditioner.as_mut().map(Preconditioner::interiors);
        let outcome =
            self.operator.remake(&problem.firm_regions(), (precision, bases), interiors, problem.space, timer);
        outcome.map_err(|singular| singular.to_string())
    }

    /// Starts from multipliers that balance a displacement as well as the rows that are `kept` there can:
    /// `(B B')^-1 B (f - F(u))` on these rows, as far as their laws admit it, and zero on others. Returns them. Collective.
    pub fn expect(&mut self, problem: &TornProblem, state: &State, kept: Vec<bool>) -> Vec<f64> {
        let mut lambda = vec![0.0; kept.len()];
        problem.gather.apply(&problem.unbalance(state), &mut lambda);
        problem.coupling.borrow_mut().solve((problem.gather, problem.space), &mut lambda, |row| kept[row]);
        problem.laws().project_onto(&kept, &mut lambda);
        self.programs.expect(&self.coarse, kept);
        lambda
    }

    /// Forgets the multipliers and factors of a solve that failed.
    pub fn forget(&mut self) {
        self.programs.forget();
        self.operator.inverse.forget();
    }

    /// Another solve follows, from what is committed now. Its tolerances refer to its first residual if that is larger than
    /// those of earlier solves.
    pub fn begin(&mut self) {
        self.programs.begin();
        self.flows.fill(Flow::default());
        self.operator.inverse.begin();
    }

    /// From now on factorises in double precision; false if that was so before.
    pub fn sharpen(&mut self) -> bool {
        self.operator.inverse.sharpen()
    }

    /// How far one step of a linear problem may reduce the gradient.
    pub fn linear_drop(&self) -> f64 {
        match self.operator.inverse.precision() {
            Precision::Single => TIGHTEST,
            Precision::Double => 0.0,
        }
    }

    /// Updates the directions of flow after a step of this `length` from `u` to `next` ([`crate::assembly::flow`]). Local.
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

    /// Solves for the step at `u` from the `last` multipliers, those of the step before or of the last trial of this one; `alive` is told the applications of F so far.
    /// Where nothing yields the program goes on, if it may, as far as that of a linear problem. Collective.
    ///
    /// # Errors
    /// A message, the same on every rank, if a tangent or the coarse problem is singular.
    pub fn solve(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        last: &[f64],
        (mut forcing, goes_on): (Forcing, bool),
        timer: &Timer,
        alive: &dyn Fn(usize),
    ) -> Result<Step, String> {
        let before = self.operator.applications();

        // K_k, its factors, and the preconditioner.
        let factorisations =
            self.update(problem, (u, state), forcing.left, timer).map_err(|singular| singular.to_string())?;

        // f_k and c_k (9), less what pinned supports move.
        let slack = problem.slack(u);
        let (mut forces, mut open) = (problem.unbalance(state), slack.clone());
        let lifted = self.operator.lift(problem.constraints, &mut forces, &mut open);

        // From multipliers with G lambda = e to lambda (14).
        let (resultants, mut from) = self.start(problem, (&forces, &open), last, timer);
        let (mut statistics, mut is_exact) = (Statistics::default(), false);
        let (found, at_floor, mut recovered, rest) = loop {
            let dual = Dual {
                operator: &mut self.operator,
                coarse: &self.coarse,
                preconditioner: self.preconditioner.as_mut(),
                space: problem.space,
                timer,
                alive: &|applications| alive(applications - before),
            };
            let found = self.programs.solve(problem, dual, &resultants, from, forcing);
            let (mut found, at_floor) = found.map_err(|floating| floating.to_string())?;
            statistics += found.statistics;

            // du = K^+ (f_k - B'lambda) + R alpha.
            let wanted = forcing.drop.max(EXACT);
            let mut recovered = self.recover(problem, (&forces, &open), &mut found, wanted, timer);
            for (du, lifted) in recovered.du.iter_mut().flatten().zip(lifted.iter().flatten().flatten()) {
                *du += lifted;
            }
            let was_exact = is_exact;
            is_exact = found.outcome == Outcome::Converged && stays_elastic(problem, (u, state), &recovered.du);
            match found.rest.take() {
                // What was solved is no approximation, and worth solving on.
                Some(rest) if goes_on && is_exact && !was_exact && !at_floor && !problem.is_linear() => {
                    from = rest;
                    forcing.drop = (self.linear_drop() / forcing.drop).min(1.0);
                }
                rest => break (found, at_floor, recovered, rest),
            }
        };

        // What the tolerance of the program left open is closed.
        if let (Some(preconditioner), Some(face)) = (&mut self.preconditioner, self.programs.face()) {
            let kept = self.programs.slides().held(face.kept());
            preconditioner.close(problem.constraints, &slack, &kept, &mut recovered.du, timer);
        }
        let Recovered { du, local_residual, refined } = recovered;
        let DualSolution { lambda, outcome, .. } = found;
        let applications = self.operator.applications() - before + refined;
        let directions = rest.map(Rest::into_directions).unwrap_or_default();
        Ok(Step {
            du,
            lambda,
            outcome,
            statistics,
            at_floor,
            is_exact,
            local_residual,
            applications,
            factorisations,
            directions,
        })
    }

    /// Where the program (14) starts: `e`, multipliers with `G lambda = e` near the `last` ones, and the residual `d - F lambda` there.
    /// Collective.
    fn start(
        &mut self,
        problem: &TornProblem,
        (forces, open): (&Torn, &[f64]),
        last: &[f64],
        timer: &Timer,
    ) -> (Vec<f64>, Rest) {
        if problem.constraints.has_friction {
            let discs = self.discs(problem);
            timer.time("coarse set-up", || self.programs.slide(&self.coarse, discs, last, open));
        }
        let (resultants, lambda) = timer.time("coarse problem", || {
            let e = recover::resultants(problem.subdomains, problem.modes, &self.coarse, forces);
            let lambda = self.programs.start(&self.coarse, last, &e);
            (e, lambda)
        });
        let mut residual = vec![0.0; open.len()];
        self.respond(&lambda, &mut forces.clone(), &mut residual, timer);
        residual.iter_mut().zip(open).for_each(|(r, c)| *r -= c);
        (resultants, Rest::new(lambda, residual))
    }

    /// Assembles the tangents at `u` and factorises those that changed by more than `left`; the preconditioner follows. Returns
    /// the number of new factors over all ranks. Collective.
    fn update(
        &mut self,
        problem: &TornProblem,
        (u, state): (&Torn, &State),
        left: f64,
        timer: &Timer,
    ) -> Result<usize, NotDefinite> {
        let Self { operator, preconditioner, flows, .. } = self;
        let at = Linearisation { regions: &problem.firm_regions(), u, yielding: &state.yielding, flows };
        let interiors = preconditioner.as_mut().map(Preconditioner::interiors);
        let changes = operator.update(&at, left, interiors, problem.space, timer)?;
        if let Some(preconditioner) = preconditioner {
            let TornProblem { subdomains, constraints, space, .. } = problem;
            preconditioner.update(operator, &changes, subdomains, constraints, space, timer)?;
        }
        Ok(changes.refreshed as usize)
    }

    /// `du` from the forces `f_k` and the multipliers that were `found`, to which it adds what the program does not see; `open` is
    /// `c_k`. The subdomains' problems are solved to `wanted`, relative. Collective.
    pub(super) fn recover(
        &mut self,
        problem: &TornProblem,
        (forces, open): (&Torn, &[f64]),
        found: &mut DualSolution,
        wanted: f64,
        timer: &Timer,
    ) -> Recovered {
        let constraints = problem.constraints;
        let DualSolution { lambda, balanced, .. } = found;

        // K^+ (f_k - B'lambda), by the multipliers that are in balance, and what rounding leaves of K du = f_k - B'lambda.
        let (mut du, mut defect) = (forces.clone(), vec![0.0; open.len()]);
        self.respond(balanced, &mut du, &mut defect, timer);
        self.operator.add_hidden(constraints, (forces, &du), [lambda, balanced]);
        let mut local = forces.clone();
        problem.gather.add_transpose(-1.0, balanced, &mut local);
        let (local_residual, refined) = timer
            .time("refinement", || self.operator.inverse.refine(&|x| problem.space.norm(x), (&local, &mut du), wanted));
        if refined > 0 {
            self.operator.rejoin(&mut du);
            self.operator.add_hidden(constraints, (forces, &du), [lambda, balanced]);
            problem.gather.apply(&du, &mut defect);
        }

        // R alpha, from B du - c_k in the rows that are kept.
        defect.iter_mut().zip(open).for_each(|(d, c)| *d -= c);
        self.programs.slides().add_compliance(-1.0, balanced, &mut defect);
        if let Some(face) = self.programs.face() {
            let coarse = &self.coarse;
            let back =
                timer.time("coarse problem", || motion::amplitudes(face, coarse, problem.space, constraints, &defect));
            recover::add_rigid_motion(problem.subdomains, problem.modes, coarse, -1.0, &back, &mut du);
        }
        Recovered { du, local_residual, refined }
    }

    /// The discs of friction. Takes the neighbour exchanges of [`Flexibility::new`] if there is no preconditioner.
    fn discs(&self, problem: &TornProblem) -> Vec<Disc> {
        let constraints = problem.constraints;
        let stiffness = (0..problem.subdomains.len()).map(|own| self.operator.inverse.stiffness(own));
        let stiffness = stiffness.map(|(symbolic, values)| (&symbolic.pattern, values));
        let made = match &self.preconditioner {
            Some(_) => None,
            None => Some(Flexibility::new(constraints, problem.gather, stiffness)),
        };
        let known = self.preconditioner.as_ref().map(Preconditioner::flexibility);
        let flexibility = known.or(made.as_ref()).expect("one of them is there");
        let disc = |(slider, radius): (&Slider, [f64; 2])| {
            let rows: Vec<usize> = slider.tangents.iter().map(|tangent| tangent.row).collect();
            let sum: f64 = rows.iter().map(|&row| flexibility.of_row(constraints, row)).sum();
            Disc {
                normal: slider.normal,
                entries: [rows[0], rows[rows.len() - 1]],
                radius,
                flexibility: sum / rows.len() as f64 * NEIGHBOURS,
            }
        };
        problem.laws().radii().map(disc).collect()
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`.
    pub(super) fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64], timer: &Timer) {
        timer.time("dual operator", || self.operator.respond(x, torn, y));
    }
}

/// Whether nothing yields at `u` nor at `u + du`. Collective.
fn stays_elastic(problem: &TornProblem, (u, state): (&Torn, &State), du: &Torn) -> bool {
    if problem.is_linear() || state.plastic > 0 {
        return problem.is_linear();
    }
    let next = |own: usize| -> Vec<f64> { u[own].iter().zip(&du[own]).map(|(u, du)| u + du).collect() };
    let yields = problem
        .regions()
        .iter()
        .enumerate()
        .any(|(own, region)| internal::yielding(region, &next(own)).next().is_some());
    problem.space.maximum(f64::from(yields)) == 0.0
}

/// A displacement from multipliers.
pub(super) struct Recovered {
    pub du: Torn,
    /// See [`Step::local_residual`].
    pub local_residual: f64,
    /// Applications of `K^+` in refinement.
    pub refined: usize,
}
