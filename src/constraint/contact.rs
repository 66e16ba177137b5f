//! Contact rows: `normal . (weighted means over the copies of the slave side's nodes - the master's) <= gap`, made a unit
//! vector. Where the normal varies over a condition, each node has its own.
//!
//! Components that a support fixes leave the row and go to its right-hand side: contact rows stay orthogonal to
//! support rows and the active rows independent. Of conditions with one direction (a node that meets two obstacles alike) only
//! the tightest counts, which implies the others: they have one row.

use super::prescribed::{Parallel, Prescribed};
use super::{Fixed, Kind, Row, Term};
use crate::contact::ContactPair;
use crate::decomposition::InterfaceNode;

/// One node of a contact, and for each component the support that fixes it there.
pub(super) type Side<'a> = (&'a InterfaceNode, [Option<usize>; 3]);

/// Rows with a cosine above this are parallel.
const PARALLEL: f64 = 1.0 - 1e-12;

/// The row of pair `number`; `sides` gives its nodes by their global number.
///
/// # Errors
/// If supports fix all nodes along the normal: what they fix.
pub(super) fn row<'a>(number: usize, pair: &ContactPair, sides: &impl Fn(u64) -> Side<'a>) -> Result<Row, Vec<Fixed>> {
    row_of(Kind::Contact { pair: number }, pair.factors(), sides)
}

/// The row of a pair along a unit `direction` of its plane; see [`row`].
///
/// # Errors
/// If supports fix all nodes along it: what they fix.
pub(super) fn row_along<'a>(
    direction: [f64; 3],
    kind: Kind,
    pair: &ContactPair,
    sides: &impl Fn(u64) -> Side<'a>,
) -> Result<Row, Vec<Fixed>> {
    row_of(kind, pair.nodes().map(|(node, factor)| (node, direction.map(|d| factor * d))), sides)
}

/// The row with these factors of nodes.
fn row_of<'a>(
    kind: Kind,
    factors: impl Iterator<Item = (u64, [f64; 3])>,
    sides: &impl Fn(u64) -> Side<'a>,
) -> Result<Row, Vec<Fixed>> {
    let (mut terms, mut fixed) = (Vec::new(), Vec::new());
    let mut square = 0.0;
    for (node, factors) in factors {
        let (node, supports) = sides(node);
        let copies = node.copies.len() as f64;
        for (axis, (factor, support)) in factors.into_iter().zip(supports).enumerate() {
            match support {
                Some(support) => fixed.push(Fixed { support, axis, weight: factor }),
                None if factor == 0.0 => {}
                None => {
                    square += factor * factor / copies;
                    let term = |&subdomain| Term { subdomain, node: node.node, axis, value: factor / copies };
                    terms.extend(node.copies.iter().map(term));
                }
            }
        }
    }
    // What is left of it is round-off: the direction is fixed.
    if square < 1e-16 {
        return Err(fixed);
    }
    let scale = 1.0 / square.sqrt();
    terms.iter_mut().for_each(|term| term.value *= scale);
    Ok(Row { kind, scale, length: 1.0, terms, fixed, parallel: Vec::new() })
}

/// Adds the row of a pair to those of the same slave node. Of parallel ones that stays which is the tightest at this time, and
/// keeps the others' conditions.
pub(super) fn add_tightest(rows: &mut Vec<Row>, mut row: Row, at: &Prescribed) {
    let same = |a: &Term, b: &Term| (a.subdomain, a.node, a.axis) == (b.subdomain, b.node, b.axis);
    let is_parallel = |other: &&mut Row| {
        other.terms.len() == row.terms.len()
            && other.terms.iter().zip(&row.terms).all(|(a, b)| same(a, b))
            && other.terms.iter().zip(&row.terms).map(|(a, b)| a.value * b.value).sum::<f64>() > PARALLEL
    };
    let Some(other) = rows.iter_mut().find(is_parallel) else { return rows.push(row) };
    if row.right_hand_side(at) < other.right_hand_side(at) {
        std::mem::swap(other, &mut row);
    }
    let Kind::Contact { pair } = row.kind else { unreachable!("only contact rows are parallel") };
    other.parallel.append(&mut row.parallel);
    other.parallel.push(Parallel { pair, scale: row.scale, fixed: row.fixed });
}
