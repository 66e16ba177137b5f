//! What the blocks of a rank are made of: conditions, nodes, groups of tied nodes and stiffness, also of other ranks' nodes.
//!
//! A block is a connected component of nodes ([`super`]), and is held whole by every rank that touches it. Ranks find the name of
//! each component together, its lowest node, then who else touches it, and send each other what they have of it. Where meshes match a
//! component has the few ranks around a node. Where they do not, or on quadratic faces, conditions share nodes: all rows of the
//! contact are one, and every rank at the contact holds them: `(B B')^-1` couples all of them ([`crate::feti::dual::coupling`]).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::components::Components;
use super::ties::Ties;
use crate::comm::meeting::{ask, home};
use crate::comm::{Comm, maximum, sums};
use crate::contact::ContactPair;
use crate::contact::known::Pairs;
use crate::decomposition::{Decomposition, InterfaceNode};

/// What a rank knows to set up its blocks, beside the conditions.
pub struct Linked {
    /// Nodes that contact or short edges tie to others.
    pub nodes: BTreeMap<u64, InterfaceNode>,
    /// Groups of tied nodes.
    pub ties: Ties,
    /// Of the subdomains that have copies of nodes.
    pub stiffness: Stiffness,
}

/// How stiff subdomains are.
pub struct Stiffness {
    known: HashMap<u32, f64>,
    /// Largest of all subdomains.
    pub largest: f64,
    /// Least of all subdomains.
    pub least: f64,
}

impl Stiffness {
    /// Of a subdomain that has a copy of a node of this rank's blocks.
    pub fn of(&self, subdomain: u32) -> f64 {
        self.known[&subdomain]
    }
}

impl Linked {
    /// From the conditions of own nodes, to which the others of the same blocks are added, and the stiffness of own subdomains
    /// (Young's modulus). Collective.
    pub fn new(comm: &dyn Comm, decomposition: &Decomposition, pairs: &mut Pairs, young: &[f64]) -> Self {
        let extreme = |sign: f64| sign * maximum(comm, &[young.iter().fold(-f64::INFINITY, |m, y| m.max(sign * y))])[0];
        let bits: Vec<u64> = young.iter().map(|young| young.to_bits()).collect();
        let known = decomposition.of_neighbours(comm, &bits).into_iter();
        let stiffness = Stiffness {
            known: known.map(|(subdomain, bits)| (subdomain, f64::from_bits(bits))).collect(),
            largest: extreme(1.0),
            least: extreme(-1.0),
        };
        let ties = Ties::new(comm, decomposition);
        let names = names(comm, pairs, &ties);
        let mut linked = Self { nodes: BTreeMap::new(), ties, stiffness };
        linked.complete(comm, decomposition, pairs, &names);
        linked
    }

    /// Brings here what other ranks have of the components of own nodes. Collective.
    fn complete(
        &mut self,
        comm: &dyn Comm,
        decomposition: &Decomposition,
        known: &mut Pairs,
        names: &HashMap<u64, u64>,
    ) {
        let linked = || decomposition.interface.iter().filter_map(|node| Some((node, *names.get(&node.node)?)));
        let members = members(comm, linked().map(|(_, name)| name).collect());
        let mut messages: [Vec<Vec<u64>>; 4] = std::array::from_fn(|_| vec![Vec::new(); comm.size()]);
        let [nodes, young, pairs, ties] = &mut messages;
        // The rank of the lowest copy of a node tells of it and of its conditions.
        let mut own: HashMap<u64, &Vec<usize>> = HashMap::new();
        for (node, name) in linked().filter(|(node, _)| decomposition.own_index(node.copies[0]).is_some()) {
            own.insert(node.node, &members[&name]);
            for &rank in &members[&name] {
                node.pack(&mut nodes[rank]);
                let of = |&copy: &u32| [u64::from(copy), self.stiffness.of(copy).to_bits()];
                young[rank].extend(node.copies.iter().flat_map(of));
            }
        }
        for (number, pair) in known.iter() {
            let ranks = own.get(&pair.slave).into_iter().flat_map(|ranks| ranks.iter());
            ranks.for_each(|&rank| known.pack(number, &mut pairs[rank]));
        }
        let first = decomposition.subdomains.first().map_or(0, |subdomain| subdomain.id as u32);
        let is_member = |rank: usize, node: u64| {
            names.get(&node).and_then(|name| members.get(name)).is_some_and(|ranks| ranks.binary_search(&rank).is_ok())
        };
        for (rank, message) in ties.iter_mut().enumerate() {
            self.ties.pack(first, |node| is_member(rank, node), message);
        }
        let [nodes, young, pairs, ties] = messages.map(|message| comm.all_to_all(message));
        let nodes = nodes.iter().flat_map(|message| InterfaceNode::unpack(message));
        self.nodes = nodes.map(|node| (node.node, node)).collect();
        let young = young.iter().flat_map(|message| message.as_chunks::<2>().0);
        self.stiffness.known.extend(young.map(|&[subdomain, bits]| (subdomain as u32, f64::from_bits(bits))));
        pairs.iter().for_each(|message| known.unpack(message));
        self.ties.unpack(ties);
    }
}

/// Nodes that a pair ties together.
pub(super) fn nodes_of(pair: &ContactPair) -> impl Iterator<Item = u64> {
    pair.nodes().map(|(node, _)| node)
}

/// Components of nodes that what is known here ties together.
pub(super) fn components(pairs: &Pairs, ties: &Ties) -> BTreeMap<u64, BTreeSet<u64>> {
    let mut components = Components::default();
    for (_, pair) in pairs.iter() {
        nodes_of(pair).for_each(|node| components.join(pair.slave, node));
    }
    for nodes in ties.nodes() {
        nodes.iter().for_each(|&node| components.join(nodes[0], node));
    }
    components.members()
}

/// The name of the component of each node that is known here: its lowest node, on whatever rank. Collective.
///
/// Ranks join what they know, and tell each node's home the lowest name that it has here; from there it goes to the others. Names
/// are nodes, too, and have names: taking these lets a name cross a long component in few rounds.
fn names(comm: &dyn Comm, pairs: &Pairs, ties: &Ties) -> HashMap<u64, u64> {
    let ranks = comm.size();
    let (mut names, nodes): (Vec<u64>, Vec<BTreeSet<u64>>) = components(pairs, ties).into_iter().unzip();
    // Nodes with the component that they are in here.
    let at: Vec<(u64, usize)> =
        nodes.iter().enumerate().flat_map(|(number, nodes)| nodes.iter().map(move |&node| (node, number))).collect();
    let mut of_node: HashMap<u64, u64> = HashMap::new();
    loop {
        let told: Vec<[u64; 2]> = at.iter().map(|&(node, number)| [node, names[number]]).collect();
        let known = &mut of_node;
        let answers = ask(
            comm,
            &told,
            |[node, _]| home(&[*node], ranks),
            |reports| {
                for &[node, name] in reports.iter().copied().flatten() {
                    let lowest = known.entry(node).or_insert(name);
                    *lowest = name.min(*lowest);
                }
                move |[node, _]| known[node]
            },
        );
        let mut lower = names.clone();
        for ((_, number), name) in at.iter().zip(answers) {
            lower[*number] = name.min(lower[*number]);
        }
        // The names of names.
        let wanted: Vec<[u64; 1]> = lower.iter().map(|&name| [name]).collect();
        let of = |[name]: &[u64; 1]| of_node.get(name).map_or(*name, |of| *of);
        let answers = ask(comm, &wanted, |name| home(name, ranks), |_| of);
        lower.iter_mut().zip(answers).for_each(|(lower, name)| *lower = name.min(*lower));
        let changed = lower != names;
        names = lower;
        if sums(comm, [u64::from(changed)]) == [0] {
            break;
        }
    }
    nodes.into_iter().zip(names).flat_map(|(nodes, name)| nodes.into_iter().map(move |node| (node, name))).collect()
}

/// For each of the components that own nodes are in, the ranks of which that is true, ascending. Collective.
fn members(comm: &dyn Comm, mine: BTreeSet<u64>) -> HashMap<u64, Vec<usize>> {
    let mut outgoing = vec![Vec::new(); comm.size()];
    mine.into_iter().for_each(|name| outgoing[home(&[name], comm.size())].push(name));
    let incoming = comm.all_to_all(outgoing.clone());
    let mut ranks: HashMap<u64, Vec<u64>> = HashMap::new();
    for (rank, names) in incoming.iter().enumerate() {
        names.iter().for_each(|name| ranks.entry(*name).or_default().push(rank as u64));
    }
    let answer = |names: Vec<u64>| {
        let of = |name: &u64| [&[*name, ranks[name].len() as u64][..], &ranks[name]].concat();
        names.iter().flat_map(of).collect()
    };
    let answers = comm.all_to_all(incoming.into_iter().map(answer).collect());
    let mut members = HashMap::new();
    for answer in answers {
        let mut rest = &answer[..];
        while let [name, count, behind @ ..] = rest {
            let (ranks, behind) = behind.split_at(*count as usize);
            members.insert(*name, ranks.iter().map(|&rank| rank as usize).collect());
            rest = behind;
        }
    }
    members
}
