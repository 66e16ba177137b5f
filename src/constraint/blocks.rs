//! Setting up the rows of one rank, block by block.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::Kind;
use super::contact::Side;
use super::links::{Linked, components};
use super::prescribed::Prescribed;
use super::reach::Reach;
use super::ties::Ties;
use super::{Constraints, Entry, JUMP, Row, Support, Term, contact, dirichlet, friction, gluing};
use crate::comm::{Comm, range};
use crate::contact::known::Pairs;
use crate::decomposition::{Decomposition, InterfaceNode};

/// What one block is made of.
struct Unit {
    /// Subdomains that hold it, ascending.
    holders: Vec<u32>,
    /// Its lowest node.
    key: u64,
    /// Nodes whose own rows are in it.
    nodes: Vec<u64>,
    /// Its contact pairs.
    pairs: Vec<usize>,
    /// Whether it is part of a large component.
    is_part: bool,
}

impl Constraints {
    /// All rows that touch this rank's subdomains. Supports agree (see [`dirichlet::check`]). Of parallel contact conditions that
    /// gives the row which is the tightest at the time `at`. `friction` tells which contacts have any. Collective.
    pub fn new(
        comm: &dyn Comm,
        decomposition: &Decomposition,
        supports: &[Support],
        pairs: &Pairs,
        linked: Linked,
        at: &Prescribed,
        friction: &[bool],
    ) -> Self {
        let Linked { nodes: tied, ties, stiffness, reach, has_large } = linked;
        let young = |subdomain: u32| stiffness.of(subdomain);
        let own: HashMap<u64, &InterfaceNode> = decomposition.interface.iter().map(|n| (n.node, n)).collect();
        let node = |number: u64| tied.get(&number).or_else(|| own.get(&number).copied());
        let side = |number: u64| -> Side<'_> {
            let node = node(number).expect("nodes of conditions are known");
            (node, dirichlet::fixed(node, supports))
        };
        let units = units(own.keys().chain(tied.keys()), pairs, &ties, &reach, node);
        let mut result = Self {
            rows: Vec::new(),
            sliders: Vec::new(),
            blocks: Vec::new(),
            block_subdomains: Vec::new(),
            is_part: Vec::new(),
            has_parts: has_large,
            slot_begin: vec![0],
            slot_subdomain: Vec::new(),
            entries: vec![Vec::new(); decomposition.subdomains.len()],
            copies: local_copies(decomposition),
            has_inequalities: pairs.total() > 0,
            has_friction: friction.contains(&true),
            uneven: stiffness.is_uneven(),
            uneven_contacts: false,
            ties,
            idle: Vec::new(),
            guided: Vec::new(),
        };
        let mut directions = Vec::new();
        for unit in units {
            let mut rows = Vec::new();
            for &number in &unit.nodes {
                let (interface, fixed) = side(number);
                rows.extend(gluing::rows(interface, &decomposition.clusters, young));
                rows.extend(dirichlet::rows(interface, &fixed));
            }
            let mut contacts: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
            for &number in &unit.pairs {
                let pair = &pairs[number];
                match contact::row(number, pair, &side) {
                    Ok(row) => {
                        contact::add_tightest(contacts.entry(pair.slave).or_default(), row, at);
                        if friction[pair.contact] {
                            result.guided.extend(friction::guided(number, pair, &side));
                        }
                    }
                    Err(held) => result.idle.push((number, held)),
                }
            }
            rows.iter_mut().for_each(|row| row.weigh(young, stiffness.largest));
            for mut of_node in contacts.into_values() {
                of_node.iter_mut().for_each(|row| row.weigh(young, stiffness.largest));
                let (more, along) = friction_rows(&of_node, pairs, &side, friction);
                directions.extend(along);
                rows.extend(of_node.into_iter().chain(more));
            }
            result.push_block(rows, unit, decomposition);
        }
        result.find_sliders(pairs, directions);
        result.uneven_contacts = uneven_contacts(comm, &result.rows);
        result
    }

    /// Appends the rows of a block; nothing if it has none.
    fn push_block(&mut self, rows: Vec<Row>, unit: Unit, decomposition: &Decomposition) {
        if rows.is_empty() {
            return;
        }
        self.blocks.push(self.rows.len()..self.rows.len() + rows.len());
        self.block_subdomains.push(unit.holders);
        self.is_part.push(unit.is_part);
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

    /// What no other of the scene's blocks is called.
    pub fn name(&self, block: &std::ops::Range<usize>) -> [u64; 2] {
        let first = &self.rows[block.start];
        match first.kind {
            Kind::Contact { pair } | Kind::Friction { pair, .. } => [1, pair as u64],
            Kind::Gluing | Kind::Support { .. } => [0, first.terms[0].node],
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

/// What the blocks of a rank are made of, in the order of the subdomains that hold them: what counts for one subdomain is in one place,
/// and neighbours' rows are. Large components are cut into the own rows of each node, and the conditions of each slave node.
fn units<'a>(
    nodes: impl Iterator<Item = &'a u64>,
    pairs: &Pairs,
    ties: &Ties,
    reach: &Reach,
    node: impl Fn(u64) -> Option<&'a InterfaceNode>,
) -> Vec<Unit> {
    let subdomains = |nodes: &BTreeSet<u64>| -> Vec<u32> {
        let copies = nodes.iter().filter_map(|&number| node(number)).flat_map(|known| known.copies.iter().copied());
        copies.collect::<BTreeSet<u32>>().into_iter().collect()
    };
    let whole = |key: u64, of: &BTreeSet<u64>| Unit {
        holders: subdomains(of),
        key,
        nodes: of.iter().copied().filter(|&number| node(number).is_some()).collect(),
        pairs: Vec::new(),
        is_part: false,
    };
    let mut units: BTreeMap<(u64, bool), Unit> = BTreeMap::new();
    // The unit of each node that is tied to others.
    let mut of_node: HashMap<u64, u64> = HashMap::new();
    for (name, of) in components(pairs, ties) {
        if !of.iter().any(|node| reach.nodes.contains_key(node)) {
            of_node.extend(of.iter().map(|&node| (node, name)));
            units.insert((name, false), whole(name, &of));
        }
    }
    for &number in nodes {
        if let Some(holders) = reach.nodes.get(&number) {
            let unit =
                || Unit { holders: holders.clone(), key: number, nodes: vec![number], pairs: vec![], is_part: true };
            units.entry((number, false)).or_insert_with(unit);
        } else if !of_node.contains_key(&number) {
            units.insert((number, false), whole(number, &BTreeSet::from([number])));
        }
    }
    for (number, pair) in pairs.iter() {
        let unit = match of_node.get(&pair.slave) {
            Some(name) => units.get_mut(&(*name, false)).expect("every component has its unit"),
            None => units.entry((pair.slave, true)).or_insert_with(|| Unit {
                holders: reach.slaves[&pair.slave].clone(),
                key: pair.slave,
                nodes: Vec::new(),
                pairs: Vec::new(),
                is_part: true,
            }),
        };
        unit.pairs.push(number);
    }
    let mut units: Vec<Unit> = units.into_values().collect();
    // The own rows of a node come before conditions.
    units.sort_by(|a, b| (&a.holders, a.key).cmp(&(&b.holders, b.key)));
    units
}

/// Whether rows of contact are of unequal length, on whatever ranks. Collective.
fn uneven_contacts(comm: &dyn Comm, rows: &[Row]) -> bool {
    let lengths = rows.iter().filter(|row| matches!(row.kind, Kind::Contact { .. })).map(|row| row.length);
    let [shortest, longest] = range(comm, lengths);
    longest * longest > JUMP * shortest * shortest
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
