//! The subdomains of one body: boxes, exactly, or compact parts, about.

use super::local;
use crate::decomposition::{BodyMesh, bricks};
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
    /// Their groups on the highest level.
    pub coarse_blocks: u64,
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
        groups: &[usize],
        touching: u64,
    ) -> Self {
        let along = bricks::along(body, cells);
        let count: u64 = along.iter().map(|&n| n as u64).product();
        let grouped = |groups: &[usize]| {
            let grid = groups.iter().fold(along, |grid, &size| bricks::parts(grid, size));
            grid.iter().map(|&n| n as u64).product()
        };
        let (clusters, coarse_blocks) = (grouped(&groups[..groups.len().min(1)]), grouped(groups));
        let of_box: u64 = 3 * cells.iter().map(|&n| (body.kind.degree() * n + 1) as u64).product::<u64>();
        let unknowns = count * of_box;
        let numbers = Numbers::of_subdomain(scene, lengths, Some(count as usize)).times(count as f64);
        let slots = SLOTS * (unknowns - 3 * body.counts().nodes) as f64;
        Self { count, clusters, coarse_blocks, touching, unknowns, slots, numbers, factor: lengths.factor }
    }

    /// As many parts as are asked for, in groups of so many, of a body with so many nodes along its axes, and on its
    /// contact surfaces.
    pub fn pieces(
        scene: &Scene,
        body: &BodyMesh,
        extent: [f64; 3],
        (count, groups): (f64, &[usize]),
        touching: f64,
    ) -> Self {
        let nodes = body.counts().nodes as f64;
        let along = boxes_along(extent, count);
        let product = |x: [f64; 3]| x.iter().product::<f64>();
        let glued = RAGGED * (product([0, 1, 2].map(|a| extent[a] + along[a] - 1.0)) - product(extent));
        let of_piece = (nodes + glued) / count;
        let lengths = local::of_nodes(body.kind, of_piece);
        let (mut of_levels, mut numbers) = (vec![count], Numbers::of_subdomain(scene, lengths, None).times(count));
        for &size in groups {
            let count = (of_levels[of_levels.len() - 1] / size as f64).ceil();
            numbers += Numbers::of_group(size as f64).times(count);
            of_levels.push(count);
        }
        Self {
            count: count.round() as u64,
            clusters: of_levels[groups.len().min(1)] as u64,
            coarse_blocks: of_levels[groups.len()] as u64,
            touching: (touching / of_piece.powf(2.0 / 3.0)).ceil().min(count.round()) as u64,
            unknowns: 3 * (body.counts().nodes + glued as u64),
            slots: 3.0 * SLOTS * glued,
            numbers,
            factor: lengths.factor,
        }
    }
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
