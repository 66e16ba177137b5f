//! Gluing rows: the copies of a node move together.
//!
//! Per component the rows are an orthonormal basis of the complement of the constant over the `m` copies (Helmert's):
//! row `k = 1..m-1` compares copy `k` with the mean of those before it.

use super::{Kind, Row, Term};
use crate::decomposition::InterfaceNode;

/// The `3 (m - 1)` gluing rows of a node.
pub(super) fn rows(node: &InterfaceNode) -> Vec<Row> {
    let mut rows = Vec::new();
    for axis in 0..3 {
        for k in 1..node.copies.len() {
            let before = 1.0 / ((k * (k + 1)) as f64).sqrt();
            let terms = node.copies[..=k].iter().enumerate().map(|(copy, &subdomain)| {
                let value = if copy < k { before } else { -(k as f64) * before };
                Term { subdomain, node: node.node, axis, value }
            });
            rows.push(Row { kind: Kind::Gluing, rhs: 0.0, scale: before, terms: terms.collect(), held: Vec::new() });
        }
    }
    rows
}
