//! Sums over the elements of one material around each node, where these are in several subdomains.

use std::ops::Range;

use super::{Decomposition, InterfaceNode};
use crate::comm::Comm;

/// Adds up what the copies of a node in subdomains of one material hold, in subdomain order: the same bits on every rank
/// that has a copy.
pub struct NodeSums<'a> {
    comm: &'a dyn Comm,
    /// Ranks that have copies of own nodes.
    neighbours: Vec<usize>,
    /// Copies of own nodes that have several of one material.
    nodes: Vec<Vec<Copy>>,
}

/// One copy of a node.
enum Copy {
    /// Own subdomain and its local node.
    Own(usize, usize),
    /// Held by a neighbour; its index.
    Other(usize),
}

impl<'a> NodeSums<'a> {
    /// For the nodes of a decomposition. Collective.
    pub fn new(comm: &'a dyn Comm, decomposition: &Decomposition) -> Self {
        let owner = |&copy: &u32| decomposition.owner(copy);
        let mine: Vec<u64> = decomposition.subdomains.iter().map(|s| s.material as u64).collect();
        let materials = decomposition.of_neighbours(comm, &mine);
        let mut several = Vec::new();
        for InterfaceNode { node, copies, .. } in &decomposition.interface {
            let mut copies = copies.clone();
            // Stable: copies of one material stay in the order of their subdomains.
            copies.sort_by_key(|copy| materials[copy]);
            let of_one = copies.chunk_by(|a, b| materials[a] == materials[b]);
            let is_own = |copy: &u32| decomposition.own_index(*copy).is_some();
            several.extend(of_one.filter(|c| c.len() > 1 && c.iter().any(is_own)).map(|c| (*node, c.to_vec())));
        }
        let mut neighbours: Vec<usize> = several.iter().flat_map(|(_, copies)| copies.iter().map(owner)).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours.retain(|&rank| rank != comm.rank());
        let copy = |node: u64, copy: &u32| match decomposition.own_index(*copy) {
            Some(own) => {
                Copy::Own(own, decomposition.subdomains[own].local_node(node).expect("a copy is in its subdomain"))
            }
            None => Copy::Other(neighbours.binary_search(&owner(copy)).expect("its owner is a neighbour")),
        };
        let nodes = several.iter().map(|(node, copies)| copies.iter().map(|c| copy(*node, c)).collect()).collect();
        Self { comm, neighbours, nodes }
    }

    /// Makes all copies of a node in one material hold the sum over them. `values` are those of each own subdomain, and
    /// `place` says where in them those of a node are, given subdomain and local node: an empty range for nodes that are not
    /// asked for. All copies of a node answer alike. One neighbour exchange.
    pub fn add(&self, place: impl Fn(usize, usize) -> Range<usize>, values: &mut [Vec<f64>]) {
        let mut outgoing = vec![Vec::new(); self.neighbours.len()];
        let mut incoming = outgoing.clone();
        let width = |copies: &[Copy]| {
            let own = copies.iter().find_map(|copy| match *copy {
                Copy::Own(own, node) => Some(place(own, node).len()),
                Copy::Other(_) => None,
            });
            own.unwrap_or_default()
        };
        for copies in &self.nodes {
            let width = width(copies);
            let mut sent = vec![false; self.neighbours.len()];
            for copy in copies {
                let Copy::Other(neighbour) = *copy else { continue };
                incoming[neighbour].extend(std::iter::repeat_n(0.0, width));
                if !std::mem::replace(&mut sent[neighbour], true) {
                    for copy in copies {
                        let Copy::Own(own, node) = *copy else { continue };
                        outgoing[neighbour].extend_from_slice(&values[own][place(own, node)]);
                    }
                }
            }
        }
        self.comm.exchange(&self.neighbours, &outgoing, &mut incoming);
        let mut taken = vec![0; self.neighbours.len()];
        for copies in &self.nodes {
            let mut sum = vec![0.0; width(copies)];
            for copy in copies {
                let part = match *copy {
                    Copy::Own(own, node) => &values[own][place(own, node)],
                    Copy::Other(neighbour) => {
                        let begin = taken[neighbour];
                        taken[neighbour] += sum.len();
                        &incoming[neighbour][begin..taken[neighbour]]
                    }
                };
                sum.iter_mut().zip(part).for_each(|(sum, x)| *sum += x);
            }
            for copy in copies {
                let Copy::Own(own, node) = *copy else { continue };
                values[own][place(own, node)].copy_from_slice(&sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{RANKS, built_in, on_ranks, quarters, same_on_any_ranks, two_bricks, two_bricks_by_metis};
    use crate::scene::Scene;

    fn scenes() -> [Scene; 4] {
        let checkered = r#"{ left-low = "stiff", left-high = "soft", right-low = "soft", right-high = "stiff" }"#;
        let quarters = quarters(checkered, &["decomposition.subdomains=9"]);
        [two_bricks(&[]), two_bricks_by_metis(9), built_in("patch", &[]), quarters]
    }

    /// Each node counts its elements of a material: those of the whole mesh, whoever asks.
    #[test]
    fn copies_hold_the_sum_over_all_copies() {
        for scene in scenes() {
            let count = |setup: &crate::fixture::Setup| {
                let mut counts: Vec<Vec<f64>> =
                    setup.subdomains().iter().map(|s| vec![0.0; 2 * s.nodes.len()]).collect();
                for (subdomain, counts) in setup.subdomains().iter().zip(&mut counts) {
                    for &node in subdomain.elements.nodes() {
                        counts[2 * node as usize] += 1.0;
                        counts[2 * node as usize + 1] += subdomain.id as f64;
                    }
                }
                counts
            };
            let known = on_ranks(&scene, 1, |setup| {
                let mut sums = std::collections::BTreeMap::<(u64, usize), [f64; 2]>::new();
                for (subdomain, counts) in setup.subdomains().iter().zip(count(setup)) {
                    for (node, count) in subdomain.nodes.iter().zip(counts.as_chunks::<2>().0) {
                        let sum = sums.entry((*node, subdomain.material)).or_default();
                        (0..2).for_each(|k| sum[k] += count[k]);
                    }
                }
                sums
            });
            for ranks in RANKS {
                on_ranks(&scene, ranks, |setup| {
                    let mut values = count(setup);
                    NodeSums::new(setup.comm, &setup.discrete.decomposition)
                        .add(|_, node| 2 * node..2 * node + 2, &mut values);
                    for (subdomain, values) in setup.subdomains().iter().zip(values) {
                        for (node, value) in subdomain.nodes.iter().zip(values.as_chunks::<2>().0) {
                            assert_eq!(known[0][&(*node, subdomain.material)], *value);
                        }
                    }
                });
            }
        }
    }

    #[test]
    fn sums_are_the_same_bits_on_any_ranks() {
        for scene in scenes() {
            same_on_any_ranks(&scene, |setup| {
                let mut values = setup.displacements(3);
                NodeSums::new(setup.comm, &setup.discrete.decomposition)
                    .add(|_, node| 3 * node..3 * node + 3, &mut values);
                values.concat()
            });
        }
    }
}
