//! Connected components of nodes that are joined pair by pair.

use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A union-find forest of the nodes that have been joined. Other nodes take no memory.
#[derive(Default)]
pub struct Components {
    parent: HashMap<u64, u64>,
}

impl Components {
    /// Puts two nodes into one component. They may be the same node.
    pub fn join(&mut self, one: u64, other: u64) {
        let (a, b) = (self.root(one), self.root(other));
        self.parent.insert(a.max(b), a.min(b));
    }

    /// The nodes of each component, keyed by its lowest node.
    pub fn members(mut self) -> BTreeMap<u64, BTreeSet<u64>> {
        let mut members: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
        for node in self.parent.keys().copied().collect::<Vec<_>>() {
            members.entry(self.root(node)).or_default().insert(node);
        }
        members
    }

    fn root(&mut self, mut node: u64) -> u64 {
        loop {
            let up = *self.parent.entry(node).or_insert(node);
            if up == node {
                return node;
            }
            // Path halving.
            let further = self.parent[&up];
            self.parent.insert(node, further);
            node = further;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_those_of_the_graph_in_any_order_of_joining() {
        let mut pairs = [(7, 3), (9, 9), (4, 8), (3, 5), (8, 6), (5, 7)];
        for _ in 0..pairs.len() {
            pairs.rotate_left(1);
            let mut components = Components::default();
            pairs.iter().for_each(|&(a, b)| components.join(a, b));
            let expected = [(3, vec![3, 5, 7]), (4, vec![4, 6, 8]), (9, vec![9])];
            assert!(components.members().into_iter().map(|(k, v)| (k, v.into_iter().collect())).eq(expected));
        }
    }
}
