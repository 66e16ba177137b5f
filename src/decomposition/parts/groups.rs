//! Connected groups of about equally many parts, by METIS (Karypis and Kumar 1998).

use std::collections::BTreeMap;

use metis::Graph;
use metis::option::{Contig, Seed};

use crate::heap::exhausted;
use crate::mesh::connectivity::split_into_pieces;
use crate::sparse::ordering::undisturbed;

/// Faces between two items, both ways and ascending.
pub type Faces = BTreeMap<(u32, u32), u64>;

/// A cluster of parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cluster {
    /// Its parts, group by group.
    pub members: Vec<u32>,
    /// For each level the sizes of its groups, in groups of the level below.
    pub sizes: Vec<Vec<usize>>,
}

/// Groups of so many items on each level, few faces between them: for each level the group of each item, an item being a part or a
/// group of the level below.
pub fn groups(parts: usize, mut faces: Faces, sizes: &[usize]) -> Vec<Vec<u32>> {
    let (mut levels, mut count) = (Vec::new(), parts);
    for &size in sizes {
        let of: Vec<u32> = if size > 1 { of_level(count, &faces, size) } else { (0..count as u32).collect() };
        let mut between = Faces::new();
        for ((a, b), n) in faces {
            let (a, b) = (of[a as usize], of[b as usize]);
            if a != b {
                *between.entry((a, b)).or_default() += n;
            }
        }
        (faces, count) = (between, number(&of));
        levels.push(of);
    }
    levels
}

/// The clusters from the groups of each level; each part is one if there are no levels.
pub fn clusters(parts: usize, levels: &[Vec<u32>]) -> Vec<Cluster> {
    let part = |part| Cluster { members: vec![part], sizes: vec![Vec::new(); levels.len()] };
    let mut items: Vec<Cluster> = (0..parts as u32).map(part).collect();
    for (level, of) in levels.iter().enumerate() {
        let mut groups = vec![Cluster { members: Vec::new(), sizes: vec![Vec::new(); levels.len()] }; number(of)];
        groups.iter_mut().for_each(|group| group.sizes[level].push(0));
        for (item, &group) in items.into_iter().zip(of) {
            let group = &mut groups[group as usize];
            group.members.extend(item.members);
            group.sizes.iter_mut().zip(item.sizes).for_each(|(all, sizes)| all.extend(sizes));
            group.sizes[level][0] += 1;
        }
        items = groups;
    }
    items
}

/// Number of groups.
fn number(of: &[u32]) -> usize {
    of.iter().max().map_or(0, |&last| last as usize + 1)
}

/// The group of each item with few faces between groups of about so many.
fn of_level(items: usize, faces: &Faces, size: usize) -> Vec<u32> {
    let mut begin = vec![0; items + 1];
    faces.keys().for_each(|face| begin[face.0 as usize + 1] += 1);
    (0..items).for_each(|item| begin[item + 1] += begin[item]);
    let adjacency: Vec<i32> = faces.keys().map(|face| face.1 as i32).collect();
    let weights: Vec<i32> = faces.values().map(|&n| n.min(i32::MAX as u64) as i32).collect();
    let wanted = items.div_ceil(size) as i32;
    let mut group = if wanted > 1 { kway((&begin, &adjacency), &weights, wanted) } else { vec![0; items] };
    let neighbours =
        |item: usize| adjacency[begin[item] as usize..begin[item + 1] as usize].iter().map(|&other| other as u32);
    split_into_pieces(&mut group, neighbours);
    group.into_iter().map(|group| group as u32).collect()
}

/// Group of each vertex of a graph, given by begins and neighbours, with little weight between the groups.
fn kway((begin, adjacency): (&[i32], &[i32]), weights: &[i32], wanted: i32) -> Vec<i32> {
    let mut groups = vec![0; begin.len() - 1];
    let cut = || {
        let graph = Graph::new(1, wanted, begin, adjacency).expect("the rows are in order").set_adjwgt(weights);
        graph.set_option(Contig(false)).set_option(Seed(1)).part_kway(&mut groups)
    };
    match undisturbed(cut, |cut| matches!(cut, Err(metis::Error::Other))) {
        Err(metis::Error::Memory) => exhausted(size_of_val(adjacency)),
        cut => cut.expect("the graph is one that METIS can cut"),
    };
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_groups_of_a_chain_are_pieces_of_it() {
        let faces = (0..11).flat_map(|k| [((k, k + 1), 1), ((k + 1, k), 1)]).collect();
        let levels = groups(12, faces, &[3, 2]);
        let clusters = clusters(12, &levels);
        let mut all: Vec<u32> = clusters.iter().flat_map(|cluster| cluster.members.clone()).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..12));
        for Cluster { members, sizes } in &clusters {
            let mut sorted = members.clone();
            sorted.sort_unstable();
            assert!(sorted.windows(2).all(|pair| pair[1] == pair[0] + 1), "{members:?}");
            assert_eq!((sizes[0].iter().sum(), sizes[1].as_slice()), (members.len(), &[sizes[0].len()][..]));
        }
        assert_eq!(super::clusters(2, &[]), [0, 1].map(|part| Cluster { members: vec![part], sizes: Vec::new() }));
    }
}
