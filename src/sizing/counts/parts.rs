//! The subdomains of one body: boxes, exactly, or compact parts, about.

use super::local;
use crate::decomposition::{BodyMesh, bricks};
use crate::feti::inverse::kernel::MODES;
use crate::scene::Scene;
use crate::sizing::memory::{Lengths, Numbers};

/// Interface nodes of compact parts to those of boxes.
const RAGGED: f64 = 1.15;
/// Slots of the gluing rows of a node beyond its first copy: two where there are two, five for two copies more.
const SLOTS: f64 = 2.2;

/// The subdomains of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    /// How many.
    pub count: u64,
    /// Clusters of them.
    pub clusters: u64,
    /// Those at contact surfaces.
    pub touching: u64,
    /// Displacements of all of them.
    pub unknowns: u64,
    /// Slots of gluing rows.
    pub slots: f64,
    /// Numbers that they hold while solving.
    pub numbers: Numbers,
    /// Numbers in the factor of one.
    pub factor: f64,
}

impl Parts {
    /// Boxes of so many cells, with these lengths.
    pub fn boxes(
        scene: &Scene,
        body: &BodyMesh,
        (cells, lengths): ([usize; 3], Lengths),
        cluster: usize,
        touching: u64,
    ) -> Self {
        let along = bricks::along(body, cells);
        let count: u64 = along.iter().map(|&n| n as u64).product();
        let parts = bricks::parts(along, cluster);
        let clusters: u64 = parts.iter().map(|&n| n as u64).product();
        let of_box: u64 = 3 * cells.iter().map(|&n| (body.kind.degree() * n + 1) as u64).product::<u64>();
        let unknowns = count * of_box;
        let members = [0, 1, 2].map(|a| along[a] as f64 / parts[a] as f64);
        let mut numbers = Numbers::of_subdomain(scene, lengths, true).times(count as f64);
        numbers += Numbers::of_bonds(clusters as f64 * bonds(members, of_box as f64));
        let slots = SLOTS * (unknowns - 3 * body.counts().nodes) as f64;
        Self { count, clusters, touching, unknowns, slots, numbers, factor: lengths.factor }
    }

    /// As many parts as are asked for, in clusters of so many, of a body with so many nodes along its axes, and on its
    /// contact surfaces.
    pub fn pieces(scene: &Scene, body: &BodyMesh, extent: [f64; 3], [count, cluster]: [f64; 2], touching: f64) -> Self {
        let nodes = body.counts().nodes as f64;
        let along = boxes_along(extent, count);
        let product = |x: [f64; 3]| x.iter().product::<f64>();
        let glued = RAGGED * (product([0, 1, 2].map(|a| extent[a] + along[a] - 1.0)) - product(extent));
        let of_piece = (nodes + glued) / count;
        let lengths = local::of_nodes(body.kind, of_piece);
        let members = [cluster.cbrt(); 3];
        let clusters = (count / cluster).ceil();
        let mut numbers = Numbers::of_subdomain(scene, lengths, false).times(count);
        numbers += Numbers::of_bonds(if cluster > 1.0 { clusters * bonds(members, 3.0 * of_piece) } else { 0.0 });
        Self {
            count: count.round() as u64,
            clusters: clusters as u64,
            touching: (touching / of_piece.powf(2.0 / 3.0)).ceil().min(count.round()) as u64,
            unknowns: 3 * (body.counts().nodes + glued as u64),
            slots: 3.0 * SLOTS * glued,
            numbers,
            factor: lengths.factor,
        }
    }
}

/// Numbers that a cluster of so many members along each axis takes besides (see [`crate::feti::inverse::hybrid::numbers`]).
fn bonds(along: [f64; 3], unknowns: f64) -> f64 {
    let members: f64 = along.iter().product();
    let modes = MODES as f64;
    let rows = modes * along.iter().map(|n| members - members / n).sum::<f64>();
    if rows == 0.0 { 0.0 } else { 2.0 * rows * unknowns + rows.powi(2) + (modes * members).powi(2) }
}

/// So many boxes, along each axis, as near to cubes as a body of so many nodes lets them.
fn boxes_along(extent: [f64; 3], count: f64) -> [f64; 3] {
    let (mut along, mut left) = ([1.0; 3], count);
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extent[a].total_cmp(&extent[b]));
    for (done, &a) in axes.iter().enumerate() {
        let rest: f64 = axes[done..].iter().map(|&b| extent[b]).product();
        let edge = (rest / left).powf(1.0 / (3 - done) as f64);
        along[a] = (extent[a] / edge).clamp(1.0, extent[a]);
        left = (left / along[a]).max(1.0);
    }
    along
}

#[cfg(test)]
mod tests {
    use super::boxes_along;

    #[test]
    fn boxes_are_as_near_to_cubes_as_the_body_lets_them() {
        for (extent, count, expected) in [
            ([40.0, 20.0, 10.0], 8.0, [4.0, 2.0, 1.0]),
            ([100.0, 100.0, 2.0], 25.0, [5.0, 5.0, 1.0]),
            ([30.0, 30.0, 30.0], 1.0, [1.0; 3]),
        ] {
            let found = boxes_along(extent, count);
            assert!((0..3).all(|a| (found[a] - expected[a]).abs() < 1e-9), "{found:?}");
        }
    }
}
