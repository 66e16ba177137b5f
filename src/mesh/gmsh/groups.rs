//! Physical groups of a mesh file: their names, their blocks, and what to say of them.

use std::collections::{BTreeMap, BTreeSet};

use super::error::Problem;
use super::{Block, Msh};

impl Msh {
    /// Volumes that some physical group names, by name.
    pub fn volume_names(&self) -> BTreeSet<String> {
        self.group_names(3).into_keys().collect()
    }

    /// Cells of each physical group of a dimension, by its name, or its number if it has none.
    pub(super) fn group_names(&self, dimension: i32) -> BTreeMap<String, u64> {
        let mut names = BTreeMap::new();
        for block in self.blocks.iter().filter(|b| b.kind.dimension == dimension) {
            for name in block.groups.iter().map(|&tag| self.name(dimension, tag)) {
                *names.entry(name).or_default() += block.cells;
            }
        }
        names
    }

    fn name(&self, dimension: i32, tag: i32) -> String {
        let known = self.names.iter().find(|n| n.dimension == dimension && n.tag == tag);
        known.map_or_else(|| tag.to_string(), |n| n.name.clone())
    }

    /// Blocks of a physical group.
    pub(super) fn group(&self, dimension: i32, name: &str) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter(move |block| self.is_in(block, dimension, name))
    }

    pub(super) fn is_in(&self, block: &Block, dimension: i32, name: &str) -> bool {
        block.kind.dimension == dimension && block.groups.iter().any(|&tag| self.name(dimension, tag) == name)
    }
}

/// Cells of higher order, counted.
pub(super) fn higher_order<'a>(what: String, blocks: impl Iterator<Item = &'a Block>) -> Problem {
    let curved: Vec<&Block> = blocks.filter(|b| !b.kind.linear).collect();
    let cells = curved.iter().map(|b| b.cells).sum();
    Problem::HigherOrder { what, cells, kind: curved.first().map_or("curved", |b| b.kind.name) }
}

/// Names and counts in words.
pub(super) fn listed(known: &BTreeMap<String, u64>, items: &str) -> String {
    if known.is_empty() {
        return "there are none".to_owned();
    }
    let each: Vec<String> = known.iter().map(|(name, count)| format!("`{name}` ({count} {items})")).collect();
    format!("there are {}", each.join(", "))
}
