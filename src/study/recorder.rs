//! What is written of each increment that is reached: its fields, its row, and the contacts that are closed in the end.

use super::{fields, report};
use crate::comm::Comm;
use crate::estimate::bregman;
use crate::model::Discrete;
use crate::monitor::timing::Timer;
use crate::newton::Newton;
use crate::record::rows::StepRow;
use crate::results::piece::Piece;
use crate::scene::Scene;

/// The increments of a history as they are reached.
pub(super) struct Recorder<'a> {
    scene: &'a Scene,
    discrete: &'a Discrete,
    comm: &'a dyn Comm,
    /// This rank's mesh and fields.
    pub piece: Piece,
    /// Fields of points and of cells that belong to the mesh and never change.
    fixed: [usize; 2],
    /// One row an increment.
    pub rows: Vec<StepRow>,
    /// Contact pairs whose rows are on this rank and that press, by index.
    pub closed: Vec<u64>,
}

impl<'a> Recorder<'a> {
    /// Nothing is reached yet.
    pub fn new(scene: &'a Scene, discrete: &'a Discrete, comm: &'a dyn Comm) -> Self {
        let piece = fields::mesh(&discrete.decomposition.subdomains, comm.rank());
        let fixed = [piece.point_data.len(), piece.cell_data.len()];
        Self { scene, discrete, comm, piece, fixed, rows: Vec::new(), closed: Vec::new() }
    }

    /// Goes on after increments whose rows and fields are known.
    pub fn resume(&mut self, rows: Vec<StepRow>, recorded: Piece) {
        let Piece { times, point_data, cell_data, .. } = recorded;
        (self.rows, self.piece.times) = (rows, times);
        self.piece.point_data.extend(point_data);
        self.piece.cell_data.extend(cell_data);
    }

    /// The rows, and the fields without the mesh.
    pub fn standing(&self) -> (Vec<StepRow>, Piece) {
        let Piece { times, point_data, cell_data, .. } = &self.piece;
        let (point_data, cell_data) = (point_data[self.fixed[0]..].to_vec(), cell_data[self.fixed[1]..].to_vec());
        (self.rows.clone(), Piece { times: times.clone(), point_data, cell_data, ..Piece::default() })
    }

    /// Takes down where an iteration ended. Collective.
    pub fn record(&mut self, newton: &Newton, timer: &Timer) {
        // The potential is that of the step, so its distances are measured before the step is committed.
        let distances = self.scene.solver.error.map(|_| {
            let (problem, u) = (newton.problem(), &newton.iterate().u);
            timer.time("error estimate", || bregman::distances(problem.sums, &problem.regions(), u))
        });
        timer.time("records", || self.record_results(newton, distances));
    }

    fn record_results(&mut self, newton: &Newton, distances: Option<Vec<Vec<f64>>>) {
        let Self { scene, discrete, comm, .. } = *self;
        let contact = report::contact_states(newton.problem(), newton.iterate());
        let von_mises = fields::record(&mut self.piece, newton, (&discrete.contacts, &contact), distances);
        self.rows.push(report::step_row(comm, scene, discrete, newton, &contact, von_mises));
        self.closed = contact.iter().filter(|state| state.status.is_closed()).map(|state| state.pair as u64).collect();
    }
}
