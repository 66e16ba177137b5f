//! How many subdomains to cut into when nobody says.
//!
//! In three dimensions the factor of a subdomain of `n/s` elements takes about `(n/s)^(4/3)` numbers (nested dissection:
//! George 1973), so the factors of all `s` take `n^(4/3) / s^(1/3)`, and that of the coarse problem `s^(4/3)`. One
//! application of the dual operator and of the projector reads both; their sum is least where `s` is proportional to
//! `n^(4/5)`. The constant is from times of whole runs without discretisation, on two ranks: of compact parts of the benchmark and of a
//! housing. They are flat near the least. The number belongs to the scene: it does not depend on the ranks.

/// Elements to the power 4/5 for each subdomain.
const SCALE: f64 = 130.0;

/// Where subdomains have fewer elements than this, more of them take more iterations and no less time.
const LEAST: f64 = 1400.0;

/// Subdomains for so many elements in so many regions of bodies, which need one each.
pub fn subdomains(elements: u64, regions: usize) -> usize {
    let elements = elements as f64;
    (elements.powf(0.8) / SCALE).min(elements / LEAST).round().max(regions as f64) as usize
}

/// So many clusters are few enough, whatever they cost.
const FEW: usize = 500;
/// Numbers in the factors of subdomains that are read in the time that one in the factor of the coarse problem takes: every
/// rank has all of that, and solves with it between two and three times for each application of F.
const DEAR: f64 = 52.0;
/// Numbers that could be read in the time that each subdomain takes besides.
const OVERHEAD: f64 = 500.0;

/// The coarse problem has at most about so many blocks: more are grouped again.
const TOP: usize = 1500;
/// It has at most one block for so many subdomains, if that is more than [`FEW`]: every rank has all of it, so it would take most of
/// the memory of many ranks.
const SPARSE: usize = 50;

/// Sizes of the groups of each level for so many subdomains of so many linear tetrahedra in all.
pub fn groups(subdomains: usize, tetrahedra: u64) -> Vec<usize> {
    let (size, most) = (cluster(subdomains, tetrahedra), (subdomains / SPARSE).clamp(FEW, TOP));
    // On several levels blocks of two an edge take fewer iterations than larger or longer ones.
    let size = if size > 1 && subdomains.div_ceil(size) > most { 8 } else { size };
    to(most, subdomains, size)
}

/// Sizes of the groups of each level if they are equal: as many levels as the coarse problem needs, one at least. Nothing if the
/// size is one.
pub fn levels(subdomains: usize, size: usize) -> Vec<usize> {
    to(TOP, subdomains, size)
}

fn to(most: usize, subdomains: usize, size: usize) -> Vec<usize> {
    let mut groups = Vec::new();
    let mut count = subdomains;
    while size > 1 && (groups.is_empty() || count > most) {
        groups.push(size);
        count = count.div_ceil(size);
    }
    groups
}

/// Subdomains in a cluster, of so many linear tetrahedra in all: blocks of one, two or three along each edge. Larger ones
/// leave a smaller coarse problem, make K^+ dearer and take more iterations: they pay where the coarse problem takes about
/// twice the time of F, by the counts of numbers above. Constants are from the benchmark in 48 to 20,250 boxes of 2, 4, 5 and
/// 10 cells an edge.
fn cluster(subdomains: usize, tetrahedra: u64) -> usize {
    let count = subdomains as f64;
    let nodes = ((tetrahedra as f64 / (6.0 * count)).cbrt() + 1.0).powi(3);
    let local = count * ((3.0 * nodes).powf(4.0 / 3.0) + OVERHEAD);
    let coarse = |size: usize| (6.0 * count / size as f64).powf(4.0 / 3.0);
    let enough = |size: &usize| subdomains <= FEW * size || DEAR * coarse(*size) <= local;
    [1, 8].into_iter().find(enough).unwrap_or(27)
}

#[cfg(test)]
mod tests {
    use super::{cluster, groups, levels, subdomains};

    #[test]
    fn there_are_as_many_levels_as_the_coarse_problem_needs() {
        let groups = |boxes: usize, cells: u64| groups(boxes, 6 * cells.pow(3) * boxes as u64);
        assert!(groups(48, 10).is_empty());
        assert_eq!(groups(1296, 5), [8]);
        for boxes in [6000, 20_250, 93_750] {
            assert_eq!(groups(boxes, 2), [8, 8], "{boxes}");
        }
        assert_eq!(groups(1_000_000, 2), [8; 4]);
        assert_eq!((levels(6000, 8), levels(93_750, 27), levels(10, 1)), (vec![8], vec![27; 2], vec![]));
    }

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

    /// Times of runs by the number of subdomains, in seconds.
    #[test]
    fn the_number_of_subdomains_is_within_a_tenth_of_the_fastest() {
        type Scan = (u64, &'static [(usize, f64)]);
        let scans: [Scan; 6] = [
            // The benchmark, level 2, of tet4 and hex8; level 1 of tet10.
            (288_000, &[(78, 3.70), (120, 3.39), (180, 3.35), (260, 3.52), (350, 3.80)]),
            (288_000, &[(50, 6.03), (90, 5.52), (140, 5.19), (200, 5.17)]),
            (288_000, &[(24, 10.24), (48, 6.78), (80, 5.30), (120, 5.07), (180, 4.67)]),
            // A housing of tet4, 30, 90 and 260 thousand nodes.
            (133_986, &[(21, 1.94), (42, 1.49), (84, 1.39), (126, 1.31), (168, 1.25)]),
            (449_662, &[(111, 6.22), (180, 5.24), (250, 5.11), (350, 5.25), (500, 6.05)]),
            (1_382_406, &[(273, 34.33), (500, 20.82), (800, 21.56)]),
        ];
        for (elements, times) in scans {
            let found = subdomains(elements, 1);
            let after = times.iter().position(|time| time.0 >= found).expect("the scan goes far enough");
            let [(low, before), (high, behind)] = [times[after - 1], times[after]];
            let time = before + (behind - before) * (found - low) as f64 / (high - low) as f64;
            let least = times.iter().map(|time| time.1).fold(f64::INFINITY, f64::min);
            assert!(time <= 1.1 * least, "{elements} elements in {found} subdomains: {time} s, {least} s at best");
        }
    }

    #[test]
    fn subdomains_grow_with_the_mesh_and_slower() {
        assert_eq!([1, 1000, 36_000, 288_000, 2_304_000].map(|n| subdomains(n, 1)), [1, 1, 26, 179, 946]);
        assert_eq!(subdomains(1000, 7), 7);
    }
}
