//! Setting up the rows of one rank, block by block.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::Kind;
use super::contact::Side;
use super::links::{Linked, components};
use super::prescribed::Prescribed;
use super::ties::Ties;
use super::{Constraints, Entry, JUMP, Row, Support, Term, contact, dirichlet, friction, gluing};
use crate::contact::known::Pairs;
use crate::decomposition::{Decomposition, InterfaceNode};

/// Nodes tied together by contact and short edges, and the contact pairs among them.
struct Cluster {
    nodes: BTreeSet<u64>,
    pairs: Vec<usize>,
}

impl Constraints {
    /// All rows that touch this rank's subdomains. Supports agree (see [`dirichlet::check`]). Of parallel contact conditions that
    /// gives the row which is the tightest at the time `at`. `friction` tells which contacts have any.
    pub fn new(
        decomposition: &Decomposition,
        supports: &[Support],
        pairs: &Pairs,
        linked: Linked,
        at: &Prescribed,
        friction: &[bool],
    ) -> Self {
        let Linked { nodes: tied, ties, stiffness } = linked;
        let clusters = clusters(pairs, &ties);
        let young = |subdomain: u32| stiffness.of(subdomain);
        let own: HashMap<u64, &InterfaceNode> = decomposition.interface.iter().map(|n| (n.node, n)).collect();
        let node = |number: u64| tied.get(&number).or_else(|| own.get(&number).copied());
        let alone = own.keys().filter(|number| !tied.contains_key(number));
        let keys: BTreeSet<u64> = clusters.keys().chain(alone).copied().collect();
        let nodes = |key: u64| -> Vec<&InterfaceNode> {
            clusters
                .get(&key)
                .map_or(node(key).into_iter().collect(), |c| c.nodes.iter().filter_map(|&n| node(n)).collect())
        };
        let mut result = Self {
            rows: Vec::new(),
            sliders: Vec::new(),
            blocks: Vec::new(),
            block_subdomains: Vec::new(),
            slot_begin: vec![0],
            slot_subdomain: Vec::new(),
            entries: vec![Vec::new(); decomposition.subdomains.len()],
            copies: local_copies(decomposition),
            has_inequalities: pairs.total() > 0,
            has_friction: friction.contains(&true),
            uneven: stiffness.least * JUMP <= stiffness.largest,
            ties,
            idle: Vec::new(),
            guided: Vec::new(),
        };
        let mut directions = Vec::new();
        for (subdomains, key) in by_subdomains(keys, nodes) {
            let mut rows = Vec::new();
            let mut sides: BTreeMap<u64, Side> = BTreeMap::new();
            for interface in nodes(key) {
                let fixed = dirichlet::fixed(interface, supports);
                rows.extend(gluing::rows(interface, &decomposition.clusters, young));
                rows.extend(dirichlet::rows(interface, &fixed));
                sides.insert(interface.node, (interface, fixed));
            }
            let mut contacts: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
            for &number in clusters.get(&key).iter().flat_map(|cluster| &cluster.pairs) {
                let pair = &pairs[number];
                match contact::row(number, pair, &|node| sides[&node]) {
                    Ok(row) => {
                        contact::add_tightest(contacts.entry(pair.slave).or_default(), row, at);
                        if friction[pair.contact] {
                            result.guided.extend(friction::guided(number, pair, &|node| sides[&node]));
                        }
                    }
                    Err(held) => result.idle.push((number, held)),
                }
            }
            rows.iter_mut().for_each(|row| row.weigh(young, stiffness.largest));
            for mut of_node in contacts.into_values() {
                of_node.iter_mut().for_each(|row| row.weigh(young, stiffness.largest));
                let (more, along) = friction_rows(&of_node, pairs, &|node| sides[&node], friction);
                directions.extend(along);
                rows.extend(of_node.into_iter().chain(more));
            }
            result.push_block(rows, subdomains, decomposition);
        }
        result.find_sliders(pairs, directions);
        result
    }

    /// Appends the rows of a block; nothing if it has none.
    fn push_block(&mut self, rows: Vec<Row>, subdomains: Vec<u32>, decomposition: &Decomposition) {
        if rows.is_empty() {
            return;
        }
        self.blocks.push(self.rows.len()..self.rows.len() + rows.len());
        self.block_subdomains.push(subdomains);
        for mut row in rows {
            let number = self.rows.len() as u32;
            row.terms.sort_by_key(|t| (t.subdomain, t.node, t.axis));
            for part in row.terms.chunk_by(Term::share_slot) {
                let slot = self.slot_subdomain.len() as u32;
                self.slot_subdomain.push(part[0].subdomain);
                let Some(own) = decomposition.own_index(part[0].subdomain) else { continue };
                for term in part {
                    let local =
                        decomposition.subdomains[own].local_node(term.node).expect("a copy is in its subdomain");
                    let dof = (3 * local + term.axis) as u32;
                    self.entries[own].push(Entry { row: number, slot, dof, value: term.value });
                }
            }
            self.slot_begin.push(self.slot_subdomain.len() as u32);
            self.rows.push(row);
        }
    }

    /// Slots of a row.
    pub fn slots(&self, row: usize) -> std::ops::Range<usize> {
        self.slot_begin[row] as usize..self.slot_begin[row + 1] as usize
    }

    /// Adds to multipliers of some kinds those whose forces `B'l` change `B f` by `change`: `l = change / |row|^2`, as these
    /// rows are orthogonal.
    pub fn add_forces(&self, change: &[f64], of: impl Fn(Kind) -> bool, lambda: &mut [f64]) {
        let rows = self.rows.iter().zip(change).zip(lambda).filter(|((row, _), _)| of(row.kind));
        rows.for_each(|((row, change), l)| *l += change / (row.length * row.length));
    }
}

/// The friction rows beside the contact rows of one node, and their directions. They are as long as those.
fn friction_rows<'a>(
    contacts: &[Row],
    pairs: &Pairs,
    sides: &impl Fn(u64) -> Side<'a>,
    friction: &[bool],
) -> (Vec<Row>, Vec<[f64; 3]>) {
    let of = |row: &Row| match row.kind {
        Kind::Contact { pair } => pair,
        _ => unreachable!("contact rows are of pairs"),
    };
    let mut taken: Vec<[f64; 3]> = contacts.iter().map(|row| pairs[of(row)].normal).collect();
    let mut found = Vec::new();
    for contact in contacts.iter().filter(|row| friction[pairs[of(row)].contact]) {
        let number = of(contact);
        for (mut row, direction) in friction::rows(number, &pairs[number], sides, &taken) {
            row.lengthen(contact.length);
            // Nodes with one condition have both directions.
            if contacts.len() > 1 {
                taken.push(direction);
            }
            found.push((row, direction));
        }
    }
    found.into_iter().unzip()
}

/// The conditions of each connected component of nodes, and its nodes, by its lowest node.
fn clusters(pairs: &Pairs, ties: &Ties) -> BTreeMap<u64, Cluster> {
    let mut of_node = HashMap::new();
    let mut clusters: BTreeMap<u64, Cluster> = BTreeMap::new();
    for (name, nodes) in components(pairs, ties) {
        of_node.extend(nodes.iter().map(|&node| (node, name)));
        clusters.insert(name, Cluster { nodes, pairs: Vec::new() });
    }
    for (number, pair) in pairs.iter() {
        clusters.get_mut(&of_node[&pair.slave]).expect("every name has its cluster").pairs.push(number);
    }
    clusters
}

/// Keys of blocks with the subdomains of their nodes, in the order of these: what counts for one subdomain is in one place, and
/// neighbours' rows are.
fn by_subdomains<'a>(keys: BTreeSet<u64>, nodes: impl Fn(u64) -> Vec<&'a InterfaceNode>) -> Vec<(Vec<u32>, u64)> {
    let of = |key: u64| -> BTreeSet<u32> { nodes(key).iter().flat_map(|n| n.copies.iter().copied()).collect() };
    let mut keys: Vec<(Vec<u32>, u64)> = keys.into_iter().map(|key| (of(key).into_iter().collect(), key)).collect();
    keys.sort_unstable();
    keys
}

/// For each own subdomain, its nodes with several copies and how many.
fn local_copies(decomposition: &Decomposition) -> Vec<Vec<(u32, u32)>> {
    let mut copies = vec![Vec::new(); decomposition.subdomains.len()];
    for node in decomposition.interface.iter().filter(|n| n.copies.len() > 1) {
        for own in node.copies.iter().filter_map(|&s| decomposition.own_index(s)) {
            let local = decomposition.subdomains[own].local_node(node.node).expect("a copy is in its subdomain");
            copies[own].push((local as u32, node.copies.len() as u32));
        }
    }
    copies
}
