//! Nodes that are stopped in several directions: their conditions must be independent.
//!
//! A node has three components, fewer where supports hold it, and cannot meet more obstacles than that in different
//! directions, nor one other node in more smooth parts of its surface (the tip of a pyramid): the forces would not be unique,
//! and the dual problem singular on any set that holds them all. Conditions
//! of one direction are no matter, the tightest stands for all ([`crate::constraint::contact`]).

use std::collections::BTreeMap;

use super::surface::unit;
use super::{ContactError, ContactPair};
use crate::comm::{Comm, of_ranks};
use crate::vector::{difference, dot, length};

/// Distance of a unit vector to the others or to their span from which a direction counts as independent.
const INDEPENDENT: f64 = 1e-6;

/// Refuses directions that are too many for a node. Each rank has all conditions of some slave nodes, no two of them of the same
/// one; `held` tells which components of these supports fix. Collective.
///
/// # Errors
/// With the contacts that meet at the first such node.
pub fn check<'a>(
    comm: &dyn Comm,
    names: &[String],
    pairs: impl IntoIterator<Item = &'a ContactPair>,
    held: impl Fn(&[u64]) -> Vec<[bool; 3]>,
) -> Result<(), ContactError> {
    let crowded = crowded(pairs, held);
    let mut mine = vec![crowded.len() as u64];
    if let Some(((slave, master), contacts)) = crowded.first() {
        // What meets no node comes before what meets one.
        mine.extend([*slave, u64::from(master.is_some()), master.unwrap_or_default()]);
        mine.extend(contacts.iter().map(|&contact| contact as u64));
    }
    let all = of_ranks(comm, &mine);
    let nodes = all.iter().map(|of_rank| of_rank[0] as usize).sum();
    let Some(first) = all.iter().filter(|of_rank| of_rank[0] > 0).min_by_key(|of_rank| &of_rank[1..]) else {
        return Ok(());
    };
    let contacts: Vec<&str> = first[4..].iter().map(|&contact| &names[contact as usize][..]).collect();
    Err(ContactError::Crowded { names: contacts.join(", "), nodes })
}

/// What a condition stops: a slave node against nothing but the other side itself, or against one node of it.
type Stopped = (u64, Option<u64>);

/// What is stopped in too many directions, ascending, and by which contacts.
fn crowded<'a>(
    pairs: impl IntoIterator<Item = &'a ContactPair>,
    held: impl Fn(&[u64]) -> Vec<[bool; 3]>,
) -> Vec<(Stopped, Vec<usize>)> {
    let mut stopped: BTreeMap<Stopped, Vec<&ContactPair>> = BTreeMap::new();
    for pair in pairs.into_iter().filter(|pair| pair.masters.len() <= 1) {
        stopped.entry((pair.slave, pair.masters.first().map(|(node, _)| *node))).or_default().push(pair);
    }
    stopped.retain(|_, pairs| pairs.len() > 1);
    let nodes: Vec<u64> = stopped.keys().map(|(slave, _)| *slave).collect();
    let mut crowded = Vec::new();
    for ((key, pairs), held) in stopped.into_iter().zip(held(&nodes)) {
        let free = |pair: &ContactPair| unit(std::array::from_fn(|a| if held[a] { 0.0 } else { pair.normal[a] }));
        let mut directions: Vec<[f64; 3]> = Vec::new();
        for direction in pairs.iter().filter_map(|pair| free(pair)) {
            if directions.iter().all(|known| length(difference(direction, *known)) > INDEPENDENT) {
                directions.push(direction);
            }
        }
        if directions.len() > rank(&directions) {
            let mut contacts: Vec<usize> = pairs.iter().map(|pair| pair.contact).collect();
            contacts.dedup();
            crowded.push((key, contacts));
        }
    }
    crowded
}

/// Directions that are independent of those before them.
fn rank(directions: &[[f64; 3]]) -> usize {
    let mut basis: Vec<[f64; 3]> = Vec::new();
    for direction in directions {
        let mut rest = *direction;
        for b in &basis {
            let along = dot(rest, *b);
            rest.iter_mut().zip(b).for_each(|(r, b)| *r -= along * b);
        }
        if length(rest) > INDEPENDENT {
            basis.extend(unit(rest));
        }
    }
    basis.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;

    fn checked(normals: &[[f64; 3]], held: [bool; 3]) -> Result<(), ContactError> {
        let alone = against(&[], normals, held);
        assert_eq!(alone, against(&[(8, 1.0)], normals, held), "obstacles, or parts of a surface against one node");
        alone
    }

    fn against(masters: &[(u64, f64)], normals: &[[f64; 3]], held: [bool; 3]) -> Result<(), ContactError> {
        let names: Vec<String> = (0..normals.len()).map(|k| format!("wall-{k}")).collect();
        let pair = |(contact, &normal): (usize, &[f64; 3])| ContactPair {
            contact,
            slave: 7,
            part: 0,
            slaves: vec![(7, 1.0)],
            masters: masters.to_vec(),
            vectors: Vec::new(),
            normal: unit(normal).expect("not zero"),
            gap: 0.0,
            area: 1.0,
            limit_area: 1.0,
            covered: true,
        };
        let pairs: Vec<ContactPair> = normals.iter().enumerate().map(pair).collect();
        check(&Solo, &names, &pairs, |nodes| vec![held; nodes.len()])
    }

    #[test]
    fn a_node_may_be_stopped_in_as_many_directions_as_it_is_free() {
        let corner = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.2, 1.0]];
        let crowded = |names: &str| Err(ContactError::Crowded { names: names.into(), nodes: 1 });
        assert_eq!(checked(&corner, [false; 3]), Ok(()));
        let four = [&corner[..], &[[1.0, 1.0, 1.0]]].concat();
        assert_eq!(checked(&four, [false; 3]), crowded("wall-0, wall-1, wall-2, wall-3"));
        // A groove whose bottom is a third wall in one plane with its sides.
        let groove = [[1.0, 0.0, -1.0], [-1.0, 0.0, -1.0], [0.0, 0.0, -1.0]];
        assert_eq!(checked(&groove, [false; 3]), crowded("wall-0, wall-1, wall-2"));
        assert_eq!(checked(&groove[..2], [false; 3]), Ok(()));
        assert_eq!(checked(&corner, [true, false, false]), Ok(()), "one is held already");
        assert_eq!(checked(&groove[..2], [true, true, false]), Ok(()), "what is left has one direction");
        assert_eq!(checked(&corner[..2], [true, false, true]), Ok(()));
        assert_eq!(checked(&[[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]], [true, false, true]), crowded("wall-0, wall-1"));
        assert_eq!(checked(&[corner[0], corner[0], corner[1]], [false; 3]), Ok(()), "twice the same");
    }
}
