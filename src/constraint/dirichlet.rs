//! Support rows: the mean over a node's copies has a prescribed value.

use super::{ConstraintError, Kind, Row, Support, Term};
use crate::decomposition::InterfaceNode;

/// For each component, the support that fixes it at a node, and the value.
///
/// # Errors
/// If two supports prescribe different values there.
pub(super) fn fixed(node: &InterfaceNode, supports: &[Support]) -> Result<[Option<(usize, f64)>; 3], ConstraintError> {
    let mut result: [Option<(usize, f64)>; 3] = [None; 3];
    for (index, support) in supports.iter().enumerate() {
        if !node.surfaces.contains(&(support.surface as u32)) {
            continue;
        }
        for axis in (0..3).filter(|&a| support.fixed[a]) {
            let value = support.displacement[axis];
            match result[axis] {
                None => result[axis] = Some((index, value)),
                Some((_, other)) if other == value => {}
                Some((first, other)) => {
                    return Err(ConstraintError::Conflict {
                        first: supports[first].name.clone(),
                        second: support.name.clone(),
                        axis: ['x', 'y', 'z'][axis],
                        first_value: other,
                        second_value: value,
                    });
                }
            }
        }
    }
    Ok(result)
}

/// One row for each fixed component: `sum of copies / sqrt(m) = sqrt(m) value`.
pub(super) fn rows(node: &InterfaceNode, fixed: &[Option<(usize, f64)>; 3]) -> Vec<Row> {
    let root = (node.copies.len() as f64).sqrt();
    let row = |axis: usize, support: usize, value: f64| Row {
        kind: Kind::Support { support, axis },
        rhs: root * value,
        scale: 1.0 / root,
        terms: node
            .copies
            .iter()
            .map(|&subdomain| Term { subdomain, node: node.node, axis, value: 1.0 / root })
            .collect(),
    };
    (0..3).filter_map(|axis| fixed[axis].map(|(support, value)| row(axis, support, value))).collect()
}
