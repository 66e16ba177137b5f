//! Gluing rows: the copies of a node move together.
//!
//! Per component the rows are an orthonormal basis of the complement of the constant over the `m` copies (Helmert's):
//! row `k = 1..m-1` compares copy `k` with the mean of those before it, which are as stiff or stiffer.

use super::{Kind, Row, Term};
use crate::decomposition::InterfaceNode;

/// The `3 (m - 1)` gluing rows of a node, given the stiffness of all subdomains.
pub(super) fn rows(node: &InterfaceNode, stiffness: &[f64]) -> Vec<Row> {
    let mut copies = node.copies.clone();
    copies.sort_by(|&a, &b| stiffness[b as usize].total_cmp(&stiffness[a as usize]));
    let mut rows = Vec::new();
    for axis in 0..3 {
        for k in 1..copies.len() {
            let before = 1.0 / ((k * (k + 1)) as f64).sqrt();
            let terms = copies[..=k].iter().enumerate().map(|(copy, &subdomain)| {
                let value = if copy < k { before } else { -(k as f64) * before };
                Term { subdomain, node: node.node, axis, value }
            });
            let (terms, held) = (terms.collect(), Vec::new());
            rows.push(Row { kind: Kind::Gluing, rhs: 0.0, scale: before, length: 1.0, terms, held });
        }
    }
    rows
}
