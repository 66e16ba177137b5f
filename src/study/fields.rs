//! The solution as fields on one rank's mesh: what ParaView shows.

use std::ops::Range;

use super::contact::{self, ContactState};
use crate::assembly::internal;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::model::contacts::Contacts;
use crate::newton::residuals::larger;
use crate::newton::{Iterate, Newton, TornProblem};
use crate::results::piece::{Field, Piece, Values};

/// Mesh of a rank's subdomains, one behind the other, with the fields that never change.
pub fn mesh(subdomains: &[Subdomain], rank: usize) -> Piece {
    let mut piece = Piece { offsets: vec![0], ..Piece::default() };
    let (mut subdomain_ids, mut bodies, mut materials, mut nodes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for subdomain in subdomains {
        nodes.extend(subdomain.nodes.iter().map(|&node| node as i64));
        let first = piece.points.len() as u64;
        piece.points.extend(&subdomain.points);
        for of_element in &subdomain.elements {
            piece.connectivity.extend(of_element.iter().map(|&n| first + u64::from(n)));
            piece.offsets.push(piece.connectivity.len() as u64);
            piece.types.push(subdomain.elements.kind().vtk());
            subdomain_ids.push(subdomain.id as i64);
            bodies.push(subdomain.body as i64);
            materials.push(subdomain.material as i64);
        }
    }
    piece.point_data = vec![Field::integer("node", nodes)];
    piece.cell_data = vec![
        Field::integer("body", bodies),
        Field::integer("material", materials),
        Field::integer("rank", vec![rank as i64; subdomain_ids.len()]),
        Field::integer("subdomain", subdomain_ids),
    ];
    piece
}

/// Adds the iterate to the mesh, at the time of its increment, with what may touch and the contact of the pairs whose rows are on this
/// rank, and what is known of the errors of elements. Returns the largest von Mises stress in this rank's elements.
pub fn record(
    piece: &mut Piece,
    newton: &Newton,
    (touching, contact): (&Contacts, &[ContactState]),
    OfElements { distances, sizes }: OfElements,
) -> f64 {
    let (problem, Iterate { u, errors, .. }) = (newton.problem(), newton.iterate());
    let displacement: Vec<[f64; 3]> = u.iter().flat_map(|u| u.as_chunks::<3>().0).copied().collect();
    let (stress, plastic): (Vec<f64>, _) = element_states(problem, u).unzip();
    let largest = stress.iter().copied().fold(0.0, larger);
    let mut point_data = vec![Field::vector("displacement", &displacement)];
    point_data.extend(contact::fields(problem.subdomains, touching, contact));
    let estimate = match errors {
        Some(errors) => errors.elements.concat(),
        None => vec![f64::NAN; piece.types.len()],
    };
    let mut cell_data = vec![
        Field::scalar("von_mises", stress),
        Field::scalar("equivalent_plastic_strain", plastic),
        Field::scalar(STRESS_ERROR, estimate),
    ];
    cell_data.extend(distances.map(|distances| Field::scalar(ENERGY_ERROR, distances.concat())));
    cell_data.extend(sizes.map(|sizes| Field::scalar(GOAL_ERROR, sizes.concat())));
    piece.record(newton.at().time(), point_data, cell_data);
    largest
}

/// The field of each element's part in the error of the stress.
pub const STRESS_ERROR: &str = "error_estimate";
/// The field of Bregman distances.
pub const ENERGY_ERROR: &str = "energy_error";
/// The field of each element's part in the error of a number.
pub const GOAL_ERROR: &str = "goal_error";

/// What is known of the errors of elements of each own subdomain, if meshes are refined.
#[derive(Default)]
pub struct OfElements {
    /// Bregman distances.
    pub distances: Option<Vec<Vec<f64>>>,
    /// Parts in the error of a number, without their signs.
    pub sizes: Option<Vec<Vec<f64>>>,
}

/// The largest value of a field in each element of some increments that were recorded, subdomain by subdomain. None if there is no
/// such field.
pub fn largest(piece: &Piece, increments: &Range<usize>, subdomains: &[Subdomain], name: &str) -> Vec<Vec<f64>> {
    let states =
        piece.cell_data.iter().filter(|field| field.name == name).flat_map(|field| &field.states[increments.clone()]);
    let mut largest: Vec<f64> = Vec::new();
    for state in states.filter_map(Values::real) {
        largest.resize(state.len(), 0.0);
        // What is not a number is not larger.
        largest.iter_mut().zip(state).for_each(|(largest, value)| *largest = largest.max(*value));
    }
    let mut rest = largest.into_iter();
    subdomains.iter().map(|subdomain| rest.by_ref().take(subdomain.elements.len()).collect()).collect()
}

/// Von Mises stress and equivalent plastic strain of all elements, one increment from what is committed.
fn element_states<'a>(problem: &'a TornProblem<'_>, u: &'a Torn) -> impl Iterator<Item = (f64, f64)> + use<'a> {
    let answers = |(own, u): (usize, &Vec<f64>)| internal::answers(&problem.region(own), u);
    u.iter().enumerate().flat_map(answers).map(|answer| (answer.von_mises, answer.equivalent_plastic_strain))
}
