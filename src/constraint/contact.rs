//! Contact rows: `normal . (mean of the slave's copies - mean of the master's) <= gap`, made a unit vector.
//!
//! Components that a support fixes leave the row and go to its right-hand side: contact rows stay orthogonal to
//! support rows and the active rows independent.

use super::{Kind, Row, Term};
use crate::contact::ContactPair;
use crate::decomposition::InterfaceNode;

/// One side of a contact: the node and what supports fix there.
pub(super) type Side<'a> = (&'a InterfaceNode, [Option<(usize, f64)>; 3]);

/// The row of a pair; `None` if supports fix both nodes along the normal.
pub(super) fn row(number: usize, pair: &ContactPair, slave: Side, master: Side) -> Option<Row> {
    let mut rhs = pair.gap;
    let mut terms = Vec::new();
    let mut square = 0.0;
    for ((node, fixed), sign) in [(slave, 1.0), (master, -1.0)] {
        let weight = sign / node.copies.len() as f64;
        for (axis, (component, held)) in pair.normal.into_iter().zip(fixed).enumerate() {
            match held {
                Some((_, value)) => rhs -= sign * component * value,
                None if component == 0.0 => {}
                None => {
                    square += component * component / node.copies.len() as f64;
                    let term = |&subdomain| Term { subdomain, node: node.node, axis, value: weight * component };
                    terms.extend(node.copies.iter().map(term));
                }
            }
        }
    }
    // A direction fixed but for round-off in the normal is fixed.
    if square < 1e-16 {
        return None;
    }
    let scale = 1.0 / square.sqrt();
    terms.iter_mut().for_each(|term| term.value *= scale);
    Some(Row { kind: Kind::Contact { pair: number }, rhs: scale * rhs, scale, terms })
}
