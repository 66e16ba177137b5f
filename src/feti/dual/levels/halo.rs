//! Numbers of the subdomains of other ranks that have rows in common with own ones.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use crate::comm::{Comm, Shares};
use crate::constraint::Constraints;

/// Which subdomains each rank needs of which.
pub struct Halo<'a> {
    comm: &'a dyn Comm,
    first: usize,
    own: usize,
    /// Numbers of others' subdomains, by rank and ascending.
    others: Vec<u32>,
    ranks: Vec<usize>,
    /// Own subdomains that each of the ranks needs.
    sends: Vec<Vec<u32>>,
    /// How many subdomains come from each of them.
    receives: Vec<usize>,
    buffers: RefCell<[Vec<Vec<f64>>; 2]>,
}

impl<'a> Halo<'a> {
    /// Of rows' blocks. Local: both ranks know which blocks they have in common.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints) -> Self {
        let owner = |subdomain: u32| shares.owner(subdomain as usize);
        let rank = comm.rank();
        let (first, own) = (shares.begin(rank), shares.0[rank]);
        let mut plan: BTreeMap<usize, [BTreeSet<u32>; 2]> = BTreeMap::new();
        for subdomains in &constraints.block_subdomains {
            let of: Vec<(usize, u32)> = subdomains.iter().map(|&s| (owner(s), s)).collect();
            for &(other, theirs) in of.iter().filter(|(other, _)| *other != rank) {
                let [sends, receives] = plan.entry(other).or_default();
                receives.insert(theirs);
                sends.extend(of.iter().filter(|(owner, _)| *owner == rank).map(|(_, own)| own));
            }
        }
        let (mut others, mut sends, mut receives) = (Vec::new(), Vec::new(), Vec::new());
        for [to, from] in plan.values() {
            sends.push(to.iter().map(|&s| s - first as u32).collect());
            receives.push(from.len());
            others.extend(from);
        }
        Self {
            comm,
            first,
            own,
            others,
            ranks: plan.into_keys().collect(),
            sends,
            receives,
            buffers: RefCell::default(),
        }
    }

    /// Place of a subdomain of any row here: own ones first.
    ///
    /// # Panics
    /// If no row here is of it.
    pub fn place(&self, subdomain: u32) -> u32 {
        let own = (subdomain as usize).checked_sub(self.first).filter(|&own| own < self.own);
        let others = || self.own + self.others.binary_search(&subdomain).expect("it has a row here");
        own.unwrap_or_else(others) as u32
    }

    /// Appends others' `width` numbers a subdomain to own ones. One neighbour exchange.
    pub fn fill(&self, values: &mut Vec<f64>, width: usize) {
        let [outgoing, incoming] = &mut *self.buffers.borrow_mut();
        outgoing.resize_with(self.ranks.len(), Vec::new);
        incoming.resize_with(self.ranks.len(), Vec::new);
        for ((out, into), (sends, count)) in
            outgoing.iter_mut().zip(&mut *incoming).zip(self.sends.iter().zip(&self.receives))
        {
            out.clear();
            sends.iter().for_each(|&own| out.extend_from_slice(&values[width * own as usize..][..width]));
            into.resize(width * count, 0.0);
        }
        self.comm.exchange(&self.ranks, outgoing, incoming);
        incoming.iter().for_each(|theirs| values.extend_from_slice(theirs));
    }
}
