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

/// Most subdomains that have rigid motions of their own in the coarse problem.
const SINGLE: usize = 2000;
/// Clusters for which the smaller kind is enough.
const ENOUGH: usize = 800;

/// Subdomains in a cluster, of so many in all: blocks of two or three along each edge. Larger ones leave a smaller coarse
/// problem, make K^+ dearer and take more iterations.
pub fn cluster(subdomains: usize) -> usize {
    match subdomains {
        0..=SINGLE => 1,
        _ if subdomains <= 8 * ENOUGH => 8,
        _ => 27,
    }
}

#[cfg(test)]
mod tests {
    use super::{cluster, subdomains};

    #[test]
    fn many_subdomains_share_rigid_motions() {
        assert_eq!([1, 2000, 2001, 6400, 6401, 100_000].map(cluster), [1, 1, 8, 8, 27, 27]);
    }

    #[test]
    fn subdomains_grow_with_the_mesh_and_slower() {
        assert_eq!([1, 1000, 36_000, 288_000, 2_304_000].map(|n| subdomains(n, 1)), [1, 1, 15, 78, 410]);
        assert_eq!(subdomains(1000, 7), 7);
    }
}
