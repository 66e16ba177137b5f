//! Parts that hang together: small pieces of a part go to a neighbour.
//!
//! A piece is a set of elements of one part that share whole faces. The largest of a part stays, others go to the part with
//! which they share most faces, of those that stay, unless they are large enough to be parts of their own. So a part that
//! takes a piece gets larger by less than a quarter of the mean.

use std::collections::BTreeMap;

use crate::mesh::connectivity::split_into_pieces;

/// A piece of more than this part of the mean size of parts is no small one.
const LARGE: f64 = 0.25;

/// Hands small pieces over to neighbours, and makes large ones parts. `neighbours` are the elements that share a face with
/// one. Returns the number of parts.
pub fn join<I: Iterator<Item = u32>>(part: &mut [i32], parts: usize, neighbours: impl Fn(usize) -> I) -> usize {
    let large = LARGE * part.len() as f64 / parts as f64;
    loop {
        let mut piece = part.to_vec();
        let pieces = split_into_pieces(&mut piece, &neighbours);
        let mut sizes = vec![0_usize; pieces];
        piece.iter().for_each(|&piece| sizes[piece as usize] += 1);
        let mut largest: BTreeMap<i32, usize> = BTreeMap::new();
        for (&piece, &part) in piece.iter().zip(part.iter()) {
            let first = largest.entry(part).or_insert(piece as usize);
            if sizes[piece as usize] > sizes[*first] {
                *first = piece as usize;
            }
        }
        let mut faces: Vec<BTreeMap<i32, u32>> = vec![BTreeMap::new(); pieces];
        let stays = |element: usize| {
            let own = piece[element] as usize;
            largest[&part[element]] == own || sizes[own] as f64 >= large
        };
        for element in (0..part.len()).filter(|&element| !stays(element)) {
            for other in neighbours(element).map(|other| other as usize).filter(|&other| stays(other)) {
                *faces[piece[element] as usize].entry(part[other]).or_default() += 1;
            }
        }
        let most = |faces: &BTreeMap<i32, u32>| {
            faces.iter().max_by(|a, b| a.1.cmp(b.1).then(b.0.cmp(a.0))).map(|(&part, _)| part)
        };
        let takers: Vec<Option<i32>> = faces.iter().map(most).collect();
        if takers.iter().all(Option::is_none) {
            part.copy_from_slice(&piece);
            return pieces;
        }
        for (part, &piece) in part.iter_mut().zip(&piece) {
            *part = takers[piece as usize].unwrap_or(*part);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::join;

    /// Neighbours in a row of elements.
    fn row(length: usize) -> impl Fn(usize) -> std::vec::IntoIter<u32> {
        move |k| {
            let next = (k + 1 < length).then_some(k as u32 + 1);
            k.checked_sub(1).map(|before| before as u32).into_iter().chain(next).collect::<Vec<_>>().into_iter()
        }
    }

    #[test]
    fn small_pieces_go_to_a_neighbour_and_empty_parts_vanish() {
        let mut part = [0, 0, 0, 0, 0, 3, 0, 3, 3, 3, 3, 3];
        // Either of the two single elements is between the other and its own part.
        assert_eq!(join(&mut part, 2, row(12)), 2);
        assert_eq!(part, [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn large_pieces_are_parts_of_their_own() {
        let mut part = [0, 0, 0, 1, 1, 1, 0, 0];
        assert_eq!(join(&mut part, 2, row(8)), 3);
        assert_eq!(part, [0, 0, 0, 2, 2, 2, 1, 1]);
    }
}
