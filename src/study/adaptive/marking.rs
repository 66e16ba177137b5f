//! Which elements to bisect, and how often: as many as leave a given share of the error, spread evenly.
//!
//! Every element has a part of the error (its square, or an energy). A bisection of an element is taken to leave `LEFT` of its
//! part in both halves together. All elements with more than a limit are bisected until no part is foretold to be above it. The
//! limit is the largest one that leaves the wanted share; it is found by bisection of its logarithm, from exact sums, so it does
//! not depend on the ranks.

use super::Wanted;
use crate::comm::{Comm, exact, maximum};
use crate::model::Discrete;

/// See the header: a quadratic tetrahedron along an edge or front where the solution is singular leaves about as much.
const LEFT: f64 = 0.5;
/// An element is bisected so often at most at once: to a quarter of its edges.
const MOST: i32 = 6;
/// Halvings of the interval of logarithms in which the limit is sought.
const HALVINGS: usize = 40;
/// Share of the largest part that the limit is above.
const LEAST: f64 = 1e-12;

/// Sum of all parts. Collective.
pub fn total(comm: &dyn Comm, parts: &[Vec<f64>]) -> f64 {
    let partial: Vec<f64> = parts.iter().map(|parts| parts.iter().sum()).collect();
    exact::sum(comm, &partial, 1)[0]
}

/// How often an element is to be bisected.
fn times(part: f64, limit: f64) -> i32 {
    if part <= limit { 0 } else { ((part / limit).ln() / -(0.5 * LEFT).ln()).ceil().min(f64::from(MOST)) as i32 }
}

/// The elements to be bisected so that a share of the error is left, as far as can be foretold; `parts` are those of the
/// elements of each own subdomain. Collective.
pub fn wanted(comm: &dyn Comm, discrete: &Discrete, parts: &[Vec<f64>], share: f64) -> Wanted {
    let left = |limit: f64| {
        let left = |part: &f64| part * LEFT.powi(times(*part, limit));
        total(comm, &parts.iter().map(|parts| parts.iter().map(left).collect()).collect::<Vec<_>>())
    };
    let goal = share * total(comm, parts);
    let largest = maximum(comm, &[parts.iter().flatten().copied().fold(0.0, f64::max)])[0];
    let (mut low, mut high) = (LEAST.ln(), 0.0_f64);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if left(largest * middle.exp()) <= goal { low = middle } else { high = middle }
    }
    let limit = largest * low.exp();
    let mut wanted = vec![Vec::new(); discrete.bodies.len()];
    for (subdomain, parts) in discrete.decomposition.subdomains.iter().zip(parts) {
        let first = discrete.bodies[subdomain.body].first_node;
        for (nodes, &part) in subdomain.elements.iter().zip(parts) {
            let times = times(part, limit);
            if times > 0 {
                let corner = |&node: &u32| (subdomain.nodes[node as usize] - first) as u32;
                let mut corners: Vec<u32> = nodes[..4].iter().map(corner).collect();
                corners.sort_unstable();
                wanted[subdomain.body].push((corners, times as usize));
            }
        }
    }
    wanted
}
