//! What is written of each increment that is reached: its fields, its row, and the contacts that are closed in the end.

use std::collections::HashMap;

use super::contact::ContactState;
use super::goal::Goal;
use super::{fields, limits, report};
use crate::comm::{Comm, exact};
use crate::contact::consistency::State;
use crate::decomposition::Subdomain;
use crate::estimate::bregman;
use crate::estimate::contact::Touching;
use crate::model::Discrete;
use crate::monitor::timing::Timer;
use crate::newton::{self, Newton, Snapshot};
use crate::record::rows::StepRow;
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
    /// The contacts, if meshes are refined.
    touching: Vec<Touching>,
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
    /// Nothing is reached yet. Collective.
    pub fn new(scene: &'a Scene, discrete: &'a Discrete, comm: &'a dyn Comm, goal: Option<Goal>, moved: Moved) -> Self {
        let piece = fields::mesh(&discrete.decomposition.subdomains, comm.rank());
        let fixed = [piece.point_data.len(), piece.cell_data.len()];
        let contacts = scene.contact.values().zip(&discrete.contacts.surfaces).filter(|_| scene.solver.error.is_some());
        let touching = contacts.map(|(contact, of)| {
            let surfaces = (of.slave, of.master.filter(|_| of.is_mortar));
            Touching::new(comm, &discrete.decomposition, surfaces, (contact.clearance.is_some(), of.share))
        });
        let touching = touching.collect();
        Self { scene, discrete, comm, goal, touching, piece, fixed, rows: Vec::new(), closed: Vec::new(), moved }
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
        let contact = report::contact_states(newton.problem(), newton.iterate());
        let errors = self.scene.solver.error.map(|_| timer.time("error estimate", || self.distances(newton, &contact)));
        let (distances, consistency) = errors.unzip();
        let (goal, mut sizes) = measured.unzip();
        if goal.is_none() && self.goal.is_some() {
            // Every increment has the same fields.
            let unknown = |s: &Subdomain| vec![f64::NAN; s.elements.len()];
            sizes = Some(self.discrete.decomposition.subdomains.iter().map(unknown).collect());
        }
        let of_elements = fields::OfElements { distances, sizes };
        timer.time("records", || {
            let row = self.row(newton, &contact, of_elements);
            self.rows.push(StepRow { goal, consistency, ..row });
        });
    }

    /// How far the energy is above the least one in each element of each own subdomain, and what conditions of contact have of all that.
    /// The potential is that of the step, so this is before the step is committed. Collective.
    fn distances(&self, newton: &Newton, contact: &[ContactState]) -> (Vec<Vec<f64>>, f64) {
        let (discrete, problem, u) = (self.discrete, newton.problem(), &newton.iterate().u);
        let mut distances = bregman::distances(problem.sums, &problem.regions(), u, self.scene.has_limit_load());
        let moved = limits::displacements(self.comm, discrete, u, self.touching.iter().flat_map(Touching::nodes));
        let of_state = |state: &ContactState| {
            let pairs = &discrete.contacts.pairs;
            let (pair, known) = (&pairs[state.pair], State { pressure: state.pressure(pairs), gap: state.gap });
            ((pair.contact, pair.slave, pair.part), known)
        };
        let states: HashMap<(usize, u64, u32), State> = contact.iter().map(of_state).collect();
        let mut added = vec![0.0; distances.len()];
        for (number, touching) in self.touching.iter().enumerate() {
            let state = |node: u64, part: u32| states.get(&(number, node, part)).copied();
            for (own, element, energy) in touching.errors(state, |node| moved[&node]) {
                distances[own][element] += energy;
                added[own] += energy;
            }
        }
        (distances, exact::sum(self.comm, &added, 1)[0])
    }

    /// Adds the fields of an increment, and tells of it.
    fn row(&mut self, newton: &Newton, contact: &[ContactState], of_elements: fields::OfElements) -> StepRow {
        let (scene, discrete, comm) = (self.scene, self.discrete, self.comm);
        let von_mises = fields::record(&mut self.piece, newton, (&discrete.contacts, contact), of_elements);
        self.closed = contact.iter().filter(|state| state.status.is_closed()).map(|state| state.pair as u64).collect();
        report::step_row(comm, scene, discrete, newton, contact, von_mises)
    }
}
