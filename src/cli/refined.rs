//! Solves a scene on finer and finer meshes until its error is small enough, or a limit is reached.

use std::ops::Range;

use super::levels::{Run, unfit};
use super::plan::Plan;
use super::room::make_room;
use super::{Failure, is_chosen};
use crate::feti::Torn;
use crate::mesh::SolidMesh;
use crate::mesh::quality::Quality;
use crate::model::meshes::Meshes;
use crate::model::{self, Discrete, ModelError};
use crate::monitor::Monitor;
use crate::monitor::events::{Event, Sink};
use crate::record::rows::RefinementRow;
use crate::record::state::State;
use crate::restart::checkpoint::Unfit;
use crate::results::checkpoint::Checkpoint;
use crate::scene::{ErrorOf, Limit, Scene};
use crate::sizing::counts::Counted;
use crate::study::adaptive::aim::shares;
use crate::study::adaptive::error::{estimate, is_history, is_known, vanishes};
use crate::study::adaptive::start::{Start, start};
use crate::study::adaptive::{Adaptive, counting, marking, parts};
use crate::study::{Begin, Solved};

/// Meshes at most.
const MOST: usize = 40;
/// The first mesh is enough if its error is so many times smaller than wanted: nothing was compared yet.
const CLEARLY: f64 = 100.0;
/// How far bounds of a limit load may be apart on meshes between the first one, which chooses the work, and the last.
const ROUGH: f64 = 0.05;

/// What to solve on.
enum On {
    /// Other meshes.
    Meshes(Meshes),
    /// The same ones again, from the displacement that is known there.
    Same(Box<Discrete>, Torn),
}

impl Run<'_> {
    /// Solves mesh after mesh, from where a checkpoint stands if there is one. What goes wrong on a finer mesh leaves the result
    /// of the one before. Collective.
    pub(super) fn refined(
        &self,
        plan: &mut Plan,
        scene: &Scene,
        mut checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<(Discrete, Solved), Failure> {
        let start = start(scene, |name| is_chosen(&plan.source, name)).map_err(Failure::Scene)?;
        start.notes.iter().for_each(|note| monitor.event(&Event::Note(note.clone())));
        let refinements = plan.refinements.len() - usize::from(plan.again);
        let (mut adaptive, meshes) = self.first_meshes(&start, &checkpoint, refinements, monitor)?;
        let (scene, goal) = (&start.scene, start.scene.solver.error.unwrap_or_default());
        let (mut before, mut next) = (None, On::Meshes(meshes));
        loop {
            let began = self.timer.total_seconds();
            let rough = rough(plan, scene);
            let solved_as = rough.as_ref().unwrap_or(scene);
            let found = self.on(plan, solved_as, (&adaptive, next), checkpoint.take(), monitor);
            let (discrete, solved) = match (found, before.take()) {
                (Ok(found), _) if found.1.summary.converged == Some(true) => found,
                (Ok((_, failed)), Some(before)) => {
                    return Ok(given_up(before, plan, goal, &failed.summary.error.unwrap_or_default()));
                }
                (Err(failure @ (Failure::Model(_) | Failure::Study(_))), Some(before)) => {
                    return Ok(given_up(before, plan, goal, &failure.to_string()));
                }
                (found, _) => return found,
            };
            let increments = counting(&solved.summary, plan.refinements.is_empty());
            let row = self.row((&discrete, &solved), &increments, adaptive.unknowns(), began);
            let row = with_error(plan, row, &scene.solver.error_of);
            monitor.event(&Event::Refinement { row: row.clone(), goal });
            if row.goal.is_some_and(|number| vanishes(&number)) {
                const NOTHING: &str = "the number is zero, and errors are relative to it";
                return Ok(given_up((discrete, solved), plan, goal, NOTHING));
            }
            let (error, is_known) = (row.error, is_known(&scene.solver.error_of, &plan.refinements));
            let is_enough = error <= goal && (is_known || error * CLEARLY <= goal);
            let finer = || self.finer(scene, &adaptive, (&discrete, &solved), &increments, plan);
            let finer = (!is_enough).then(|| self.timer.time("refinement of the mesh", finer));
            match finer {
                Some(Ok(finer)) => {
                    let (meshes, tight);
                    (adaptive, meshes, tight) = finer;
                    tight.into_iter().for_each(|text| monitor.event(&Event::Warning(text)));
                    (before, next, plan.again) = (Some((discrete, solved)), On::Meshes(meshes), false);
                }
                _ if rough.is_some() => {
                    monitor.event(&Event::Note("bounds of the limit load on this mesh".into()));
                    (next, plan.again) = (On::Same(Box::new(discrete), solved.u), true);
                }
                Some(Err(limit)) if error > goal => return Ok(given_up((discrete, solved), plan, goal, &limit)),
                _ => return Ok((discrete, solved)),
            }
        }
    }

    /// The meshes to begin with, or those of a checkpoint. Collective.
    fn first_meshes(
        &self,
        Start { scene, read, .. }: &Start,
        checkpoint: &Option<Checkpoint>,
        refinements: usize,
        monitor: &mut Monitor,
    ) -> Result<(Adaptive, Meshes), Failure> {
        let made = self.timer.time("discretisation", || Adaptive::new(scene, read, self.comm));
        let mut adaptive = made.map_err(ModelError::from)?;
        adaptive.notes.iter().for_each(|note| monitor.event(&Event::Note(note.clone())));
        if let Some(file) = checkpoint {
            let unreadable = |reason| unfit(Unfit::Unreadable(reason));
            adaptive.repeat(self.comm, file, refinements).map_err(unreadable)?;
            let meshes = self.timer.time("discretisation", || adaptive.meshes(scene));
            return Ok((adaptive, meshes));
        }
        let (mut meshes, tight) = self.room(scene, &adaptive).map_err(Failure::Memory)?;
        adaptive.warnings.extend(tight);
        meshes.warnings.clone_from(&adaptive.warnings);
        Ok((adaptive, meshes))
    }

    /// Solves on meshes, near the displacement that these have. Collective.
    fn on(
        &self,
        plan: &Plan,
        scene: &Scene,
        (adaptive, on): (&Adaptive, On),
        checkpoint: Option<Checkpoint>,
        monitor: &mut Monitor,
    ) -> Result<(Discrete, Solved), Failure> {
        let (comm, timer) = (self.comm, self.timer);
        let limit = plan.refinements.last().and_then(|row| row.limit_load);
        let (discrete, begin) = match on {
            On::Same(discrete, u) => (*discrete, Begin::Around(u, limit)),
            On::Meshes(meshes) => {
                let discrete = timer.time("discretisation", || model::discretise_meshes(scene, meshes, None, comm))?;
                let begin = match checkpoint {
                    Some(file) => self.at(&discrete, file, monitor)?,
                    None if plan.refinements.is_empty() || is_history(&plan.refinements) => Begin::Rest,
                    None => {
                        Begin::Around(timer.time("interpolation", || adaptive.displacement(comm, &discrete)), limit)
                    }
                };
                (discrete, begin)
            }
        };
        self.solve_problem(plan, scene, (discrete, adaptive.arrays()), begin, monitor)
    }

    /// What a solved mesh took; its error is not known yet.
    fn row(
        &self,
        (discrete, solved): (&Discrete, &Solved),
        increments: &Range<usize>,
        unknowns: u64,
        began: f64,
    ) -> RefinementRow {
        let summary = &solved.summary;
        let steps = &summary.steps[increments.clone()];
        let limit_load = steps.last().and_then(|row| row.limit_load);
        let of_limit = limit_load.map_or(0.0, |limit| limit.factor * limit.work);
        // Of all increments the largest, as elements have it.
        let largest = |of: fn(&State) -> Option<f64>| {
            let values = steps.iter().filter_map(|step| of(&step.state));
            values.filter(|value| value.is_finite()).reduce(f64::max)
        };
        let of_duals: u64 =
            summary.steps.iter().filter_map(|row| row.goal).map(|goal| goal.hessian_multiplications).sum();
        let energy =
            steps.last().and_then(|row| row.state.energy).filter(|energy| energy.is_finite()).unwrap_or_default()
                + of_limit;
        RefinementRow {
            elements: summary.sizes.elements,
            unknowns,
            increments: summary.steps.len() as u64,
            error: f64::MAX,
            energy,
            size: if limit_load.is_some() {
                energy.abs()
            } else {
                largest(|state| state.energy.map(f64::abs)).unwrap_or_default()
            },
            distance: marking::total(self.comm, &parts(discrete, solved, &ErrorOf::Energy, increments)),
            consistency: steps.iter().filter_map(|step| step.consistency).fold(0.0, f64::max),
            gap: largest(|state| state.errors.duality_gap).unwrap_or_default(),
            stress: largest(|state| state.errors.discretisation).unwrap_or(f64::MAX),
            limit_load,
            goal: steps.last().and_then(|row| row.goal),
            newton_iterations: summary.newton_iterations,
            hessian_multiplications: summary.counters.hessian_multiplications.map(|count| count + of_duals),
            seconds: self.timer.total_seconds() - began,
        }
    }

    /// The next meshes, with a warning where they hardly have room, or the limit that they would be beyond. Collective.
    fn finer(
        &self,
        scene: &Scene,
        adaptive: &Adaptive,
        (discrete, solved): (&Discrete, &Solved),
        increments: &Range<usize>,
        plan: &Plan,
    ) -> Result<(Adaptive, Meshes, Option<String>), String> {
        if plan.refinements.len() == MOST {
            return Err(format!("{MOST} meshes did not reach it"));
        }
        let of = &scene.solver.error_of;
        let parts = parts(discrete, solved, of, increments);
        let mut limit = String::new();
        for share in shares(of, scene.solver.error.unwrap_or_default(), &plan.refinements) {
            let mut finer = adaptive.clone();
            finer.refine(self.comm, (discrete, &solved.u), marking::wanted(self.comm, discrete, &parts, share));
            if finer.unknowns() == adaptive.unknowns() {
                return Err("no element has more of it than others".into());
            }
            match self.room(scene, &finer) {
                Ok((meshes, tight)) => return Ok((finer, meshes, tight)),
                Err(beyond) => limit = beyond,
            }
        }
        Err(limit)
    }

    /// The meshes, if there is room for them, and a warning if there hardly is; if not, why. Collective.
    fn room(&self, scene: &Scene, adaptive: &Adaptive) -> Result<(Meshes, Option<String>), String> {
        let unknowns = adaptive.unknowns();
        if let Some(most) = scene.solver.max_unknowns.filter(|&most| unknowns > most) {
            return Err(format!("the next mesh would have {unknowns} unknowns, and solver.max_unknowns is {most}"));
        }
        let meshes = adaptive.meshes(scene);
        let is_sound = |mesh: &SolidMesh| Quality::of(self.comm, &mesh.portion).is_sound();
        if !meshes.solids.values().all(is_sound) {
            return Err(
                "elements of a thin wall would turn inside out on its curved surface; begin with more cells".into()
            );
        }
        let counted = Counted::of_meshes(scene, &meshes.bodies);
        let tight = make_room(self.comm, &counted, self.ignore_memory).map_err(|error| error.to_string())?;
        Ok((meshes, tight))
    }
}

/// A limit load as it is sought on the present mesh, if that is neither the first nor known to be the last one.
fn rough(plan: &Plan, scene: &Scene) -> Option<Scene> {
    let limit = scene.limit.as_ref().filter(|_| !plan.refinements.is_empty() && !plan.again)?;
    let limit = Limit { tolerance: limit.tolerance.max(ROUGH), ..limit.clone() };
    Some(Scene { limit: Some(limit), ..scene.clone() })
}

/// Takes the row of the last mesh down, and returns it with its error. If that was solved on before it counts as well.
fn with_error(plan: &mut Plan, mut row: RefinementRow, of: &ErrorOf) -> RefinementRow {
    if let Some(rough) = plan.refinements.pop_if(|_| plan.again) {
        let sum = |a: Option<u64>, b: Option<u64>| a.zip(b).map(|(a, b)| a + b);
        row.newton_iterations = sum(row.newton_iterations, rough.newton_iterations);
        row.hessian_multiplications = sum(row.hessian_multiplications, rough.hessian_multiplications);
        row.seconds += rough.seconds;
    }
    plan.refinements.push(row);
    // Files have no infinite numbers.
    let error = estimate(of, &plan.refinements).min(f64::MAX);
    let row = plan.refinements.last_mut().expect("a mesh was solved on");
    row.error = error;
    row.clone()
}

/// The result of the mesh before, and why there is no better one.
fn given_up((discrete, mut solved): (Discrete, Solved), plan: &Plan, goal: f64, reason: &str) -> (Discrete, Solved) {
    let found = plan.refinements.last().map_or(f64::MAX, |row| row.error);
    solved.summary.converged = Some(false);
    solved.summary.error = Some(match found {
        f64::MAX => format!("the error is not known: {reason}"),
        found => format!("the error is about {:.2} %, not {:.2} %: {reason}", 100.0 * found, 100.0 * goal),
    });
    (discrete, solved)
}
