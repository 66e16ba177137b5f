//! The tree of groups: sums from subdomains to their groups, and numbers of groups back to their members.
//!
//! A group is at home on the rank that owns its first subdomain. As numbers are consecutive, a rank has members of at most one
//! group of a level that is at home on another rank: it sends their numbers there. Members are added up in their order: the same
//! bits on any ranks.

use std::cell::RefCell;
use std::ops::Range;

use crate::comm::{Comm, Shares};
use crate::decomposition::Clusters;

/// The groups of all levels, as one rank sees them.
pub struct Tree<'a> {
    comm: &'a dyn Comm,
    /// Number of own subdomains.
    own: usize,
    shares: Shares,
    levels: Vec<Level>,
    /// Number of clusters at home on each rank.
    pub clusters: Shares,
}

/// The groups of one level. Their children are those of the level below that are at home here.
struct Level {
    /// Numbers of the groups at home here.
    groups: Range<usize>,
    /// The children of each of them, among all of theirs.
    members: Vec<Range<usize>>,
    /// Home of the first children here, and their number, if it is another rank.
    above: Option<(usize, usize)>,
    /// Other ranks with children of the last group, and their numbers.
    below: Vec<(usize, usize)>,
    buffers: RefCell<[Vec<Vec<f64>>; 2]>,
}

impl<'a> Tree<'a> {
    /// Of subdomains in these shares. Local.
    pub fn new(comm: &'a dyn Comm, clusters: &Clusters, shares: &Shares) -> Self {
        let owned = |rank: usize| shares.begin(rank)..shares.begin(rank + 1);
        let levels = (1..=clusters.levels()).map(|level| Level::new(clusters, level, owned(comm.rank()), shares));
        let at_home = (0..comm.size()).map(|rank| clusters.beginning(clusters.levels(), owned(rank)).len());
        let (levels, clusters) = (levels.collect(), Shares::new(at_home.collect()));
        Self { comm, own: owned(comm.rank()).len(), levels, clusters, shares: shares.clone() }
    }

    /// Subdomains of each rank.
    pub fn shares(&self) -> &Shares {
        &self.shares
    }

    /// The rank that owns a subdomain.
    pub fn home(&self, subdomain: usize) -> usize {
        self.shares.owner(subdomain)
    }

    /// Levels above the subdomains.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Numbers of the groups of a level, from 1, that are at home here.
    pub fn groups(&self, level: usize) -> Range<usize> {
        self.levels[level - 1].groups.clone()
    }

    /// The members of each of them in what [`Tree::up`] returns.
    pub fn members(&self, level: usize) -> &[Range<usize>] {
        &self.levels[level - 1].members
    }

    /// The `width` numbers of each child here, of groups of a `level`, brought to the homes of these groups: of all their children.
    pub fn up(&self, level: usize, values: &[f64], width: usize) -> Vec<f64> {
        let Level { above, below, buffers, .. } = &self.levels[level - 1];
        let (leaving, staying) = values.split_at(above.map_or(0, |(_, count)| width * count));
        let [outgoing, incoming] = &mut *buffers.borrow_mut();
        let neighbours: Vec<usize> = above.iter().chain(below).map(|at| at.0).collect();
        outgoing.resize_with(neighbours.len(), Vec::new);
        incoming.resize_with(neighbours.len(), Vec::new);
        outgoing.iter_mut().chain(&mut *incoming).for_each(Vec::clear);
        if above.is_some() {
            outgoing[0].extend_from_slice(leaving);
        }
        let theirs = &mut incoming[usize::from(above.is_some())..];
        theirs.iter_mut().zip(below).for_each(|(into, &(_, count))| into.resize(width * count, 0.0));
        self.comm.exchange(&neighbours, outgoing, incoming);
        let theirs = incoming[usize::from(above.is_some())..].iter().flatten();
        staying.iter().chain(theirs).copied().collect()
    }

    /// The way back: numbers for all children of the groups at home here to where these children are.
    pub fn down(&self, level: usize, values: &[f64], width: usize) -> Vec<f64> {
        let Level { above, below, buffers, .. } = &self.levels[level - 1];
        let behind: usize = below.iter().map(|&(_, count)| width * count).sum();
        let (staying, mut leaving) = values.split_at(values.len() - behind);
        let [outgoing, incoming] = &mut *buffers.borrow_mut();
        let neighbours: Vec<usize> = above.iter().chain(below).map(|at| at.0).collect();
        outgoing.resize_with(neighbours.len(), Vec::new);
        incoming.resize_with(neighbours.len(), Vec::new);
        outgoing.iter_mut().chain(&mut *incoming).for_each(Vec::clear);
        if let Some((_, count)) = above {
            incoming[0].resize(width * count, 0.0);
        }
        for (out, &(_, count)) in outgoing[usize::from(above.is_some())..].iter_mut().zip(below) {
            out.extend_from_slice(leaving.split_off(..width * count).expect("numbers of all children"));
        }
        self.comm.exchange(&neighbours, outgoing, incoming);
        let first: &[f64] = if above.is_some() { &incoming[0] } else { &[] };
        first.iter().chain(staying).copied().collect()
    }

    /// Sums of `width` numbers an own subdomain over each group of a level that is at home here. Collective.
    pub fn sum(&self, level: usize, values: &[f64], width: usize) -> Vec<f64> {
        self.fold(level, values, width, |sum, x| sum + x)
    }

    /// As [`Tree::sum`], with another way to put numbers together.
    pub fn fold(&self, level: usize, values: &[f64], width: usize, join: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut values = values.to_vec();
        for level in 1..=level {
            let all = self.up(level, &values, width);
            values.clear();
            for members in self.members(level) {
                let begin = values.len();
                values.extend_from_slice(&all[width * members.start..][..width]);
                for member in members.start + 1..members.end {
                    values[begin..].iter_mut().zip(&all[width * member..]).for_each(|(sum, x)| *sum = join(*sum, *x));
                }
            }
        }
        values
    }

    /// The `width` numbers of each group of a level that is at home here, for its own subdomains on each rank. Collective.
    pub fn spread(&self, level: usize, values: &[f64], width: usize) -> Vec<f64> {
        let mut values = values.to_vec();
        for level in (1..=level).rev() {
            let mut of_children = Vec::new();
            for (of_group, members) in values.chunks_exact(width).zip(self.members(level)) {
                members.clone().for_each(|_| of_children.extend_from_slice(of_group));
            }
            values = self.down(level, &of_children, width);
        }
        values
    }

    /// The `width` numbers of each cluster that is at home here, of all clusters, on every rank. Collective.
    pub fn of_clusters(&self, mine: &[f64], width: usize) -> Vec<f64> {
        self.comm.all_gather(mine, &self.clusters.counts(width))
    }

    /// Number of own subdomains.
    pub fn own(&self) -> usize {
        self.own
    }

    /// The ranks.
    pub fn comm(&self) -> &'a dyn Comm {
        self.comm
    }
}

impl Level {
    fn new(clusters: &Clusters, level: usize, own: Range<usize>, shares: &Shares) -> Self {
        let (groups, children) = (clusters.beginning(level, own.clone()), clusters.beginning(level - 1, own));
        // What is before the first group belongs to the one before.
        let first = if groups.is_empty() { children.end } else { clusters.children(level, groups.start).start };
        let leaving = first.min(children.end).saturating_sub(children.start);
        let home = |group: usize| shares.owner(clusters.begin(level, group));
        let above =
            (leaving > 0).then(|| (home(clusters.group(level, clusters.begin(level - 1, children.start))), leaving));
        let members = |group: usize| {
            let of = clusters.children(level, group);
            of.start - first..of.end - first
        };
        let members: Vec<Range<usize>> = groups.clone().map(members).collect();
        let mut below: Vec<(usize, usize)> = Vec::new();
        for child in children.end..members.last().map_or(0, |last| first + last.end) {
            let rank = shares.owner(clusters.begin(level - 1, child));
            match below.last_mut() {
                Some((last, count)) if *last == rank => *count += 1,
                _ => below.push((rank, 1)),
            }
        }
        Self { groups, members, above, below, buffers: RefCell::default() }
    }
}
