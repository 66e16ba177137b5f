//! Which elements share a face, and which ranks a node, where each rank has some of the elements.
//!
//! A face can be another rank's too only if all of its corners are. Such faces meet on the rank that their nodes point to,
//! so nothing as long as the mesh is sent, and no rank hears of more than its own borders.

use std::collections::HashMap;

use super::connectivity::split_into_pieces;
use super::faces::{Neighbours, OUTSIDE, turns};
use super::portion::Portion;
use crate::comm::common::common;
use crate::comm::words::{before, least, sum};
use crate::comm::{Comm, all_gather_u64};

/// Neighbours of the elements of a mesh.
pub struct Joints {
    /// Those on this rank.
    pub own: Neighbours,
    /// For each rank the faces of own elements behind which it has the element, in the same order there.
    pub across: Vec<Vec<Across>>,
    /// For each rank the places of the nodes that it has too, ascending.
    pub nodes: Vec<Vec<u32>>,
    /// Faces with more than two elements, or two on the same side, of all ranks, and the least node of the first.
    pub overlapping: Option<(u64, u32)>,
    /// Faces of own elements in `across`.
    elsewhere: HashMap<u32, u32>,
}

/// A face whose other element another rank has.
#[derive(Clone, Copy, Debug)]
pub struct Across {
    /// Number of the face among those of own elements (see [`Neighbours::overlapping`]).
    pub face: u32,
    /// Number of the element behind within the body.
    pub element: u32,
    /// Its region.
    pub region: u32,
    /// Nodes of its face in the middle of edges, within the body, ascending; zeros if it has none.
    pub middles: [u32; 3],
}

/// Words of a face where it meets others.
const WORDS: usize = 6;

impl Joints {
    /// Pairs up the faces of all ranks' elements. Collective.
    pub fn new(comm: &dyn Comm, portion: &Portion) -> Self {
        let own = Neighbours::new(portion.nodes.len(), &portion.elements);
        let keys: Vec<[u64; 1]> = portion.nodes.iter().map(|&node| [u64::from(node)]).collect();
        let nodes = common(comm, &keys);
        let mut is_shared = vec![false; portion.nodes.len()];
        nodes.iter().flatten().for_each(|&node| is_shared[node as usize] = true);
        let faces = portion.elements.kind().faces().len();
        let corners = portion.elements.kind().cell().corners_of_face();
        let is_common = |nodes: &[u32]| nodes[..corners].iter().all(|&node| is_shared[node as usize]);
        let mut outgoing = vec![Vec::new(); comm.size()];
        for face in (0..(faces * portion.len()) as u32).filter(|_| comm.size() > 1) {
            let nodes = portion.elements.face(face as usize / faces, face as usize % faces);
            if is_common(&nodes) {
                let record = record(portion, face, &nodes);
                outgoing[(record[0] ^ record[1]) as u32 as usize % comm.size()].extend(record);
            }
        }
        let alone = |face: &&u32| !is_common(&portion.elements.face(**face as usize / faces, **face as usize % faces));
        let key = |&face: &u32| {
            let nodes = portion.elements.face(face as usize / faces, face as usize % faces);
            key(portion, &nodes[..corners])
        };
        let overlaps: Vec<[u64; 2]> = own.overlapping.iter().filter(alone).map(key).collect();
        let mut joints = Self { own, across: Vec::new(), nodes, overlapping: None, elsewhere: HashMap::new() };
        joints.meet(comm, outgoing, overlaps);
        joints
    }

    /// Lets faces meet, and counts those that overlap.
    fn meet(&mut self, comm: &dyn Comm, outgoing: Vec<Vec<u64>>, mut overlaps: Vec<[u64; 2]>) {
        let mut met: Vec<([u64; WORDS], usize)> = Vec::new();
        for (rank, theirs) in comm.all_to_all(outgoing).iter().enumerate() {
            met.extend(theirs.as_chunks().0.iter().map(|record| (*record, rank)));
        }
        met.sort_unstable();
        let mut answers = vec![Vec::new(); comm.size()];
        for same in met.chunk_by(|a, b| a.0[..2] == b.0[..2]) {
            match same {
                [_] => {}
                [(a, of_a), (b, of_b)] if (a[3] ^ b[3]) & 1 == 1 => {
                    for ([_, _, own, ..], to, other, from) in [(a, of_a, b, of_b), (b, of_b, a, of_a)] {
                        if to != from {
                            let its = [u64::from(*own as u32) << 32 | other[2] >> 32, *from as u64];
                            answers[*to].extend(its.iter().chain(&other[3..]));
                        }
                    }
                }
                _ => overlaps.push([same[0].0[0], same[0].0[1]]),
            }
        }
        let count = sum(comm, vec![overlaps.len() as u64])[0];
        let first = least(comm, overlaps.into_iter().min());
        self.overlapping = first.map(|[key, _]| (count, (key >> 32) as u32));
        self.across = vec![Vec::new(); comm.size()];
        for &[faces, rank, other, edges, last] in
            comm.all_to_all(answers).iter().flat_map(|theirs| theirs.as_chunks::<5>().0)
        {
            let (face, element, region) = ((faces >> 32) as u32, faces as u32, (other >> 1) as u32);
            let middles = [(edges >> 32) as u32, edges as u32, last as u32];
            self.elsewhere.insert(face, element);
            self.across[rank as usize].push(Across { face, element, region, middles });
        }
    }

    /// Own elements with their sides that no element is behind, in the order of the elements.
    pub fn outer<'a>(&'a self, portion: &'a Portion) -> impl Iterator<Item = (usize, usize)> + 'a {
        let faces = portion.elements.kind().faces().len();
        let is_outer = move |&(element, side): &(usize, usize)| {
            self.own.behind(element)[side] == OUTSIDE
                && !self.elsewhere.contains_key(&((faces * element + side) as u32))
        };
        (0..portion.len()).flat_map(move |element| (0..faces).map(move |side| (element, side))).filter(is_outer)
    }

    /// Own elements with their sides that another element is behind, once for each such face on all ranks.
    pub fn inner<'a>(&'a self, portion: &'a Portion) -> impl Iterator<Item = (usize, usize)> + 'a {
        let faces = portion.elements.kind().faces().len();
        let is_first = move |&(element, side): &(usize, usize)| match self.own.behind(element)[side] {
            OUTSIDE => {
                let behind = self.elsewhere.get(&((faces * element + side) as u32));
                behind.is_some_and(|&other| portion.numbers[element] < other)
            }
            other => portion.numbers[element] < portion.numbers[other as usize],
        };
        (0..portion.len()).flat_map(move |element| (0..faces).map(move |side| (element, side))).filter(is_first)
    }

    /// The face-connected piece of each own element among those with its label, and the number of pieces of all ranks. Pieces
    /// are numbered by label, then by their first element. Every rank hears of the pieces of each, not of elements.
    /// Collective.
    pub fn pieces(&self, comm: &dyn Comm, portion: &Portion, labels: &[u32]) -> (Vec<u32>, usize) {
        let faces = portion.elements.kind().faces().len();
        let mut own: Vec<i32> = labels.iter().map(|&label| label as i32).collect();
        let count = split_into_pieces(&mut own, |element| self.own.of(element));
        let mut mine = vec![[0, u64::MAX]; count];
        for ((&piece, &label), &number) in own.iter().zip(labels).zip(&portion.numbers) {
            let [its, first] = &mut mine[piece as usize];
            (*its, *first) = (label.into(), (*first).min(number.into()));
        }
        let [begin, total] = before(comm, count as u64);
        let all = all_gather_u64(comm, mine.as_flattened());
        // What lies across belongs together.
        let of_face = |across: &Across| {
            let element = across.face as usize / faces;
            [begin + own[element] as u64, labels[element].into()]
        };
        let outgoing = self.across.iter().map(|faces| faces.iter().flat_map(of_face).collect()).collect();
        let mut pairs = Vec::new();
        for (theirs, faces) in comm.all_to_all(outgoing).iter().zip(&self.across) {
            let met = theirs.as_chunks::<2>().0.iter().zip(faces.iter().map(of_face));
            pairs.extend(met.filter(|(a, b)| a[1] == b[1] && a[0] > b[0]).map(|(a, b)| [b[0], a[0]]));
        }
        pairs.sort_unstable();
        pairs.dedup();
        let pairs = all_gather_u64(comm, pairs.as_flattened());
        let mut beside = vec![Vec::new(); total as usize];
        for &[a, b] in pairs.as_chunks::<2>().0 {
            beside[a as usize].push(b as u32);
            beside[b as usize].push(a as u32);
        }
        let mut joined = vec![0; total as usize];
        let groups = split_into_pieces(&mut joined, |piece| beside[piece].iter().copied());
        // In the order of labels and first elements.
        let mut firsts = vec![[u64::MAX; 2]; groups];
        for (&group, piece) in joined.iter().zip(all.as_chunks::<2>().0) {
            firsts[group as usize] = firsts[group as usize].min(*piece);
        }
        let mut order: Vec<usize> = (0..groups).collect();
        order.sort_by_key(|&group| firsts[group]);
        let mut number = vec![0; groups];
        (0..).zip(order).for_each(|(new, group)| number[group] = new);
        let of_piece = |&piece: &i32| number[joined[begin as usize + piece as usize] as usize];
        (own.iter().map(of_piece).collect(), groups)
    }

    /// Lets all ranks that have a node agree on it: `fold` adds what another rank has to a value here. Collective.
    pub fn agree<const N: usize>(
        &self,
        comm: &dyn Comm,
        values: &mut [[u64; N]],
        fold: impl Fn(&mut [u64; N], [u64; N]),
    ) {
        let outgoing =
            self.nodes.iter().map(|nodes| nodes.iter().flat_map(|&n| values[n as usize]).collect()).collect();
        for (theirs, nodes) in comm.all_to_all(outgoing).iter().zip(&self.nodes) {
            nodes.iter().zip(theirs.as_chunks().0).for_each(|(&node, value)| fold(&mut values[node as usize], *value));
        }
    }
}

/// Corners of a face within the body, ascending, two to a word.
fn key(portion: &Portion, corners: &[u32]) -> [u64; 2] {
    let mut nodes = [u32::MAX; 4];
    nodes.iter_mut().zip(corners).for_each(|(to, &node)| *to = portion.nodes[node as usize]);
    nodes.sort_unstable();
    let [a, b, c, d] = nodes.map(u64::from);
    [a << 32 | b, c << 32 | d]
}

/// What is told of a face where it meets others.
fn record(portion: &Portion, face: u32, nodes: &[u32]) -> [u64; WORDS] {
    let kind = portion.elements.kind();
    let (element, corners) = (face as usize / kind.faces().len(), kind.cell().corners_of_face());
    let [a, b] = key(portion, &nodes[..corners]);
    let [m, n, o] = middles(portion, &nodes[corners..]).map(u64::from);
    let sense = u64::from(portion.wholes[element]) << 1 | u64::from(turns(&nodes[..corners]));
    [a, b, u64::from(portion.numbers[element]) << 32 | u64::from(face), sense, m << 32 | n, o]
}

/// Nodes in the middle of a face's edges within the body, ascending; zeros if there are none.
fn middles(portion: &Portion, nodes: &[u32]) -> [u32; 3] {
    let mut middles = [0; 3];
    middles.iter_mut().zip(nodes).for_each(|(to, &node)| *to = portion.nodes[node as usize]);
    middles.sort_unstable();
    middles
}
