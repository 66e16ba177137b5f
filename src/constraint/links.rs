//! What the blocks of a rank are made of: conditions, nodes, groups of tied nodes and stiffness, also of other ranks' nodes.
//!
//! Ranks find the name of each connected component of nodes ([`super`]) together, its lowest node, then who else touches it, and send each
//! other what they have of it. Where meshes match a component has the few ranks around a node, and is held whole by all of them. Where
//! they do not, or on quadratic faces, conditions share nodes: all rows of the contact are one. Of such a large component ranks hold
//! what their subdomains [reach](super::reach).

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::JUMP;
use super::components::Components;
use super::reach::{Reach, rounds};
use super::ties::Ties;
use crate::comm::meeting::{ask, each_packed, home, look_up, pack};
use crate::comm::{Comm, range, sums};
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
    /// Who holds what of large components.
    pub reach: Reach,
    /// Whether there is any large component, on whatever rank.
    pub has_large: bool,
}

/// Components of more conditions and groups of tied nodes are large. Below, ranks that hold all of it have less to do. Tests have small
/// scenes.
pub const FEW: u64 = if cfg!(test) { 32 } else { 1000 };

/// How stiff subdomains are.
pub struct Stiffness {
    known: HashMap<u32, f64>,
    /// Largest of all subdomains.
    pub largest: f64,
    /// Least of all subdomains.
    pub least: f64,
}

impl Stiffness {
    /// Whether it jumps so much that rows are of unequal length.
    pub fn is_uneven(&self) -> bool {
        self.least * JUMP <= self.largest
    }

    /// Of a subdomain that has a copy of a node of this rank's blocks.
    pub fn of(&self, subdomain: u32) -> f64 {
        self.known[&subdomain]
    }
}

impl Linked {
    /// From the conditions of own nodes, to which the others of the same blocks are added, and the stiffness of own subdomains
    /// (Young's modulus). Collective.
    pub fn new(comm: &dyn Comm, decomposition: &Decomposition, pairs: &mut Pairs, young: &[f64]) -> Self {
        let [least, largest] = range(comm, young.iter().copied());
        let bits: Vec<u64> = young.iter().map(|young| young.to_bits()).collect();
        let known = decomposition.of_neighbours(comm, &bits).into_iter();
        let stiffness = Stiffness {
            known: known.map(|(subdomain, bits)| (subdomain, f64::from_bits(bits))).collect(),
            largest,
            least,
        };
        let ties = Ties::new(comm, decomposition);
        let names = names(comm, pairs, &ties);
        let large = large(comm, decomposition, (pairs, &ties), &names);
        let is_large = |node: u64| names.get(&node).is_some_and(|name| large.contains(name));
        let has_large = sums(comm, [large.len() as u64]) != [0];
        let reach = if has_large {
            Reach::new(comm, decomposition, (pairs, &ties), rounds(stiffness.is_uneven()), is_large)
        } else {
            Reach::default()
        };
        let mut linked = Self { nodes: BTreeMap::new(), ties, stiffness, reach, has_large };
        linked.complete(comm, decomposition, pairs, &names, is_large);
        linked
    }

    /// Brings here what other ranks have of the components of own nodes, or of what own subdomains reach of them. Collective.
    fn complete(
        &mut self,
        comm: &dyn Comm,
        decomposition: &Decomposition,
        known: &mut Pairs,
        names: &HashMap<u64, u64>,
        is_large: impl Fn(u64) -> bool,
    ) {
        let linked = || decomposition.interface.iter().filter_map(|node| Some((node, *names.get(&node.node)?)));
        let small = linked().filter(|(node, _)| !is_large(node.node)).map(|(_, name)| name);
        let members = members(comm, small.collect());
        let ranks = |holders: Option<&Vec<u32>>, name: u64| {
            holders.map_or_else(|| members[&name].clone(), |holders| decomposition.owners(holders))
        };
        let mut messages: [Vec<Vec<u64>>; 6] = std::array::from_fn(|_| vec![Vec::new(); comm.size()]);
        let [nodes, young, pairs, ties, of_nodes, of_slaves] = &mut messages;
        // The rank of the lowest copy of a node tells of it and of its conditions.
        for (node, name) in linked().filter(|(node, _)| decomposition.tells(node.node)) {
            let holders = self.reach.nodes.get(&node.node);
            for rank in ranks(holders, name) {
                node.pack(&mut nodes[rank]);
                let of = |&copy: &u32| [u64::from(copy), self.stiffness.of(copy).to_bits()];
                young[rank].extend(node.copies.iter().flat_map(of));
                holders.iter().for_each(|holders| pack([node.node], &words(*holders), &mut of_nodes[rank]));
            }
        }
        for (slave, holders) in &self.reach.slaves {
            let ranks = decomposition.owners(holders).into_iter();
            ranks.for_each(|rank| pack([*slave], &words(holders), &mut of_slaves[rank]));
        }
        for (number, pair) in known.iter().filter(|(_, pair)| decomposition.tells(pair.slave)) {
            let ranks = ranks(self.reach.slaves.get(&pair.slave), names[&pair.slave]);
            ranks.into_iter().for_each(|rank| known.pack(number, &mut pairs[rank]));
        }
        let reached = self.reached_groups(comm, decomposition);
        let is_member = |rank: usize, node: u64| {
            let of_component = names.get(&node).and_then(|name| members.get(name)).or_else(|| reached.get(&node));
            of_component.is_some_and(|ranks| ranks.binary_search(&rank).is_ok())
        };
        let first = decomposition.subdomains.first().map_or(0, |subdomain| subdomain.id as u32);
        for (rank, message) in ties.iter_mut().enumerate() {
            self.ties.pack(first, |node| is_member(rank, node), message);
        }
        let [nodes, young, pairs, ties, of_nodes, of_slaves] = messages.map(|message| comm.all_to_all(message));
        let nodes = nodes.iter().flat_map(|message| InterfaceNode::unpack(message));
        self.nodes = nodes.map(|node| (node.node, node)).collect();
        let young = young.iter().flat_map(|message| message.as_chunks::<2>().0);
        self.stiffness.known.extend(young.map(|&[subdomain, bits]| (subdomain as u32, f64::from_bits(bits))));
        pairs.iter().for_each(|message| known.unpack(message));
        self.ties.unpack(ties);
        let Reach { nodes, slaves } = &mut self.reach;
        for (messages, all) in [(of_nodes, nodes), (of_slaves, slaves)] {
            let mut add = |[node]: [u64; 1], holders: &[u64]| _ = all.insert(node, subdomains(holders));
            messages.iter().for_each(|message| each_packed(message, &mut add));
        }
    }

    /// The ranks that hold nodes of the groups that are known here, where they are in large components: others may tell of them.
    /// Collective.
    fn reached_groups(&self, comm: &dyn Comm, decomposition: &Decomposition) -> HashMap<u64, Vec<usize>> {
        if !self.has_large {
            return HashMap::new();
        }
        let wanted: BTreeSet<[u64; 1]> = self.ties.iter().flat_map(|(_, nodes)| nodes.iter().map(|&n| [n])).collect();
        let reached = self.reach.nodes.iter().map(|(node, holders)| ([*node], words(holders)));
        let found = look_up(comm, reached, wanted).into_iter();
        found.map(|([node], holders)| (node, decomposition.owners(&subdomains(&holders)))).collect()
    }
}

/// Subdomains as words of a message.
pub(super) fn words<'a>(subdomains: impl IntoIterator<Item = &'a u32>) -> Vec<u64> {
    subdomains.into_iter().map(|&subdomain| u64::from(subdomain)).collect()
}

/// Back from [`words`].
pub(super) fn subdomains(words: &[u64]) -> Vec<u32> {
    words.iter().map(|&subdomain| subdomain as u32).collect()
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
    for (_, nodes) in ties.iter() {
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

/// Names of the large ones among the components that own nodes are in. Collective.
fn large(
    comm: &dyn Comm,
    decomposition: &Decomposition,
    (pairs, ties): (&Pairs, &Ties),
    names: &HashMap<u64, u64>,
) -> HashSet<u64> {
    let mut counts: HashMap<u64, u64> = names.values().map(|&name| (name, 0)).collect();
    let told = pairs.iter().map(|(_, pair)| pair.slave).filter(|&slave| decomposition.tells(slave));
    let own = ties.iter().filter(|((subdomain, _), _)| decomposition.own_index(*subdomain).is_some());
    for node in told.chain(own.map(|(_, nodes)| nodes[0])) {
        *counts.get_mut(&names[&node]).expect("it has a name") += 1;
    }
    let told: Vec<[u64; 2]> = counts.into_iter().map(|(name, count)| [name, count]).collect();
    let sum = |reports: &[&[[u64; 2]]]| {
        let mut sums: HashMap<u64, u64> = HashMap::new();
        reports.iter().copied().flatten().for_each(|&[name, count]| *sums.entry(name).or_default() += count);
        move |[name, _]: &[u64; 2]| sums[name]
    };
    let counts = ask(comm, &told, |[name, _]| home(&[*name], comm.size()), sum);
    let large = told.iter().zip(counts).filter(|(_, count)| *count > FEW);
    large.map(|([name, _], _)| *name).collect()
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
        let mut message = Vec::new();
        names.iter().for_each(|name| pack([*name], &ranks[name], &mut message));
        message
    };
    let answers = comm.all_to_all(incoming.into_iter().map(answer).collect());
    let mut members = HashMap::new();
    for answer in answers {
        each_packed(&answer, |[name]: [u64; 1], ranks| {
            members.insert(name, ranks.iter().map(|&rank| rank as usize).collect());
        });
    }
    members
}
