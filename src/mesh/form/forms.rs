//! Which forms the faces and edges of a body are on, known to the ranks that have them.
//!
//! A face is on one form. An edge is on those of the faces beside it, though these may be on other ranks, or of other elements.
//! Edges between planes need no form: what is in the middle of one is on both.

use std::collections::HashMap;

use super::{Form, find};
use crate::comm::{Comm, of_ranks};
use crate::mesh::SolidMesh;
use crate::mesh::faces::{Neighbours, key};
use crate::mesh::marked::forward;
use crate::vector::Point;

/// The forms of a body.
#[derive(Clone, Debug, Default)]
pub struct Forms {
    /// All of them, the same on every rank.
    pub all: Vec<Form>,
    /// Those of faces, by corners (ascending): all own ones, and some others.
    pub faces: HashMap<Vec<u32>, u32>,
    /// Those of edges that are on a curved one, all own ones and some others: two, which may be the same.
    pub edges: HashMap<[u32; 2], [u32; 2]>,
}

impl Forms {
    /// Of own faces, each with its form. Collective.
    pub fn new(comm: &dyn Comm, nodes: &[u32], all: Vec<Form>, faces: HashMap<Vec<u32>, u32>) -> Self {
        let edges = |(face, &form): (&Vec<u32>, &u32)| {
            [[face[0], face[1]], [face[1], face[2]], [face[0], face[2]]].map(|edge| (edge.to_vec(), form as usize))
        };
        let edges: Vec<(Vec<u32>, usize)> = faces.iter().flat_map(edges).collect();
        let of_edge = |(edge, forms): (Vec<u32>, Vec<usize>)| {
            let forms = match forms[..] {
                [one] => [one, one],
                [one, other] => [one, other],
                _ => return None,
            };
            let is_curved = forms.iter().any(|&form| all[form].is_curved());
            is_curved.then(|| ([edge[0], edge[1]], forms.map(|form| form as u32)))
        };
        let edges = forward(comm, nodes, 2, &edges).into_iter().filter_map(of_edge).collect();
        Self { all, faces, edges }
    }

    /// Those that all nodes of a part of the surface are on. Rank 0 has the surface for that. Collective.
    pub fn found(comm: &dyn Comm, mesh: &SolidMesh) -> Self {
        let portion = &mesh.portion;
        let outer = Neighbours::new(portion.points.len(), &portion.elements);
        let mut message = Vec::new();
        for face in outer.outer(&portion.elements) {
            for node in face {
                message.push(u64::from(portion.nodes[node as usize]));
                message.extend(portion.points[node as usize].map(f64::to_bits));
            }
        }
        let mut outgoing = vec![Vec::new(); comm.size()];
        outgoing[0] = message;
        let (mut faces, mut places) = (Vec::new(), HashMap::new());
        for theirs in comm.all_to_all(outgoing) {
            for face in theirs.chunks_exact(4 * mesh.portion.elements.kind().faces()[0].len()) {
                for node in face.chunks_exact(4) {
                    let place: Point = std::array::from_fn(|a| f64::from_bits(node[1 + a]));
                    places.insert(node[0] as u32, place);
                }
                faces.push(face.iter().step_by(4).map(|&node| node as u32).collect::<Vec<u32>>());
            }
        }
        // What two elements of different ranks share is no surface.
        faces.sort_unstable_by_key(|face| key(&face[..3]));
        let faces: Vec<Vec<u32>> = faces
            .chunk_by(|a, b| key(&a[..3]) == key(&b[..3]))
            .filter(|same| same.len() == 1)
            .flat_map(<[_]>::to_vec)
            .collect();
        let found = find::find(&faces, |node| places[&node]);
        let packed: Vec<u64> = found.iter().flat_map(|(form, _)| pack(form)).collect();
        let all: Vec<Form> = of_ranks(comm, &packed)[0].chunks_exact(WORDS).map(unpack).collect();
        let on = |(number, (_, part)): (usize, &(Form, Vec<usize>))| {
            part.iter().map(|&face| (key(&faces[face][..3]), number)).collect::<Vec<_>>()
        };
        let marked: Vec<(Vec<u32>, usize)> = found.iter().enumerate().flat_map(on).collect();
        let of_faces = forward(comm, &portion.nodes, 3, &marked);
        Self::new(
            comm,
            &portion.nodes,
            all,
            of_faces.into_iter().map(|(face, forms)| (face, forms[0] as u32)).collect(),
        )
    }
}

/// Words of a packed form.
const WORDS: usize = 9;

fn pack(form: &Form) -> [u64; WORDS] {
    let (kind, [a, b, c], [d, e, f], [r, s]) = match *form {
        Form::Plane { point, normal } => (0, point, normal, [0.0; 2]),
        Form::Sphere { centre, radius } => (1, centre, [0.0; 3], [radius, 0.0]),
        Form::Cone { point, axis, radius, opening } => (2, point, axis, [radius, opening]),
        Form::Torus { centre, axis, radii } => (3, centre, axis, radii),
    };
    let [a, b, c, d, e, f, r, s] = [a, b, c, d, e, f, r, s].map(f64::to_bits);
    [kind, a, b, c, d, e, f, r, s]
}

fn unpack(words: &[u64]) -> Form {
    let number = |k: usize| f64::from_bits(words[k]);
    let [one, other]: [Point; 2] = [1, 4].map(|first| std::array::from_fn(|a| number(first + a)));
    match words[0] {
        0 => Form::Plane { point: one, normal: other },
        1 => Form::Sphere { centre: one, radius: number(7) },
        2 => Form::Cone { point: one, axis: other, radius: number(7), opening: number(8) },
        _ => Form::Torus { centre: one, axis: other, radii: [number(7), number(8)] },
    }
}
