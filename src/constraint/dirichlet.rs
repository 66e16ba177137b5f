//! Support rows: the mean over a node's copies has a prescribed value.

use std::collections::HashMap;

use super::{ConstraintError, Kind, Row, Support, Term};
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::InterfaceNode;

/// For each component, the support that fixes it at a node, and the value.
pub(super) fn fixed(node: &InterfaceNode, supports: &[Support]) -> [Option<(usize, f64)>; 3] {
    [0, 1, 2].map(|axis| at(node, supports, axis).next())
}

/// Which components supports fix at some nodes of named surfaces. The nodes are ascending, may be repeated, and are the same
/// on every rank. Collective.
pub fn fixed_at(comm: &dyn Comm, interface: &[InterfaceNode], supports: &[Support], nodes: &[u64]) -> Vec<[bool; 3]> {
    let mut mine = Vec::new();
    for node in interface.iter().filter(|node| nodes.binary_search(&node.node).is_ok()) {
        let fixed = fixed(node, supports).map(|support| u64::from(support.is_some()));
        mine.extend([node.node, fixed[0], fixed[1], fixed[2]]);
    }
    let all = all_gather_u64(comm, &mine);
    let reports = all.as_chunks::<4>().0.iter().map(|&[node, x, y, z]| (node, [x, y, z].map(|fixed| fixed == 1)));
    let found: HashMap<u64, [bool; 3]> = reports.collect();
    nodes.iter().map(|node| found.get(node).copied().unwrap_or_default()).collect()
}

/// The supports that fix a component at a node, and their values.
fn at(node: &InterfaceNode, supports: &[Support], axis: usize) -> impl Iterator<Item = (usize, f64)> {
    let holds = move |s: &Support| s.fixed[axis] && node.surfaces.contains(&(s.surface as u32));
    supports.iter().enumerate().filter(move |(_, s)| holds(s)).map(move |(index, s)| (index, s.displacement[axis]))
}

/// Whether supports agree wherever they meet. Collective.
///
/// # Errors
/// If two supports prescribe different values at a node. Every rank returns the error of the lowest such node.
pub(super) fn check(comm: &dyn Comm, nodes: &[InterfaceNode], supports: &[Support]) -> Result<(), ConstraintError> {
    let conflict = |node: &InterfaceNode| {
        (0..3).find_map(|axis| {
            let mut values = at(node, supports, axis);
            let first = values.next()?;
            let second = values.find(|other| other.1 != first.1)?;
            Some([node.node, first.0 as u64, second.0 as u64, axis as u64])
        })
    };
    let mine = nodes.iter().find_map(conflict);
    let all = all_gather_u64(comm, mine.as_slice().as_flattened());
    let Some(lowest) = all.chunks_exact(4).min() else { return Ok(()) };
    let (first, second) = (&supports[lowest[1] as usize], &supports[lowest[2] as usize]);
    let axis = lowest[3] as usize;
    Err(ConstraintError::Conflict {
        first: first.name.clone(),
        second: second.name.clone(),
        axis: ['x', 'y', 'z'][axis],
        first_value: first.displacement[axis],
        second_value: second.displacement[axis],
    })
}

/// One row for each fixed component: `sum of copies / sqrt(m) = sqrt(m) value`.
pub(super) fn rows(node: &InterfaceNode, fixed: &[Option<(usize, f64)>; 3]) -> Vec<Row> {
    let root = (node.copies.len() as f64).sqrt();
    let row = |axis: usize, support: usize, value: f64| Row {
        kind: Kind::Support { support, axis },
        rhs: root * value,
        scale: 1.0 / root,
        length: 1.0,
        terms: node
            .copies
            .iter()
            .map(|&subdomain| Term { subdomain, node: node.node, axis, value: 1.0 / root })
            .collect(),
        fixed: Vec::new(),
    };
    (0..3).filter_map(|axis| fixed[axis].map(|(support, value)| row(axis, support, value))).collect()
}
