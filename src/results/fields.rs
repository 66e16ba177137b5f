//! The solution as fields on one rank's mesh: what ParaView shows.

use super::piece::{Field, Piece};
use crate::contact::ContactPair;
use crate::decomposition::{Decomposition, Subdomain};
use crate::element::tet4::Tet4;
use crate::feti::Torn;
use crate::material::{History, Material};
use crate::tensor;

/// VTK's number of a linear tetrahedron.
const VTK_TETRA: u8 = 10;

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

/// Mesh and fields of a rank's subdomains, one behind the other. `contact` holds the pairs whose slave is here.
pub fn piece(
    decomposition: &Decomposition,
    materials: &[Material],
    u: &Torn,
    pairs: &[ContactPair],
    contact: &[ContactState],
    rank: usize,
) -> Piece {
    let mut piece = Piece { offsets: vec![0], ..Piece::default() };
    let (mut displacement, mut stress, mut plastic) = (Vec::new(), Vec::new(), Vec::new());
    let (mut pressure, mut gap, mut status) = (Vec::new(), Vec::new(), Vec::new());
    let (mut subdomain_ids, mut bodies) = (Vec::new(), Vec::new());
    for (subdomain, u) in decomposition.subdomains.iter().zip(u) {
        let first = piece.points.len() as u64;
        piece.points.extend(&subdomain.points);
        displacement.extend(u.chunks_exact(3).map(|u| [u[0], u[1], u[2]]));
        let slaves = slave_fields(subdomain, pairs, contact);
        pressure.extend(slaves.pressure);
        gap.extend(slaves.gap);
        status.extend(slaves.status);
        for nodes in &subdomain.elements {
            piece.connectivity.extend(nodes.map(|n| first + u64::from(n)));
            piece.offsets.push(piece.connectivity.len() as u64);
            piece.types.push(VTK_TETRA);
            let (equivalent, kappa) = element_state(subdomain, &materials[subdomain.body], nodes, u);
            stress.push(equivalent);
            plastic.push(kappa);
            subdomain_ids.push(subdomain.id as i64);
            bodies.push(subdomain.body as i64);
        }
    }
    piece.point_data = vec![
        Field::vector("displacement", &displacement),
        Field::scalar("contact_pressure", pressure),
        Field::scalar("contact_gap", gap),
        Field::integer("contact_status", status),
    ];
    piece.cell_data = vec![
        Field::scalar("von_mises", stress),
        Field::scalar("equivalent_plastic_strain", plastic),
        Field::integer("body", bodies),
        Field::integer("rank", vec![rank as i64; subdomain_ids.len()]),
        Field::integer("subdomain", subdomain_ids),
    ];
    piece
}

/// Largest von Mises stress in this rank's elements.
pub fn largest_von_mises(decomposition: &Decomposition, materials: &[Material], u: &Torn) -> f64 {
    let mut largest = 0.0_f64;
    for (subdomain, u) in decomposition.subdomains.iter().zip(u) {
        for nodes in &subdomain.elements {
            let (equivalent, _) = element_state(subdomain, &materials[subdomain.body], nodes, u);
            largest = if equivalent.is_nan() { equivalent } else { largest.max(equivalent) };
        }
    }
    largest
}

/// Von Mises stress and equivalent plastic strain of an element, one step from rest.
fn element_state(subdomain: &Subdomain, material: &Material, nodes: &[u32; 4], u: &[f64]) -> (f64, f64) {
    let element =
        Tet4::new(&nodes.map(|n| subdomain.points[n as usize])).expect("elements of a checked mesh have volume");
    let strain = element.strain(&std::array::from_fn(|k| u[3 * nodes[k / 3] as usize + k % 3]));
    let response = material.respond(&strain, &History::default());
    (tensor::von_mises(&response.stress), response.kappa)
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
    fields
}
