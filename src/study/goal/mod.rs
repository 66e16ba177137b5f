//! A number of a solution whose error is asked for, and its dual solution.
//!
//! Displacements and multipliers of a step satisfy `K u + B'lambda = f`, `B u = c` on the rows that are kept. A number
//!
//! ```text
//! Q = l'u + m'lambda
//! ```
//!
//! has the dual solution of the same equations, `K z + B'mu = l`, `B z = m`. That of a displacement has a unit force at the point, that
//! of a reaction a unit displacement of the support, and that of a contact force a unit shift of one side: in that form, of the
//! forces of the domain, they converge as energies do. Then
//!
//! ```text
//! Q(u) - Q(u_h) = int (sigma(u) - sigma(u_h)) : (eps(z) - eps(z_h))
//! ```
//!
//! but for terms of higher order, which `estimate::weighted` estimates. The number that is told is
//!
//! ```text
//! l'u + (f - F(u))'z + mu'(c - B u)
//! ```
//!
//! that of the mesh up to the square of what the solver left: by itself `Q` has the error of `u` and `lambda`, where energies have
//! its square. A contact force is its component along its own direction, if no other one is given.

mod point;

use std::collections::HashSet;
use std::ops::Range;

use thiserror::Error;

use self::point::Place;
use super::report;
use crate::comm::{Comm, maximum};
use crate::constraint::{Constraints, Kind, Row};
use crate::estimate::weighted::weighted;
use crate::feti::Torn;
use crate::model::Discrete;
use crate::monitor::timing::Timer;
use crate::newton::response::Response;
use crate::newton::{Iterate, Newton};
use crate::qp::Outcome;
use crate::record::rows::GoalRow;
use crate::scene::{self, Scene};
use crate::vector::{dot, length};

/// The dual program reduces its gradient by this factor: its error counts times that of the solution.
const DROP: f64 = 1e-4;
/// Shape functions below this are those of nodes that a point does not move with.
const NOTHING: f64 = 1e-9;

/// Why a solution has no such number.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GoalError {
    /// The point is nowhere.
    #[error("solver.error_of: the point {point:?} is outside of {}", body.as_ref().map_or("all bodies".into(), |body| format!("body {body}")))]
    Outside {
        /// Where.
        point: [f64; 3],
        /// The body that it is sought in.
        body: Option<String>,
    },
    /// It is in two bodies.
    #[error(
        "solver.error_of: the bodies {one} and {other} both have the point {point:?}; say which is meant, as in displacement:X,Y,Z:z:{one}"
    )]
    Shared {
        /// Where.
        point: [f64; 3],
        /// A body.
        one: String,
        /// Another.
        other: String,
    },
    /// Nothing is left to be found.
    #[error("solver.error_of: supports prescribe the displacement of the point {point:?} along that direction")]
    Prescribed {
        /// Where.
        point: [f64; 3],
    },
}

/// What is asked for, by the numbers of the discrete problem.
enum Number {
    Displacement,
    /// Of a support, along what.
    Reaction(usize, [f64; 3]),
    /// By rows, each component of the force of a unit multiplier; along what, if not its own direction.
    Contact([Vec<f64>; 3], Option<[f64; 3]>),
}

/// The number, on one rank.
pub(super) struct Goal {
    number: Number,
    /// `l`: forces, torn.
    forces: Torn,
    /// `m`: right-hand sides of the rows; those of a contact force may follow its direction.
    openings: Vec<f64>,
    /// Supports of the scene.
    supports: usize,
}

impl Goal {
    /// What a scene asks for, if it asks for a number. Collective.
    ///
    /// # Errors
    /// If there is no such number.
    pub fn new(
        scene: &Scene,
        discrete: &Discrete,
        comm: &dyn Comm,
        zeros: &dyn Fn() -> Torn,
    ) -> Result<Option<Self>, GoalError> {
        let Some(goal) = scene.solver.error_of.goal().filter(|_| scene.solver.error.is_some()) else { return Ok(None) };
        let (mut forces, mut openings) = (zeros(), vec![0.0; discrete.constraints.rows.len()]);
        let number = match goal {
            scene::Goal::Displacement { point, direction, body } => {
                let place = point::find(comm, scene, discrete, (*point, body.as_deref()))?;
                if !push(discrete, comm, &place, direction.0, &mut forces) {
                    return Err(GoalError::Prescribed { point: *point });
                }
                Number::Displacement
            }
            scene::Goal::Reaction { support, direction } => {
                let index = position(support.as_ref(), scene.support.keys());
                let fixed = discrete.supports[index].fixed;
                let along = direction.map_or(fixed.map(|fixed| f64::from(u8::from(fixed))), |along| along.0);
                openings = of_support(&discrete.constraints, index, along);
                Number::Reaction(index, along)
            }
            scene::Goal::ContactForce { contact, direction } => {
                let index = position(contact.as_ref(), scene.contact.keys());
                let sign = report::signs(scene, discrete)[index];
                Number::Contact(of_contact(discrete, index, sign), direction.map(|along| along.0))
            }
        };
        Ok(Some(Self { number, forces, openings, supports: scene.support.len() }))
    }

    /// The number where an iteration ended, what is known of its error, and what each element of each own subdomain has of it. None
    /// if there is no dual solution. Collective.
    pub fn measure(&mut self, newton: &mut Newton, timer: &Timer) -> Option<(GoalRow, Vec<Vec<f64>>)> {
        let known = self.value(newton);
        let dual = timer.time("dual solution", || newton.response((&self.forces, &self.openings), DROP, timer));
        if !matches!(dual.outcome, Outcome::Converged | Outcome::LimitReached) {
            return None;
        }
        let (problem, u) = (newton.problem(), &newton.iterate().u);
        let found = timer.time("error estimate", || weighted(problem.sums, &problem.regions(), u, &dual.v));
        let of = |parts: &[Vec<f64>]| parts.iter().map(|parts| parts.iter().sum::<f64>()).collect::<Vec<_>>();
        let [correction, distance] = [&found.signed, &found.sizes].map(|parts| problem.space.sum(&of(parts), 1)[0]);
        let [value, terms] = self.exact_value(newton, &dual);
        let row = GoalRow {
            value,
            gap: (value - known).abs(),
            correction,
            distance,
            terms,
            hessian_multiplications: dual.applications as u64,
        };
        Some((row, found.sizes))
    }

    /// The number as the solution has it; a contact force without a direction takes that of the present one. Collective.
    fn value(&mut self, newton: &Newton) -> f64 {
        let (problem, Iterate { u, lambda, state, .. }) = (newton.problem(), newton.iterate());
        match &self.number {
            Number::Displacement => {
                let of = |own: usize| dot(&self.forces[own], &u[own]);
                problem.space.sum(&(0..u.len()).map(of).collect::<Vec<_>>(), 1)[0]
            }
            Number::Reaction(support, along) => dot(problem.reactions(state, lambda, self.supports)[*support], along),
            Number::Contact(parts, along) => {
                let force = problem.space.dots(&parts.each_ref().map(|part| (&part[..], &lambda[..])));
                let size = length(&force);
                let own = || [0, 1, 2].map(|axis| if size > 0.0 { force[axis] / size } else { 0.0 });
                let along = along.unwrap_or_else(own);
                let row = |row: usize| (0..3).map(|axis| along[axis] * parts[axis][row]).sum();
                self.openings = (0..lambda.len()).map(row).collect();
                dot(&force, along)
            }
        }
    }

    /// The number without what the solver left, and the sum of the sizes of its terms. Collective.
    fn exact_value(&self, newton: &Newton, Response { v: z, lambda: mu, .. }: &Response) -> [f64; 2] {
        let (problem, Iterate { u, state, .. }) = (newton.problem(), newton.iterate());
        let (unbalance, slack) = (problem.unbalance(state), problem.slack(u));
        let sizes = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x * y).abs()).sum::<f64>();
        let of_domain = |own: usize| {
            let pairs = [(&self.forces[own], &u[own]), (&unbalance[own], &z[own])];
            [pairs.map(|(x, y)| dot(x, y)).iter().sum(), pairs.map(|(x, y)| sizes(x, y)).iter().sum::<f64>()]
        };
        let of_rows = |rows: &Range<usize>| {
            let (mu, slack) = (&mu[rows.clone()], &slack[rows.clone()]);
            [dot(mu, slack), sizes(mu, slack)]
        };
        let rows = problem.space.owned().iter().map(of_rows);
        let partial: Vec<[f64; 2]> = (0..z.len()).map(of_domain).chain(rows).collect();
        let sums = problem.space.sum(partial.as_flattened(), 2);
        [sums[0], sums[1]]
    }
}

/// The number of a name among those of a section; of the only one if there is no name.
fn position<'a>(name: Option<&String>, mut all: impl Iterator<Item = &'a String>) -> usize {
    name.and_then(|name| all.position(|known| known == name)).unwrap_or_default()
}

/// Adds a unit force at a place to those of its subdomain; false if supports take all of it. Collective.
fn push(discrete: &Discrete, comm: &dyn Comm, place: &Place, along: [f64; 3], forces: &mut Torn) -> bool {
    let decomposition = &discrete.decomposition;
    let mut is_free = false;
    if let Some(own) = decomposition.own_index(place.subdomain as u32) {
        let subdomain = &decomposition.subdomains[own];
        let held: HashSet<(u64, usize)> = discrete.constraints.rows.iter().filter_map(held).collect();
        let nodes = subdomain.elements.iter().nth(place.element).unwrap_or_default();
        for (&node, value) in nodes.iter().zip(subdomain.elements.kind().values(&place.at)) {
            for (axis, along) in along.into_iter().enumerate() {
                forces[own][3 * node as usize + axis] += value * along;
                let moves = (value * along).abs() > NOTHING;
                is_free |= moves && !held.contains(&(subdomain.nodes[node as usize], axis));
            }
        }
    }
    maximum(comm, &[f64::from(u8::from(is_free))])[0] > 0.0
}

/// The node and the component that a support's row fixes.
fn held(row: &Row) -> Option<(u64, usize)> {
    let Kind::Support { axis, .. } = row.kind else { return None };
    row.terms.first().map(|term| (term.node, axis))
}

/// Right-hand sides that move a support against a direction: what acts on bodies is minus its rows' forces.
fn of_support(constraints: &Constraints, support: usize, along: [f64; 3]) -> Vec<f64> {
    let of = |row: &Row| match row.kind {
        Kind::Support { support: of_row, axis } if of_row == support => {
            -(row.terms.len() as f64).sqrt() * along[axis] * row.length
        }
        Kind::Contact { .. } => {
            let fixed = row.fixed.iter().filter(|fixed| fixed.support == support);
            row.scale * fixed.map(|fixed| fixed.weight * along[fixed.axis]).sum::<f64>()
        }
        _ => 0.0,
    };
    constraints.rows.iter().map(of).collect()
}

/// By rows, each component of the force of a contact on the side of this sign, where multipliers are one.
fn of_contact(discrete: &Discrete, contact: usize, sign: f64) -> [Vec<f64>; 3] {
    let pairs = &discrete.contacts.pairs;
    let of = |axis: usize, row: &Row| match row.kind {
        Kind::Contact { pair } if pairs[pair].contact == contact => sign * pairs[pair].force(row.scale)[axis],
        _ => 0.0,
    };
    [0, 1, 2].map(|axis| discrete.constraints.rows.iter().map(|row| of(axis, row)).collect())
}

#[cfg(test)]
mod tests;
