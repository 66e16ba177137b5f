//! What is known of the subdomains that share nodes with own ones.

use std::collections::HashMap;

use super::Decomposition;
use crate::comm::Comm;

impl Decomposition {
    /// A number of each own subdomain, and of each that has a copy of one of their nodes, from its owner. Collective.
    pub fn of_neighbours(&self, comm: &dyn Comm, mine: &[u64]) -> HashMap<u32, u64> {
        let rank = comm.rank();
        // Who shares a node with whom is mutual: each sends what the others need.
        let mut outgoing: Vec<Vec<u32>> = vec![Vec::new(); comm.size()];
        for copies in self.interface.iter().map(|node| &node.copies).filter(|copies| copies.len() > 1) {
            let owners = || copies.iter().map(|&copy| (copy, self.owner(copy)));
            for (_, other) in owners().filter(|(_, owner)| *owner != rank) {
                outgoing[other].extend(owners().filter(|(_, owner)| *owner == rank).map(|(copy, _)| copy));
            }
        }
        let pack = |mut copies: Vec<u32>| {
            copies.sort_unstable();
            copies.dedup();
            let of = |copy: u32| mine[self.own_index(copy).expect("it is an own one")];
            copies.into_iter().flat_map(|copy| [u64::from(copy), of(copy)]).collect()
        };
        let incoming = comm.all_to_all(outgoing.into_iter().map(pack).collect());
        let others = incoming.iter().flat_map(|message| message.as_chunks::<2>().0.iter().map(|&[s, x]| (s as u32, x)));
        let own = self.subdomains.iter().map(|subdomain| subdomain.id as u32).zip(mine.iter().copied());
        own.chain(others).collect()
    }

    /// The rank that owns a subdomain.
    pub fn owner(&self, subdomain: u32) -> usize {
        self.shares.owner(subdomain as usize)
    }

    /// The ranks that own some of these subdomains, which are ascending.
    pub fn owners(&self, subdomains: &[u32]) -> Vec<usize> {
        let mut ranks: Vec<usize> = subdomains.iter().map(|&subdomain| self.owner(subdomain)).collect();
        ranks.dedup();
        ranks
    }
}

#[cfg(test)]
mod tests {
    use crate::fixture::{RANKS, on_ranks, two_bricks, two_bricks_by_metis};

    #[test]
    fn numbers_of_all_copies_of_own_nodes_are_known_and_those_of_others_not() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(13)] {
            for ranks in RANKS {
                on_ranks(&scene, ranks, |setup| {
                    let decomposition = &setup.discrete.decomposition;
                    let mine: Vec<u64> = setup.subdomains().iter().map(|s| 100 + s.id as u64).collect();
                    let found = decomposition.of_neighbours(setup.comm, &mine);
                    let mut expected: Vec<u32> = setup.subdomains().iter().map(|s| s.id as u32).collect();
                    expected.extend(decomposition.interface.iter().flat_map(|node| &node.copies));
                    expected.sort_unstable();
                    expected.dedup();
                    assert_eq!(found.len(), expected.len());
                    assert!(expected.iter().all(|subdomain| found[subdomain] == 100 + u64::from(*subdomain)));
                });
            }
        }
    }
}
