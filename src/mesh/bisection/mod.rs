//! Refinement of a body's mesh of tetrahedra by bisection, conforming, on all ranks together.
//!
//! Sweep by sweep all elements are bisected that are due or have an edge that was bisected on one of their sides; bisection ends as
//! `tagged` edges agree. New nodes and elements are numbered behind the old ones, in the order of the edges and elements that
//! they come from: the refined mesh does not depend on the ranks (`register`). A rank keeps its elements while it bisects, and
//! ranks tell each other which edges on their borders are bisected.
//!
//! A `cell` inherits region, piece and surfaces. Straight elements are split exactly; so are curved ones of second order, whose
//! halves are the same quadratic patch. On round surfaces of the body new nodes are put on the form ([`Forms`], `round`).
//! Every node carries a displacement, which is passed on as shape functions interpolate it: exactly, where nodes are not moved.

mod cell;
mod register;
mod round;
mod tagged;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap, HashSet};

use self::cell::{Cell, Edge};
use self::register::Register;
pub use self::round::Round;
use super::curve::{self, on_grid};
use super::faces::key;
use super::form::Forms;
use super::marked::forward;
use super::solid::{Counts, NamedSurface};
use super::wholes::Wholes;
use super::{Portion, SolidMesh};
use crate::comm::common::common;
use crate::comm::words::sum;
use crate::comm::{Comm, of_ranks};
use crate::element::Kind;

/// What is known at a node: its place and its displacement.
pub type AtNode = [[f64; 3]; 2];

/// This rank's part of a mesh that can be refined.
#[derive(Clone, Debug)]
pub struct Refinable {
    kind: Kind,
    cells: Vec<Cell>,
    /// Nodes of own elements, by number within the body.
    nodes: HashMap<u32, AtNode>,
    /// Of all ranks.
    counts: Counts,
    piece_count: usize,
    surfaces: Vec<String>,
    /// Sets of surfaces that a face may be on, the empty one first. Numbers behind those of the surfaces are curved forms.
    sets: Vec<Vec<u64>>,
    /// For each set the one without its form.
    without_form: Vec<u32>,
    round: Round,
}

impl Refinable {
    /// Of a mesh of tetrahedra that nothing was displaced of yet, as elements of a kind: linear ones become quadratic ones where these
    /// are wanted, straight but for edges on the forms of the body. Collective.
    ///
    /// # Panics
    /// If it has other elements.
    pub fn new(comm: &dyn Comm, mesh: &SolidMesh, forms: Forms, kind: Kind) -> Self {
        let portion = &mesh.portion;
        let mut on: HashMap<Vec<u32>, Vec<u64>> = HashMap::new();
        for (k, surface) in (0..).zip(&mesh.surfaces) {
            for face in &surface.faces {
                on.entry(key(&face[..3])).or_default().push(k);
            }
        }
        let first_form = mesh.surfaces.len() as u64;
        for (face, &form) in forms.faces.iter().filter(|(_, form)| forms.all[**form as usize].is_curved()) {
            on.entry(face.clone()).or_default().push(first_form + u64::from(form));
        }
        let surfaces_of = |set: &Vec<u64>| set.iter().copied().filter(|&k| k < first_form).collect::<Vec<u64>>();
        let mut sets: BTreeSet<Vec<u64>> = on.values().flat_map(|set| [set.clone(), surfaces_of(set)]).collect();
        sets.insert(Vec::new());
        let packed: Vec<u64> =
            sets.iter().flat_map(|set| std::iter::once(set.len() as u64).chain(set.iter().copied())).collect();
        for mut theirs in of_ranks(comm, &packed).iter().map(|theirs| &theirs[..]) {
            while let Some((&count, rest)) = theirs.split_first() {
                let (set, rest) = rest.split_at(count as usize);
                sets.insert(set.to_vec());
                theirs = rest;
            }
        }
        let sets: Vec<Vec<u64>> = sets.into_iter().collect();
        let number =
            |set: &[u64]| sets.binary_search_by(|other| other[..].cmp(set)).expect("every set is listed") as u32;
        let without_form = sets.iter().map(|set| number(&surfaces_of(set))).collect();
        let of_face = |corners: [u32; 3]| number(on.get(&key(&corners)).map_or(&[][..], |set| &set[..]));
        let cells = (0..portion.len()).map(|at| Cell::new(portion, mesh.pieces[at], at, &of_face)).collect();
        let at_nodes = portion.points.iter().map(|&place| [place, [0.0; 3]]);
        let mut refinable = Self {
            kind: portion.elements.kind(),
            cells,
            nodes: portion.nodes.iter().copied().zip(at_nodes).collect(),
            counts: mesh.counts,
            piece_count: mesh.piece_count,
            surfaces: mesh.surfaces.iter().map(|surface| surface.name.clone()).collect(),
            without_form,
            sets,
            round: Round::new(forms),
        };
        if kind.degree() > refinable.kind.degree() {
            refinable.straighten(comm, kind);
            refinable.kind = kind;
            refinable.raise(comm);
        }
        refinable
    }

    /// Leaves edges straight that would spoil linear elements as edges of quadratic ones of a kind, and the faces at them as they are.
    /// Collective.
    fn straighten(&mut self, comm: &dyn Comm, quadratic: Kind) {
        let mut nodes: Vec<u32> = self.nodes().collect();
        nodes.sort_unstable();
        let mut spoilt = BTreeSet::new();
        loop {
            let mut straight: Vec<(Vec<u32>, usize)> = Vec::new();
            for cell in &self.cells {
                if self.round.is_spoilt([self.kind, quadratic], cell, |node| self.nodes[&node][0]) {
                    straight.extend(cell.edges().map(|edge| (edge.to_vec(), 0)));
                    spoilt.insert(cell.number);
                }
            }
            if sum(comm, vec![straight.len() as u64]) == [0] {
                break;
            }
            let straight: HashSet<Edge> =
                forward(comm, &nodes, 2, &straight).into_keys().map(|edge| [edge[0], edge[1]]).collect();
            straight.iter().for_each(|&edge| self.round.straighten(edge));
            for cell in &mut self.cells {
                cell.flatten(|edge| straight.contains(&edge), |set| self.without_form[set as usize]);
            }
        }
        self.round.spoilt = sum(comm, vec![spoilt.len() as u64])[0];
    }

    /// Puts nodes in the middle of all edges. Collective.
    fn raise(&mut self, comm: &dyn Comm) {
        let edges: BTreeSet<Edge> = self.cells.iter().flat_map(Cell::edges).collect();
        let keys: Vec<[u64; 2]> = edges.iter().map(|edge| edge.map(u64::from)).collect();
        let mut register = Register::new(self.counts.nodes);
        let middles: HashMap<Edge, u32> = edges.into_iter().zip(register.numbers(comm, &keys)).collect();
        self.counts.nodes = register.count();
        for (&edge, &node) in &middles {
            let middle = self.round.middle(edge, edge.map(|end| self.nodes[&end][0]));
            self.nodes.insert(node, [middle, [0.0; 3]]);
        }
        self.cells.iter_mut().for_each(|cell| cell.raise(&middles));
    }

    /// The forms that faces follow.
    pub fn round(&self) -> &Round {
        &self.round
    }

    /// Numbers within the body of the nodes that this rank has.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        self.nodes.keys().copied()
    }

    /// What is known at a node of this rank.
    pub fn at(&self, node: u32) -> &AtNode {
        &self.nodes[&node]
    }

    /// Sizes of the mesh of all ranks.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Sets the displacement of every node of this rank.
    pub fn displace(&mut self, of: impl Fn(u32) -> [f64; 3]) {
        self.nodes.iter_mut().for_each(|(&node, at)| at[1] = of(node));
    }

    /// Bisects elements, named by their corners (ascending), at least so many times, and as many others as it takes for a
    /// conforming mesh. Any rank may name an element. Collective.
    pub fn refine(&mut self, comm: &dyn Comm, wanted: &[(Vec<u32>, usize)]) {
        self.balance(comm);
        let mut nodes: Vec<u32> = self.nodes().collect();
        nodes.sort_unstable();
        let wanted = forward(comm, &nodes, 4, wanted);
        for cell in &mut self.cells {
            let times = wanted.get(&cell.key()[..]);
            cell.due = times.and_then(|times| times.last()).map_or(0, |&times| times as u32);
        }
        let mut sweeps = Sweeps::new(comm, self, &nodes);
        while sweeps.sweep(comm, self) {}
    }

    /// Gives every rank as many elements as the others, near each other. Collective.
    fn balance(&mut self, comm: &dyn Comm) {
        if comm.size() == 1 {
            return;
        }
        let wholes = Wholes::new(vec![self.counts.elements], vec![comm.size() as u32]);
        let centre = |cell: &Cell| -> [f64; 3] {
            let corners = cell.corners().map(|node| self.nodes[&node][0]);
            std::array::from_fn(|a| corners.iter().map(|x| 0.25 * x[a]).sum())
        };
        let centres: Vec<[f64; 3]> = self.cells.iter().map(centre).collect();
        let owners = curve::start(comm, &on_grid(comm, &centres), &vec![0; centres.len()], &wholes);
        let mut outgoing = vec![Vec::new(); comm.size()];
        for (cell, &owner) in self.cells.iter().zip(&owners) {
            cell.pack(self.kind, &self.nodes, &mut outgoing[owner as usize]);
            self.round.pack(cell, &mut outgoing[owner as usize]);
        }
        self.cells.clear();
        self.nodes.clear();
        self.round.clear();
        for message in comm.all_to_all(outgoing) {
            let mut words = message.into_iter();
            while let Some(cell) = Cell::unpack(self.kind, &mut words, &mut self.nodes) {
                self.round.unpack(&cell, &mut words);
                self.cells.push(cell);
            }
        }
    }

    /// As a mesh.
    pub fn mesh(&self) -> SolidMesh {
        let mut cells: Vec<&Cell> = self.cells.iter().collect();
        cells.sort_unstable_by_key(|cell| cell.number);
        let of_elements: Vec<u32> = cells.iter().flat_map(|cell| cell.nodes(self.kind)).copied().collect();
        let mut portion = Portion::new(self.kind, 0, &of_elements, |node| self.nodes[&node][0]);
        portion.numbers = cells.iter().map(|cell| cell.number).collect();
        portion.wholes = cells.iter().map(|cell| cell.region).collect();
        let mut surfaces: Vec<NamedSurface> =
            self.surfaces.iter().map(|name| NamedSurface { name: name.clone(), faces: Vec::new() }).collect();
        for (face, set) in cells.iter().flat_map(|cell| cell.faces(self.kind)) {
            let of_set = self.sets[set as usize].iter().map(|&k| k as usize);
            of_set.filter(|&k| k < self.surfaces.len()).for_each(|k| surfaces[k].faces.push(face.clone()));
        }
        SolidMesh {
            portion,
            pieces: cells.iter().map(|cell| cell.piece).collect(),
            surfaces,
            piece_count: self.piece_count,
            counts: self.counts,
        }
    }

    /// The form that the faces of a set are on.
    fn form(&self, set: u32) -> Option<u32> {
        let last = *self.sets[set as usize].last()? as usize;
        last.checked_sub(self.surfaces.len()).map(|form| form as u32)
    }
}

/// What a refinement has done so far.
struct Sweeps {
    /// Edges that were bisected, here or on other ranks.
    bisected: HashSet<Edge>,
    /// Nodes in the middle of edges that own elements have or had.
    middles: HashMap<Edge, u32>,
    register: Register,
    /// Other ranks that may have a node.
    sharers: HashMap<u32, Vec<u32>>,
}

impl Sweeps {
    /// `nodes` are those of this rank, ascending. Collective.
    fn new(comm: &dyn Comm, mesh: &Refinable, nodes: &[u32]) -> Self {
        let keys: Vec<[u64; 1]> = nodes.iter().map(|&node| [node.into()]).collect();
        let mut sharers: HashMap<u32, Vec<u32>> = HashMap::new();
        for (rank, places) in (0..).zip(common(comm, &keys)) {
            places.iter().for_each(|&place| sharers.entry(nodes[place as usize]).or_default().push(rank));
        }
        let middles = mesh.cells.iter().flat_map(|cell| cell.middles(mesh.kind)).collect();
        Self { bisected: HashSet::new(), middles, register: Register::new(mesh.counts.nodes), sharers }
    }

    /// Bisects all elements that are due; returns whether any was. Collective.
    fn sweep(&mut self, comm: &dyn Comm, mesh: &mut Refinable) -> bool {
        let is_due = |cell: &Cell| cell.due > 0 || cell.edges().iter().any(|edge| self.bisected.contains(edge));
        let due: Vec<usize> = (0..mesh.cells.len()).filter(|&at| is_due(&mesh.cells[at])).collect();
        if sum(comm, vec![due.len() as u64]) == [0] {
            mesh.counts.cells = mesh.counts.elements;
            return false;
        }
        let edges: BTreeSet<Edge> = due.iter().map(|&at| mesh.cells[at].refinement_edge()).collect();
        self.tell(comm, edges.into_iter().filter(|edge| !self.bisected.contains(edge)).collect());
        self.place(comm, mesh, &due);

        // The second halves are numbered in the order of the first.
        let numbers: Vec<[u64; 2]> = due.iter().map(|&at| [mesh.cells[at].number.into(), 0]).collect();
        let mut register = Register::new(mesh.counts.elements);
        let numbers = register.numbers(comm, &numbers);
        mesh.counts.elements = register.count();
        for (at, number) in due.into_iter().zip(numbers) {
            let [first, second] = mesh.cells[at].halves(mesh.kind, number, &self.middles);
            mesh.cells[at] = first;
            mesh.cells.push(second);
        }
        true
    }

    /// Bisects edges; tells the other ranks that may have them too. Collective.
    fn tell(&mut self, comm: &dyn Comm, edges: Vec<Edge>) {
        let mut outgoing = vec![Vec::new(); comm.size()];
        for edge in &edges {
            let [a, b] = edge.map(u64::from);
            self.both(*edge).into_iter().for_each(|rank| outgoing[rank as usize].push(a << 32 | b));
        }
        self.bisected.extend(edges);
        if comm.size() > 1 {
            let heard = comm.all_to_all(outgoing).concat();
            self.bisected.extend(heard.into_iter().map(|words| [(words >> 32) as u32, words as u32]));
        }
    }

    /// Other ranks that may have both nodes.
    fn both(&self, [a, b]: Edge) -> Vec<u32> {
        let [one, other] = [a, b].map(|node| self.sharers.get(&node));
        let Some((one, other)) = one.zip(other) else { return Vec::new() };
        one.iter().copied().filter(|rank| other.contains(rank)).collect()
    }

    /// Makes the new nodes of elements that are due. Collective.
    fn place(&mut self, comm: &dyn Comm, mesh: &mut Refinable, due: &[usize]) {
        let mut new: Vec<(Edge, AtNode)> = Vec::new();
        for &at in due {
            let (cell, middles) = (&mesh.cells[at], &self.middles);
            let fresh = cell.new_nodes(mesh.kind, &mesh.nodes).into_iter();
            new.extend(fresh.filter(|(edge, _)| !middles.contains_key(edge)));
        }
        new.sort_unstable_by_key(|(edge, _)| *edge);
        new.dedup_by_key(|(edge, _)| *edge);
        let keys: Vec<[u64; 2]> = new.iter().map(|(edge, _)| edge.map(u64::from)).collect();
        let numbers = self.register.numbers(comm, &keys);
        mesh.counts.nodes = self.register.count();
        self.middles.extend(new.iter().map(|(edge, _)| *edge).zip(numbers.iter().copied()));
        for &at in due {
            let cell = &mesh.cells[at];
            let across = cell.faces_across().map(|(node, set)| (node, mesh.form(set)));
            mesh.round.bisect(cell.refinement_edge(), self.middles[&cell.refinement_edge()], across);
        }
        for ((edge, [place, displacement]), node) in new.into_iter().zip(numbers) {
            let ends = edge.map(|end| mesh.nodes[&end][0]);
            mesh.nodes.insert(node, [mesh.round.put(edge, ends, place), displacement]);
            let sharers = self.both(edge);
            if !sharers.is_empty() {
                self.sharers.insert(node, sharers);
            }
        }
    }
}
