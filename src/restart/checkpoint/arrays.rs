//! The arrays of a checkpoint, in the order of own subdomains.
//!
//! | group | a row is |
//! |---|---|
//! | `subdomains` | a subdomain: its number of rows in other groups, and at what its factors were made |
//! | `points`, `cells` | a node's copy, an element |
//! | `rows` | a row of B that a subdomain owns |
//! | `contacts` | a contact row, by what tells it from others on other subdomains, too |
//! | `histories`, `flow`, `factor_flow`, `interior_flow` | an integration point |

use std::ops::Range;
use std::sync::Arc;

use super::{contact, lowest_node};
use crate::assembly::flow::Flow;
use crate::comm::Comm;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::basis::{Bases, Basis};
use crate::material::history;
use crate::model::Discrete;
use crate::newton::Snapshot;
use crate::restart::places::key;
use crate::results::piece::{Field, Values};

/// Makes the arrays of a snapshot.
pub(super) struct Packer<'a> {
    discrete: &'a Discrete,
    newton: &'a Snapshot,
    /// Rows that each own subdomain owns.
    owned: Vec<Range<usize>>,
    /// First own subdomain.
    first: usize,
    /// Where factors of whole subdomains, and those of their interiors, were made.
    factor: Vec<Option<Basis>>,
    interior: Vec<Option<Basis>>,
}

impl<'a> Packer<'a> {
    /// Of a snapshot on a discrete problem. Collective.
    pub fn new(comm: &dyn Comm, discrete: &'a Discrete, newton: &'a Snapshot) -> Self {
        let shares = &discrete.decomposition.shares;
        let space = RowSpace::new(comm, shares, &discrete.constraints);
        let of_bases = |of: fn(&Bases) -> &Option<Basis>| newton.solver.bases.iter().map(|b| of(b).clone()).collect();
        Self {
            discrete,
            newton,
            owned: space.owned().to_vec(),
            first: shares.begin(comm.rank()),
            factor: of_bases(|bases| &bases.factor),
            interior: of_bases(|bases| &bases.interior),
        }
    }

    /// All of them.
    pub fn arrays(&self) -> Vec<Field> {
        let groups = [self.subdomains(), self.points(), self.rows(), self.contacts(), self.histories(), self.flows()];
        groups.into_iter().flatten().collect()
    }

    fn own(&self) -> &'a [Subdomain] {
        &self.discrete.decomposition.subdomains
    }

    fn subdomains(&self) -> Vec<Field> {
        let (own, committed) = (self.own(), &self.newton.committed);
        let count = |name: &str, of: &dyn Fn(usize) -> usize| {
            Field::integer(&format!("subdomains/{name}"), (0..own.len()).map(|k| of(k) as i64).collect())
        };
        let clusters = &self.discrete.decomposition.clusters;
        let drift = self.newton.solver.bases.iter().map(|bases| bases.drift).collect();
        vec![
            count("points", &|k| own[k].nodes.len()),
            count("cells", &|k| own[k].elements.len()),
            count("rows", &|k| self.owned[k].len()),
            count("histories", &|k| committed.history(k).len()),
            count("cluster", &|k| clusters.of(self.first + k)),
            Field::integer("subdomains/factor", self.factor.iter().map(code).collect()),
            Field::integer("subdomains/interior", self.interior.iter().map(code).collect()),
            Field::scalar("subdomains/drift", drift),
        ]
    }

    /// Points and cells.
    fn points(&self) -> Vec<Field> {
        let own = self.own();
        let zero = || own.iter().map(|s| vec![0.0; s.dofs()]).collect::<Torn>();
        let Snapshot { reached, origin, .. } = self.newton;
        let last = reached.as_ref().map(|reached| &reached.u).or(origin.as_ref()).cloned().unwrap_or_else(zero);
        let elements = own.iter().flat_map(|s| s.elements.iter().flat_map(|element| key(element, &s.nodes)));
        vec![
            Field::integer("points/node", own.iter().flat_map(|s| &s.nodes).map(|&node| node as i64).collect()),
            vector("points/displacement", self.newton.u.concat()),
            vector("points/last", last.concat()),
            vector("points/factor", displacements(&self.factor, zero())),
            vector("points/interior", displacements(&self.interior, zero())),
            Field::of("cells/nodes", 4, Values::Integer(elements.collect())),
        ]
    }

    fn rows(&self) -> Vec<Field> {
        let rows = &self.discrete.constraints.rows;
        let owned = || self.owned.iter().flat_map(Range::clone);
        let slips = self.discrete.constraints.has_friction.then(|| owned().map(|row| self.slip(row)).collect());
        let mut fields = vec![
            Field::integer("rows/node", owned().map(|row| lowest_node(&rows[row]) as i64).collect()),
            Field::integer("rows/kept", owned().map(|row| i64::from(self.is_kept(row))).collect()),
            Field::scalar("rows/multiplier", owned().map(|row| self.newton.lambda[row]).collect()),
            Field::scalar("rows/last", owned().map(|row| self.last_multiplier(row)).collect()),
        ];
        fields.extend(slips.map(|slips| Field::scalar("rows/slip", slips)));
        fields
    }

    /// What surfaces have slid in a row of friction.
    fn slip(&self, row: usize) -> f64 {
        self.newton.committed.slips.get(row).copied().unwrap_or_default()
    }

    fn contacts(&self) -> Vec<Field> {
        let rows = &self.discrete.constraints.rows;
        let owned = self.owned.iter().flat_map(Range::clone);
        let contacts: Vec<(usize, [i64; 4])> =
            owned.filter_map(|row| Some((row, contact(self.discrete, row)?))).collect();
        let force = |row: usize| rows[row].scale * self.last_multiplier(row);
        let slips = self
            .discrete
            .constraints
            .has_friction
            .then(|| contacts.iter().map(|(row, _)| self.slip(*row) / rows[*row].scale).collect());
        let mut fields = vec![
            Field::of("contacts/condition", 4, Values::Integer(contacts.iter().flat_map(|(_, key)| *key).collect())),
            Field::integer("contacts/kept", contacts.iter().map(|(row, _)| i64::from(self.is_kept(*row))).collect()),
            Field::scalar("contacts/last_force", contacts.iter().map(|(row, _)| force(*row)).collect()),
        ];
        fields.extend(slips.map(|slips| Field::scalar("contacts/slip", slips)));
        fields
    }

    /// Whether the multipliers of the iterate act on a row.
    fn is_kept(&self, row: usize) -> bool {
        self.newton.solver.programs.kept.as_ref().is_some_and(|kept| kept[row])
    }

    /// The multiplier of a row in the last increment that was reached.
    fn last_multiplier(&self, row: usize) -> f64 {
        self.newton.reached.as_ref().map_or(0.0, |reached| reached.lambda[row])
    }

    fn histories(&self) -> Vec<Field> {
        let histories = (0..self.own().len()).flat_map(|own| self.newton.committed.history(own));
        let field = |(name, numbers, values)| Field::of(&format!("histories/{name}"), numbers, Values::Real(values));
        history::arrays(histories).into_iter().map(field).collect()
    }

    /// Directions of plastic flow: those of the iterate, and those at which factors were made.
    fn flows(&self) -> Vec<Field> {
        let of_bases = |bases: &[Option<Basis>]| bases.iter().map(flow_of).collect();
        let (factor, interior) = (of_bases(&self.factor), of_bases(&self.interior));
        let all = [("flow", self.newton.solver.flows.clone()), ("factor_flow", factor), ("interior_flow", interior)];
        let fields = all.into_iter().flat_map(|(name, flows): (_, Vec<Flow>)| {
            let counts = flows.iter().map(|flow| flow.len() as i64).collect();
            let directions = flows.iter().flat_map(|flow| flow.iter().flatten().copied()).collect();
            [
                Field::integer(&format!("subdomains/{name}"), counts),
                Field::of(&format!("{name}/direction"), 6, Values::Real(directions)),
            ]
        });
        fields.collect()
    }
}

fn vector(name: &str, values: Vec<f64>) -> Field {
    Field::of(name, 3, Values::Real(values))
}

fn code(basis: &Option<Basis>) -> i64 {
    match basis {
        None => 0,
        Some(Basis::Elastic) => 1,
        Some(Basis::At(..)) => 2,
    }
}

/// Of a code, and what the arrays have for it.
pub(super) fn basis(code: i64, u: Vec<f64>, flow: Flow) -> Option<Basis> {
    match code {
        0 => None,
        1 => Some(Basis::Elastic),
        _ => Some(Basis::At(Arc::new(u), flow)),
    }
}

fn flow_of(basis: &Option<Basis>) -> Flow {
    match basis {
        Some(Basis::At(_, flow)) => Flow::clone(flow),
        _ => Flow::default(),
    }
}

/// Zeros where the basis is none.
fn displacements(bases: &[Option<Basis>], mut zero: Torn) -> Vec<f64> {
    for (basis, zero) in bases.iter().zip(&mut zero) {
        if let Some(Basis::At(u, _)) = basis {
            zero.clone_from(u);
        }
    }
    zero.concat()
}
