//! Parts that hang together: small pieces of a part go to a neighbour.
//!
//! A piece is a set of elements of one part that share whole faces. The largest of a part stays, others go to the part with
//! which they share most faces, of those that stay, unless they are large enough to be parts of their own. So a part that
//! takes a piece gets larger by less than a quarter of the mean.

use std::collections::BTreeMap;

use crate::comm::{Comm, all_gather_u64};
use crate::mesh::Portion;
use crate::mesh::connectivity::split_into_pieces;
use crate::mesh::faces::{Neighbours, OUTSIDE};
use crate::mesh::wholes::Wholes;

/// A piece of more than this part of the mean size of parts is no small one.
const LARGE: f64 = 0.25;

/// A face-connected set of elements of one part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Piece {
    /// Its part.
    pub part: u32,
    /// The least number of an element.
    pub first: u32,
    /// The whole that it is of.
    pub whole: u32,
    /// Number of elements.
    pub size: u64,
}

/// The pieces of all parts of a body, and their faces; the same on every rank.
pub struct Pieces {
    /// By part, then by first element.
    pub list: Vec<Piece>,
    /// Faces between two pieces of one whole, both ways.
    pub faces: BTreeMap<(u32, u32), u64>,
    /// The piece of each own element.
    pub own: Vec<u32>,
}

impl Pieces {
    /// Of the parts of a body, each of which is on one rank. Collective.
    pub fn new(comm: &dyn Comm, portion: &Portion) -> Self {
        let neighbours = Neighbours::new(portion.nodes.len(), &portion.elements);
        let mut own: Vec<i32> = portion.part.iter().map(|&part| part as i32).collect();
        let count = split_into_pieces(&mut own, |element| neighbours.of(element));
        let mut mine = vec![Piece { part: 0, first: u32::MAX, whole: 0, size: 0 }; count];
        for (element, &piece) in own.iter().enumerate() {
            let piece = &mut mine[piece as usize];
            (piece.part, piece.whole) = (portion.part[element], portion.wholes[element]);
            piece.first = piece.first.min(portion.numbers[element]);
            piece.size += 1;
        }
        let message: Vec<u64> =
            mine.iter().flat_map(|p| [p.part.into(), p.first.into(), p.whole.into(), p.size]).collect();
        let all = all_gather_u64(comm, &message);
        let unpack = |&[part, first, whole, size]: &[u64; 4]| Piece {
            part: part as u32,
            first: first as u32,
            whole: whole as u32,
            size,
        };
        let mut list: Vec<Piece> = all.as_chunks().0.iter().map(unpack).collect();
        list.sort_unstable();
        let number: Vec<u32> =
            mine.iter().map(|piece| list.binary_search(piece).expect("every piece is listed") as u32).collect();
        let own: Vec<u32> = own.into_iter().map(|piece| number[piece as usize]).collect();
        let faces = faces(comm, portion, &neighbours, &own, &list);
        Self { list, faces, own }
    }

    /// Hands small pieces over to neighbours, and makes large ones parts: the part of each piece, parts being numbered
    /// consecutively.
    pub fn join(&self, wholes: &Wholes) -> Vec<u32> {
        let mut largest: BTreeMap<u32, usize> = BTreeMap::new();
        for (k, piece) in self.list.iter().enumerate() {
            let first = largest.entry(piece.part).or_insert(k);
            if piece.size > self.list[*first].size {
                *first = k;
            }
        }
        let stays = |k: usize| {
            let piece = &self.list[k];
            largest[&piece.part] == k || piece.size as f64 >= LARGE * wholes.mean(piece.whole)
        };
        // Where each piece has gone so far.
        let mut to: Vec<Option<u32>> = (0..self.list.len()).map(|k| stays(k).then_some(k as u32)).collect();
        loop {
            let taker = |k: usize| {
                let mut faces: BTreeMap<u32, u64> = BTreeMap::new();
                for (&(_, other), count) in self.faces.range((k as u32, 0)..=(k as u32, u32::MAX)) {
                    to[other as usize].iter().for_each(|&to| *faces.entry(to).or_default() += count);
                }
                faces.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0))).map(|(to, _)| to)
            };
            let homeless = (0..to.len()).filter(|&k| to[k].is_none());
            let found: Vec<(usize, u32)> = homeless.filter_map(|k| Some((k, taker(k)?))).collect();
            if found.is_empty() {
                break;
            }
            found.into_iter().for_each(|(k, taker)| to[k] = Some(taker));
        }
        let to: Vec<u32> = (0..).zip(to).map(|(k, to)| to.unwrap_or(k)).collect();
        let mut kept = to.clone();
        kept.sort_unstable();
        kept.dedup();
        to.iter().map(|to| kept.binary_search(to).expect("it is one of them") as u32).collect()
    }
}

/// Numbers of faces between pieces of one whole. Faces with one element here meet on the rank that their nodes point to.
fn faces(
    comm: &dyn Comm,
    portion: &Portion,
    neighbours: &Neighbours,
    own: &[u32],
    list: &[Piece],
) -> BTreeMap<(u32, u32), u64> {
    let mut counts: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    let mut count = |a: u32, b: u32| {
        if a != b && list[a as usize].whole == list[b as usize].whole {
            *counts.entry((a, b)).or_default() += 1;
            *counts.entry((b, a)).or_default() += 1;
        }
    };
    let mut outgoing = vec![Vec::new(); comm.size()];
    for (element, &piece) in own.iter().enumerate() {
        for (face, &other) in neighbours.behind(element).iter().enumerate() {
            if other != OUTSIDE && (other as usize) > element {
                count(piece, own[other as usize]);
            } else if other == OUTSIDE && comm.size() > 1 {
                let [first, last] = portion.face_key(element, face);
                let at = (first ^ last) as u32 as usize % comm.size();
                outgoing[at].push([first, last << 32 | u64::from(piece)]);
            }
        }
    }
    let outgoing = outgoing.into_iter().map(|faces| faces.into_flattened()).collect();
    let mut met: Vec<[u64; 2]> =
        comm.all_to_all(outgoing).iter().flat_map(|theirs| theirs.as_chunks::<2>().0).copied().collect();
    met.sort_unstable();
    for same in met.chunk_by(|a, b| a[0] == b[0] && a[1] >> 32 == b[1] >> 32) {
        if let [a, b] = same {
            count(a[1] as u32, b[1] as u32);
        }
    }
    let mine: Vec<u64> = counts.iter().flat_map(|(&(a, b), &n)| [u64::from(a) << 32 | u64::from(b), n]).collect();
    let mut all: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    for &[pair, n] in all_gather_u64(comm, &mine).as_chunks::<2>().0 {
        *all.entry(((pair >> 32) as u32, pair as u32)).or_default() += n;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Elements in a row.
    fn row(parts: &[u32]) -> Pieces {
        let (mut list, mut faces, mut own) = (Vec::<Piece>::new(), BTreeMap::new(), Vec::new());
        for (at, &part) in parts.iter().enumerate() {
            match list.last_mut().filter(|last| last.part == part) {
                Some(last) => last.size += 1,
                None => list.push(Piece { part, first: at as u32, whole: 0, size: 1 }),
            }
        }
        let order = list.clone();
        list.sort_unstable();
        let number = |piece: &Piece| list.binary_search(piece).unwrap() as u32;
        for pair in order.windows(2) {
            let [a, b] = [&pair[0], &pair[1]].map(number);
            faces.extend([((a, b), 1), ((b, a), 1)]);
        }
        order.iter().for_each(|piece| own.extend(vec![number(piece); piece.size as usize]));
        Pieces { list, faces, own }
    }

    fn joined(parts: &[u32], wanted: u32) -> Vec<u32> {
        let pieces = row(parts);
        let to = pieces.join(&Wholes::new(vec![parts.len() as u64], vec![wanted]));
        pieces.own.iter().map(|&piece| to[piece as usize]).collect()
    }

    #[test]
    fn small_pieces_go_to_a_neighbour_and_empty_parts_vanish() {
        // Either of the two single elements is between the other and its own part.
        assert_eq!(joined(&[0, 0, 0, 0, 0, 3, 0, 3, 3, 3, 3, 3], 2), [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn large_pieces_are_parts_of_their_own() {
        assert_eq!(joined(&[0, 0, 0, 1, 1, 1, 0, 0], 2), [0, 0, 0, 2, 2, 2, 1, 1]);
    }
}
