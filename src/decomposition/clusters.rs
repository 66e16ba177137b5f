//! Groups of neighbouring subdomains of one body, and groups of such groups: the levels of the coarse problem.
//!
//! Level 0 are the subdomains. The groups of the highest level are the *clusters*: each has one set of six rigid motions in the
//! coarse problem. As subdomains groups belong to the scene: consecutive numbers, the same on any number of ranks. Ranks may
//! share a group.

use std::ops::Range;

/// The groups of all levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clusters {
    /// For each level above the subdomains the first subdomain of each group, and the end.
    begins: Vec<Vec<usize>>,
    subdomains: usize,
}

impl Clusters {
    /// From the sizes of the groups of each level, counted in groups of the level below.
    pub fn new(subdomains: usize, sizes: &[Vec<usize>]) -> Self {
        let mut begins: Vec<Vec<usize>> = Vec::new();
        for sizes in sizes {
            let mut ends = vec![0];
            sizes.iter().for_each(|size| ends.push(ends[ends.len() - 1] + size));
            let first = |child: &usize| begins.last().map_or(*child, |below| below[*child]);
            begins.push(ends.iter().map(first).collect());
        }
        debug_assert!(begins.iter().all(|begins| begins.last() == Some(&subdomains)), "groups cover all subdomains");
        Self { begins, subdomains }
    }

    /// Levels above the subdomains; none in plain Total FETI.
    pub fn levels(&self) -> usize {
        self.begins.len()
    }

    /// Number of groups of a level.
    pub fn count(&self, level: usize) -> usize {
        level.checked_sub(1).map_or(self.subdomains, |level| self.begins[level].len() - 1)
    }

    /// The group of a subdomain on a level.
    pub fn group(&self, level: usize, subdomain: usize) -> usize {
        level.checked_sub(1).map_or(subdomain, |at| self.begins[at].partition_point(|&begin| begin <= subdomain) - 1)
    }

    /// The first subdomain of a group; that behind all for the number of groups.
    pub fn begin(&self, level: usize, group: usize) -> usize {
        level.checked_sub(1).map_or(group, |level| self.begins[level][group])
    }

    /// The groups of a level whose first subdomains are among these.
    pub fn beginning(&self, level: usize, subdomains: Range<usize>) -> Range<usize> {
        let Some(at) = level.checked_sub(1) else { return subdomains };
        let begins = &self.begins[at][..self.count(level)];
        begins.partition_point(|&begin| begin < subdomains.start)
            ..begins.partition_point(|&begin| begin < subdomains.end)
    }

    /// Groups of the level below that a group consists of.
    pub fn children(&self, level: usize, group: usize) -> Range<usize> {
        self.beginning(level - 1, self.begin(level, group)..self.begin(level, group + 1))
    }

    /// Number of clusters.
    pub fn total(&self) -> usize {
        self.count(self.levels())
    }

    /// Whether each subdomain is a cluster of its own: plain Total FETI.
    pub fn are_single(&self) -> bool {
        self.begins.is_empty()
    }

    /// The cluster of a subdomain.
    pub fn of(&self, subdomain: usize) -> usize {
        self.group(self.levels(), subdomain)
    }

    /// The first subdomain of a cluster.
    pub fn first(&self, cluster: usize) -> usize {
        self.begin(self.levels(), cluster)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_consecutive_and_nested() {
        let clusters = Clusters::new(9, &[vec![3, 2, 1, 3], vec![3, 1]]);
        assert_eq!([0, 1, 2].map(|level| clusters.count(level)), [9, 4, 2]);
        assert_eq!((0..9).map(|s| clusters.group(1, s)).collect::<Vec<_>>(), [0, 0, 0, 1, 1, 2, 3, 3, 3]);
        assert_eq!((0..9).map(|s| clusters.of(s)).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 0, 1, 1, 1]);
        assert_eq!((0..3).map(|group| clusters.begin(2, group)).collect::<Vec<_>>(), [0, 6, 9]);
        assert_eq!((clusters.first(1), clusters.levels(), clusters.total()), (6, 2, 2));
        assert_eq!((clusters.children(2, 0), clusters.children(2, 1), clusters.children(1, 1)), (0..3, 3..4, 3..5));
        assert_eq!(
            (clusters.beginning(1, 1..6), clusters.beginning(2, 1..6), clusters.beginning(0, 1..6)),
            (1..3, 1..1, 1..6)
        );
        let singles = Clusters::new(3, &[]);
        assert!(singles.are_single() && singles.total() == 3 && singles.of(2) == 2 && singles.first(2) == 2);
    }
}
