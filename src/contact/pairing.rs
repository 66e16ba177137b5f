//! How two surfaces are paired, and which of them is the slave where nobody says.
//!
//! The slave is the surface whose nodes supports do not hold where the two face each other: held nodes carry no condition.
//! If that does not decide, it is that of a body which is much softer: what hard nodes press on soft faces between them is next to
//! arbitrary where these are coarser. If that does not decide, it is the finer one, on which more conditions fit: the coarser one would
//! let the finer one's nodes enter between its own. If that does not decide either, it is the one named first.

use super::patch::Patch;
use super::{Conditions, ContactError, matching, mortar, quadratic};
use crate::comm::{Comm, sums};

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

/// What finds the conditions of one contact.
#[derive(Clone, Copy)]
pub struct Pairing<'a> {
    /// The ranks.
    pub comm: &'a dyn Comm,
    /// Number of the contact.
    pub contact: usize,
    /// Its name.
    pub name: &'a str,
    /// What supports hold.
    pub held: HeldNodes<'a>,
}

impl Pairing<'_> {
    /// Conditions of the slave's nodes. Collective.
    ///
    /// # Errors
    /// If the surfaces do not face each other, or supports hold all slave nodes that do.
    pub fn pair(&self, slave: &Patch, master: &Patch) -> Result<(Conditions, Rule), ContactError> {
        match (self.matching(slave, master), [slave, master].map(|patch| patch.is_quadratic)) {
            (Some(found), _) if found.count == 0 => Err(ContactError::Apart { name: self.name.to_owned() }),
            (Some(found), [false, false] | [true, true]) => Ok((found, Rule::NodeToNode)),
            _ => Ok((self.mortar(slave, master)?, Rule::Mortar)),
        }
    }

    /// As [`Pairing::pair`], but chooses the slave: its index comes first. The `harder` one is that of a body which is much stiffer than
    /// the other one's, if there is one. Collective.
    ///
    /// # Errors
    /// As there, for either surface as the slave.
    pub fn choose(
        &self,
        [one, other]: [&Patch; 2],
        harder: Option<usize>,
    ) -> Result<(usize, Conditions, Rule), ContactError> {
        let first = self.pair(one, other);
        if let Ok((found, Rule::NodeToNode)) = first {
            return Ok((0, found, Rule::NodeToNode));
        }
        let second = self.pair(other, one);
        let rank =
            |slave, (found, _): &(Conditions, Rule)| (found.held > 0, harder == Some(slave), usize::MAX - found.count);
        match (first, second) {
            (Ok(first), Ok(second)) if rank(1, &second) < rank(0, &first) => Ok((1, second.0, second.1)),
            (Err(_), Ok((found, rule))) => Ok((1, found, rule)),
            (Ok((found, rule)), _) => Ok((0, found, rule)),
            (Err(error), Err(_)) => Err(error),
        }
    }

    /// Conditions node by node; `None` if the surfaces do not match. Collective.
    fn matching(&self, slave: &Patch, master: &Patch) -> Option<Conditions> {
        let [one, other] = [slave, master].map(|patch| &patch.surface);
        let opposite = master.near(self.comm, &matching::lines(one, other.spacing()));
        let back = slave.near(self.comm, &matching::lines(other, one.spacing()));
        let (facing, backwards) = (matching::facing(one, &opposite), matching::facing(other, &back));
        let differs = facing.is_none() || backwards.is_none();
        if sums(self.comm, [u64::from(differs)]) != [0] {
            return None;
        }
        let mut found = matching::conditions(self.contact, one, &opposite, facing?);
        if slave.is_quadratic && master.is_quadratic {
            let count = found.pairs.len();
            found.pairs = quadratic::conditions(one, quadratic::SHARE, found.pairs);
            assert_eq!(found.pairs.len(), count, "covered faces have all their corners");
        }
        [found.count] = sums(self.comm, [found.masters.len() as u64]).map(|count| count as usize);
        Some(found)
    }

    /// Conditions against means. Collective.
    fn mortar(&self, slave: &Patch, master: &Patch) -> Result<Conditions, ContactError> {
        let one = &slave.surface;
        let opposite = master.near(self.comm, &mortar::lines(one));
        let (found, is_opposite) = mortar::conditions(self.contact, one, &opposite, &(self.held)(&one.nodes));
        let all = sums(self.comm, [found.count as u64, found.held as u64, u64::from(is_opposite)]);
        let [count, held, opposite] = all.map(|n| n as usize);
        mortar::accept(self.name, Conditions { count, held, ..found }, opposite > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::contact::mortar::tests::grid;
    use crate::contact::surface::GatheredSurface;

    /// Squares that face each other, of `n` x `n` and `m` x `m` cells.
    fn squares(n: usize, m: usize) -> [GatheredSurface; 2] {
        [grid([n, n], 100, true, |x, y| [x, y, 0.1]), grid([m, m], 900, false, |x, y| [x, y, 0.0])]
    }

    /// Index of the slave, number of conditions and their rule; all of the surfaces in `all_held` is held along z.
    fn chosen(surfaces: &[GatheredSurface; 2], all_held: &[u64]) -> Option<(usize, usize, Rule)> {
        chosen_beside(surfaces, all_held, None)
    }

    /// The same where one may be of a harder body.
    fn chosen_beside(
        [one, other]: &[GatheredSurface; 2],
        all_held: &[u64],
        harder: Option<usize>,
    ) -> Option<(usize, usize, Rule)> {
        let held = |nodes: &[u64]| {
            let all = all_held.contains(&nodes[0]);
            nodes.iter().map(|n| [false, false, all || all_held.contains(n)]).collect()
        };
        let [one, other] = [one, other].map(|surface| Patch::alone(surface.clone()));
        let pairing = Pairing { comm: &Solo, contact: 0, name: "joint", held: &held };
        let found = pairing.choose([&one, &other], harder);
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
    fn the_slave_is_on_the_softer_body_unless_supports_hold_it() {
        let (fine, coarse) = ((0, 25, Rule::Mortar), (1, 16, Rule::Mortar));
        assert_eq!(chosen_beside(&squares(4, 3), &[], Some(0)), Some(coarse));
        assert_eq!(chosen_beside(&squares(4, 3), &[], Some(1)), Some(fine));
        assert_eq!(chosen_beside(&squares(4, 3), &[901], Some(0)), Some(fine));
        assert_eq!(chosen_beside(&squares(4, 3), &[104], Some(1)), Some(coarse));
    }

    #[test]
    fn another_order_of_the_two_is_the_same_contact() {
        let [fine, coarse] = squares(5, 3).map(Patch::alone);
        let free = |nodes: &[u64]| vec![[false; 3]; nodes.len()];
        let pairing = Pairing { comm: &Solo, contact: 0, name: "joint", held: &free };
        let (slave, found, _) = pairing.choose([&fine, &coarse], None).expect("they face each other");
        let (turned, same, _) = pairing.choose([&coarse, &fine], None).expect("they face each other");
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
