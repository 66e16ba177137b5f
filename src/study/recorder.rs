//! What is written of each increment that is reached: its fields, its row, and the contacts that are closed in the end.

use super::goal::Goal;
use super::{fields, report};
use crate::comm::Comm;
use crate::decomposition::Subdomain;
use crate::estimate::bregman;
use crate::model::Discrete;
use crate::monitor::timing::Timer;
use crate::newton::{self, Newton, Snapshot};
use crate::record::rows::{GoalRow, StepRow};
use crate::restart::Standing;
use crate::results::piece::Piece;
use crate::scene::{Moved, Scene};

/// The increments of a history as they are reached.
pub(super) struct Recorder<'a> {
    scene: &'a Scene,
    discrete: &'a Discrete,
    comm: &'a dyn Comm,
    /// The number whose error is asked for.
    goal: Option<Goal>,
    /// This rank's mesh and fields.
    pub piece: Piece,
    /// Fields of points and of cells that belong to the mesh and never change.
    fixed: [usize; 2],
    /// One row an increment.
    pub rows: Vec<StepRow>,
    /// Contact pairs whose rows are on this rank and that press, by index.
    pub closed: Vec<u64>,
    /// Where supports and obstacles were at the beginning.
    pub moved: Moved,
}

impl<'a> Recorder<'a> {
    /// Nothing is reached yet.
    pub fn new(scene: &'a Scene, discrete: &'a Discrete, comm: &'a dyn Comm, goal: Option<Goal>, moved: Moved) -> Self {
        let piece = fields::mesh(&discrete.decomposition.subdomains, comm.rank());
        let fixed = [piece.point_data.len(), piece.cell_data.len()];
        Self { scene, discrete, comm, goal, piece, fixed, rows: Vec::new(), closed: Vec::new(), moved }
    }

    /// Goes on after increments whose rows and fields are known.
    pub fn resume(&mut self, rows: Vec<StepRow>, recorded: Piece) {
        let Piece { times, point_data, cell_data, .. } = recorded;
        (self.rows, self.piece.times) = (rows, times);
        self.piece.point_data.extend(point_data);
        self.piece.cell_data.extend(cell_data);
    }

    /// What it takes to go on from here; of the fields all but the mesh.
    pub fn standing(&self, newton: Snapshot) -> Standing {
        let Piece { times, point_data, cell_data, .. } = &self.piece;
        let (point_data, cell_data) = (point_data[self.fixed[0]..].to_vec(), cell_data[self.fixed[1]..].to_vec());
        let recorded = Piece { times: times.clone(), point_data, cell_data, ..Piece::default() };
        Standing { newton, rows: self.rows.clone(), recorded, moved: self.moved.clone() }
    }

    /// Takes down where an iteration ended. Collective.
    pub fn record(&mut self, newton: &mut Newton, timer: &Timer) {
        let is_there = newton.outcome() == Some(&newton::Outcome::Converged);
        let measured = self.goal.as_mut().filter(|_| is_there).and_then(|goal| goal.measure(newton, timer));
        // The potential is that of the step, so its distances are measured before the step is committed.
        let distances = self.scene.solver.error.map(|_| {
            let (problem, u) = (newton.problem(), &newton.iterate().u);
            let perfect = self.scene.has_limit_load();
            timer.time("error estimate", || bregman::distances(problem.sums, &problem.regions(), u, perfect))
        });
        let (goal, mut sizes) = measured.unzip();
        if goal.is_none() && self.goal.is_some() {
            // Every increment has the same fields.
            let unknown = |s: &Subdomain| vec![f64::NAN; s.elements.len()];
            sizes = Some(self.discrete.decomposition.subdomains.iter().map(unknown).collect());
        }
        let of_elements = fields::OfElements { distances, sizes };
        timer.time("records", || self.record_results(newton, goal, of_elements));
    }

    fn record_results(&mut self, newton: &Newton, goal: Option<GoalRow>, of_elements: fields::OfElements) {
        let (scene, discrete, comm) = (self.scene, self.discrete, self.comm);
        let contact = report::contact_states(newton.problem(), newton.iterate());
        let von_mises = fields::record(&mut self.piece, newton, (&discrete.contacts, &contact), of_elements);
        let row = report::step_row(comm, scene, discrete, newton, &contact, von_mises);
        self.rows.push(StepRow { goal, ..row });
        self.closed = contact.iter().filter(|state| state.status.is_closed()).map(|state| state.pair as u64).collect();
    }
}
