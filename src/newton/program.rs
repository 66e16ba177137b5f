//! The quadratic program of a Newton step, from the last step's multipliers to its own.
//!
//! The dual is `min 1/2 l'F l - l'd` over `l_I >= 0`, `G l = e` with `e = R'f_k`, `d = B K^+ f_k - c_k` (paper, section 4).
//! It starts from the last step's multipliers `l0`, corrected so that `G l0 = e`; the residual
//! `d - F l0 = B K^+ (f_k - B'l0) - c_k` costs one application of F. Without inequalities PCPG solves it. With them the
//! active set does, and where its sets come back SMALSE-M, on the homogeneous problem of `l - l0`. With Coulomb's friction SMALSE-M
//! solves programs with given radii until these are those of the solution.

use super::dual::{Dual, DualFace, Multipliers, WholeDual, sliding};
use super::forcing::Forcing;
use super::problem::TornProblem;
use super::radii;
use super::solution::{DualSolution, Rest};
use crate::feti::coarse::face::CoarseFace;
use crate::feti::coarse::{Coarse, Floating};
use crate::qp::pcpg::{Directions, Pcpg, Report};
use crate::qp::quadratic::{Quadratic, Space};
use crate::qp::slides::{Disc, Slides};
use crate::qp::{Limits, Outcome, Statistics, active_set, power};
use crate::scene::Qp;

/// Of a residual its projection cannot tell more than this share, and surely less than a tenth of it.
const ROUNDING: f64 = 1e-14;
/// As long as all projections are below this share of their residuals, they may be nothing but rounding: bodies move without strain, or
/// as the coarse problem tells already. 1.2e-13 was seen of bricks 40 times as long as thick.
const UNSTRAINED: f64 = 1e-12;

/// A program that is not the last may leave this share of contacts on the wrong set: the next one corrects them along with its own. Not
/// with friction where stiffness jumps: forces of the stiff side on a wrong set are far off, and energies with them.
const ASTRAY: f64 = 0.1;

/// How to solve the programs.
#[derive(Clone, Copy, Debug)]
pub struct ProgramSettings {
    /// Which solver takes a program with inequalities: active sets fall back on SMALSE-M where they cycle.
    pub method: Qp,
    /// Tolerance relative to the first step's residual, which measures the whole displacement.
    pub tolerance: f64,
    /// Products with the Hessian that one program may take.
    pub products: usize,
}

/// What later programs depend on, beside the last multipliers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProgramState {
    /// Rows that the last program kept: its multipliers are zero elsewhere. `None`: the next one starts from scratch.
    pub kept: Option<Vec<bool>>,
    /// The largest first residual of a solve so far that was more than rounding.
    pub reference: Option<f64>,
    /// Whether the next program is the first of a solve.
    pub first: bool,
    /// Norm of `F`, estimated for SMALSE-M.
    pub norm: Option<f64>,
}

/// The solvers with what they carry from step to step. The multipliers themselves belong to the caller.
pub struct Programs {
    settings: ProgramSettings,
    /// Coarse problem of the rows that the last program kept. `None`: the next one starts from scratch.
    face: Option<CoarseFace>,
    /// What friction does on these rows.
    slides: Slides,
    /// The largest first residual of a solve so far that was more than rounding.
    reference: Option<f64>,
    /// Whether the next program is the first of a solve.
    first: bool,
    norm: Option<f64>,
}

impl Programs {
    /// Nothing is known yet.
    pub fn new(settings: ProgramSettings) -> Self {
        Self { settings, face: None, slides: Slides::default(), reference: None, first: true, norm: None }
    }

    /// What the next programs depend on.
    pub fn state(&self) -> ProgramState {
        let kept = self.face().map(|face| face.kept().to_vec());
        ProgramState { kept, reference: self.reference, first: self.first, norm: self.norm }
    }

    /// Goes on from such a state. Collective.
    pub fn resume(&mut self, coarse: &Coarse, state: ProgramState) {
        (self.reference, self.first, self.norm) = (state.reference, state.first, state.norm);
        self.face = None;
        if let Some(kept) = state.kept {
            self.expect(coarse, kept);
        }
    }

    /// Products with the Hessian that one program may take.
    pub fn products(&self) -> usize {
        self.settings.products
    }

    /// Another solve follows.
    pub fn begin(&mut self) {
        self.first = true;
    }

    /// The next program starts from scratch.
    pub fn forget(&mut self) {
        self.face = None;
    }

    /// The next program starts with these rows kept. Collective.
    pub fn expect(&mut self, coarse: &Coarse, kept: Vec<bool>) {
        self.face = Some(CoarseFace::new(coarse, kept));
    }

    /// The next program begins with these discs of friction, and with what the `last` multipliers and what slides, `-slack`, tell of
    /// them; a program that starts from scratch starts without friction. Collective.
    pub fn slide(&mut self, coarse: &Coarse, discs: Vec<Disc>, last: &[f64], slack: &[f64]) {
        let moved: Vec<f64> = slack.iter().map(|slack| -slack).collect();
        self.slides = match &self.face {
            Some(_) => Slides::told(discs, last, &moved),
            None => Slides::open(discs),
        };
        if let Some(face) = self.face.take() {
            self.face = Some(self.on_slides(coarse, face.kept().to_vec()));
        }
    }

    /// Coarse problem of the kept rows, but in friction rows of those that slides leave free. Collective.
    fn on_slides(&self, coarse: &Coarse, mut kept: Vec<bool>) -> CoarseFace {
        self.slides.mark(&mut kept);
        CoarseFace::sliding(coarse, kept, sliding(&self.slides))
    }

    /// Multipliers with `G l = e` next to the `last` ones; the smallest such if the program starts from scratch.
    /// `resultants` are `e = R'f_k`: forces and moments on all clusters, whole on every rank. Collective.
    pub fn start(&self, coarse: &Coarse, last: &[f64], resultants: &[f64]) -> Vec<f64> {
        let all = |coarse| self.on_slides(coarse, vec![true; last.len()]);
        let mut lambda = vec![0.0; last.len()];
        let Some(face) = &self.face else {
            all(coarse).add_balance(coarse, resultants.to_vec(), &mut lambda);
            return lambda;
        };
        lambda.copy_from_slice(last);
        let missing: Vec<f64> = resultants.iter().zip(coarse.apply(&lambda)).map(|(e, b)| e - b).collect();
        let size = resultants.iter().map(|e| e * e).sum::<f64>().sqrt();
        // Open contacts stay open where that can be.
        match face.unbalanced(&missing, size) {
            None => face.add_balance(coarse, missing, &mut lambda),
            Some(_) => all(coarse).add_balance(coarse, missing, &mut lambda),
        }
        lambda
    }

    /// Solves the program with these `resultants` `e` from such multipliers, or solves on. [`Programs::face`] has the kept rows
    /// afterwards. Says whether it was solved to the tolerance of the scene as well. Collective.
    ///
    /// # Errors
    /// If these rows leave a rigid motion free.
    pub fn solve(
        &mut self,
        problem: &TornProblem,
        dual: Dual,
        resultants: &[f64],
        from: Rest,
        forcing: Forcing,
    ) -> Result<(DualSolution, bool), Floating> {
        let size = Multipliers(problem.space, dual.timer).norm(&from.residual);
        let (absolute, rounding) = match self.reference {
            None => (ROUNDING, UNSTRAINED),
            Some(_) => (0.1 * ROUNDING, 0.0),
        };
        let limits = Limits {
            relative: self.settings.tolerance * forcing.floor,
            reference: self.reference,
            absolute: absolute * size,
            rounding: rounding * size,
            drop: forcing.drop,
            products: self.settings.products.saturating_sub(from.spent),
        };
        let found = if problem.constraints.has_inequalities {
            self.inequalities(problem, dual, resultants, from, limits)?
        } else {
            self.on_face((problem, dual, resultants), from, None, limits)
        };
        let at_floor = self.note(&limits, found.first_norm);
        Ok((found, at_floor))
    }

    /// What friction does on them.
    pub fn slides(&self) -> &Slides {
        &self.slides
    }

    /// The rows that the last program kept, with their coarse problem.
    pub fn face(&self) -> Option<&CoarseFace> {
        self.face.as_ref()
    }

    /// The rows that the last program kept; all rows if there was none.
    fn take_face(&mut self, coarse: &Coarse, rows: usize) -> CoarseFace {
        self.face.take().unwrap_or_else(|| self.on_slides(coarse, vec![true; rows]))
    }

    /// Solves the program by the method asked for, and by SMALSE-M where the sets come back. Collective.
    fn inequalities(
        &mut self,
        problem: &TornProblem,
        mut dual: Dual,
        resultants: &[f64],
        from: Rest,
        limits: Limits,
    ) -> Result<DualSolution, Floating> {
        let mut wasted = Statistics::default();
        let (lambda, b) = (from.start.clone(), from.residual.clone());
        if self.settings.method == Qp::ActiveSet {
            let found = self.active_set(problem, &mut dual, resultants, from, limits);
            if found.outcome != Outcome::Cycled {
                return Ok(found);
            }
            wasted = found.statistics;
            dual.restrict_scaling(problem.constraints, &vec![true; b.len()]);
        }
        let mut found = self.smalse(problem, dual, lambda, b, limits)?;
        found.statistics += wasted;
        Ok(found)
    }

    /// Solves the program on the rows that the last one kept, all of them equalities. Directions that are `known` to be conjugate in
    /// the same `F` go first; tolerances refer to the residual before them. Collective.
    pub(super) fn on_face(
        &mut self,
        (problem, dual, resultants): (&TornProblem, Dual, &[f64]),
        Rest { start: mut lambda, mut residual, mut directions, spent }: Rest,
        known: Option<Directions>,
        mut limits: Limits,
    ) -> DualSolution {
        let space = Multipliers(problem.space, dual.timer);
        let rows = dual.timer.time("coarse set-up", || self.take_face(dual.coarse, lambda.len()));
        let slides = self.slides.clone();
        let mut face = DualFace { dual, constraints: problem.constraints, resultants, rows, slides };
        if let Some(known) = known {
            let mut projected = residual.clone();
            face.project(&mut projected);
            limits.reference = Some(space.norm(&projected));
            known.descend(&space, &mut lambda, &mut residual);
            directions = known;
        }
        let mut solver = Pcpg::with(&space, directions);
        let report = solver.solve(&mut face, &mut lambda, &mut residual, &limits);
        let spent = spent + report.statistics.hessian;
        let rest = Rest { start: lambda.clone(), residual, directions: solver.into_directions(), spent };
        self.face = Some(face.rows);
        let Report { outcome, statistics, first_norm, .. } = report;
        DualSolution { balanced: lambda.clone(), lambda, outcome, statistics, first_norm, rest: Some(rest) }
    }

    fn active_set(
        &mut self,
        problem: &TornProblem,
        dual: &mut Dual,
        resultants: &[f64],
        Rest { start: x, residual, directions, spent }: Rest,
        limits: Limits,
    ) -> DualSolution {
        let space = Multipliers(problem.space, dual.timer);
        let bounded = problem.constraints.may_open();
        let rows = dual.timer.time("coarse set-up", || self.take_face(dual.coarse, bounded.len()));
        let mut kept = rows.kept().to_vec();
        let slides = self.slides.clone();
        let mut face = DualFace { dual: dual.reborrow(), constraints: problem.constraints, resultants, rows, slides };
        let timer = face.dual.timer;
        if !timer.time("coarse set-up", || face.complete(&mut kept)) {
            let (outcome, statistics) = (Outcome::Cycled, Statistics::default());
            let (lambda, balanced) = (Vec::new(), Vec::new());
            return DualSolution { lambda, balanced, outcome, statistics, first_norm: f64::NAN, rest: None };
        }
        face.dual.restrict_scaling(problem.constraints, &kept);
        face.slides.adopt(&kept);
        let (slides, uneven) = (face.slides.clone(), problem.constraints.uneven_contacts);
        let rubs_unlike = problem.constraints.uneven && problem.constraints.has_friction;
        let astray = if rubs_unlike { 0.0 } else { ASTRAY };
        let start = active_set::Guess { x, residual, kept, slides, uneven, astray, directions };
        let solution = active_set::solve(&space, &mut face, &bounded, start, &limits);
        let active_set::Solution { x: balanced, residual, slides, outcome, statistics, first_norm, directions, .. } =
            solution;
        self.slides = slides;
        let spent = spent + statistics.hessian;
        let rest = Some(Rest { start: balanced.clone(), residual, directions, spent });
        let mut lambda = balanced.clone();
        problem.laws().project(&mut lambda);
        let DualFace { dual, rows, .. } = face;
        self.face = Some(dual.timer.time("coarse set-up", || rows.settled(dual.coarse)));
        DualSolution { lambda, balanced, outcome, statistics, first_norm, rest }
    }

    fn smalse(
        &mut self,
        problem: &TornProblem,
        dual: Dual,
        start: Vec<f64>,
        b: Vec<f64>,
        mut limits: Limits,
    ) -> Result<DualSolution, Floating> {
        let (timer, coarse) = (dual.timer, dual.coarse);
        let space = Multipliers(problem.space, timer);
        let projector = timer.time("coarse set-up", || coarse.projector())?;
        let mut dual = WholeDual::new(dual, projector, problem.constraints, self.slides.clone());
        let mut projected = b.clone();
        let mean = timer.time("coarse problem", || projector.project(&mut projected));
        let mut statistics = Statistics::default();
        let mut x = vec![0.0; b.len()];
        let (mut outcome, mut first_norm) = (Outcome::Converged, 0.0);
        let size = space.norm(&projected);
        if size != 0.0 {
            if self.norm.is_none() {
                let estimate = power::norm(&space, &mut dual, &projected);
                statistics.hessian += estimate.as_ref().map_or(0, |e| e.products);
                self.norm = estimate.map(|e| e.norm);
            }
            // The first program of all refers to the residual on all rows, as the active set's does.
            self.reference = self.reference.or(limits.told(size));
            limits.reference = self.reference;
            limits.products = limits.products.saturating_sub(statistics.hessian);
            let program = radii::Program {
                space: &space,
                function: &mut dual,
                b: &projected,
                start: &start,
                lower: problem.laws().lower_bounds(&start),
                has_friction: problem.constraints.has_friction,
                // With a norm that is not a number SMALSE-M ends as `Outcome::NotFinite`.
                norm: self.norm.unwrap_or(f64::NAN),
                multiplier: self.face.as_ref().map(|face| first_multiplier(face, coarse, &b, &mean)),
            };
            let found = radii::solve(program, &mut self.slides, limits);
            statistics += found.statistics;
            (x, outcome, first_norm) = (found.x, found.outcome, found.first_norm);
        } else {
            let radii = self.slides.radii(&start);
            self.slides.settle(&start, &radii);
        }
        let mut lambda: Vec<f64> = start.iter().zip(&x).map(|(s, x)| s + x).collect();
        dual.project(&mut x);
        let balanced = start.iter().zip(&x).map(|(s, x)| s + x).collect();
        problem.laws().project(&mut lambda);
        let kept = problem.laws().kept(&lambda, 0.0);
        self.face = Some(timer.time("coarse set-up", || self.on_slides(coarse, kept)));
        Ok(DualSolution { lambda, balanced, outcome, statistics, first_norm, rest: None })
    }

    /// Takes the `first` residual of a program down as the reference of all tolerances, if it is that of the first program
    /// of a solve and larger than those of earlier solves, or the first of all that is more than rounding. Returns whether the
    /// program was to be solved to the tolerance of the scene.
    fn note(&mut self, limits: &Limits, first: f64) -> bool {
        match &mut self.reference {
            Some(reference) if self.first => *reference = reference.max(first),
            Some(_) => {}
            None => self.reference = limits.told(first),
        }
        self.first = false;
        limits.relative * self.reference.unwrap_or(first) >= limits.drop * first
    }
}

/// The multiplier of `G x = 0` that SMALSE-M begins with. It follows from `b`, less its `mean` motion, on the rows that the last program
/// kept. The slack of open contacts is part of `b` too, but is no rigid motion. Collective.
fn first_multiplier(face: &CoarseFace, coarse: &Coarse, b: &[f64], mean: &[f64]) -> Vec<f64> {
    let mut a = face.amplitudes(coarse, b);
    a.iter_mut().zip(mean).for_each(|(a, m)| *a -= m);
    let mut multiplier = vec![0.0; b.len()];
    coarse.add_transpose(1.0, &a, &mut multiplier);
    multiplier
}
