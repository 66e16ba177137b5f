//! Sums over subdomains, row by row, between the ranks that hold the rows.
//!
//! Each row has slots, one behind the other, which belong to subdomains, ascending. The owner of a subdomain fills its slots, and every
//! rank that holds a row is given all slots of it: the same bits anywhere.

use std::cell::RefCell;

use crate::comm::{Comm, Shares};
use crate::constraint::Constraints;

/// Slots of the rows of one rank.
pub struct Slots<'a> {
    comm: &'a dyn Comm,
    /// First slot of each row, and the end.
    begin: Vec<u32>,
    neighbours: Vec<Neighbour>,
    buffers: RefCell<Buffers>,
}

/// A rank that shares rows with this one.
struct Neighbour {
    rank: usize,
    /// Own slots that it needs, and its slots that are needed here; both in the order of the rows.
    sends: Vec<u32>,
    receives: Vec<u32>,
}

#[derive(Default)]
struct Buffers {
    slots: Vec<f64>,
    outgoing: Vec<Vec<f64>>,
    incoming: Vec<Vec<f64>>,
}

impl<'a> Slots<'a> {
    /// Slots begin where `begin` says, row by row, and belong to these `subdomains`.
    pub fn new(
        comm: &'a dyn Comm,
        shares: &Shares,
        constraints: &Constraints,
        begin: Vec<u32>,
        subdomains: &[u32],
    ) -> Self {
        let rank = comm.rank();
        let mut plan: Vec<(Vec<u32>, Vec<u32>)> = vec![Default::default(); comm.size()];
        for (rows, holders) in constraints.blocks.iter().zip(&constraints.block_subdomains) {
            let mut holders: Vec<usize> = holders.iter().map(|&s| shares.owner(s as usize)).collect();
            holders.dedup();
            for slot in begin[rows.start]..begin[rows.end] {
                let owner = shares.owner(subdomains[slot as usize] as usize);
                if owner != rank {
                    plan[owner].1.push(slot);
                    continue;
                }
                for &holder in holders.iter().filter(|&&h| h != rank) {
                    plan[holder].0.push(slot);
                }
            }
        }
        let neighbours = plan
            .into_iter()
            .enumerate()
            .filter(|(_, (sends, receives))| !sends.is_empty() || !receives.is_empty())
            .map(|(rank, (sends, receives))| Neighbour { rank, sends, receives })
            .collect();
        Self { comm, begin, neighbours, buffers: RefCell::default() }
    }

    /// Number of rows on this rank.
    pub fn rows(&self) -> usize {
        self.begin.len() - 1
    }

    /// Slots of a row.
    pub fn of_row(&self, row: usize) -> std::ops::Range<usize> {
        self.begin[row] as usize..self.begin[row + 1] as usize
    }

    /// Lets `fill` add the numbers of own subdomains to their slots, `width` a slot, and hands the slots of each row to `take`. One
    /// neighbour exchange.
    pub fn exchange(&self, width: usize, fill: impl FnOnce(&mut [f64]), mut take: impl FnMut(usize, &[f64])) {
        let Buffers { slots, outgoing, incoming } = &mut *self.buffers.borrow_mut();
        slots.clear();
        slots.resize(width * self.begin[self.rows()] as usize, 0.0);
        fill(slots);
        let of = |slot: u32| width * slot as usize..width * (slot as usize + 1);
        outgoing.resize_with(self.neighbours.len(), Vec::new);
        incoming.resize_with(self.neighbours.len(), Vec::new);
        for ((neighbour, out), into) in self.neighbours.iter().zip(&mut *outgoing).zip(&mut *incoming) {
            out.clear();
            neighbour.sends.iter().for_each(|&slot| out.extend_from_slice(&slots[of(slot)]));
            into.resize(width * neighbour.receives.len(), 0.0);
        }
        let ranks: Vec<usize> = self.neighbours.iter().map(|n| n.rank).collect();
        self.comm.exchange(&ranks, outgoing, incoming);
        for (neighbour, data) in self.neighbours.iter().zip(&*incoming) {
            for (&slot, values) in neighbour.receives.iter().zip(data.chunks_exact(width)) {
                slots[of(slot)].copy_from_slice(values);
            }
        }
        for row in 0..self.rows() {
            let of_row = self.of_row(row);
            take(row, &slots[width * of_row.start..width * of_row.end]);
        }
    }
}
