//! The limit load factor between two bounds, by loads that follow the work they do ([`super::control`]).
//!
//! Each equilibrium without hardening is a stress within the yield surface: its `zeta` is a lower bound of the limit of the mesh. What
//! bodies moved by since the equilibrium before is a mechanism `v`, and so is the response of their tangents to the loads. Each has
//!
//! ```text
//! (most power that stresses have on v  -  f_0'v) / f_1'v,
//! ```
//!
//! an upper bound where `v` keeps volumes; what is left of their change, which falls as the flow spreads, counts with the pressure
//! that is there ([`crate::assembly::dissipation`]). The least one counts. Both are bounds of the limit of the mesh; that of conforming
//! meshes is above the exact one.

use super::control::add;
use super::iterate;
use super::iteration::Newton;
use super::snapshot::Reached;
use crate::feti::Torn;
use crate::monitor::timing::Timer;

/// What an equilibrium tells of the limit load.
pub struct Bounds {
    /// A lower bound: its own factor.
    pub lower: f64,
    /// An upper bound, from its mechanism.
    pub upper: f64,
    /// The work `alpha` (energy).
    pub work: f64,
    /// The work without the loads that grow (energy).
    pub rest: f64,
}

impl Newton<'_> {
    /// The mechanism since the equilibrium before, or since rest.
    fn mechanism(&self) -> Torn {
        let mut v = self.iterate.u.clone();
        self.reached.iter().for_each(|reached| add(-1.0, &reached.u, &mut v));
        v
    }

    /// The lower and the upper bound at an equilibrium; `None` if loads do not follow their work, or do none. Collective.
    pub fn bounds(&self) -> Option<Bounds> {
        let (control, problem) = (self.control.as_ref()?, &self.problem);
        let of_way = control.upper(problem, &self.iterate.u, self.mechanism());
        let upper = of_way.into_iter().chain(control.reach.upper).reduce(f64::min)?;
        let (lower, work, rest) = (control.reach.factor, control.reach.work?, control.reach.rest);
        lower.is_finite().then_some(Bounds { lower, upper, work, rest })
    }

    /// Goes on from an equilibrium, along its mechanism, until that has done so many times the work. Since rest bodies also moved by what
    /// others than the loads that grow did, so the way is no longer than the work is. Collective.
    pub fn press_on(&mut self, times: f64, timer: &Timer) {
        let v = self.mechanism();
        let Some(control) = &mut self.control else { return };
        let [before, along] = control.works(&self.problem, [&self.iterate.u, &v])[..] else { unreachable!() };
        let done = if self.reached.is_some() { along } else { before - control.reach.rest };
        control.reach.work = Some(before + (times - 1.0) * done);
        (control.reach.number, control.reach.upper) = (control.reach.number + 1, None);
        let length = if along > 0.0 { (times - 1.0) * (done / along).min(1.0) } else { 0.0 };
        let mut u = self.iterate.u.clone();
        add(length, &v, &mut u);
        self.problem.make_admissible(&mut u);
        let reached = Reached { u: self.iterate.u.clone(), lambda: self.iterate.lambda.clone() };
        self.begin(u, Some(&reached.lambda), timer);
        self.reached = Some(reached);
    }

    /// Tries so much of the way again, from the last equilibrium, where loads had this `factor`, or from rest. Collective.
    pub fn fall_back(&mut self, share: f64, factor: f64, timer: &Timer) {
        let reached = self.reached.take();
        let mut u = reached.as_ref().map_or_else(|| self.problem.gather.zeros(), |reached| reached.u.clone());
        self.problem.make_admissible(&mut u);
        let Some(control) = &mut self.control else { return };
        let before = reached.as_ref().map_or(control.reach.rest, |_| control.works(&self.problem, [&u])[0]);
        control.reach.work = control.reach.work.map(|work| before + share * (work - before));
        (control.reach.factor, control.reach.upper) = (factor, None);
        self.problem.loads = control.loads();
        self.solver.forget();
        self.begin(u, reached.as_ref().map(|reached| &reached.lambda[..]), timer);
        self.reached = reached;
    }

    /// Begins the iteration for another work; contacts press where these multipliers say so.
    fn begin(&mut self, u: Torn, lambda: Option<&[f64]>, timer: &Timer) {
        let kept = lambda.map(|lambda| self.problem.laws().kept(lambda, 0.0));
        let rest = vec![0.0; self.problem.gather.rows()];
        let first = iterate::first(&self.problem, &mut self.solver, (u, rest), kept, None, timer);
        self.start_at(first, true);
    }
}
