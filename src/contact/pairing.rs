//! How two surfaces are paired, and which of them is the slave where nobody says.
//!
//! The slave is the surface whose nodes supports do not hold where the two face each other: held nodes carry no condition.
//! If that does not decide, it is the finer one, on which more conditions fit: the coarser one would let the finer one's nodes
//! enter between its own. If that does not decide either, it is the one named first.

use super::surface::GatheredSurface;
use super::{Conditions, ContactError, ContactPair, matching, mortar, quadratic};

/// What the conditions on the slave nodes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Against the master node opposite: meshes match.
    NodeToNode,
    /// Against weighted means of master nodes.
    Mortar,
}

/// Directions that supports fix at each of some nodes. Collective.
pub type HeldNodes<'a> = &'a dyn Fn(&[u64]) -> Vec<[bool; 3]>;

/// Conditions of contact number `contact`. Collective.
///
/// # Errors
/// If the surfaces do not face each other, or supports hold all slave nodes that do.
pub fn pair(
    contact: usize,
    name: &str,
    slave: &GatheredSurface,
    master: &GatheredSurface,
    held: HeldNodes,
) -> Result<(Conditions, Rule), ContactError> {
    let quadratic = [slave, master].map(|surface| !surface.quadratic.is_empty());
    match (matching::pair(contact, slave, master), quadratic) {
        (Some(found), _) if found.pairs.is_empty() => Err(ContactError::Apart { name: name.to_owned() }),
        (Some(found), [false, false]) => Ok((found, Rule::NodeToNode)),
        (Some(found), [true, true]) => {
            let gap = |pair: &ContactPair, along| quadratic::distance(slave, master, pair, along);
            let count = found.pairs.len();
            let pairs = quadratic::conditions(slave, found.pairs, gap);
            assert_eq!(pairs.len(), count, "covered faces have all their corners");
            Ok((Conditions { pairs, ..found }, Rule::NodeToNode))
        }
        _ => Ok((mortar::pair(contact, name, slave, master, &held(&slave.nodes))?, Rule::Mortar)),
    }
}

/// As [`pair`], but chooses the slave: its index comes first. Collective.
///
/// # Errors
/// As there, for either surface as the slave.
pub fn choose(
    contact: usize,
    name: &str,
    surfaces: [&GatheredSurface; 2],
    held: HeldNodes,
) -> Result<(usize, Conditions, Rule), ContactError> {
    let [one, other] = surfaces;
    let first = pair(contact, name, one, other, held);
    if let Ok((found, Rule::NodeToNode)) = first {
        return Ok((0, found, Rule::NodeToNode));
    }
    let second = pair(contact, name, other, one, held);
    let rank = |(found, _): &(Conditions, Rule)| (found.held > 0, usize::MAX - found.pairs.len());
    match (first, second) {
        (Ok(first), Ok(second)) if rank(&second) < rank(&first) => Ok((1, second.0, second.1)),
        (Err(_), Ok((found, rule))) => Ok((1, found, rule)),
        (Ok((found, rule)), _) => Ok((0, found, rule)),
        (Err(error), Err(_)) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mortar::tests::grid;

    /// Squares that face each other, of `n` x `n` and `m` x `m` cells.
    fn squares(n: usize, m: usize) -> [GatheredSurface; 2] {
        [grid([n, n], 100, true, |x, y| [x, y, 0.1]), grid([m, m], 900, false, |x, y| [x, y, 0.0])]
    }

    /// Index of the slave, number of conditions and their rule; all of the surfaces in `all_held` is held along z.
    fn chosen([one, other]: &[GatheredSurface; 2], all_held: &[u64]) -> Option<(usize, usize, Rule)> {
        let held = |nodes: &[u64]| {
            let all = all_held.contains(&nodes[0]);
            nodes.iter().map(|n| [false, false, all || all_held.contains(n)]).collect()
        };
        let found = choose(0, "joint", [one, other], &held);
        found.ok().map(|(slave, found, rule)| (slave, found.pairs.len(), rule))
    }

    #[test]
    fn the_slave_is_the_surface_that_is_not_held_then_the_finer_one_then_the_first() {
        assert_eq!(chosen(&squares(4, 3), &[]), Some((0, 25, Rule::Mortar)));
        assert_eq!(chosen(&squares(3, 4), &[]), Some((1, 25, Rule::Mortar)));
        // One node held, not the first: the coarser one takes over.
        assert_eq!(chosen(&squares(4, 3), &[104]), Some((1, 16, Rule::Mortar)));
        assert_eq!(chosen(&squares(4, 3), &[104, 901]), Some((0, 24, Rule::Mortar)));
        assert_eq!(chosen(&squares(4, 3), &[100]), Some((1, 16, Rule::Mortar)));
        assert_eq!(chosen(&squares(4, 3), &[100, 900]), None);
        assert_eq!(chosen(&squares(4, 4), &[]), Some((0, 25, Rule::NodeToNode)));
        // As many cells, split otherwise.
        let [one, mut other] = squares(2, 2);
        other.triangles = vec![[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [3, 4, 6], [4, 7, 6], [4, 5, 7], [5, 8, 7]];
        assert_eq!(chosen(&[one, other], &[]), Some((0, 9, Rule::Mortar)));
    }

    #[test]
    fn another_order_of_the_two_is_the_same_contact() {
        let [fine, coarse] = squares(5, 3);
        let free = |nodes: &[u64]| vec![[false; 3]; nodes.len()];
        let (slave, found, _) = choose(0, "joint", [&fine, &coarse], &free).expect("they face each other");
        let (turned, same, _) = choose(0, "joint", [&coarse, &fine], &free).expect("they face each other");
        assert_eq!((slave, turned), (0, 1));
        assert_eq!(found, same);
    }

    #[test]
    fn a_gap_or_distance_that_is_given_is_that_of_surfaces_further_apart() {
        let [one, other] = squares(4, 3);
        let mut further = grid([4, 4], 100, true, |x, y| [x, y, 0.35]);
        let held: Vec<[bool; 3]> = one.nodes.iter().map(|n| [false, false, n % 5 == 0]).collect();
        let found = mortar::pair(0, "joint", &one, &other, &held).expect("they face each other");
        assert_eq!(found.held, 5);
        assert!(found.pairs.iter().any(|pair| pair.slaves.len() > 1));
        further.nodes = one.nodes;
        let expected = mortar::pair(0, "joint", &further, &other, &held).expect("they face each other");
        for (mut pair, expected) in found.pairs.into_iter().zip(expected.pairs) {
            let near = |gap: f64| (gap - expected.gap).abs() < 1e-13;
            pair.gap += 0.25;
            assert!(near(pair.gap));
            pair.gap = 0.35;
            assert!(near(pair.gap));
        }
    }
}
