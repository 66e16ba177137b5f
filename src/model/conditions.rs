//! The rows of B of a scene, and their right-hand sides at the end of each step of its load history.

use super::ModelError;
use super::contacts::Contacts;
use crate::comm::agree::agree;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::prescribed::Prescribed;
use crate::constraint::{Constraints, Support, dirichlet};
use crate::contact::{ContactError, ContactPair};
use crate::decomposition::Decomposition;
use crate::scene::{Contact, Scene, Step};
use crate::vector::dot;

/// Right-hand sides of a rank's rows.
pub struct RightHandSides {
    /// At rest: contact gaps are there, prescribed displacements are not.
    pub begin: Vec<f64>,
    /// At the end of each step.
    pub ends: Vec<Vec<f64>>,
}

/// What the rows are made of.
pub(super) struct Given<'a> {
    pub decomposition: &'a Decomposition,
    /// With the displacements that the scene gives.
    pub supports: &'a [Support],
    pub contacts: &'a Contacts,
    /// Young's modulus of each subdomain, of all ranks.
    pub stiffness: &'a [f64],
}

/// The rows of B, and their right-hand sides over the history, which are all that changes. Collective.
///
/// # Errors
/// If supports contradict each other, or violate a contact, in some step.
pub(super) fn constraints(
    scene: &Scene,
    comm: &dyn Comm,
    given: &Given,
) -> Result<(Constraints, RightHandSides), ModelError> {
    let &Given { decomposition, supports, contacts, stiffness } = given;
    let agreed = |at: &Prescribed| {
        let outcome = dirichlet::check(comm, &decomposition.interface, supports, at);
        agree(comm, "supports", outcome).map_err(ModelError::Supports)
    };
    let steps = scene.steps();
    let at = given.prescribed(scene, Some(&steps[0]));
    agreed(&at)?;
    let constraints = Constraints::new(comm, decomposition, supports, &contacts.pairs, stiffness, &at);
    refuse_held(comm, contacts, &constraints.idle_distances(&at))?;
    let first = constraints.right_hand_sides(&at);

    let displacements = supports.iter().map(|s| s.displacement);
    let mut displacements = displacements.chain(scene.contact.values().map(Contact::displacement));
    if scene.step.is_empty() || displacements.all(|displacement| displacement == [0.0; 3]) {
        let (begin, ends) = (first.clone(), vec![first; steps.len()]);
        return Ok((constraints, RightHandSides { begin, ends }));
    }
    let right_hand_sides = |step: Option<&Step>| {
        let at = given.prescribed(scene, step);
        agreed(&at)?;
        refuse_held(comm, contacts, &constraints.idle_distances(&at))?;
        Ok::<_, ModelError>(constraints.right_hand_sides(&at))
    };
    let begin = right_hand_sides(None)?;
    let mut ends = vec![first];
    for step in &steps[1..] {
        ends.push(right_hand_sides(Some(step))?);
    }
    Ok((constraints, RightHandSides { begin, ends }))
}

impl Given<'_> {
    /// What is prescribed at the end of a step, or at rest without one. The gap to an obstacle changes by the obstacle's motion
    /// along the normal.
    fn prescribed(&self, scene: &Scene, step: Option<&Step>) -> Prescribed {
        let of_support = |s: &Support| {
            let factor = step.map_or(0.0, |step| step.of_support(&s.name));
            s.displacement.map(|d| factor * d)
        };
        let obstacles = scene.contact.iter();
        let obstacles: Vec<([f64; 3], f64)> = obstacles
            .map(|(name, contact)| (contact.displacement(), step.map_or(0.0, |step| step.of_contact(name))))
            .collect();
        let gap = |pair: &ContactPair| {
            let (displacement, factor) = obstacles[pair.contact];
            pair.gap + dot(pair.normal, displacement) * factor
        };
        Prescribed {
            displacements: self.supports.iter().map(of_support).collect(),
            gaps: self.contacts.pairs.iter().map(gap).collect(),
        }
    }
}

/// Overlap, in diameters of a slave node's share of the surface, that may remain where supports hold both sides.
const HELD_OVERLAP: f64 = 1e-6;

/// Refuses contacts that supports violate, given the distances that are left on this rank, by pair. Collective.
fn refuse_held(
    comm: &dyn Comm,
    Contacts { names, pairs, .. }: &Contacts,
    distances: &[(usize, f64)],
) -> Result<(), ContactError> {
    let mine: Vec<u64> = distances.iter().flat_map(|&(pair, left)| [pair as u64, left.to_bits()]).collect();
    let all = all_gather_u64(comm, &mine);
    let mut depths: Vec<(usize, f64)> =
        all.chunks_exact(2).map(|idle| (idle[0] as usize, -f64::from_bits(idle[1]))).collect();
    depths.sort_by_key(|(pair, _)| *pair);
    depths.dedup_by_key(|(pair, _)| *pair);
    depths.retain(|&(pair, depth)| depth > HELD_OVERLAP * pairs[pair].area.sqrt());
    let Some(&(first, _)) = depths.first() else { return Ok(()) };
    let contact = pairs[first].contact;
    let of_contact = || depths.iter().filter(|(pair, _)| pairs[*pair].contact == contact);
    let depth = of_contact().fold(0.0_f64, |deepest, (_, depth)| deepest.max(*depth));
    Err(ContactError::Held { name: names[contact].clone(), nodes: of_contact().count(), depth })
}
