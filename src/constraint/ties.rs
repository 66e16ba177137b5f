//! Groups of nodes that short edges tie together.
//!
//! In flat or needle-like elements the ends of a short edge hardly move against each other. A force on one end moves both,
//! so the diagonal of the stiffness at one node is far larger than its resistance. The scaling of the preconditioner
//! therefore treats such nodes as a group, and their rows are in one block.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::components::Components;
use crate::comm::meeting::{each_packed, pack};
use crate::comm::{Comm, maximum};
use crate::decomposition::{Decomposition, Subdomain};
use crate::mesh::Elements;

/// An edge is short if the longest edge of its element is more than this many times as long (1.7 times in a cube cut into
/// tetrahedra).
const SHORT: f64 = 4.0;
/// Larger groups are not formed: their dense blocks would cost more than they save.
const MOST: usize = 32;

/// A group of an own subdomain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Local nodes, ascending.
    pub nodes: Vec<u32>,
    /// Places among them of those on the interface.
    pub on_interface: Vec<u32>,
}

/// The groups that have nodes on the interface: those that have a node in a block of this rank.
pub struct Ties {
    /// Groups of each own subdomain.
    own: Vec<Vec<Group>>,
    /// Nodes on the interface of each group that is known here, by its subdomain and its number there.
    known: BTreeMap<(u32, u32), Vec<u64>>,
    /// Where a copy of a node is: the number of its group among those known here, in their order, and its place among those on the
    /// interface.
    place: HashMap<(u32, u64), (u32, u32)>,
    /// Most nodes on the interface that a group has, on any rank.
    widest: usize,
}

impl Ties {
    /// Those of the subdomains that have copies of own nodes. Collective.
    pub fn new(comm: &dyn Comm, decomposition: &Decomposition) -> Self {
        let on_interface = |node| decomposition.interface.binary_search_by_key(&node, |n| n.node).is_ok();
        let of_subdomain = |subdomain: &Subdomain| {
            let local = |nodes: Vec<u32>| {
                let there = (0..).zip(&nodes).filter(|(_, node)| on_interface(subdomain.nodes[**node as usize]));
                Group { on_interface: there.map(|(place, _)| place).collect(), nodes }
            };
            let groups = groups(&subdomain.elements, &subdomain.shape).into_iter().map(local);
            groups.filter(|group| !group.on_interface.is_empty()).collect()
        };
        let own: Vec<Vec<Group>> = decomposition.subdomains.iter().map(of_subdomain).collect();
        let mut known = BTreeMap::new();
        for (subdomain, groups) in decomposition.subdomains.iter().zip(&own) {
            for (number, group) in (0..).zip(groups) {
                let node = |&k: &u32| subdomain.nodes[group.nodes[k as usize] as usize];
                known.insert((subdomain.id as u32, number), group.on_interface.iter().map(node).collect::<Vec<u64>>());
            }
        }
        let widest = known.values().map(Vec::len).max().unwrap_or(0);
        let widest = maximum(comm, &[widest as f64])[0] as usize;
        let mut outgoing = vec![Vec::new(); comm.size()];
        for (group, nodes) in &known {
            let copies = nodes.iter().flat_map(|node| {
                let at = decomposition.interface.binary_search_by_key(node, |n| n.node).expect("it is there");
                &decomposition.interface[at].copies
            });
            let ranks: BTreeSet<usize> = copies.map(|&copy| decomposition.owner(copy)).collect();
            ranks.into_iter().for_each(|rank| pack_group(*group, nodes, &mut outgoing[rank]));
        }
        let mut ties = Self { own, known, place: HashMap::new(), widest };
        ties.unpack(comm.all_to_all(outgoing));
        ties
    }

    /// Groups of own subdomains that have a node for which this holds, as numbers, for sending.
    pub fn pack(&self, first: u32, has: impl Fn(u64) -> bool, message: &mut Vec<u64>) {
        let last = first + self.own.len() as u32;
        let own = self.known.range((first, 0)..(last, 0)).filter(|(_, nodes)| nodes.iter().any(|&node| has(node)));
        own.for_each(|(group, nodes)| pack_group(*group, nodes, message));
    }

    /// Adds groups that ranks have packed one behind the other.
    pub fn unpack(&mut self, messages: Vec<Vec<u64>>) {
        for message in messages {
            each_packed(&message, |[subdomain, number], nodes| {
                self.known.insert((subdomain as u32, number as u32), nodes.to_vec());
            });
        }
        self.place.clear();
        for (number, ((subdomain, _), nodes)) in (0..).zip(&self.known) {
            for (k, &node) in (0..).zip(nodes) {
                assert!(self.place.insert((*subdomain, node), (number, k)).is_none(), "groups have no node in common");
            }
        }
    }

    /// Groups of an own subdomain.
    pub fn of_own(&self, own: usize) -> &[Group] {
        &self.own[own]
    }

    /// Each group that is known here, by its subdomain and its number there, with its nodes on the interface.
    pub fn iter(&self) -> impl Iterator<Item = ((u32, u32), &[u64])> {
        self.known.iter().map(|(&group, nodes)| (group, nodes.as_slice()))
    }

    /// Most nodes on the interface that a group has, on any rank; 0 if there are no groups.
    pub fn widest(&self) -> usize {
        self.widest
    }

    /// The number of the group of a copy of a node, and its place among those on the interface.
    pub fn place(&self, subdomain: u32, node: u64) -> Option<(u32, u32)> {
        self.place.get(&(subdomain, node)).copied()
    }
}

fn pack_group((subdomain, number): (u32, u32), nodes: &[u64], message: &mut Vec<u64>) {
    pack([subdomain, number].map(u64::from), nodes, message);
}

/// Groups of nodes, ascending, of elements on nodes at these points.
fn groups(elements: &Elements, points: &[[f64; 3]]) -> Vec<Vec<u32>> {
    // Between the nodes of a quadratic element is half an edge.
    let short = SHORT * elements.kind().degree() as f64;
    let square = |a: u32, b: u32| -> f64 {
        let (a, b) = (points[a as usize], points[b as usize]);
        (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum()
    };
    let mut components = Components::default();
    for element in elements.iter() {
        let pairs = || element.iter().enumerate().flat_map(|(k, &a)| element[..k].iter().map(move |&b| (a, b)));
        let longest = pairs().map(|(a, b)| square(a, b)).fold(0.0, f64::max);
        for (a, b) in pairs().filter(|&(a, b)| square(a, b) * short * short < longest) {
            components.join(a.into(), b.into());
        }
    }
    let groups = components.members().into_values().map(|nodes| nodes.into_iter().map(|node| node as u32).collect());
    groups.filter(|group: &Vec<u32>| group.len() <= MOST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Kind;
    use crate::fixture::{RANKS, on_ranks, two_bricks};

    /// Cells in a row along x, of unit length and width and this height.
    fn row_of_cells(count: u32, height: f64) -> (Elements, Vec<[f64; 3]>) {
        let at = |x: u32, y: u32, z: u32| 4 * x + 2 * y + z;
        let cell = |x: u32| {
            let base = |z| [at(x, 0, z), at(x + 1, 0, z), at(x + 1, 1, z), at(x, 1, z)];
            [base(0), base(1)].concat()
        };
        let elements = Elements::new(Kind::Hex8, (0..count).flat_map(cell).collect());
        let point = |n: u32| [f64::from(n / 4), f64::from(n / 2 % 2), height * f64::from(n % 2)];
        (elements, (0..4 * (count + 1)).map(point).collect())
    }

    #[test]
    fn ends_of_short_edges_are_a_group() {
        let (elements, points) = row_of_cells(3, 0.1);
        let found = groups(&elements, &points);
        assert_eq!(found, (0..8).map(|k| vec![2 * k, 2 * k + 1]).collect::<Vec<_>>());
        let (elements, points) = row_of_cells(3, 0.5);
        assert!(groups(&elements, &points).is_empty());
    }

    #[test]
    fn large_groups_are_left_alone() {
        for (count, expected) in [(15, 2), (16, 0)] {
            let (elements, mut points) = row_of_cells(count, 1.0);
            // Needles along z: all corners below are a group, all above.
            points.iter_mut().for_each(|point| (point[0], point[1]) = (1e-3 * point[0], 1e-3 * point[1]));
            assert_eq!(groups(&elements, &points).len(), expected, "{count}");
        }
    }

    #[test]
    fn ranks_know_the_groups_of_the_subdomains_that_share_their_nodes() {
        let flat = ["body.upper.brick.size.2=0.2"];
        for scene in [two_bricks(&flat), two_bricks(&["decomposition.subdomains=7", flat[0]])] {
            let mut groups = Vec::new();
            for ranks in RANKS {
                let found = on_ranks(&scene, ranks, |setup| {
                    let ties = Ties::new(setup.comm, &setup.discrete.decomposition);
                    let mut own = 0;
                    for (k, subdomain) in setup.subdomains().iter().enumerate() {
                        for group in ties.of_own(k) {
                            let node = |k: &u32| subdomain.nodes[group.nodes[*k as usize] as usize];
                            let (number, place) =
                                ties.place(subdomain.id as u32, node(&group.on_interface[0])).unwrap();
                            assert_eq!(place, 0);
                            let nodes: Vec<u64> = group.on_interface.iter().map(node).collect();
                            assert_eq!(ties.iter().nth(number as usize).map(|(_, nodes)| nodes), Some(&nodes[..]));
                            assert_eq!(subdomain.body, 1, "the lower brick's cells are cubes");
                            own += 1;
                        }
                    }
                    let interface = setup.discrete.decomposition.interface.iter().map(|node| node.node).collect();
                    (own, ties.known, interface)
                });
                let all: BTreeMap<(u32, u32), Vec<u64>> =
                    found.iter().flat_map(|(_, known, _)| known.clone()).collect();
                assert!(!all.is_empty());
                assert_eq!(found.iter().map(|(own, ..)| own).sum::<usize>(), all.len());
                for (_, known, interface) in &found {
                    let touches = |nodes: &Vec<u64>| nodes.iter().any(|node| BTreeSet::contains(interface, node));
                    assert!(known.keys().eq(all.iter().filter(|(_, nodes)| touches(nodes)).map(|(group, _)| group)));
                }
                groups.push(all);
            }
            assert!(groups.iter().all(|all| *all == groups[0]), "whatever the ranks");
        }
    }
}
