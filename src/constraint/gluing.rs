//! Gluing rows: the copies of a node move together.
//!
//! Per component the rows are an orthonormal basis of the complement of the constant over the copies (Helmert's): row `k`
//! compares copy `k` with the mean of those before it. They come in threes, one along each axis with the same coefficients.
//! Copies in one group are compared among themselves, and the mean of each group with that of the groups before it: only these
//! rows move whole groups against each other. The stiffest come first.

use super::{Kind, Row, Term};
use crate::decomposition::{Clusters, InterfaceNode};

/// The `3 (m - 1)` gluing rows of a node with `m` copies, given the stiffness of subdomains.
pub(super) fn rows(node: &InterfaceNode, clusters: &Clusters, stiffness: impl Fn(u32) -> f64) -> Vec<Row> {
    let mut copies = node.copies.clone();
    copies.sort_by(|&a, &b| stiffness(b).total_cmp(&stiffness(a)));
    for level in 1..=clusters.levels() {
        let of = |copy: &u32| clusters.group(level, *copy as usize);
        let stiffest: Vec<usize> = copies.iter().map(of).collect();
        copies.sort_by_key(|copy| stiffest.iter().position(|group| *group == of(copy)));
    }
    let mut rows = Vec::new();
    compare_within(clusters, clusters.levels(), node.node, &copies, &mut rows);
    rows
}

/// The rows of copies in one group of the level above `level`, of which those of one group of a level are side by side.
fn compare_within(clusters: &Clusters, level: usize, node: u64, copies: &[u32], rows: &mut Vec<Row>) {
    let of = |copy: u32| clusters.group(level, copy as usize);
    let mut before = 0;
    for group in copies.chunk_by(|&a, &b| of(a) == of(b)) {
        let end = before + group.len();
        if before > 0 {
            rows.extend((0..3).map(|axis| compare((node, axis), &copies[..before], &copies[before..end])));
        }
        if level > 0 {
            compare_within(clusters, level - 1, node, group, rows);
        }
        before = end;
    }
}

/// The mean of some copies against that of others.
fn compare((node, axis): (u64, usize), first: &[u32], second: &[u32]) -> Row {
    let (p, q) = (first.len(), second.len());
    let unit = 1.0 / ((p * q * (p + q)) as f64).sqrt();
    let before = first.iter().map(|&subdomain| Term { subdomain, node, axis, value: q as f64 * unit });
    let behind = second.iter().map(|&subdomain| Term { subdomain, node, axis, value: -(p as f64) * unit });
    let terms = before.chain(behind).collect();
    Row { kind: Kind::Gluing, scale: q as f64 * unit, length: 1.0, terms, fixed: Vec::new(), parallel: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_orthonormal_and_few_of_them_leave_a_cluster() {
        let node = InterfaceNode { node: 7, copies: vec![0, 1, 2, 5, 6, 8], surfaces: Vec::new() };
        let [single, clusters, nested] =
            [&[][..], &[vec![3, 4, 2]], &[vec![3, 4, 2], vec![2, 1]]].map(|sizes| Clusters::new(9, sizes));
        for (clusters, leaving) in [(single, 15), (clusters, 6), (nested, 3)] {
            let rows = rows(&node, &clusters, |s| [1.0, 4.0, 1.0, 1.0, 1.0, 2.0, 8.0, 1.0, 1.0][s as usize]);
            assert_eq!(rows.len(), 15);
            for three in rows.as_chunks::<3>().0 {
                for (axis, row) in three.iter().enumerate() {
                    assert!(row.terms.iter().copied().eq(three[0].terms.iter().map(|t| Term { axis, ..*t })));
                }
            }
            for (i, a) in rows.iter().enumerate() {
                assert!(a.terms.iter().map(|t| t.value).sum::<f64>().abs() < 1e-15);
                for (j, b) in rows.iter().enumerate() {
                    let same = |a: &Term, b: &Term| (a.subdomain, a.axis) == (b.subdomain, b.axis);
                    let products = a
                        .terms
                        .iter()
                        .flat_map(|s| b.terms.iter().filter(move |t| same(s, t)).map(move |t| s.value * t.value));
                    assert!((products.sum::<f64>() - f64::from(i == j)).abs() < 1e-15);
                }
            }
            let leaves = |row: &&Row| {
                row.terms
                    .windows(2)
                    .any(|t| clusters.of(t[0].subdomain as usize) != clusters.of(t[1].subdomain as usize))
            };
            assert_eq!(rows.iter().filter(leaves).count(), leaving);
        }
    }
}
