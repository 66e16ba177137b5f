//! Face-connectivity of a partition: two elements are neighbours only if they share a whole face.
//!
//! A part that falls into pieces, or hangs together by an edge or a vertex only, has more than six rigid body modes.

/// Splits every part into its connected pieces. `parts[e]` is the part of element `e`, `neighbours(e)` are those that share a
/// face with it. Pieces are numbered consecutively in the order of their parts (empty parts vanish), within a part by first
/// element. Returns the number of pieces.
pub fn split_into_pieces<I: Iterator<Item = u32>>(parts: &mut [i32], neighbours: impl Fn(usize) -> I) -> usize {
    let mut pieces = vec![usize::MAX; parts.len()];
    let mut part_of_piece = Vec::new();
    let mut stack = Vec::new();
    for seed in 0..parts.len() {
        if pieces[seed] != usize::MAX {
            continue;
        }
        let piece = part_of_piece.len();
        part_of_piece.push(parts[seed]);
        pieces[seed] = piece;
        stack.push(seed);
        while let Some(element) = stack.pop() {
            for other in neighbours(element).map(|o| o as usize) {
                if pieces[other] == usize::MAX && parts[other] == parts[element] {
                    pieces[other] = piece;
                    stack.push(other);
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..part_of_piece.len()).collect();
    order.sort_by_key(|&piece| (part_of_piece[piece], piece));
    let mut number = vec![0; order.len()];
    for (new, &piece) in order.iter().enumerate() {
        number[piece] = new as i32;
    }
    for (part, piece) in parts.iter_mut().zip(pieces) {
        *part = number[piece];
    }
    order.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Kind;
    use crate::mesh::Elements;
    use crate::mesh::faces::Neighbours;

    #[test]
    fn a_part_in_two_pieces_becomes_two_and_empty_parts_vanish() {
        // A chain of five elements; part 0 holds both ends, part 2 is empty.
        let elements = Elements::new(Kind::Tet4, (0..5).flat_map(|k| k..k + 4).collect());
        let mut parts = [0, 1, 1, 3, 0];
        let neighbours = Neighbours::new(8, &elements);
        assert_eq!(split_into_pieces(&mut parts, |e| neighbours.of(e)), 4);
        assert_eq!(parts, [0, 2, 2, 3, 1]);
    }
}
