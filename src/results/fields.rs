//! The solution as fields on one rank's mesh: what ParaView shows.

use super::piece::{Field, Piece};
use crate::assembly::internal;
use crate::contact::ContactPair;
use crate::decomposition::Subdomain;
use crate::element::Kind;
use crate::feti::Torn;
use crate::newton::{Solution, TornProblem};

/// VTK's number of a kind of cell.
fn vtk_type(kind: Kind) -> u8 {
    match kind {
        Kind::Tet4 => 10,
        Kind::Tet10 => 24,
        Kind::Hex8 => 12,
    }
}

/// Contact at one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState {
    /// Index of the pair.
    pub pair: usize,
    /// Normal force that the surfaces exert on each other, at least zero (force).
    pub force: f64,
    /// Distance along the normal (length); negative is penetration.
    pub gap: f64,
}

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
            piece.types.push(vtk_type(subdomain.elements.kind()));
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

/// Adds the solution at a time to the mesh; returns the largest von Mises stress in this rank's elements. `contact` holds
/// the pairs whose slave is here.
pub fn record(
    piece: &mut Piece,
    time: f64,
    problem: &TornProblem,
    solution: &Solution,
    pairs: &[ContactPair],
    contact: &[ContactState],
) -> f64 {
    let u = &solution.u;
    let (mut displacement, mut pressure, mut gap, mut status) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (subdomain, u) in problem.subdomains.iter().zip(u) {
        displacement.extend(u.chunks_exact(3).map(|u| [u[0], u[1], u[2]]));
        let slaves = slave_fields(subdomain, pairs, contact);
        pressure.extend(slaves.pressure);
        gap.extend(slaves.gap);
        status.extend(slaves.status);
    }
    let (stress, plastic): (Vec<f64>, _) = element_states(problem, u).unzip();
    let largest = stress.iter().fold(0.0, |a: f64, &b| if b.is_nan() || b > a { b } else { a });
    let point_data = vec![
        Field::vector("displacement", &displacement),
        Field::scalar("contact_pressure", pressure),
        Field::scalar("contact_gap", gap),
        Field::integer("contact_status", status),
    ];
    let estimate = match &solution.errors {
        Some(errors) => errors.elements.concat(),
        None => vec![f64::NAN; piece.types.len()],
    };
    let cell_data = vec![
        Field::scalar("von_mises", stress),
        Field::scalar("equivalent_plastic_strain", plastic),
        Field::scalar("error_estimate", estimate),
    ];
    piece.record(time, point_data, cell_data);
    largest
}

/// Von Mises stress and equivalent plastic strain of all elements, one increment from what is committed.
fn element_states<'a>(problem: &'a TornProblem<'_>, u: &'a Torn) -> impl Iterator<Item = (f64, f64)> + use<'a> {
    problem.subdomains.iter().zip(u).enumerate().flat_map(|(own, (subdomain, u))| {
        let (material, history) = (&problem.materials[own], problem.committed.history(own));
        internal::answers(subdomain, material, history, u).into_iter().map(|answer| (answer.von_mises, answer.kappa))
    })
}

/// Where contact of a quadratic face has conditions at its corners only, its fields are linear: middles have the means.
fn fill_middles(subdomain: &Subdomain, SlaveFields { pressure, gap, status }: &mut SlaveFields) {
    let quadratic = subdomain.facets.iter().filter(|facet| facet.nodes.len() == 6);
    let edges = quadratic.flat_map(|facet| (0..3).map(|k| [3 + k, k, (k + 1) % 3].map(|n| facet.nodes[n] as usize)));
    for [middle, a, b] in edges {
        if status[middle] < 0 && status[a] >= 0 && status[b] >= 0 {
            pressure[middle] = 0.5 * (pressure[a] + pressure[b]);
            gap[middle] = 0.5 * (gap[a] + gap[b]);
            status[middle] = status[a].max(status[b]);
        }
    }
}

/// Contact at the nodes of a subdomain: where a node is in several contacts, the sum of the pressures and the smallest gap.
struct SlaveFields {
    /// Zero off the slave surfaces.
    pressure: Vec<f64>,
    /// Not a number off them.
    gap: Vec<f64>,
    /// 1 where a contact is closed, 0 where none is, -1 off the slave surfaces.
    status: Vec<i64>,
}

fn slave_fields(subdomain: &Subdomain, pairs: &[ContactPair], contact: &[ContactState]) -> SlaveFields {
    let nodes = subdomain.nodes.len();
    let mut fields = SlaveFields { pressure: vec![0.0; nodes], gap: vec![f64::NAN; nodes], status: vec![-1; nodes] };
    for state in contact {
        let pair = &pairs[state.pair];
        if let Some(node) = subdomain.local_node(pair.slave) {
            fields.pressure[node] += state.force / pair.area;
            // Whatever is smaller than not a number is the number.
            fields.gap[node] = state.gap.min(fields.gap[node]);
            fields.status[node] = fields.status[node].max(i64::from(state.force > 0.0));
        }
    }
    fill_middles(subdomain, &mut fields);
    fields
}
