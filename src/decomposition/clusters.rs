//! Groups of neighbouring subdomains of one body that share one set of six rigid motions in the coarse problem.
//!
//! As subdomains they belong to the scene: consecutive numbers, whole on one rank, the same on any number of ranks.

use std::ops::Range;

use crate::comm::Shares;

/// The clusters of all ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clusters {
    /// Clusters owned by each rank.
    pub shares: Shares,
    /// The first subdomain of each cluster, and the end.
    begins: Vec<usize>,
}

impl Clusters {
    /// Of so many subdomains each, spread over the ranks as `shares` say; also the shares of the subdomains.
    pub fn new(shares: Shares, sizes: &[usize]) -> (Self, Shares) {
        let mut begins = vec![0];
        sizes.iter().for_each(|size| begins.push(begins[begins.len() - 1] + size));
        let mut first = 0;
        let subdomains = shares.0.iter().map(|count| {
            let of_rank = begins[first + count] - begins[first];
            first += count;
            of_rank
        });
        let subdomains = Shares::new(subdomains.collect());
        (Self { shares, begins }, subdomains)
    }

    /// Number of clusters.
    pub fn total(&self) -> usize {
        self.begins.len() - 1
    }

    /// Whether each subdomain is a cluster of its own: plain Total FETI.
    pub fn are_single(&self) -> bool {
        self.begins.last() == Some(&self.total())
    }

    /// The cluster of a subdomain.
    pub fn of(&self, subdomain: usize) -> usize {
        self.begins.partition_point(|&begin| begin <= subdomain) - 1
    }

    /// The first subdomain of a cluster.
    pub fn first(&self, cluster: usize) -> usize {
        self.begins[cluster]
    }

    /// The clusters of a rank, as ranges of its own subdomains.
    pub fn of_rank(&self, rank: usize) -> impl Iterator<Item = Range<usize>> + Clone + '_ {
        let clusters = &self.begins[self.shares.begin(rank)..=self.shares.begin(rank) + self.shares.0[rank]];
        clusters.windows(2).map(|pair| pair[0] - clusters[0]..pair[1] - clusters[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_are_consecutive_and_whole_on_a_rank() {
        let (clusters, subdomains) = Clusters::new(Shares::new(vec![2, 0, 1]), &[3, 2, 4]);
        assert_eq!(subdomains.0, [5, 0, 4]);
        assert_eq!((0..9).map(|s| clusters.of(s)).collect::<Vec<_>>(), [0, 0, 0, 1, 1, 2, 2, 2, 2]);
        assert_eq!((0..3).map(|c| clusters.first(c)).collect::<Vec<_>>(), [0, 3, 5]);
        let of_ranks = (0..3).flat_map(|rank| clusters.of_rank(rank).map(move |members| (rank, members)));
        assert!(of_ranks.eq([(0, 0..3), (0, 3..5), (2, 0..4)]));
        assert!(!clusters.are_single());
        let (singles, subdomains) = Clusters::new(Shares::new(vec![1, 2]), &[1; 3]);
        assert!(singles.are_single() && singles.total() == 3 && singles.of(2) == 2);
        assert_eq!(subdomains.0, [1, 2]);
    }
}
