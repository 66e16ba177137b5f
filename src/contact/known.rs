//! The conditions that a rank knows: those of the nodes that it has copies of.
//!
//! Conditions are numbered over the whole scene, by contact, slave node and part, whatever the ranks. Ranks have ranges of nodes
//! to number; each condition is told by the rank that has the first face around its slave node.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Index;

use super::{Conditions, ContactPair, MasterNode, Site};
use crate::comm::meeting::{ask, home, look_up};
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::{Decomposition, InterfaceNode};

/// Some of a scene's conditions, by their numbers.
#[derive(Clone, Debug, Default)]
pub struct Pairs {
    known: BTreeMap<usize, (ContactPair, Site)>,
    total: usize,
}

impl Pairs {
    /// How many the scene has.
    pub fn total(&self) -> usize {
        self.total
    }

    /// How many are known here.
    pub fn known(&self) -> usize {
        self.known.len()
    }

    /// Those that are known here with their numbers, ascending.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &ContactPair)> {
        self.known.iter().map(|(number, (pair, _))| (*number, pair))
    }

    /// One of them, if it is known here.
    pub fn get(&self, number: usize) -> Option<&ContactPair> {
        self.known.get(&number).map(|(pair, _)| pair)
    }

    /// Where one of them is.
    ///
    /// # Panics
    /// If it is not known here.
    pub fn site(&self, number: usize) -> Site {
        self.known[&number].1
    }

    /// As numbers, for sending.
    pub fn pack(&self, number: usize, message: &mut Vec<u64>) {
        let (pair, site) = &self.known[&number];
        pack(number, pair, site, message);
    }

    /// Adds those that another rank has packed one behind the other.
    pub fn unpack(&mut self, message: &[u64]) {
        let mut rest = message.iter().copied();
        while let Some(number) = rest.next() {
            let mut next = || rest.next().expect("conditions are whole");
            let [contact, slave, part, covered, slaves, masters, vectors] = [(); 7].map(|()| next());
            let mut real = || f64::from_bits(next());
            let (normal, [gap, area, limit_area]) = ([(); 3].map(|()| real()), [(); 3].map(|()| real()));
            let site = Site { place: [(); 3].map(|()| real()), facet: real() };
            let mut weights = |count: u64| (0..count).map(|_| (next(), f64::from_bits(next()))).collect();
            let (slaves, masters) = (weights(slaves), weights(masters));
            let vectors = (0..vectors).map(|_| [(); 3].map(|()| f64::from_bits(next()))).collect();
            let (contact, part, covered) = (contact as usize, part as u32, covered == 1);
            let pair =
                ContactPair { contact, slave, part, slaves, masters, vectors, normal, gap, area, limit_area, covered };
            self.known.insert(number as usize, (pair, site));
        }
    }
}

fn pack(number: usize, pair: &ContactPair, site: &Site, message: &mut Vec<u64>) {
    let ContactPair { contact, slave, part, slaves, masters, vectors, normal, gap, area, limit_area, covered } = pair;
    message.extend([number as u64, *contact as u64, *slave, u64::from(*part), u64::from(*covered)]);
    message.extend([slaves.len(), masters.len(), vectors.len()].map(|n| n as u64));
    message.extend(
        normal.iter().chain([gap, area, limit_area]).chain(&site.place).chain([&site.facet]).map(|x| x.to_bits()),
    );
    message.extend(slaves.iter().chain(masters).flat_map(|(node, weight)| [*node, weight.to_bits()]));
    message.extend(vectors.iter().flatten().map(|x| x.to_bits()));
}

impl Index<usize> for Pairs {
    type Output = ContactPair;

    /// A condition by its number; panics if it is not known here.
    fn index(&self, number: usize) -> &ContactPair {
        &self.known[&number].0
    }
}

/// The conditions of one contact as a rank found them.
pub struct Found {
    /// On the nodes of its own faces.
    pub conditions: Conditions,
    /// Where each of them is.
    pub sites: Vec<Site>,
    /// Which of them this rank tells the others.
    pub told: Vec<bool>,
}

/// Numbers the conditions of all contacts, and brings them, and the nodes of master surfaces, to the ranks that have copies of
/// their nodes. `nodes` are those of the scene. Master nodes refer to numbers then. Collective.
pub fn spread(
    comm: &dyn Comm,
    decomposition: &Decomposition,
    nodes: u64,
    contacts: Vec<Found>,
) -> (Pairs, Vec<MasterNode>) {
    let key = |pair: &ContactPair| [pair.contact as u64, pair.slave, u64::from(pair.part)];
    let keys: Vec<[u64; 3]> = contacts.iter().flat_map(|found| found.conditions.pairs.iter().map(key)).collect();
    let (numbers, total) = numbers(comm, nodes, contacts.len(), &keys);
    let mut pairs = Pairs { known: BTreeMap::new(), total };
    let (mut told, mut masters) = (Pairs::default(), Vec::new());
    for Found { conditions, sites, told: tells } in contacts {
        let number: Vec<usize> = conditions.pairs.iter().map(|pair| numbers[&key(pair)]).collect();
        masters.extend(conditions.masters.into_iter().map(|master| {
            let pairs = master.pairs.iter().map(|&(pair, weight)| (number[pair], weight)).collect();
            MasterNode { pairs, ..master }
        }));
        for (((number, pair), site), _) in
            number.into_iter().zip(conditions.pairs).zip(sites).zip(tells).filter(|x| x.1)
        {
            told.known.insert(number, (pair, site));
        }
    }
    let masters = nearest(comm, masters);
    // Both go where copies of their nodes are.
    let touched =
        |pair: &ContactPair| pair.slaves.iter().chain(&pair.masters).map(|(node, _)| *node).collect::<Vec<_>>();
    let wanted: BTreeSet<u64> =
        told.iter().flat_map(|(_, pair)| touched(pair)).chain(masters.iter().map(|master| master.node)).collect();
    let holders = holders(comm, decomposition, wanted);
    let (mut of_pairs, mut of_masters) = (vec![Vec::new(); comm.size()], vec![Vec::new(); comm.size()]);
    for (number, pair) in told.iter() {
        let ranks: BTreeSet<usize> = touched(pair).iter().flat_map(|node| holders[node].iter().copied()).collect();
        ranks.into_iter().for_each(|rank| told.pack(number, &mut of_pairs[rank]));
    }
    for master in &masters {
        holders[&master.node].iter().for_each(|&rank| pack_master(master, &mut of_masters[rank]));
    }
    comm.all_to_all(of_pairs).iter().for_each(|message| pairs.unpack(message));
    let mut masters: Vec<MasterNode> =
        comm.all_to_all(of_masters).iter().flat_map(|message| masters_in(message)).collect();
    masters.sort_by(|a, b| {
        (a.contact, a.node, a.part).cmp(&(b.contact, b.node, b.part)).then(a.pairs[0].0.cmp(&b.pairs[0].0))
    });
    (pairs, masters)
}

/// A number for each of these keys (contact, slave node, part), the same for the same key of all ranks, and how many there are.
/// Collective.
fn numbers(comm: &dyn Comm, nodes: u64, contacts: usize, keys: &[[u64; 3]]) -> (HashMap<[u64; 3], usize>, usize) {
    let ranks = comm.size();
    let whom = |key: &[u64; 3]| (u128::from(key[1]) * ranks as u128 / u128::from(nodes.max(1))) as usize;
    let mut total = 0;
    let found = ask(comm, keys, whom, |incoming| {
        let here: BTreeSet<[u64; 3]> = incoming.iter().copied().flatten().copied().collect();
        let mut counts = vec![0_u64; contacts];
        here.iter().for_each(|key| counts[key[0] as usize] += 1);
        let all = all_gather_u64(comm, &counts);
        total = all.iter().sum::<u64>() as usize;
        let of = |rank: usize, contact: usize| all[rank * contacts + contact];
        let first = |contact: usize| -> u64 {
            let before = (0..contact).flat_map(|c| (0..ranks).map(move |rank| (rank, c)));
            before.chain((0..comm.rank()).map(|rank| (rank, contact))).map(|(rank, c)| of(rank, c)).sum()
        };
        let mut next: Vec<u64> = (0..contacts).map(first).collect();
        let mut number = |key: [u64; 3]| {
            let next = &mut next[key[0] as usize];
            *next += 1;
            (key, *next - 1)
        };
        let numbers: HashMap<[u64; 3], u64> = here.into_iter().map(&mut number).collect();
        move |key| numbers[key]
    });
    (keys.iter().copied().zip(found.into_iter().map(|number| number as usize)).collect(), total)
}

/// Of what ranks say of a master node the nearest surface counts, of the same distance that of the lowest rank, whose faces come
/// first. Each is left on one rank. Where meshes match there is one for each condition. Collective.
fn nearest(comm: &dyn Comm, masters: Vec<MasterNode>) -> Vec<MasterNode> {
    let mut outgoing = vec![Vec::new(); comm.size()];
    for master in &masters {
        pack_master(master, &mut outgoing[home(&[master.node], comm.size())]);
    }
    let mut kept: BTreeMap<(usize, u64, u32, usize), MasterNode> = BTreeMap::new();
    for master in comm.all_to_all(outgoing).iter().flat_map(|message| masters_in(message)) {
        let alone = if master.matches { master.pairs[0].0 } else { usize::MAX };
        let key = (master.contact, master.node, master.part, alone);
        if kept.get(&key).is_none_or(|known| master.distance.abs() < known.distance.abs()) {
            kept.insert(key, master);
        }
    }
    kept.into_values().collect()
}

fn pack_master(master: &MasterNode, message: &mut Vec<u64>) {
    let MasterNode { contact, node, part, distance, matches, pairs } = master;
    message.extend([*contact as u64, *node, u64::from(*part), distance.to_bits(), u64::from(*matches)]);
    message.push(pairs.len() as u64);
    message.extend(pairs.iter().flat_map(|(pair, weight)| [*pair as u64, weight.to_bits()]));
}

fn masters_in(message: &[u64]) -> Vec<MasterNode> {
    let (mut masters, mut rest) = (Vec::new(), message);
    while let [contact, node, part, distance, matches, count, behind @ ..] = rest {
        let (pairs, behind) = behind.split_at(2 * *count as usize);
        let pairs = pairs.as_chunks::<2>().0.iter().map(|&[pair, weight]| (pair as usize, f64::from_bits(weight)));
        masters.push(MasterNode {
            contact: *contact as usize,
            node: *node,
            part: *part as u32,
            distance: f64::from_bits(*distance),
            matches: *matches == 1,
            pairs: pairs.collect(),
        });
        rest = behind;
    }
    masters
}

/// The ranks that have copies of some nodes of named surfaces. Collective.
fn holders(
    comm: &dyn Comm,
    decomposition: &Decomposition,
    wanted: impl IntoIterator<Item = u64>,
) -> HashMap<u64, Vec<usize>> {
    // The rank of the lowest copy answers.
    let answers =
        |node: &&InterfaceNode| !node.surfaces.is_empty() && decomposition.own_index(node.copies[0]).is_some();
    let ranks = |node: &InterfaceNode| {
        let ranks = decomposition.owners(&node.copies).into_iter().map(|rank| rank as u64);
        ([node.node], ranks.collect())
    };
    let known = decomposition.interface.iter().filter(answers).map(ranks);
    let found = look_up(comm, known, wanted.into_iter().map(|node| [node]));
    found.into_iter().map(|([node], ranks)| (node, ranks.into_iter().map(|rank| rank as usize).collect())).collect()
}
