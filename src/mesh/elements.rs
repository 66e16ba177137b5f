//! Elements by their nodes.

use crate::element::Kind;

/// Elements of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Elements {
    kind: Kind,
    /// Nodes, element after element.
    nodes: Vec<u32>,
}

impl Elements {
    /// Of their nodes, element after element.
    ///
    /// # Panics
    /// If the last element is not whole.
    pub fn new(kind: Kind, nodes: Vec<u32>) -> Self {
        assert!(nodes.len().is_multiple_of(kind.nodes()), "elements have all their nodes");
        Self { kind, nodes }
    }

    /// Their kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.kind.nodes()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// All nodes, element after element.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Nodes of each element.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.nodes())
    }

    /// Nodes of an element.
    pub fn get(&self, element: usize) -> &[u32] {
        let nodes = self.kind.nodes();
        &self.nodes[element * nodes..(element + 1) * nodes]
    }

    /// Nodes of each element, which has `N`.
    ///
    /// # Panics
    /// If it has another number of nodes.
    pub fn of<const N: usize>(&self) -> &[[u32; N]] {
        assert_eq!(N, self.kind.nodes(), "elements are asked for by their own number of nodes");
        self.nodes.as_chunks().0
    }

    /// Nodes of a face of an element, counter-clockwise from outside.
    pub fn face(&self, element: usize, face: usize) -> Vec<u32> {
        let nodes = self.get(element);
        self.kind.faces()[face].iter().map(|&k| nodes[k]).collect()
    }
}

impl<'a> IntoIterator for &'a Elements {
    type Item = &'a [u32];
    type IntoIter = std::slice::ChunksExact<'a, u32>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}
