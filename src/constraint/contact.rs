//! Contact rows: `normal . (weighted means over the copies of the slave side's nodes - the master's) <= gap`, made a unit
//! vector.
//!
//! Components that a support fixes leave the row and go to its right-hand side: contact rows stay orthogonal to
//! support rows and the active rows independent. Of rows with one direction (a node that meets two obstacles alike) only
//! the tightest counts, which implies the others.

use super::{Fixed, Kind, Row, Term};
use crate::contact::ContactPair;
use crate::decomposition::InterfaceNode;

/// One node of a contact, and for each component the support that fixes it, with the value (length).
pub(super) type Side<'a> = (&'a InterfaceNode, [Option<(usize, f64)>; 3]);

/// Rows with a cosine above this are parallel.
const PARALLEL: f64 = 1.0 - 1e-12;

/// Nodes of a pair and their factors in its condition.
pub(super) fn nodes(pair: &ContactPair) -> impl Iterator<Item = (u64, f64)> {
    let masters = pair.masters.iter().map(|(node, weight)| (*node, -weight));
    pair.slaves.iter().copied().chain(masters)
}

/// The row of pair `number`; `sides` gives its nodes by their global number.
///
/// # Errors
/// If supports fix all nodes along the normal: the distance that is left for good (length).
pub(super) fn row<'a>(number: usize, pair: &ContactPair, sides: impl Fn(u64) -> Side<'a>) -> Result<Row, f64> {
    let mut rhs = pair.gap;
    let (mut terms, mut moved) = (Vec::new(), Vec::new());
    let mut square = 0.0;
    for (node, factor) in nodes(pair) {
        let (node, fixed) = sides(node);
        let weight = factor / node.copies.len() as f64;
        for (axis, (component, support)) in pair.normal.into_iter().zip(fixed).enumerate() {
            match support {
                Some((support, value)) => {
                    let weight = factor * component;
                    rhs -= weight * value;
                    moved.push(Fixed { support, axis, weight });
                }
                None if component == 0.0 => {}
                None => {
                    square += component * component * factor * factor / node.copies.len() as f64;
                    let term = |&subdomain| Term { subdomain, node: node.node, axis, value: weight * component };
                    terms.extend(node.copies.iter().map(term));
                }
            }
        }
    }
    // What is left of the normal is round-off: the direction is fixed.
    if square < 1e-16 {
        return Err(rhs);
    }
    let scale = 1.0 / square.sqrt();
    terms.iter_mut().for_each(|term| term.value *= scale);
    Ok(Row { kind: Kind::Contact { pair: number }, rhs: scale * rhs, scale, length: 1.0, terms, fixed: moved })
}

/// Adds a row to those of the same slave node. Of two parallel rows only the one with the smaller gap stays.
pub(super) fn add_tightest(rows: &mut Vec<Row>, row: Row) {
    let same = |a: &Term, b: &Term| (a.subdomain, a.node, a.axis) == (b.subdomain, b.node, b.axis);
    let parallel = |other: &&mut Row| {
        other.terms.len() == row.terms.len()
            && other.terms.iter().zip(&row.terms).all(|(a, b)| same(a, b))
            && other.terms.iter().zip(&row.terms).map(|(a, b)| a.value * b.value).sum::<f64>() > PARALLEL
    };
    match rows.iter_mut().find(parallel) {
        Some(other) if other.rhs <= row.rhs => {}
        Some(other) => *other = row,
        None => rows.push(row),
    }
}
