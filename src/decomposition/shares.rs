//! How many subdomains each rank gets.

use super::Clusters;
use crate::comm::Shares;

/// So many groups of the lowest level for each rank keep ranks equal to a few per cent.
const MANY: usize = 16;

/// Consecutive blocks of subdomains with costs as equal as can be: whole groups of the lowest level where there are many, as ranks
/// that share one send messages for it.
pub fn whole_groups(clusters: &Clusters, cost: impl Fn(usize) -> u64, ranks: usize) -> Shares {
    let level = usize::from(clusters.levels() > 0 && clusters.count(1) >= MANY * ranks);
    let members = |group: usize| clusters.begin(level, group)..clusters.begin(level, group + 1);
    let costs: Vec<u64> = (0..clusters.count(level)).map(|group| members(group).map(&cost).sum()).collect();
    let groups = by_cost(&costs, ranks);
    let mut first = 0;
    let subdomains = groups.0.iter().map(|count| {
        let begin = clusters.begin(level, first);
        first += count;
        clusters.begin(level, first) - begin
    });
    Shares::new(subdomains.collect())
}

/// Consecutive blocks of items over `ranks`, their costs as equal as a walk along the items makes them. Every rank has
/// an item as long as there are enough.
pub fn by_cost(costs: &[u64], ranks: usize) -> Shares {
    let mut left: u64 = costs.iter().sum();
    let mut at = 0;
    let count = |rank: usize| {
        let (others, first) = ((ranks - rank - 1) as u64, at);
        let mut mine = 0;
        while at < costs.len() {
            let next = costs[at];
            // Nearer to this rank's part of what is left with the next item than without?
            let nearer = (2 * mine + next) * (others + 1) <= 2 * left;
            if at > first && (!nearer || costs.len() - at <= others as usize) {
                break;
            }
            mine += next;
            at += 1;
        }
        left -= mine;
        at - first
    };
    Shares::new((0..ranks).map(count).collect())
}

/// The items of several lists, given by their lengths, in an order in which every part of it has about the same part of
/// each list: bodies under load beside bodies at rest. Returns (list, number in it).
pub fn interleave(lengths: &[usize]) -> Vec<(usize, usize)> {
    let mut items: Vec<(usize, usize)> =
        lengths.iter().enumerate().flat_map(|(list, &length)| (0..length).map(move |k| (list, k))).collect();
    // By the place of an item's middle in its list.
    let middle = |&(list, k): &(usize, usize)| (2 * k as u128 + 1, lengths[list] as u128);
    items.sort_by(|a, b| {
        let ((m, n), (o, p)) = (middle(a), middle(b));
        (m * p).cmp(&(o * n)).then(a.cmp(b))
    });
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_groups_stay_whole_and_few_do_not() {
        let clusters = Clusters::new(99, &[vec![3; 33]]);
        assert_eq!(whole_groups(&clusters, |_| 1, 2).0, [51, 48]);
        assert_eq!(whole_groups(&clusters, |_| 1, 3).0, [33, 33, 33]);
        assert_eq!(whole_groups(&clusters, |_| 1, 5).0, [20, 20, 20, 20, 19]);
    }

    #[test]
    fn equal_items_are_spread_evenly_and_ranks_beyond_them_stay_idle() {
        assert_eq!(by_cost(&[1; 6], 2).0, [3, 3]);
        assert_eq!(by_cost(&[5; 7], 3).0, [2, 3, 2]);
        assert_eq!(by_cost(&[1; 3], 5).0, [1, 1, 1, 0, 0]);
        assert_eq!(by_cost(&[], 2).0, [0, 0]);
    }

    #[test]
    fn costs_decide_but_leave_no_rank_idle() {
        assert_eq!(by_cost(&[1, 1, 1, 1, 1, 1, 3, 3], 2).0, [6, 2]);
        assert_eq!(by_cost(&[9, 9, 1, 1], 3).0, [1, 1, 2]);
        assert_eq!(by_cost(&[1, 1, 10], 3).0, [1, 1, 1]);
    }

    #[test]
    fn owners_have_what_begins_with_them() {
        let shares = Shares::new(vec![0, 2, 0, 3, 0]);
        assert_eq!((0..5).map(|item| shares.owner(item)).collect::<Vec<_>>(), [1, 1, 3, 3, 3]);
        assert_eq!((0..5).map(|rank| shares.begin(rank)).collect::<Vec<_>>(), [0, 0, 2, 2, 5]);
        assert_eq!(shares.total(), 5);
    }

    #[test]
    fn every_part_has_its_part_of_each_list() {
        assert_eq!(interleave(&[2, 4]), [(1, 0), (0, 0), (1, 1), (1, 2), (0, 1), (1, 3)]);
        let lengths = [7, 20, 3];
        let items = interleave(&lengths);
        for half in items.chunks(15) {
            for (list, length) in lengths.iter().enumerate() {
                let found = half.iter().filter(|(l, _)| *l == list).count();
                assert!((2 * found).abs_diff(*length) <= 1);
            }
        }
    }
}
