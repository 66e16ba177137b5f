//! Which edges of a rank's elements are on the forms of the body, and where nodes on them belong.
//!
//! Halves of an edge are on its forms. An edge that cuts a face in two is on the form of the face; only elements that come from the
//! one with this face have it, so its rank knows. Linear elements that become quadratic get curved edges. That would turn some inside
//! out: those with two faces on one smooth surface, and those that are flatter than their neighbours are curved. Their edges stay
//! straight, and the faces at these edges as they are.

use std::collections::HashMap;

use super::cell::{Cell, Edge, edge};
use crate::element::Kind;
use crate::mesh::form::{Form, Forms, project};
use crate::vector::{Point, difference, length};

/// Nodes on an edge are moved by less than this share of it: the sagitta of a third of a circle is 0.29 of its chord.
const NEAR: f64 = 0.3;
/// Curved elements have at least this share of the shape of straight ones.
const SHAPE: f64 = 0.2;

/// The forms of a body, and own edges on them.
#[derive(Clone, Debug)]
pub struct Round {
    forms: Vec<Form>,
    edges: HashMap<Edge, [u32; 2]>,
    /// Elements of all ranks with edges that stay straight.
    pub spoilt: u64,
}

impl Round {
    /// With the edges of own elements.
    pub fn new(Forms { all, edges, .. }: Forms) -> Self {
        Self { forms: all, edges, spoilt: 0 }
    }

    /// How many curved forms there are.
    pub fn count(&self) -> usize {
        self.forms.iter().filter(|form| form.is_curved()).count()
    }

    /// Where a node on an edge belongs that is between these ends.
    pub fn put(&self, edge: Edge, ends: [Point; 2], place: Point) -> Point {
        let Some(&forms) = self.edges.get(&edge) else { return place };
        let within = NEAR * length(difference(ends[1], ends[0]));
        project(forms.map(|form| &self.forms[form as usize]), place, within).unwrap_or(place)
    }

    /// Where the node in the middle of an edge belongs.
    pub fn middle(&self, edge: Edge, ends: [Point; 2]) -> Point {
        self.put(edge, ends, std::array::from_fn(|axis| 0.5 * ends[0][axis] + 0.5 * ends[1][axis]))
    }

    /// An edge is bisected at a node; `across` has the corners opposite to it in the faces of an element, and their forms.
    pub fn bisect(&mut self, [a, b]: Edge, middle: u32, across: [(u32, Option<u32>); 2]) {
        if let Some(&forms) = self.edges.get(&[a, b]) {
            self.edges.extend([(edge(a, middle), forms), (edge(b, middle), forms)]);
        }
        for (corner, form) in across {
            self.edges.extend(form.map(|form| (edge(corner, middle), [form; 2])));
        }
    }

    /// Whether an element of the first kind would be turned inside out, or nearly so, as one of the second with edges on the forms.
    pub fn is_spoilt(&self, [linear, quadratic]: [Kind; 2], cell: &Cell, place: impl Fn(u32) -> Point) -> bool {
        let edges = cell.edges();
        if !edges.iter().any(|edge| self.edges.contains_key(edge)) {
            return false;
        }
        let middle = |&edge: &Edge| self.middle(edge, edge.map(&place));
        let corners = cell.corners().map(&place);
        let curved: Vec<Point> = corners.into_iter().chain(edges.iter().map(middle)).collect();
        quadratic.shape(&curved) < SHAPE * linear.shape(&corners)
    }

    /// Leaves an edge straight.
    pub fn straighten(&mut self, edge: Edge) {
        self.edges.remove(&edge);
    }

    /// Forgets all edges.
    pub fn clear(&mut self) {
        self.edges.clear();
    }

    /// Appends what is known of the edges of a cell.
    pub fn pack(&self, cell: &Cell, message: &mut Vec<u64>) {
        let word = |edge| self.edges.get(edge).map_or(NONE, |&[a, b]| u64::from(a) << 32 | u64::from(b));
        message.extend(cell.edges().iter().map(word));
    }

    /// Takes it from a message.
    pub fn unpack(&mut self, cell: &Cell, words: &mut impl Iterator<Item = u64>) {
        let known = cell.edges().into_iter().zip(words).filter(|(_, word)| *word != NONE);
        self.edges.extend(known.map(|(edge, word)| (edge, [(word >> 32) as u32, word as u32])));
    }
}

/// An edge that is on no form, in a message.
const NONE: u64 = u64::MAX;
