//! Solves a scene on finer and finer meshes until its error is small enough, or a limit is reached.

use super::Failure;
use super::levels::{Run, unfit};
use super::plan::Plan;
use super::room::make_room;
use crate::model::{self, Discrete, ModelError};
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::record::rows::RefinementRow;
use crate::restart::checkpoint::Unfit;
use crate::results::checkpoint::Checkpoint;
use crate::scene::{ErrorOf, Scene};
use crate::sizing::counts::Counted;
use crate::study::adaptive::error::{Known, estimate};
use crate::study::adaptive::start::start;
use crate::study::adaptive::{Adaptive, marking, parts};
use crate::study::{Begin, Solved};

/// A mesh aims at this share of the error of the one before at least: further off the estimate is not to be trusted ...
const SHARE: f64 = 0.4;
/// ... and at this share of the wanted error: less is left than was foretold.
const AIM: f64 = 0.85;
/// Where that is too large a mesh, these shares are tried.
const SMALLER: [f64; 3] = [0.6, 0.75, 0.9];
/// Meshes at most.
const MOST: usize = 40;
/// The first mesh is enough if its error is so many times smaller than wanted: nothing was compared yet.
const CLEARLY: f64 = 100.0;

impl Run<'_> {
    /// Solves mesh after mesh, from where a checkpoint stands if there is one. Collective.
    pub(super) fn refined(
        &self,
        plan: &mut Plan,
        scene: &Scene,
        mut checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<(Discrete, Solved), Failure> {
        let (comm, timer) = (self.comm, self.timer);
        let is_chosen =
            |name: &str| plan.source.sets.iter().any(|set| set.trim().starts_with(&format!("body.{name}.element")));
        let start = start(scene, is_chosen).map_err(Failure::Scene)?;
        let scene = &start.scene;
        start.notes.iter().for_each(|note| monitor.event(&Event::Note(note.clone())));
        let made = timer.time("discretisation", || Adaptive::new(&start, comm)).map_err(ModelError::from);
        let (mut adaptive, of_meshes) = made?;
        if let Some(file) = &checkpoint {
            let unreadable = |reason| unfit(Unfit::Unreadable(reason));
            adaptive.repeat(comm, file, plan.refinements.len()).map_err(unreadable)?;
        }
        loop {
            let began = timer.total_seconds();
            let meshes = timer.time("discretisation", || adaptive.meshes(scene));
            let mut discrete = timer.time("discretisation", || model::discretise_meshes(scene, meshes, None, comm))?;
            discrete.warnings.extend(of_meshes.iter().cloned());
            let begin = match checkpoint.take() {
                Some(file) => self.at(&discrete, file, monitor)?,
                None if plan.refinements.is_empty() || !scene.step.is_empty() => Begin::Rest,
                None => Begin::Around(timer.time("interpolation", || adaptive.displacement(comm, &discrete))),
            };
            let (discrete, mut solved) =
                self.solve_problem(plan, scene, (discrete, adaptive.arrays()), begin, monitor)?;
            plan.refinements.push(self.row(scene, &plan.refinements, (&discrete, &solved), adaptive.unknowns(), began));
            let row = plan.refinements.last().expect("it was pushed");
            let (found, goal) = (row.error, scene.solver.error.unwrap_or_default());
            monitor.event(&Event::Refinement { row: row.clone(), goal });
            let is_compared = plan.refinements.len() > 1 || found * CLEARLY <= goal;
            if solved.summary.converged != Some(true) || (found <= goal && is_compared) {
                return Ok((discrete, solved));
            }
            let finer =
                timer.time("refinement of the mesh", || self.finer(scene, &adaptive, (&discrete, &solved), plan));
            match finer {
                Ok(finer) => adaptive = finer,
                Err(limit) => {
                    solved.summary.converged = Some(false);
                    solved.summary.error =
                        Some(format!("the error is about {:.2} %, not {:.2} %: {limit}", 100.0 * found, 100.0 * goal));
                    return Ok((discrete, solved));
                }
            }
        }
    }

    /// What a solved mesh took, and its error.
    fn row(
        &self,
        scene: &Scene,
        before: &[RefinementRow],
        (discrete, solved): (&Discrete, &Solved),
        unknowns: u64,
        began: f64,
    ) -> RefinementRow {
        let summary = &solved.summary;
        let (energy, errors) = (summary.state.energy.unwrap_or(f64::NAN), &summary.state.errors);
        let distance = marking::total(self.comm, &parts(discrete, solved, ErrorOf::Energy));
        let gap = errors.duality_gap.unwrap_or(0.0);
        let stress = errors.discretisation.unwrap_or(f64::NAN);
        let of_row = |row: &RefinementRow| Known {
            energy: row.energy,
            distance: row.distance,
            gap: row.gap,
            stress: row.stress,
        };
        let known: Vec<Known> = before.iter().map(of_row).chain([Known { energy, distance, gap, stress }]).collect();
        RefinementRow {
            elements: summary.sizes.elements,
            unknowns,
            error: estimate(scene.solver.error_of, &known, !scene.step.is_empty()),
            energy,
            distance,
            gap,
            stress,
            newton_iterations: summary.newton_iterations,
            hessian_multiplications: summary.counters.hessian_multiplications,
            seconds: self.timer.total_seconds() - began,
        }
    }

    /// The next meshes, or the limit that they would be beyond. Collective.
    fn finer(
        &self,
        scene: &Scene,
        adaptive: &Adaptive,
        (discrete, solved): (&Discrete, &Solved),
        plan: &Plan,
    ) -> Result<Adaptive, String> {
        if plan.refinements.len() == MOST {
            return Err(format!("{MOST} meshes did not reach it"));
        }
        let row = plan.refinements.last().expect("a mesh was solved on");
        let share = scene.solver.error.map_or(1.0, |goal| AIM * goal / row.error).clamp(SHARE, SMALLER[2]);
        let share = match scene.solver.error_of {
            ErrorOf::Energy => share,
            // Its parts are squares.
            ErrorOf::Stress => share.max(SHARE.sqrt()).powi(2),
        };
        let parts = parts(discrete, solved, scene.solver.error_of);
        let mut limit = String::new();
        for share in std::iter::once(share).chain(SMALLER.into_iter().filter(|&smaller| smaller > share)) {
            let mut finer = adaptive.clone();
            finer.refine(self.comm, (discrete, &solved.u), marking::wanted(self.comm, discrete, &parts, share));
            if finer.unknowns() == adaptive.unknowns() {
                return Err("no element has more of it than others".into());
            }
            match self.room(scene, &finer) {
                Ok(()) => return Ok(finer),
                Err(beyond) => limit = beyond,
            }
        }
        Err(limit)
    }

    /// Whether there is room for meshes, and if not, why. Collective.
    fn room(&self, scene: &Scene, adaptive: &Adaptive) -> Result<(), String> {
        let unknowns = adaptive.unknowns();
        if let Some(most) = scene.solver.max_unknowns.filter(|&most| unknowns > most) {
            return Err(format!("the next mesh would have {unknowns} unknowns, and solver.max_unknowns is {most}"));
        }
        let meshes = adaptive.meshes(scene);
        let counted = Counted::of_meshes(scene, &meshes.bodies);
        make_room(self.comm, &counted, self.ignore_memory).map(|_| ()).map_err(|error| error.to_string())
    }
}
