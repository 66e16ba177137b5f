//! Which subdomains are congruent: equal shape, connectivity and material within one body, so that what depends on these
//! alone is the same.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::Subdomain;
use crate::comm::Comm;
use crate::comm::meeting::count;

/// A number for each own subdomain that has congruent ones, here or on other ranks: equal for the congruent ones among
/// the own. Whether a subdomain has one does not depend on the ranks. Collective.
pub fn twins(comm: &dyn Comm, subdomains: &[Subdomain]) -> Vec<Option<usize>> {
    let mine: Vec<[u64; 1]> = subdomains.iter().map(|subdomain| [hash(subdomain)]).collect();
    let all = count(comm, &mine);
    let mut kinds: HashMap<[u64; 1], Vec<usize>> = HashMap::new();
    mine.iter()
        .enumerate()
        .map(|(own, hash)| {
            if all[hash] == 1 {
                return None;
            }
            let firsts = kinds.entry(*hash).or_default();
            let first = firsts.iter().copied().find(|&first| congruent(&subdomains[first], &subdomains[own]));
            Some(first.unwrap_or_else(|| {
                firsts.push(own);
                own
            }))
        })
        .collect()
}

/// For each own subdomain, how many congruent ones there are whose rows touch the same local unknowns (`boundaries`),
/// itself included, on all ranks together. Collective.
pub fn alike(comm: &dyn Comm, subdomains: &[Subdomain], boundaries: &[Vec<u32>]) -> Vec<usize> {
    let kind = |(subdomain, boundary)| {
        let mut hasher = DefaultHasher::new();
        (hash(subdomain), boundary).hash(&mut hasher);
        [hasher.finish()]
    };
    let mine: Vec<[u64; 1]> = subdomains.iter().zip(boundaries).map(kind).collect();
    let all = count(comm, &mine);
    mine.iter().map(|kind| all[kind] as usize).collect()
}

fn congruent(a: &Subdomain, b: &Subdomain) -> bool {
    (a.body, a.material) == (b.body, b.material) && a.shape == b.shape && a.elements == b.elements
}

fn hash(subdomain: &Subdomain) -> u64 {
    let mut hasher = DefaultHasher::new();
    (subdomain.body, subdomain.material).hash(&mut hasher);
    subdomain.elements.hash(&mut hasher);
    subdomain.shape.iter().flatten().for_each(|x| x.to_bits().hash(&mut hasher));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{RANKS, on_ranks, two_bricks, two_bricks_by_metis};

    #[test]
    fn boxes_of_one_body_are_twins_wherever_they_are() {
        // Coordinates in thirds are rounded differently in every box.
        let thirds = two_bricks(&[
            "body.lower.brick.size=[1.0, 1.0, 1.0]",
            "body.lower.brick.origin=[0.1, 0.7, -123.4]",
            "body.lower.brick.cells=[6, 6, 6]",
            "body.upper.brick.origin=[0.1, 0.7, -122.4]",
            "body.upper.brick.size=[2.0, 2.0, 2.0]",
        ]);
        for ranks in RANKS {
            let found = on_ranks(&thirds, ranks, |setup| {
                let twins = twins(setup.comm, setup.subdomains());
                for (own, twin) in twins.iter().enumerate() {
                    let first = twin.expect("it has twins");
                    assert_eq!(setup.subdomains()[first].body, setup.subdomains()[own].body);
                    assert!(twins[..own].iter().all(|other| other.is_some_and(|o| setup.subdomains()[o].body == 0)
                        != (setup.subdomains()[own].body == 0)
                        || *other == *twin));
                }
                twins.len()
            });
            assert_eq!(found.iter().sum::<usize>(), 27 + 2);
        }
    }

    #[test]
    fn boxes_with_equal_neighbourhoods_are_alike() {
        let long = two_bricks(&["body.lower.brick.cells=[12, 2, 2]", "body.upper.brick.cells=[2, 2, 2]"]);
        for ranks in RANKS {
            let found = on_ranks(&long, ranks, |setup| {
                let boundaries = setup.gather.boundaries();
                let body = |s: &Subdomain| s.body;
                let alike = alike(setup.comm, setup.subdomains(), &boundaries);
                setup.subdomains().iter().map(body).zip(alike).collect::<Vec<_>>()
            });
            let mut lower: Vec<usize> = found.concat().into_iter().filter(|(b, _)| *b == 0).map(|(_, n)| n).collect();
            lower.sort_unstable();
            assert_eq!(lower, [1, 1, 4, 4, 4, 4], "one is held, one has no neighbour on one side");
        }
    }

    #[test]
    fn a_part_of_its_own_shape_has_none() {
        for ranks in RANKS {
            let found = on_ranks(&two_bricks_by_metis(7), ranks, |setup| {
                let alone = |own: usize| {
                    let all: Vec<bool> = (0..setup.subdomains().len())
                        .map(|k| congruent(&setup.subdomains()[k], &setup.subdomains()[own]))
                        .collect();
                    all.iter().filter(|same| **same).count() == 1
                };
                let twins = twins(setup.comm, setup.subdomains());
                assert!(setup.comm.size() > 1 || (0..twins.len()).all(|own| twins[own].is_none() == alone(own)));
                twins.iter().map(Option::is_some).collect::<Vec<_>>()
            });
            assert!(found.concat().contains(&false));
        }
    }
}
