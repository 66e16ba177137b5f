//! Boundary faces in triangles: which of them touch. A rank has those of its own elements, and of the others what may touch
//! them.

use std::collections::HashSet;

use crate::comm::{Comm, all_gather_u64};
use crate::mesh::boxes::{Box3, BoxTree, around, meet};
use crate::mesh::joints::Joints;
use crate::mesh::near::{of_segments, pierces, volume};
use crate::mesh::portion::Portion;
use crate::mesh::surface::{area, normal};

/// What is nearer than this, in units of the height of elements, touches.
pub const NEAR: f64 = 1e-4;

/// Triangles of a face, at most.
const TRIANGLES: u64 = 4;
/// Numbers from here on are those of centres of faces.
const CENTRES: u64 = 1 << 32;

/// A triangle of a boundary face.
pub(super) struct Facet {
    /// Number among the triangles of the faces of all elements, in their order.
    pub number: u64,
    /// Place of the element on this rank; none if another rank has it.
    pub element: Option<u32>,
    /// Region of the element.
    pub region: u32,
    /// Its corners, by the numbers of nodes within the body or beyond these of centres of faces.
    pub ids: [u64; 3],
    pub corners: [[f64; 3]; 3],
    /// The node of a linear tetrahedron that is not on the face.
    apex: u64,
    /// What is nearer touches.
    pub near: f64,
}

/// Words of a facet in a message.
const WORDS: usize = 16;

impl Facet {
    /// Number of the face.
    pub fn face(&self) -> u64 {
        self.number / TRIANGLES
    }

    /// Corners that are nodes.
    pub fn is_node(id: u64) -> bool {
        id < CENTRES
    }

    fn pack(&self) -> [u64; WORDS] {
        let numbers = [self.number, self.region.into(), self.apex, self.near.to_bits()];
        let corners = self.corners.as_flattened().iter().map(|x| x.to_bits());
        let mut words = numbers.into_iter().chain(self.ids).chain(corners);
        std::array::from_fn(|_| words.next().expect("a facet has so many words"))
    }

    fn unpack(&[number, region, apex, near, a, b, c, ref corners @ ..]: &[u64; WORDS]) -> Self {
        let corners = std::array::from_fn(|k| std::array::from_fn(|i| f64::from_bits(corners[3 * k + i])));
        let (region, near) = (region as u32, f64::from_bits(near));
        Self { number, element: None, region, ids: [a, b, c], corners, apex, near }
    }

    /// The box of all that may touch it.
    pub fn room(&self) -> Box3 {
        let [low, high] = around(&self.corners);
        [low.map(|x| x - self.near), high.map(|x| x + self.near)]
    }

    /// Corners that another facet does not have.
    pub fn own<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (u64, [f64; 3])> + 'a {
        self.ids.into_iter().zip(self.corners).filter(|(id, _)| !other.ids.contains(id))
    }

    /// The corner that another facet does not have, if there is one only.
    fn only(&self, other: &Self) -> Option<u64> {
        let mut own = self.own(other);
        let (id, _) = own.next()?;
        own.next().is_none().then_some(id)
    }

    /// Sides by the numbers of their ends, and their ends.
    fn edges(&self) -> [([u64; 2], [[f64; 3]; 2]); 3] {
        [[0, 1], [1, 2], [2, 0]].map(|edge| (edge.map(|k| self.ids[k]), edge.map(|k| self.corners[k])))
    }

    /// Whether the corners that another facet has for itself are clearly on one side of this one.
    pub fn is_aside(&self, other: &Self, near: f64) -> bool {
        let Some(normal) = normal(&self.corners) else { return false };
        let height = |x: [f64; 3]| (0..3).map(|i| normal[i] * (x[i] - self.corners[0][i])).sum::<f64>();
        let (low, high) = other.own(self).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| {
            let height = height(x);
            (low.min(height), high.max(height))
        });
        low > near || high < -near
    }

    /// Whether edges come near each other, or go through the other facet, beyond the corners that both have.
    pub fn crosses(&self, other: &Self, near: f64) -> bool {
        let through = |one: &Self, other: &Self| {
            let free = |ids: &[u64; 2]| !ids.iter().any(|id| other.ids.contains(id));
            one.edges().iter().any(|(ids, edge)| free(ids) && pierces(edge, &other.corners, near))
        };
        let touch = self.edges().iter().any(|(of_self, a)| {
            let apart = |ids: &[u64; 2]| !ids.iter().any(|id| of_self.contains(id));
            other.edges().iter().any(|(ids, b)| apart(ids) && of_segments(a, b) <= near * near)
        });
        touch || through(self, other) || through(other, self)
    }
}

/// The boundary of own elements in triangles, in the order of the elements. Collective.
pub(super) fn facets(comm: &dyn Comm, portion: &Portion, joints: &Joints) -> Vec<Facet> {
    let heights = heights(comm, portion, joints);
    let kind = portion.elements.kind();
    let global = |node: u32| u64::from(portion.nodes[node as usize]);
    let at = |node: u32| portion.points[node as usize];
    let mut facets = Vec::new();
    for (element, side) in joints.outer(portion) {
        let face = portion.elements.face(element, side);
        let near = NEAR * face.iter().map(|&n| heights[n as usize]).fold(f64::INFINITY, f64::min);
        let number = u64::from(portion.numbers[element]) * kind.faces().len() as u64 + side as u64;
        let apex = portion.elements.get(element).iter().find(|n| !face.contains(n)).map_or(0, |&n| global(n));
        let mut add = |k: u64, ids: [u64; 3], corners| {
            let (number, region) = (TRIANGLES * number + k, portion.wholes[element]);
            facets.push(Facet { number, element: Some(element as u32), region, ids, corners, apex, near });
        };
        match face[..] {
            [a, b, c, ab, bc, ca] => {
                for (k, ids) in (0..).zip([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]) {
                    add(k, ids.map(global), ids.map(at));
                }
            }
            [a, b, c, d] => {
                let centre = std::array::from_fn(|i| 0.25 * face.iter().map(|&n| at(n)[i]).sum::<f64>());
                for (k, [m, n]) in (0..).zip([[a, b], [b, c], [c, d], [d, a]]) {
                    add(k, [global(m), global(n), CENTRES + number], [at(m), at(n), centre]);
                }
            }
            _ => {
                let ids = [face[0], face[1], face[2]];
                add(0, ids.map(global), ids.map(at));
            }
        }
    }
    facets
}

/// The least height of the elements around each node of the boundary; not a number for other nodes. Collective.
fn heights(comm: &dyn Comm, portion: &Portion, joints: &Joints) -> Vec<f64> {
    let mut on_boundary = vec![[0]; portion.nodes.len()];
    let outer = joints.outer(portion).flat_map(|(element, side)| portion.elements.face(element, side));
    outer.for_each(|node| on_boundary[node as usize] = [1]);
    joints.agree(comm, &mut on_boundary, |mine, theirs| mine[0] |= theirs[0]);
    let start = |[on]: &[u64; 1]| if *on == 1 { f64::INFINITY } else { f64::NAN };
    let mut heights: Vec<f64> = on_boundary.iter().map(start).collect();
    for (element, nodes) in portion.elements.iter().enumerate() {
        if nodes.iter().any(|&n| !heights[n as usize].is_nan()) {
            let height = height(portion, element);
            for &node in nodes {
                // What is not a number stays so.
                if heights[node as usize] > height {
                    heights[node as usize] = height;
                }
            }
        }
    }
    let mut bits: Vec<[u64; 1]> = heights.into_iter().map(|height| [height.to_bits()]).collect();
    joints.agree(comm, &mut bits, |mine, theirs| {
        mine[0] = f64::from_bits(mine[0]).min(f64::from_bits(theirs[0])).to_bits();
    });
    bits.into_iter().map(|[bits]| f64::from_bits(bits)).collect()
}

/// Facets of other ranks that may touch own ones, behind these. Collective.
pub(super) fn with_others(comm: &dyn Comm, mut own: Vec<Facet>) -> Vec<Facet> {
    if comm.size() == 1 {
        return own;
    }
    let rooms: Vec<Box3> = own.iter().map(Facet::room).collect();
    let hulls = BoxTree::new(&rooms).hulls();
    let mut message = vec![comm.rank() as u64, hulls.len() as u64];
    message.extend(hulls.as_flattened().as_flattened().iter().map(|x| x.to_bits()));
    let all = all_gather_u64(comm, &message);
    let (mut outgoing, mut rest) = (vec![Vec::new(); comm.size()], &all[..]);
    while let [rank, count, after @ ..] = rest {
        let (hulls, after) = after.split_at(6 * *count as usize);
        rest = after;
        if *rank == comm.rank() as u64 {
            continue;
        }
        let number = |bits: &u64| f64::from_bits(*bits);
        let hulls: Vec<Box3> = hulls
            .as_chunks::<6>()
            .0
            .iter()
            .map(|hull| [std::array::from_fn(|i| number(&hull[i])), std::array::from_fn(|i| number(&hull[3 + i]))])
            .collect();
        let near = own.iter().zip(&rooms).filter(|(_, room)| hulls.iter().any(|hull| meet(hull, room)));
        outgoing[*rank as usize].extend(near.flat_map(|(facet, _)| facet.pack()));
    }
    for theirs in comm.all_to_all(outgoing) {
        own.extend(theirs.as_chunks().0.iter().map(Facet::unpack));
    }
    own
}

/// The least height of a tetrahedron, or of those that the edges at the corners of a hexahedron span.
fn height(portion: &Portion, element: usize) -> f64 {
    let places = portion.places(element);
    let of = |tet: &[usize; 4]| {
        let [a, b, c, d] = tet.map(|k| places[k]);
        let largest = [[a, b, c], [a, b, d], [b, c, d], [a, c, d]].iter().map(area).fold(0.0, f64::max);
        0.5 * volume(a, b, c, d).abs() / largest
    };
    portion.elements.kind().cell().spanned().iter().map(of).fold(f64::INFINITY, f64::min)
}

/// The nodes of two facets with an edge in common, if the other two faces of their tetrahedron are there, too, but no element
/// is. The boundary is empty where cells are not cut.
pub(super) fn hole_between(one: &Facet, other: &Facet, boundary: &HashSet<[u64; 3]>) -> Option<[u64; 4]> {
    if boundary.is_empty() {
        return None;
    }
    let [a, b] = [one.only(other)?, other.only(one)?];
    let closed = one.ids.iter().filter(|&&id| id != a).all(|&id| boundary.contains(&sorted([a, b, id])));
    let [i, j, k] = one.ids;
    (closed && one.apex != b).then(|| sorted([i, j, k, b]))
}

pub(super) fn sorted<const N: usize>(mut ids: [u64; N]) -> [u64; N] {
    ids.sort_unstable();
    ids
}
