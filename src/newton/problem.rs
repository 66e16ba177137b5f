//! The torn nonlinear problem: `J`, `F(u)`, and the admissible set.

use crate::vector::dot;
use std::cell::RefCell;

use super::committed::Committed;
use crate::assembly::Region;
use crate::assembly::internal::{self, Terms};
use crate::constraint::Constraints;
use crate::constraint::law::Laws;
use crate::decomposition::Subdomain;
use crate::decomposition::sums::NodeSums;
use crate::feti::Torn;
use crate::feti::dual::Interconnection;
use crate::feti::dual::coupling::Coupling;
use crate::feti::dual::gather::Gather;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::kernel::RigidModes;
use crate::material::{Law as _, Material};
use crate::model::Discrete;
use crate::model::history::Conditions;
use crate::scene::Friction;
use crate::work;

/// What one rank holds of the problem.
pub struct TornProblem<'a> {
    /// Own subdomains.
    pub subdomains: &'a [Subdomain],
    /// Material of each own subdomain.
    pub materials: Vec<Material>,
    /// The same as tangents take it: where loads are near their limit these must not vanish.
    pub firm: Vec<Material>,
    /// Rigid modes of each own subdomain's cluster.
    pub modes: &'a [RigidModes],
    /// `f`: nodal forces.
    pub loads: Torn,
    /// `c`: right-hand sides of the rows.
    pub rhs: Vec<f64>,
    /// State that former increments left.
    pub committed: Committed,
    /// The rows of B.
    pub constraints: &'a Constraints,
    /// B.
    pub gather: &'a Gather<'a>,
    /// Contact rows that are not orthogonal.
    pub coupling: RefCell<Coupling>,
    /// Inner products and sums.
    pub space: &'a RowSpace<'a>,
    /// Sums around nodes.
    pub sums: &'a NodeSums<'a>,
    /// Whether any material of the scene yields.
    pub yields: bool,
    /// Law of friction of each contact of the scene.
    pub friction: Vec<Option<Friction>>,
}

/// The problem at one displacement.
pub struct State {
    /// `F(u)`.
    pub forces: Torn,
    /// `J(u)`.
    pub energy: f64,
    /// `Psi(u)`.
    pub internal_energy: f64,
    /// `f'u`.
    pub external_work: f64,
    /// Elements that yield.
    pub plastic: usize,
    /// Elements of each own subdomain that yield.
    pub yielding: Vec<usize>,
    /// Sizes of the terms that forces and energies are sums of.
    pub terms: Terms,
}

/// Least size that energies and forces are relative to, as a share of the terms that they are sums of (in the energy norm,
/// of their root). Bodies that move without strain have nothing but round-off in these sums.
pub(super) const SIGNIFICANT: f64 = 1e-8;

impl<'a> TornProblem<'a> {
    /// Of a discrete problem, with what is prescribed now; nothing is committed yet.
    pub fn new(
        discrete: &'a Discrete,
        connection: &'a Interconnection<'a>,
        sums: &'a NodeSums<'a>,
        Conditions { loads, rhs, friction }: Conditions,
    ) -> Self {
        let Discrete { materials, constraints, bodies, .. } = discrete;
        let subdomains = &discrete.decomposition.subdomains[..];
        let yields = |&material: &usize| materials[material].yields();
        let of_subdomains: Vec<Material> = subdomains.iter().map(|s| materials[s.material]).collect();
        Self {
            subdomains,
            firm: of_subdomains.clone(),
            materials: of_subdomains,
            modes: connection.modes(),
            loads,
            rhs,
            committed: Committed::default(),
            constraints,
            gather: &connection.gather,
            coupling: RefCell::new(Coupling::new(constraints)),
            space: &connection.space,
            sums,
            yields: bodies.iter().flat_map(|body| &body.materials).any(yields),
            friction,
        }
    }
}

impl TornProblem<'_> {
    /// Own subdomains, each with its material and history.
    pub fn regions(&self) -> Vec<Region<'_>> {
        (0..self.subdomains.len()).map(|own| self.region(own)).collect()
    }

    /// An own subdomain with its material and history.
    pub fn region(&self, own: usize) -> Region<'_> {
        let (subdomain, material) = (&self.subdomains[own], &self.materials[own]);
        Region { subdomain, material, history: self.committed.history(own) }
    }

    /// Own subdomains as their tangents are made.
    pub fn firm_regions(&self) -> Vec<Region<'_>> {
        self.regions().into_iter().zip(&self.firm).map(|(region, material)| Region { material, ..region }).collect()
    }

    /// The laws of the rows.
    pub fn laws(&self) -> Laws<'_> {
        self.constraints.laws(&self.friction)
    }

    /// Whether surfaces rub on each other, on any rank.
    pub fn has_friction(&self) -> bool {
        self.friction.iter().any(Option::is_some)
    }

    /// Without plastic material and friction, one step solves the problem.
    pub fn is_linear(&self) -> bool {
        !self.yields && !self.has_friction()
    }

    /// Internal forces and energies at `u`. One collective.
    pub fn evaluate(&self, u: &Torn) -> State {
        let mut forces = self.gather.zeros();
        let mut partial = Vec::with_capacity(5 * u.len());
        let mut yielding = Vec::with_capacity(u.len());
        for (own, region) in self.regions().iter().enumerate() {
            let found = internal::add_forces(region, &u[own], &mut forces[own]);
            let Terms { energy, force_squares } = found.terms;
            let worked = dot(&self.loads[own], &u[own]);
            work::each(u[own].len(), 2, size_of::<f64>());
            yielding.push(found.plastic);
            partial.extend([found.energy, worked, found.plastic as f64, energy, force_squares]);
        }
        let sum = self.space.sum(&partial, 5);
        State {
            forces,
            energy: sum[0] - sum[1],
            internal_energy: sum[0],
            external_work: sum[1],
            plastic: sum[2] as usize,
            yielding,
            terms: Terms { energy: sum[3], force_squares: sum[4] },
        }
    }

    /// `f - F(u)`, torn.
    pub fn unbalance(&self, state: &State) -> Torn {
        let mut forces = self.loads.clone();
        for (f, internal) in forces.iter_mut().zip(&state.forces) {
            f.iter_mut().zip(internal).for_each(|(f, i)| *f -= i);
        }
        forces
    }

    /// `(F(u) - f)'v`, the slope of `J` along `v`. One collective.
    pub fn slope(&self, state: &State, v: &Torn) -> f64 {
        let partial: Vec<f64> =
            (0..v.len()).map(|own| dot(&state.forces[own], &v[own]) - dot(&self.loads[own], &v[own])).collect();
        self.space.sum(&partial, 1)[0]
    }

    /// The paper's stopping criterion `|v - u|_e / (|v|_e + |u|_e)`, zero if nothing moves at all. `terms` are those at `v`.
    /// After an unloading the largest committed displacement is what the change is compared with.
    pub fn relative_change(&self, u: &Torn, v: &Torn, terms: &Terms) -> f64 {
        let mut partial = Vec::with_capacity(3 * u.len());
        for (own, region) in self.regions().iter().enumerate() {
            let difference: Vec<f64> = v[own].iter().zip(&u[own]).map(|(v, u)| v - u).collect();
            partial.extend(internal::elastic_squares(region, [&difference, &u[own], &v[own]]));
        }
        let norms: Vec<f64> = self.space.sum(&partial, 3).into_iter().map(f64::sqrt).collect();
        let size = (norms[1] + norms[2]).max(SIGNIFICANT * terms.energy.sqrt()).max(self.committed.sizes.elastic_norm);
        if norms[0] == 0.0 { 0.0 } else { norms[0] / size }
    }

    /// `c - B u`: what is left until each constraint holds. One neighbour exchange.
    pub fn slack(&self, u: &Torn) -> Vec<f64> {
        let mut slack = vec![0.0; self.gather.rows()];
        self.gather.apply(u, &mut slack);
        for (s, rhs) in slack.iter_mut().zip(&self.rhs) {
            *s = rhs - *s;
        }
        slack.iter_mut().zip(&self.committed.slips).for_each(|(s, slip)| *s += slip);
        slack
    }

    /// Adds `B'x` to a displacement that makes it admissible. Where rows are orthogonal that is the projection.
    pub fn make_admissible(&self, u: &mut Torn) {
        self.close(self.slack(u), u);
    }

    /// The same for a velocity: supports are at rest, and closed gaps may open.
    pub fn make_admissible_velocity(&self, v: &mut Torn) {
        let mut slack = vec![0.0; self.gather.rows()];
        self.gather.apply(v, &mut slack);
        slack.iter_mut().for_each(|s| *s = -*s);
        self.close(slack, v);
    }

    fn close(&self, slack: Vec<f64>, u: &mut Torn) {
        let mut correction = slack.clone();
        self.constraints.violation(&mut correction);
        let around = (self.gather, self.space);
        self.coupling.borrow_mut().close(around, self.constraints, &slack, &mut correction);
        self.gather.add_transpose(1.0, &correction, u);
    }

    /// Whether a displacement satisfies all constraints to round-off.
    pub fn is_admissible(&self, u: &Torn) -> bool {
        let mut violation = self.slack(u);
        self.constraints.violation(&mut violation);
        let squares = self.space.dots(&[(&violation, &violation), (&self.rhs, &self.rhs)]);
        squares[0] <= f64::EPSILON * squares[1]
    }

    /// Number of contact rows that are closed. One collective.
    pub fn active_contacts(&self, lambda: &[f64]) -> usize {
        let active = |row: &usize| {
            let of = &self.constraints.rows[*row];
            of.law().opens() && of.law().status(lambda[*row]).is_closed()
        };
        let partial: Vec<f64> =
            self.space.owned().iter().map(|rows| rows.clone().filter(active).count() as f64).collect();
        self.space.sum(&partial, 1)[0] as usize
    }
}
