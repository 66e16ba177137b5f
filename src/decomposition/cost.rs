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

/// Sizes of the groups of each level for so many subdomains of so many linear tetrahedra in all. In thin bodies several levels take
/// up to twice the iterations, and are left to where one is too little.
pub fn groups(subdomains: usize, tetrahedra: u64, is_thin: bool) -> Vec<usize> {
    let most = if is_thin { TOP } else { (subdomains / SPARSE).clamp(FEW, TOP) };
    let size = cluster(subdomains, tetrahedra);
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
mod tests;
