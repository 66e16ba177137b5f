//! How many subdomains to cut into when nobody says.
//!
//! In three dimensions the factor of a subdomain of `n/s` elements takes about `(n/s)^(4/3)` numbers (nested dissection:
//! George 1973), so the factors of all `s` take `n^(4/3) / s^(1/3)`, and that of the coarse problem `s^(4/3)`. One
//! application of the dual operator and of the projector reads both; their sum is least where `s` is proportional to
//! `n^(4/5)`. The constant is from the benchmark at levels 1 and 2 (36 000 and 288 000 elements), where times are
//! least, and flat, about 12 to 24 and 96 subdomains. The number belongs to the scene: it does not depend on the ranks.

/// Elements to the power 4/5 for each subdomain.
const SCALE: f64 = 300.0;

/// Subdomains for so many elements in so many regions of bodies, which need one each.
pub fn subdomains(elements: u64, regions: usize) -> usize {
    ((elements as f64).powf(0.8) / SCALE).round().max(regions as f64) as usize
}

/// So many clusters are few enough, whatever they cost.
const FEW: usize = 500;
/// Numbers in the factors of subdomains that are read in the time that one in the factor of the coarse problem takes: every
/// rank has all of that, and solves with it between two and three times for each application of F.
const DEAR: f64 = 52.0;
/// Numbers that could be read in the time that each subdomain takes besides.
const OVERHEAD: f64 = 500.0;

/// Subdomains in a cluster, of so many linear tetrahedra in all: blocks of one, two or three along each edge. Larger ones
/// leave a smaller coarse problem, make K^+ dearer and take more iterations: they pay where the coarse problem takes about
/// twice the time of F, by the counts of numbers above. Constants are from the benchmark in 48 to 20,250 boxes of 2, 4, 5 and
/// 10 cells an edge.
pub fn cluster(subdomains: usize, tetrahedra: u64) -> usize {
    let count = subdomains as f64;
    let nodes = ((tetrahedra as f64 / (6.0 * count)).cbrt() + 1.0).powi(3);
    let local = count * ((3.0 * nodes).powf(4.0 / 3.0) + OVERHEAD);
    let coarse = |size: usize| (6.0 * count / size as f64).powf(4.0 / 3.0);
    let enough = |size: &usize| subdomains <= FEW * size || DEAR * coarse(*size) <= local;
    [1, 8].into_iter().find(enough).unwrap_or(27)
}

#[cfg(test)]
mod tests {
    use super::{cluster, subdomains};

    #[test]
    fn many_small_subdomains_share_rigid_motions() {
        // Boxes, the cells of their edge, and the size of the clusters that was fastest (384 and 750 of 4 cells: as fast as another).
        for (boxes, cells, fastest) in [
            (48, 5, 1),
            (48, 10, 1),
            (162, 10, 1),
            (384, 5, 1),
            (750, 4, 8),
            (750, 2, 8),
            (1296, 5, 8),
            (6000, 2, 8),
            (20_250, 2, 27),
        ] {
            assert_eq!(cluster(boxes, 6 * cells * cells * cells * boxes as u64), fastest, "{boxes} boxes");
        }
    }

    #[test]
    fn subdomains_grow_with_the_mesh_and_slower() {
        assert_eq!([1, 1000, 36_000, 288_000, 2_304_000].map(|n| subdomains(n, 1)), [1, 1, 15, 78, 410]);
        assert_eq!(subdomains(1000, 7), 7);
    }
}
