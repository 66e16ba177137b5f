//! Which edge of a tetrahedron is bisected next (Arnold, Mukherjee and Pouly, "Locally adapted tetrahedral meshes using
//! bisection", SIAM J. Sci. Comput. 22 (2000) 431).
//!
//! Every face has a marked edge, and the refinement edge is that of both faces beside it. At first the longest edge of a face is
//! marked, of equal ones the one with the larger numbers, so tetrahedra agree on their common faces. Bisected again and again, a
//! tetrahedron has descendants of finitely many shapes: each contains a copy of it, scaled by some `a`, and is in another,
//! scaled by some `b`, with `a / b` at least 0.08 (computed by the tests). So the ratio of inscribed sphere to longest edge
//! never falls below that share of the first one's.

/// Bound on the shapes of descendants, see the header; over all first tags, as the tests compute it.
#[cfg(test)]
pub const LEAST_COPY: f64 = 0.08;

/// How a tetrahedron is to be bisected; its refinement edge is from corner 0 to corner 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tag {
    /// Of the faces opposite to corners 0 and 1, the corner that is not on the marked edge.
    marks: [u8; 2],
    /// Set in the children of a plane tetrahedron that has no flag.
    is_flagged: bool,
}

/// The point of a child that is the middle of its parent's refinement edge, behind the corners of the parent.
pub const MIDDLE: usize = 4;

/// A half of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Half {
    /// Its corners: those of the parent, or [`MIDDLE`]. In the sense of the parent.
    pub corners: [usize; 4],
    /// For the face opposite to each of them, the corner of the parent that the face of which it is a part is opposite to; none
    /// between the halves.
    pub within: [Option<usize>; 4],
    /// How it is to be bisected.
    pub tag: Tag,
}

impl Tag {
    /// Of a new tetrahedron, and its corners in order, in the same sense. `length` tells how long the edge between two of them is,
    /// all different.
    pub fn first<L: PartialOrd>(length: impl Fn(usize, usize) -> L) -> ([usize; 4], Self) {
        let longest = |among: &[(usize, usize)]| {
            let longer = |best: (usize, usize), edge: (usize, usize)| {
                if length(edge.0, edge.1) > length(best.0, best.1) { edge } else { best }
            };
            among.iter().copied().reduce(longer).expect("there are edges")
        };
        let (p, q) = longest(&[(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]);
        let others: Vec<usize> = (0..4).filter(|k| ![p, q].contains(k)).collect();
        let order = in_sense([0, 1, 2, 3], [p, q, others[0], others[1]]);
        // The corner of a face that is not on its longest edge, as a place in the order.
        let mark = |face: [usize; 3]| {
            let [a, b, c] = face.map(|k| order[k]);
            let (x, y) = longest(&[(a.min(b), a.max(b)), (a.min(c), a.max(c)), (b.min(c), b.max(c))]);
            face.into_iter().find(|&k| ![x, y].contains(&order[k])).expect("a face has three corners") as u8
        };
        (order, Self { marks: [mark([1, 2, 3]), mark([0, 2, 3])], is_flagged: false })
    }

    /// As a number.
    pub fn pack(self) -> u32 {
        u32::from(self.marks[0]) | u32::from(self.marks[1]) << 2 | u32::from(self.is_flagged) << 4
    }

    /// From its number.
    pub fn unpack(packed: u32) -> Self {
        Self { marks: [packed as u8 & 3, (packed >> 2) as u8 & 3], is_flagged: packed >> 4 == 1 }
    }

    /// Whether all marked edges are in one plane.
    fn is_plane(self) -> bool {
        self.marks[0] == self.marks[1]
    }

    /// The halves at corners 0 and 1.
    pub fn halves(self) -> [Half; 2] {
        [0, 1].map(|end| self.half(end))
    }

    fn half(self, end: usize) -> Half {
        let other = 1 - end;
        // The inherited face has the end and corners 2 and 3, and its marked edge p-q is the next to be bisected.
        let apart = usize::from(self.marks[other]);
        let on: Vec<usize> = [end, 2, 3].into_iter().filter(|&k| k != apart).collect();
        let (p, q) = (on[0], on[1]);
        // Positive if the middle takes the place of the other end.
        let base: [usize; 4] = std::array::from_fn(|k| if k == other { MIDDLE } else { k });
        let corners = in_sense(base, [p, q, apart, MIDDLE]);
        let within = corners.map(|corner| match corner {
            MIDDLE => Some(other),
            2 => Some(2),
            3 => Some(3),
            _ => None,
        });
        let place = |corner: usize| corners.iter().position(|&c| c == corner).expect("it is a corner") as u8;
        // On a face with the middle the edge opposite to it is marked, but between the flagged halves of a plane
        // tetrahedron the edge from the middle to the next refinement edge.
        let is_across = self.is_plane() && self.is_flagged;
        let mark = |opposite: usize| if opposite == end && is_across { place(apart) } else { place(MIDDLE) };
        Half {
            corners,
            within,
            tag: Self { marks: [mark(p), mark(q)], is_flagged: self.is_plane() && !self.is_flagged },
        }
    }
}

/// The corners of a tetrahedron in another order, the last two exchanged if that turned it inside out.
fn in_sense(corners: [usize; 4], order: [usize; 4]) -> [usize; 4] {
    let [p, q, a, b] = order;
    if is_even(corners, order) { order } else { [p, q, b, a] }
}

/// Whether one order of four is an even permutation of the other.
fn is_even(one: [usize; 4], other: [usize; 4]) -> bool {
    let places = other.map(|k| one.iter().position(|&c| c == k).expect("both have the same"));
    let pairs = (0..4).flat_map(|a| (0..a).map(move |b| (b, a)));
    pairs.filter(|&(b, a)| places[b] > places[a]).count().is_multiple_of(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::collections::HashSet;

    /// Barycentric coordinates of the corners in the first tetrahedron, in units of a power of a half.
    type Corners = [[i64; 4]; 4];

    const WHOLE: Corners = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];

    fn halves((corners, tag): &(Corners, Tag)) -> [(Corners, Tag); 2] {
        let middle = std::array::from_fn(|k| corners[0][k] + corners[1][k]);
        tag.halves().map(|half| {
            let of = |corner: usize| if corner == MIDDLE { middle } else { corners[corner].map(|x| 2 * x) };
            (half.corners.map(of), half.tag)
        })
    }

    /// All first tags, from all orders of the lengths of edges.
    fn first_tags() -> Vec<([usize; 4], Tag)> {
        let mut random = Random::new(5);
        let mut found = Vec::new();
        for _ in 0..20_000 {
            let lengths: [[f64; 4]; 4] = std::array::from_fn(|_| random.vector(1.0));
            let first = Tag::first(|a, b| lengths[a.min(b)][a.max(b)]);
            if !found.contains(&first) {
                found.push(first);
            }
        }
        found
    }

    fn determinant(c: &Corners) -> i128 {
        let mut sum = 0;
        let mut order = [0, 1, 2, 3];
        permute(&mut order, 0, &mut |p| {
            let sign = if is_even([0, 1, 2, 3], *p) { 1 } else { -1 };
            sum += sign * (0..4).map(|k| i128::from(c[k][p[k]])).product::<i128>();
        });
        sum
    }

    fn permute(order: &mut [usize; 4], from: usize, see: &mut impl FnMut(&[usize; 4])) {
        if from == 4 {
            return see(order);
        }
        for k in from..4 {
            order.swap(from, k);
            permute(order, from + 1, see);
            order.swap(from, k);
        }
    }

    /// `a / b` of the header. With the barycentric coordinates of each in the other, the largest copy inside has
    /// `a = 1 / (1 - sum min)`, the least one around `b = 1 - sum min`.
    fn copy(c: &Corners) -> f64 {
        let matrix = |k: usize| c[k].map(|x| x as f64);
        // Rows of the inverse are the coordinates in the child as functions of those in the whole.
        let mut rows: Vec<[f64; 8]> = (0..4)
            .map(|i| std::array::from_fn(|j| if j < 4 { matrix(j)[i] } else { f64::from(u8::from(j - 4 == i)) }))
            .collect();
        for k in 0..4 {
            let pivot = (k..4).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs())).expect("there are rows");
            rows.swap(k, pivot);
            let row = rows[k].map(|x| x / rows[k][k]);
            for i in (0..4).filter(|&i| i != k) {
                let factor = rows[i][k];
                (0..8).for_each(|j| rows[i][j] -= factor * row[j]);
            }
            rows[k] = row;
        }
        let scale = c[0].iter().sum::<i64>() as f64;
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let inner = 1.0 - rows.iter().map(|row| scale * least(&mut row[4..].iter().copied())).sum::<f64>();
        let outer = 1.0 - (0..4).map(|i| least(&mut (0..4).map(|k| matrix(k)[i] / scale))).sum::<f64>();
        1.0 / (inner * outer)
    }

    #[test]
    fn descendants_have_finitely_many_shapes_and_keep_the_bound() {
        let tags = first_tags();
        let mut least = f64::INFINITY;
        for (order, tag) in &tags {
            let mut all = HashSet::new();
            let mut generation = vec![(order.map(|k| WHOLE[k]), *tag)];
            assert!(determinant(&generation[0].0) > 0, "{order:?}");
            let mut counts = Vec::new();
            for _ in 0..12 {
                let mut next = Vec::new();
                for parent in &generation {
                    for child in halves(parent) {
                        assert!(determinant(&child.0) > 0 && (!child.1.is_flagged || child.1.is_plane()));
                        // Up to where it is, how large, and which way the edges point.
                        let edges: Vec<[i64; 4]> =
                            (1..4).map(|k| std::array::from_fn(|a| child.0[k][a] - child.0[0][a])).collect();
                        let common = edges.iter().flatten().fold(0, |a, &b| gcd(a, b.abs()));
                        let shape: Vec<i64> = edges.iter().flatten().map(|x| x / common).collect();
                        if all.insert((shape, child.1.marks, child.1.is_flagged)) {
                            least = least.min(copy(&child.0));
                            next.push(child);
                        }
                    }
                }
                counts.push(next.len());
                generation = next;
            }
            assert_eq!(counts.last(), Some(&0), "no new shapes come: {counts:?}");
        }
        assert!(tags.len() > 20 && least >= LEAST_COPY * (1.0 - 1e-12), "{} {}", tags.len(), 1.0 / least);
        assert!(least < LEAST_COPY * (1.0 + 1e-9), "the bound is sharp: {}", 1.0 / least);
    }

    fn gcd(a: i64, b: i64) -> i64 {
        if b == 0 { a } else { gcd(b, a % b) }
    }

    /// The edges of the face of points 0, 1, 2 that are bisected up to a generation; points are named by the first ones that they
    /// are between.
    fn cuts(points: [usize; 4], lengths: &[[f64; 5]; 5], generations: usize) -> HashSet<[Vec<usize>; 2]> {
        let (order, tag) = Tag::first(|a, b| lengths[points[a].min(points[b])][points[a].max(points[b])]);
        let mut cells = vec![(order.map(|k| vec![points[k]]), tag)];
        let mut found = HashSet::new();
        for _ in 0..generations {
            let halved = cells.iter().flat_map(|(corners, tag)| {
                let mut edge = [corners[0].clone(), corners[1].clone()];
                let mut middle = edge.concat();
                middle.sort_unstable();
                edge.sort_unstable();
                if middle.iter().all(|&point| point < 3) {
                    found.insert(edge);
                }
                let of = move |k: usize| if k == MIDDLE { middle.clone() } else { corners[k].clone() };
                tag.halves().map(|half| (half.corners.map(&of), half.tag))
            });
            cells = halved.collect();
        }
        found
    }

    #[test]
    fn a_face_is_cut_alike_from_both_sides() {
        let mut random = Random::new(3);
        for _ in 0..100 {
            let lengths: [[f64; 5]; 5] = std::array::from_fn(|_| random.vector(1.0));
            for [one, other] in [[[0, 1, 2, 3], [0, 2, 1, 4]], [[0, 2, 1, 4], [0, 1, 2, 3]]] {
                let (few, many) = (cuts(one, &lengths, 4), cuts(other, &lengths, 10));
                assert!(!few.is_empty() && few.is_subset(&many));
            }
        }
    }
}
