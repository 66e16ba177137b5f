//! Which subdomains hold which rows of a large component of conditions.
//!
//! Where meshes do not match, or faces are quadratic, neighbouring conditions share nodes, and all of a contact are one component. What couples
//! its rows is inverted near each subdomain by itself ([`crate::feti::preconditioner::patches`]). For that the subdomain holds the conditions
//! that it touches and those around them: in each of some [`rounds`] it reaches all nodes of a condition, or of a group of tied nodes,
//! of which it has reached one. It holds what it has reached. This belongs to the scene, whatever the ranks.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::links::{nodes_of, subdomains, words};
use super::ties::Ties;
use crate::comm::Comm;
use crate::comm::meeting::look_up;
use crate::contact::known::Pairs;
use crate::decomposition::{Decomposition, InterfaceNode};

/// How many rounds subdomains reach, where stiffness is even and where it jumps: the more the sides differ, the more slowly the inverse
/// decays. Measured, with 24 x 24 cells on 23 x 23, applications of F of 2 and 4 rounds beside those of the whole inverse: 19 and 19 of 19 for
/// equal bodies, 32 and 19 of 19 where the slave is 100 times as stiff, 124 and 29 of 26 where it is so a million times.
const ROUNDS: [usize; 2] = [2, 4];

/// How many rounds subdomains reach.
pub fn rounds(is_uneven: bool) -> usize {
    ROUNDS[usize::from(is_uneven)]
}

/// What ties nodes together: the conditions of a slave node, or a group of tied nodes by its subdomain and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Edge {
    Slave(u64),
    Group(u32, u32),
}

impl Edge {
    fn key(self) -> [u64; 3] {
        match self {
            Self::Slave(node) => [0, node, 0],
            Self::Group(subdomain, number) => [1, subdomain.into(), number.into()],
        }
    }
}

/// The subdomains, ascending, that hold something, of nodes and slave nodes that are in large components. Others are not listed.
#[derive(Clone, Debug, Default)]
pub struct Reach {
    /// Of a node's own rows.
    pub nodes: HashMap<u64, Vec<u32>>,
    /// Of the conditions of a slave node.
    pub slaves: HashMap<u64, Vec<u32>>,
}

impl Reach {
    /// Of the nodes, slave nodes and groups of tied nodes that this rank tells others of: those whose lowest copy, or subdomain, is its
    /// own. `is_large` says which nodes are in large components. Collective.
    pub fn new(
        comm: &dyn Comm,
        decomposition: &Decomposition,
        (pairs, ties): (&Pairs, &Ties),
        rounds: usize,
        is_large: impl Fn(u64) -> bool,
    ) -> Self {
        let tells = |node: &&InterfaceNode| is_large(node.node) && decomposition.tells(node.node);
        let told = decomposition.interface.iter().filter(tells);
        let mut nodes: BTreeMap<u64, BTreeSet<u32>> =
            told.map(|node| (node.node, node.copies.iter().copied().collect())).collect();
        // All edges of own nodes, and of those that are told here all nodes.
        let mut edges: BTreeMap<Edge, BTreeSet<u64>> = BTreeMap::new();
        for (_, pair) in pairs.iter() {
            edges.entry(Edge::Slave(pair.slave)).or_default().extend(nodes_of(pair).chain([pair.slave]));
        }
        edges.extend(
            ties.iter().map(|((subdomain, number), of)| (Edge::Group(subdomain, number), of.iter().copied().collect())),
        );
        edges.retain(|_, of| of.iter().any(|&node| is_large(node)));
        let is_told = |edge: &Edge| match *edge {
            Edge::Slave(node) => nodes.contains_key(&node),
            Edge::Group(subdomain, _) => decomposition.own_index(subdomain).is_some(),
        };
        let told: BTreeSet<Edge> = edges.keys().copied().filter(is_told).collect();
        let mut of_edges: BTreeMap<Edge, BTreeSet<u32>> = BTreeMap::new();
        for _ in 0..rounds {
            let known = nodes.iter().map(|(node, of)| ([*node], words(of)));
            let wanted: BTreeSet<u64> = told.iter().flat_map(|edge| edges[edge].iter().copied()).collect();
            let found = look_up(comm, known, wanted.into_iter().map(|node| [node]));
            let of = |edge: &Edge| (*edge, edges[edge].iter().flat_map(|node| subdomains(&found[&[*node]])).collect());
            of_edges = told.iter().map(of).collect();
            let known = of_edges.iter().map(|(edge, of)| (edge.key(), words(of)));
            let around = |of: &BTreeSet<u64>| of.iter().any(|node| nodes.contains_key(node));
            let wanted = edges.iter().filter(|(_, of)| around(of)).map(|(edge, _)| edge.key());
            let found = look_up(comm, known, wanted);
            for (edge, of) in &edges {
                let Some(reached) = found.get(&edge.key()) else { continue };
                for node in of {
                    if let Some(known) = nodes.get_mut(node) {
                        known.extend(subdomains(reached));
                    }
                }
            }
        }
        let list = |of: BTreeSet<u32>| of.into_iter().collect::<Vec<u32>>();
        let slaves = of_edges.into_iter().filter_map(|(edge, of)| match edge {
            Edge::Slave(node) => Some((node, list(of))),
            Edge::Group(..) => None,
        });
        Self { slaves: slaves.collect(), nodes: nodes.into_iter().map(|(node, of)| (node, list(of))).collect() }
    }
}
