//! Which elements share a face.
//!
//! Faces are sorted into one bucket for each smallest corner, so nothing but their numbers is stored: four bytes a face
//! while they are paired, as many for the result.

use super::Elements;

/// In place of a neighbour: the face belongs to one element only.
pub const OUTSIDE: u32 = u32::MAX;

/// Neighbours of the elements of a mesh.
pub struct Neighbours {
    /// Faces of an element.
    faces: usize,
    /// Element by element, for each face the element behind, or [`OUTSIDE`].
    behind: Vec<u32>,
    /// Faces with more than two elements, or two on the same side, each by one of its numbers: the mesh overlaps itself.
    /// Nobody is behind them. The number of a face is that of its element, times the faces of an element, and its own.
    pub overlapping: Vec<u32>,
}

impl Neighbours {
    /// Pairs up the faces, at most 2^32, of elements on nodes `0..nodes`.
    pub fn new(nodes: usize, elements: &Elements) -> Self {
        match elements.kind().cell().corners_of_face() {
            3 => Self::pair::<3>(nodes, elements),
            _ => Self::pair::<4>(nodes, elements),
        }
    }

    fn pair<const C: usize>(nodes: usize, elements: &Elements) -> Self {
        let table: Vec<[usize; C]> =
            elements.kind().faces().iter().map(|face| std::array::from_fn(|k| face[k])).collect();
        let faces = table.len();
        let rows = elements.kind().nodes();
        let corners = |id: u32| {
            let first = id as usize / faces * rows;
            table[id as usize % faces].map(|corner| elements.nodes()[first + corner])
        };
        let ids = || 0..(faces * elements.len()) as u32;
        let smallest = |id| corners(id).into_iter().min().expect("a face has corners") as usize;
        let mut begin = vec![0_u32; nodes + 1];
        ids().for_each(|id| begin[smallest(id) + 1] += 1);
        (0..nodes).for_each(|n| begin[n + 1] += begin[n]);
        let mut sorted = vec![0; faces * elements.len()];
        let mut next = begin.clone();
        for id in ids() {
            let next = &mut next[smallest(id)];
            sorted[*next as usize] = id;
            *next += 1;
        }

        let mut neighbours = Self { faces, behind: vec![OUTSIDE; sorted.len()], overlapping: Vec::new() };
        let mut bucket = Vec::new();
        for range in begin.windows(2) {
            bucket.clear();
            let ascending = |id| {
                let mut corners = corners(id);
                corners.sort_unstable();
                corners
            };
            bucket.extend(sorted[range[0] as usize..range[1] as usize].iter().map(|&id| (ascending(id), id)));
            bucket.sort_unstable();
            for same in bucket.chunk_by(|a, b| a.0 == b.0) {
                match *same {
                    [_] => {}
                    [(_, a), (_, b)] if turns(&corners(a)) != turns(&corners(b)) => {
                        neighbours.behind[a as usize] = b / faces as u32;
                        neighbours.behind[b as usize] = a / faces as u32;
                    }
                    _ => neighbours.overlapping.push(same[0].1),
                }
            }
        }
        neighbours
    }

    /// Elements behind the faces of one.
    pub fn behind(&self, element: usize) -> &[u32] {
        &self.behind[self.faces * element..self.faces * (element + 1)]
    }

    /// Elements that share a face with one.
    pub fn of(&self, element: usize) -> impl Iterator<Item = u32> {
        self.behind(element).iter().copied().filter(|&other| other != OUTSIDE)
    }

    /// Nodes of the faces that belong to one element only, counter-clockwise from outside, in the order of the elements.
    pub fn outer<'a>(&'a self, elements: &'a Elements) -> impl Iterator<Item = Vec<u32>> + 'a {
        (0..self.behind.len()).filter(|&id| self.behind[id] == OUTSIDE).map(|id| self.face(elements, id))
    }

    /// Nodes of the faces between two elements, once each.
    pub fn inner<'a>(&'a self, elements: &'a Elements) -> impl Iterator<Item = Vec<u32>> + 'a {
        let first = |id: &usize| self.behind[*id] != OUTSIDE && id / self.faces < self.behind[*id] as usize;
        (0..self.behind.len()).filter(first).map(|id| self.face(elements, id))
    }

    fn face(&self, elements: &Elements, id: usize) -> Vec<u32> {
        elements.face(id / self.faces, id % self.faces)
    }
}

/// What identifies a face, whatever its first node and sense.
pub fn key(face: &[u32]) -> Vec<u32> {
    let mut nodes = face.to_vec();
    nodes.sort_unstable();
    nodes
}

/// Which way a face turns: the same for every first corner, opposite on its other side.
pub fn turns(corners: &[u32]) -> bool {
    let count = corners.len();
    let first = (0..count).min_by_key(|&k| corners[k]).expect("a face has corners");
    corners[(first + 1) % count] > corners[(first + count - 1) % count]
}

#[cfg(test)]
mod tests;
