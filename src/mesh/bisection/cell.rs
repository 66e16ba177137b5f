//! A tetrahedron that can be bisected, with all that its halves inherit.

use std::collections::HashMap;

use super::tagged::{MIDDLE, Tag};
use super::{AtNode, Portion};
use crate::element::Kind;
use crate::element::cell::EDGES;

/// An edge by its nodes, the lesser first.
pub type Edge = [u32; 2];

/// The edge between two nodes.
pub fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// A tetrahedron with four or ten nodes.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Its number within the body.
    pub number: u32,
    /// Region of the body.
    pub region: u32,
    /// Face-connected piece of the body.
    pub piece: u32,
    /// How often it is still to be bisected.
    pub due: u32,
    /// Corners, those of the refinement edge first, then the middles of its edges if it has any.
    nodes: [u32; 10],
    /// Set of surfaces that the face opposite to each corner is on.
    on: [u32; 4],
    tag: Tag,
}

impl Cell {
    /// Of an element of a portion; `of_face` tells the set of surfaces of a face by its corners.
    pub fn new(portion: &Portion, piece: u32, at: usize, of_face: &dyn Fn([u32; 3]) -> u32) -> Self {
        let element = portion.elements.get(at);
        let place = |k: usize| portion.points[element[k] as usize];
        let length = |a: usize, b: usize| {
            let (x, y) = (place(a), place(b));
            let square: f64 = (0..3).map(|i| (x[i] - y[i]) * (x[i] - y[i])).sum();
            (square, edge(portion.nodes[element[a] as usize], portion.nodes[element[b] as usize]))
        };
        let (order, tag) = Tag::first(length);
        let mut nodes = [0; 10];
        (0..4).for_each(|k| nodes[k] = portion.nodes[element[order[k]] as usize]);
        if !portion.elements.kind().middles().is_empty() {
            for (k, &(a, b)) in EDGES.iter().enumerate() {
                let was = edge(order[a] as u32, order[b] as u32);
                let of = EDGES.iter().position(|&(p, q)| edge(p as u32, q as u32) == was).expect("it is an edge");
                nodes[4 + k] = portion.nodes[element[4 + of] as usize];
            }
        }
        let on = OPPOSITE.map(|face| of_face(face.map(|k| nodes[k])));
        let (number, region) = (portion.numbers[at], portion.wholes[at]);
        Self { number, region, piece, due: 0, nodes, on, tag }
    }

    /// Its corners, ascending.
    pub fn key(&self) -> [u32; 4] {
        let mut corners = self.corners();
        corners.sort_unstable();
        corners
    }

    /// Its corners.
    pub fn corners(&self) -> [u32; 4] {
        [self.nodes[0], self.nodes[1], self.nodes[2], self.nodes[3]]
    }

    /// Its nodes.
    pub fn nodes(&self, kind: Kind) -> &[u32] {
        &self.nodes[..kind.nodes()]
    }

    /// The edge that is bisected next.
    pub fn refinement_edge(&self) -> Edge {
        edge(self.nodes[0], self.nodes[1])
    }

    /// All edges.
    pub fn edges(&self) -> [Edge; 6] {
        EDGES.map(|(a, b)| edge(self.nodes[a], self.nodes[b]))
    }

    /// Nodes in the middle of edges, if it has any.
    pub fn middles(&self, kind: Kind) -> impl Iterator<Item = (Edge, u32)> {
        self.edges().into_iter().zip(self.nodes[4..].iter().copied()).filter(move |_| !kind.middles().is_empty())
    }

    /// Faces on surfaces: their nodes, counter-clockwise from outside, and the set of surfaces.
    pub fn faces(&self, kind: Kind) -> impl Iterator<Item = (Vec<u32>, u32)> {
        let face = move |face: &&[usize]| {
            let opposite = (0..4).find(|k| !face[..3].contains(k)).expect("a face lacks a corner");
            (face.iter().map(|&k| self.nodes[k]).collect(), self.on[opposite])
        };
        kind.faces().iter().map(face).filter(|(_, set)| *set > 0)
    }

    /// The faces at the refinement edge: the corner opposite to it, and the set of surfaces.
    pub fn faces_across(&self) -> [(u32, u32); 2] {
        [(self.nodes[2], self.on[3]), (self.nodes[3], self.on[2])]
    }

    /// Takes the forms from faces with straight edges; `without_form` tells the set of surfaces of a face that leaves its form.
    pub fn flatten(&mut self, is_straight: impl Fn(Edge) -> bool, without_form: impl Fn(u32) -> u32) {
        let of_face = |[a, b, c]: [usize; 3]| [(a, b), (b, c), (a, c)].map(|(a, b)| edge(self.nodes[a], self.nodes[b]));
        let is_flat = OPPOSITE.map(|face| of_face(face).into_iter().any(&is_straight));
        self.on = std::array::from_fn(|face| if is_flat[face] { without_form(self.on[face]) } else { self.on[face] });
    }

    /// What is at the nodes that bisection makes, in the middle of which edges.
    pub fn new_nodes(&self, kind: Kind, nodes: &HashMap<u32, AtNode>) -> Vec<(Edge, AtNode)> {
        let [p, q, ..] = self.nodes;
        let at = |k: usize| &nodes[&self.nodes[k]];
        if kind.middles().is_empty() {
            return vec![(edge(p, q), combined(&[(0.5, at(0)), (0.5, at(1))]))];
        }
        let middle = self.nodes[MIDDLE];
        // A quadratic function at a quarter of an edge, and between the middle of an edge and the corner of a face opposite to it.
        let quarter = |k: usize| combined(&[(0.375, at(k)), (-0.125, at(1 - k)), (0.75, at(MIDDLE))]);
        let across = |k: usize| {
            let of = |end: usize| {
                at(4 + EDGES.iter().position(|&(a, b)| (a, b) == (end, k) || (b, a) == (end, k)).expect("an edge"))
            };
            let (ends, sides) = (sum(at(0), at(1)), sum(of(0), of(1)));
            combined(&[(-0.125, &ends), (0.25, at(MIDDLE)), (0.5, &sides)])
        };
        vec![
            (edge(p, middle), quarter(0)),
            (edge(q, middle), quarter(1)),
            (edge(self.nodes[2], middle), across(2)),
            (edge(self.nodes[3], middle), across(3)),
        ]
    }

    /// Its halves, of which the first keeps its number; `middles` knows all nodes in the middle of edges.
    pub fn halves(&self, kind: Kind, number: u32, middles: &HashMap<Edge, u32>) -> [Self; 2] {
        let middle = middles[&self.refinement_edge()];
        let [first, second] = self.tag.halves().map(|half| {
            let mut nodes = [0; 10];
            for (node, &corner) in nodes.iter_mut().zip(&half.corners) {
                *node = if corner == MIDDLE { middle } else { self.nodes[corner] };
            }
            let on = half.within.map(|face| face.map_or(0, |face| self.on[face]));
            let mut half = Self { nodes, on, tag: half.tag, due: self.due.saturating_sub(1), ..*self };
            if !kind.middles().is_empty() {
                half.raise(middles);
            }
            half
        });
        [first, Self { number, ..second }]
    }

    /// Takes the nodes in the middle of its edges.
    pub fn raise(&mut self, middles: &HashMap<Edge, u32>) {
        let of_edges = self.edges().map(|edge| middles[&edge]);
        self.nodes[4..].copy_from_slice(&of_edges);
    }

    /// Appends it with all that is known at its nodes.
    pub fn pack(&self, kind: Kind, nodes: &HashMap<u32, AtNode>, message: &mut Vec<u64>) {
        let head = [self.number, self.region, self.piece, self.tag.pack()];
        message.extend(head.iter().chain(&self.on).map(|&word| u64::from(word)));
        for node in self.nodes(kind) {
            message.push(u64::from(*node));
            message.extend(nodes[node].as_flattened().iter().map(|x| x.to_bits()));
        }
    }

    /// The next cell of a message; adds its nodes.
    pub fn unpack(kind: Kind, words: &mut impl Iterator<Item = u64>, known: &mut HashMap<u32, AtNode>) -> Option<Self> {
        let number = words.next()? as u32;
        let mut next = || words.next().expect("a packed cell is whole");
        let [region, piece, tag] = [(); 3].map(|()| next() as u32);
        let on = [(); 4].map(|()| next() as u32);
        let mut nodes = [0; 10];
        for node in &mut nodes[..kind.nodes()] {
            *node = next() as u32;
            known.insert(*node, [(); 2].map(|()| [(); 3].map(|()| f64::from_bits(next()))));
        }
        Some(Self { number, region, piece, due: 0, nodes, on, tag: Tag::unpack(tag) })
    }
}

/// Corners of the face opposite to each corner.
const OPPOSITE: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

fn combined(terms: &[(f64, &AtNode)]) -> AtNode {
    let sum = |what: usize, axis: usize| terms.iter().map(|(weight, at)| weight * at[what][axis]).sum();
    [0, 1].map(|what| [0, 1, 2].map(|axis| sum(what, axis)))
}

fn sum(a: &AtNode, b: &AtNode) -> AtNode {
    combined(&[(1.0, a), (1.0, b)])
}
