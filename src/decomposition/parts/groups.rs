//! Connected groups of about equally many parts, by METIS (Karypis and Kumar 1998).

use metis::Graph;
use metis::option::{Contig, Seed};

use crate::heap::exhausted;
use crate::mesh::connectivity::split_into_pieces;
use crate::sparse::ordering::alone;

/// The group of each part of a graph with few faces between groups of about so many parts. `faces` are those between two
/// parts, both ways and ascending.
pub fn groups(parts: usize, faces: &[((u32, u32), u64)], size: usize) -> Vec<u32> {
    let begin: Vec<i32> = (0..=parts as u32).map(|part| faces.partition_point(|face| face.0.0 < part) as i32).collect();
    let adjacency: Vec<i32> = faces.iter().map(|face| face.0.1 as i32).collect();
    let weights: Vec<i32> = faces.iter().map(|face| face.1.min(i32::MAX as u64) as i32).collect();
    let wanted = parts.div_ceil(size) as i32;
    let mut group = if wanted > 1 { kway((&begin, &adjacency), &weights, wanted) } else { vec![0; parts] };
    let neighbours =
        |part: usize| adjacency[begin[part] as usize..begin[part + 1] as usize].iter().map(|&other| other as u32);
    split_into_pieces(&mut group, neighbours);
    group.into_iter().map(|group| group as u32).collect()
}

/// Group of each vertex of a graph, given by begins and neighbours, with little weight between the groups.
fn kway((begin, adjacency): (&[i32], &[i32]), weights: &[i32], wanted: i32) -> Vec<i32> {
    let mut groups = vec![0; begin.len() - 1];
    let _alone = alone();
    let cut = Graph::new(1, wanted, begin, adjacency)
        .expect("the rows are in order")
        .set_adjwgt(weights)
        .set_option(Contig(false))
        .set_option(Seed(1))
        .part_kway(&mut groups);
    match cut {
        Err(metis::Error::Memory) => exhausted(size_of_val(adjacency)),
        cut => cut.expect("the graph is one that METIS can cut"),
    };
    groups
}
