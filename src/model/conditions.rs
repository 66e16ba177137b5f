//! The rows of B of a scene, and their right-hand sides at the end of each step of its load history.

use super::ModelError;
use crate::comm::agree::agree;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::{ConstraintError, Constraints, Support};
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
    /// Names of the contacts.
    pub contacts: &'a [String],
    pub pairs: &'a [ContactPair],
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
    &Given { decomposition, supports, contacts, pairs, stiffness }: &Given,
) -> Result<(Constraints, RightHandSides), ModelError> {
    // At rest without a step.
    let rows = |step: Option<&Step>| {
        let factor = |s: &Support| step.map_or(0.0, |step| step.of_support(&s.name));
        let scaled = |s: &Support| Support { displacement: s.displacement.map(|d| factor(s) * d), ..s.clone() };
        let supports: Vec<Support> = supports.iter().map(scaled).collect();
        let pairs: Vec<ContactPair> = pairs.iter().map(|pair| moved(scene, pair, step)).collect();
        let rows: Result<_, ConstraintError> = Constraints::new(comm, decomposition, &supports, &pairs, stiffness);
        let rows = agree(comm, "supports", rows).map_err(ModelError::Supports)?;
        refuse_held(comm, contacts, &pairs, &rows)?;
        Ok::<_, ModelError>(rows)
    };
    let right_hand_sides = |rows: &Constraints| rows.rows.iter().map(|row| row.rhs).collect::<Vec<f64>>();
    let steps = scene.steps();
    let constraints = rows(Some(&steps[0]))?;
    let first = right_hand_sides(&constraints);
    let displacements = supports.iter().map(|s| s.displacement);
    let mut displacements = displacements.chain(scene.contact.values().map(Contact::displacement));
    if scene.step.is_empty() || displacements.all(|displacement| displacement == [0.0; 3]) {
        let (begin, ends) = (first.clone(), vec![first; steps.len()]);
        return Ok((constraints, RightHandSides { begin, ends }));
    }
    let begin = right_hand_sides(&rows(None)?);
    let mut ends = vec![first];
    for step in &steps[1..] {
        ends.push(right_hand_sides(&rows(Some(step))?));
    }
    Ok((constraints, RightHandSides { begin, ends }))
}

/// A pair whose obstacle is where it is at the end of a step, or at rest: the plane that a node keeps clear of goes along.
fn moved(scene: &Scene, pair: &ContactPair, step: Option<&Step>) -> ContactPair {
    let (name, contact) = scene.contact.iter().nth(pair.contact).expect("a pair belongs to a contact");
    let mut pair = pair.clone();
    let away = dot(pair.normal, contact.displacement());
    pair.widen(away * step.map_or(0.0, |step| step.of_contact(name)));
    pair
}

/// Overlap, in diameters of a slave node's share of the surface, that may remain where supports hold both sides.
const HELD_OVERLAP: f64 = 1e-6;

/// Refuses contacts that supports violate. Collective.
fn refuse_held(
    comm: &dyn Comm,
    names: &[String],
    pairs: &[ContactPair],
    constraints: &Constraints,
) -> Result<(), ContactError> {
    let mine: Vec<u64> = constraints.idle.iter().flat_map(|&(pair, left)| [pair as u64, left.to_bits()]).collect();
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
