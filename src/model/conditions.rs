//! The rows of B of a scene, and their right-hand sides at the end of each step of its load history.

use super::ModelError;
use super::contacts::Contacts;
use super::discrete::Discrete;
use crate::comm::agree::agree;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::links::Linked;
use crate::constraint::prescribed::Prescribed;
use crate::constraint::{Constraints, Support, dirichlet};
use crate::contact::{ContactError, ContactPair};
use crate::decomposition::Decomposition;
use crate::scene::{Contact, Moved, Scene};
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
}

/// The rows of B, and their right-hand sides over the history, which are all that changes. Collective.
///
/// # Errors
/// If supports contradict each other, or violate a contact, in some step.
pub(super) fn constraints(
    scene: &Scene,
    comm: &dyn Comm,
    given: &Given,
    linked: Linked,
) -> Result<(Constraints, RightHandSides, Vec<String>), ModelError> {
    let &Given { decomposition, supports, contacts } = given;
    let agreed = |at: &Prescribed| {
        let outcome = dirichlet::check(comm, &decomposition.interface, supports, at);
        agree(comm, "supports", outcome).map_err(ModelError::Supports)
    };
    let steps = scene.steps();
    let at = given.prescribed(scene, &Moved::at_end(scene, &steps[0]));
    agreed(&at)?;
    let laws: Vec<bool> = scene.contact.iter().map(|(name, contact)| contact.rubs(name, steps)).collect();
    let constraints = Constraints::new(comm, decomposition, supports, &contacts.pairs, linked, &at, &laws);
    refuse_held(comm, given, &constraints.idle_distances(&at))?;
    let first = constraints.right_hand_sides(&at);
    let mut warned = Slides::default();
    warned.add(comm, given, &constraints, &at);

    let displacements = supports.iter().map(|s| s.displacement);
    let mut displacements = displacements.chain(scene.contact.values().map(Contact::displacement));
    if scene.step.is_empty() || displacements.all(|displacement| displacement == [0.0; 3]) {
        let (begin, ends) = (first.clone(), vec![first; steps.len()]);
        return Ok((constraints, RightHandSides { begin, ends }, warned.told(contacts)));
    }
    let mut right_hand_sides = |moved: &Moved| {
        let at = given.prescribed(scene, moved);
        agreed(&at)?;
        refuse_held(comm, given, &constraints.idle_distances(&at))?;
        warned.add(comm, given, &constraints, &at);
        Ok::<_, ModelError>(constraints.right_hand_sides(&at))
    };
    let begin = right_hand_sides(&Moved::default())?;
    let mut ends = vec![first];
    for step in &steps[1..] {
        ends.push(right_hand_sides(&Moved::at_end(scene, step))?);
    }
    Ok((constraints, RightHandSides { begin, ends }, warned.told(contacts)))
}

/// Where supports and obstacles slide along each other at contacts with friction, in any step: nodes and length of each contact.
#[derive(Default)]
struct Slides(Vec<(usize, f64)>);

impl Slides {
    /// Adds what is prescribed at the end of a step. Collective.
    fn add(&mut self, comm: &dyn Comm, given: &Given, constraints: &Constraints, at: &Prescribed) {
        if !constraints.has_friction {
            return;
        }
        let found = beyond(comm, given, &constraints.guided_slides(at));
        self.0.resize(found.len(), (0, 0.0));
        self.0.iter_mut().zip(found).for_each(|(most, of)| *most = (most.0.max(of.0), most.1.max(of.1)));
    }

    /// In words.
    fn told(self, contacts: &Contacts) -> Vec<String> {
        let of = |(name, (nodes, length)): (&String, (usize, f64))| {
            (nodes > 0).then(|| {
                format!(
                    "contact.{name}: at {nodes} nodes supports hold both sides and slide along each other, by up to {length:.3e}: friction \
                     there acts on the supports, and is not counted; where one direction is free it has all of the limit. Hold a \
                     body where it does not touch"
                )
            })
        };
        contacts.names.iter().zip(self.0).filter_map(of).collect()
    }
}

/// Right-hand sides of a rank's rows where supports and obstacles are moved like that.
pub fn right_hand_sides(scene: &Scene, discrete: &Discrete, moved: &Moved) -> Vec<f64> {
    let Discrete { decomposition, supports, contacts, constraints, .. } = discrete;
    constraints.right_hand_sides(&Given { decomposition, supports, contacts }.prescribed(scene, moved))
}

impl Given<'_> {
    /// What is prescribed where supports and obstacles are moved like that. The gap to an obstacle changes by the obstacle's motion
    /// along the normal.
    fn prescribed(&self, scene: &Scene, moved: &Moved) -> Prescribed {
        let of_support = |s: &Support| moved.support.get(&s.name).copied().unwrap_or_default();
        let of_contact = |name: &String| moved.contact.get(name).copied().unwrap_or_default();
        let obstacles: Vec<[f64; 3]> = scene.contact.keys().map(of_contact).collect();
        let gap = |pair: &ContactPair| pair.gap + dot(pair.resultant(), obstacles[pair.contact]);
        let is_moved = |(_, pair): &(usize, &ContactPair)| obstacles[pair.contact] != [0.0; 3];
        let moving = self.contacts.pairs.iter().filter(is_moved);
        Prescribed {
            displacements: self.supports.iter().map(of_support).collect(),
            gaps: self.contacts.pairs.iter().map(|(number, pair)| (number, gap(pair))).collect(),
            drags: moving.map(|(number, pair)| (number, obstacles[pair.contact])).collect(),
        }
    }
}

/// Lengths that count, in diameters of a slave node's share of the surface.
const LEAST: f64 = 1e-6;

/// Refuses contacts that supports violate, given the distances that are left on this rank, by pair. Collective.
fn refuse_held(comm: &dyn Comm, given: &Given, distances: &[(usize, f64)]) -> Result<(), ContactError> {
    let depths: Vec<(usize, f64)> = distances.iter().map(|(pair, left)| (*pair, -left)).collect();
    let found = given.contacts.names.iter().zip(beyond(comm, given, &depths));
    match found.into_iter().find(|(_, (nodes, _))| *nodes > 0) {
        Some((name, (nodes, depth))) => Err(ContactError::Held { name: name.clone(), nodes, depth }),
        None => Ok(()),
    }
}

/// How many nodes of each contact have a length that counts, and the largest, given those on this rank, by pair. Collective.
fn beyond(
    comm: &dyn Comm,
    &Given { decomposition, contacts: Contacts { names, pairs, .. }, .. }: &Given,
    lengths: &[(usize, f64)],
) -> Vec<(usize, f64)> {
    // A pair counts where its slave node has the lowest copy.
    let (mut nodes, mut largest) = (vec![0_u64; names.len()], vec![0.0_f64; names.len()]);
    for &(number, length) in lengths {
        let pair = &pairs[number];
        if decomposition.tells(pair.slave) && length > LEAST * pair.area.sqrt() {
            nodes[pair.contact] += 1;
            largest[pair.contact] = largest[pair.contact].max(length);
        }
    }
    let mine: Vec<u64> = nodes.into_iter().zip(largest).flat_map(|(n, length)| [n, length.to_bits()]).collect();
    let all = all_gather_u64(comm, &mine);
    let of = |contact: usize| all.as_chunks::<2>().0.iter().skip(contact).step_by(names.len());
    let most = |contact: usize| {
        let lengths = of(contact).map(|[_, length]| f64::from_bits(*length));
        (of(contact).map(|[nodes, _]| *nodes as usize).sum(), lengths.fold(0.0, f64::max))
    };
    (0..names.len()).map(most).collect()
}
