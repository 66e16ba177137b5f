//! Support rows: the mean over a node's copies has a prescribed value.

use super::prescribed::Prescribed;
use super::{ConstraintError, Kind, Row, Support, Term};
use crate::comm::meeting::look_up;
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::InterfaceNode;

/// For each component, the support that fixes it at a node.
pub(super) fn fixed(node: &InterfaceNode, supports: &[Support]) -> [Option<usize>; 3] {
    [0, 1, 2].map(|axis| at(node, supports, axis).next())
}

/// Which components supports fix at some nodes of named surfaces, whoever has them. Collective.
pub fn fixed_at(comm: &dyn Comm, interface: &[InterfaceNode], supports: &[Support], nodes: &[u64]) -> Vec<[bool; 3]> {
    let bits = |node: &InterfaceNode| {
        fixed(node, supports).iter().rev().fold(0, |bits, support| 2 * bits + u64::from(support.is_some()))
    };
    let known = interface.iter().map(|node| ([node.node], bits(node))).filter(|(_, bits)| *bits != 0);
    let found = look_up(comm, known.map(|(node, bits)| (node, vec![bits])), nodes.iter().map(|&node| [node]));
    let of = |node: &u64| found.get(&[*node]).map_or([false; 3], |bits| [0, 1, 2].map(|axis| bits[0] >> axis & 1 == 1));
    nodes.iter().map(of).collect()
}

/// Which components supports fix at some own nodes of named surfaces.
pub fn fixed_here(interface: &[InterfaceNode], supports: &[Support], nodes: &[u64]) -> Vec<[bool; 3]> {
    let of = |node: &u64| {
        let at = interface.binary_search_by_key(node, |known| known.node);
        at.map_or([false; 3], |at| fixed(&interface[at], supports).map(|support| support.is_some()))
    };
    nodes.iter().map(of).collect()
}

/// The supports that fix a component at a node.
fn at(node: &InterfaceNode, supports: &[Support], axis: usize) -> impl Iterator<Item = usize> {
    let holds = move |s: &Support| s.fixed[axis] && node.surfaces.contains(&(s.surface as u32));
    supports.iter().enumerate().filter(move |(_, s)| holds(s)).map(|(index, _)| index)
}

/// Whether supports agree at a time wherever they meet. Collective.
///
/// # Errors
/// If two of them prescribe different values at one node: on every rank, that of the lowest such node.
pub fn check(
    comm: &dyn Comm,
    nodes: &[InterfaceNode],
    supports: &[Support],
    time: &Prescribed,
) -> Result<(), ConstraintError> {
    let value = |support: usize, axis: usize| time.displacements[support][axis];
    let conflict = |node: &InterfaceNode| {
        (0..3).find_map(|axis| {
            let mut fixing = at(node, supports, axis);
            let first = fixing.next()?;
            let second = fixing.find(|&other| value(other, axis) != value(first, axis))?;
            Some([node.node, first as u64, second as u64, axis as u64])
        })
    };
    let mine = nodes.iter().find_map(conflict);
    let all = all_gather_u64(comm, mine.as_slice().as_flattened());
    let Some(lowest) = all.chunks_exact(4).min() else { return Ok(()) };
    let [first, second, axis] = [1, 2, 3].map(|k| lowest[k] as usize);
    Err(ConstraintError::Conflict {
        first: supports[first].name.clone(),
        second: supports[second].name.clone(),
        axis: ['x', 'y', 'z'][axis],
        first_value: value(first, axis),
        second_value: value(second, axis),
    })
}

/// One row for each fixed component: `sum of copies / sqrt(m) = sqrt(m) value`.
pub(super) fn rows(node: &InterfaceNode, fixed: &[Option<usize>; 3]) -> Vec<Row> {
    let root = (node.copies.len() as f64).sqrt();
    let row = |axis: usize, support: usize| Row {
        kind: Kind::Support { support, axis },
        scale: 1.0 / root,
        length: 1.0,
        terms: node
            .copies
            .iter()
            .map(|&subdomain| Term { subdomain, node: node.node, axis, value: 1.0 / root })
            .collect(),
        fixed: Vec::new(),
        parallel: Vec::new(),
    };
    (0..3).filter_map(|axis| fixed[axis].map(|support| row(axis, support))).collect()
}
