//! `B u` and `B' lambda`.
//!
//! Multipliers live on every rank that holds their row, so `B'` is local. For `B` each subdomain fills its slots of
//! the rows, neighbours exchange slots, and every holder adds a row's slots in subdomain order: the same bits anywhere.

use std::cell::RefCell;

use crate::comm::{Comm, Shares};
use crate::constraint::{Constraints, Entry};
use crate::feti::Torn;
use crate::work;

/// The constraint matrix B of one rank.
pub struct Gather<'a> {
    comm: &'a dyn Comm,
    /// Coefficients of each own subdomain.
    entries: Vec<Vec<Entry>>,
    /// Local unknowns of each own subdomain.
    dofs: Vec<usize>,
    slot_begin: Vec<u32>,
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

impl<'a> Gather<'a> {
    /// For subdomains with so many local unknowns each.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints, dofs: Vec<usize>) -> Self {
        let rank = comm.rank();
        let mut plan: Vec<(Vec<u32>, Vec<u32>)> = vec![Default::default(); comm.size()];
        for (rows, subdomains) in constraints.blocks.iter().zip(&constraints.block_subdomains) {
            let mut holders: Vec<usize> = subdomains.iter().map(|&s| shares.owner(s as usize)).collect();
            holders.dedup();
            for row in rows.clone() {
                for slot in constraints.slots(row) {
                    let owner = shares.owner(constraints.slot_subdomain[slot] as usize);
                    if owner != rank {
                        plan[owner].1.push(slot as u32);
                        continue;
                    }
                    for &holder in holders.iter().filter(|&&h| h != rank) {
                        plan[holder].0.push(slot as u32);
                    }
                }
            }
        }
        let neighbours = plan
            .into_iter()
            .enumerate()
            .filter(|(_, (sends, receives))| !sends.is_empty() || !receives.is_empty())
            .map(|(rank, (sends, receives))| Neighbour { rank, sends, receives })
            .collect();
        Self {
            comm,
            entries: constraints.entries.clone(),
            dofs,
            slot_begin: constraints.slot_begin.clone(),
            neighbours,
            buffers: RefCell::default(),
        }
    }

    /// Number of rows on this rank.
    pub fn rows(&self) -> usize {
        self.slot_begin.len() - 1
    }

    /// Coefficients of an own subdomain, by row.
    pub fn entries(&self, own: usize) -> &[Entry] {
        &self.entries[own]
    }

    /// Unknowns of each own subdomain that rows touch, ascending.
    pub fn boundaries(&self) -> Vec<Vec<u32>> {
        let touched = |entries: &Vec<Entry>| {
            let mut dofs: Vec<u32> = entries.iter().map(|entry| entry.dof).collect();
            dofs.sort_unstable();
            dofs.dedup();
            dofs
        };
        self.entries.iter().map(touched).collect()
    }

    /// A torn vector of zeros.
    pub fn zeros(&self) -> Torn {
        self.dofs.iter().map(|&n| vec![0.0; n]).collect()
    }

    /// `torn += factor B' rows`. Local.
    pub fn add_transpose(&self, factor: f64, rows: &[f64], torn: &mut Torn) {
        for (own, part) in torn.iter_mut().enumerate() {
            self.add_transpose_one(own, factor, rows, part);
        }
    }

    /// `local += factor B_s' rows` for one own subdomain.
    pub fn add_transpose_one(&self, own: usize, factor: f64, rows: &[f64], local: &mut [f64]) {
        work::each(self.entries[own].len(), 2, size_of::<Entry>());
        for entry in &self.entries[own] {
            local[entry.dof as usize] += factor * entry.value * rows[entry.row as usize];
        }
    }

    /// `rows = B torn`. One neighbour exchange.
    pub fn apply(&self, torn: &Torn, rows: &mut [f64]) {
        let fill = |own: usize, slots: &mut [f64]| {
            work::each(self.entries[own].len(), 2, size_of::<Entry>());
            for entry in &self.entries[own] {
                slots[entry.slot as usize] += entry.value * torn[own][entry.dof as usize];
            }
        };
        // From zero, not by `sum`, which begins with -0.
        self.exchange(1, fill, |row, slots| rows[row] = slots.iter().fold(0.0, |sum, slot| sum + slot));
    }

    /// Hands to `take` what the six modes of each slot's subdomain make of each `wanted` row, given one component of the modes'
    /// displacements of an own subdomain's node. One neighbour exchange.
    pub fn moved(
        &self,
        wanted: impl Fn(usize) -> bool,
        modes: impl Fn(usize, usize, usize) -> [f64; 6],
        mut take: impl FnMut(usize, &[[f64; 6]]),
    ) {
        let fill = |own: usize, slots: &mut [f64]| {
            let slots = slots.as_chunks_mut::<6>().0;
            for entry in self.entries[own].iter().filter(|entry| wanted(entry.row as usize)) {
                let of_dof = modes(own, entry.dof as usize / 3, entry.dof as usize % 3);
                slots[entry.slot as usize].iter_mut().zip(of_dof).for_each(|(sum, x)| *sum += entry.value * x);
            }
        };
        self.exchange(6, fill, |row, slots| {
            if wanted(row) {
                take(row, slots.as_chunks().0);
            }
        });
    }

    /// Lets `fill` add the numbers of each own subdomain to its slots, `width` a slot, and hands the slots of each row to `take`, in
    /// subdomain order. One neighbour exchange.
    pub fn exchange(&self, width: usize, fill: impl Fn(usize, &mut [f64]), mut take: impl FnMut(usize, &[f64])) {
        let Buffers { slots, outgoing, incoming } = &mut *self.buffers.borrow_mut();
        let count = self.slot_begin[self.rows()] as usize;
        slots.clear();
        slots.resize(width * count, 0.0);
        for own in 0..self.entries.len() {
            fill(own, slots);
        }
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
            take(row, &slots[width * self.slot_begin[row] as usize..width * self.slot_begin[row + 1] as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::fixture::{
        RANKS, assert_close, built_in, column, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis,
    };
    use crate::scene::Scene;

    fn scenes() -> [Scene; 3] {
        [two_bricks(&[]), two_bricks_by_metis(9), built_in("patch", &[])]
    }

    #[test]
    fn b_and_its_transpose_are_those_of_the_rows() {
        for scene in scenes() {
            on_ranks(&scene, 1, |setup| {
                let (b, u, x) = (setup.dense_rows(), setup.displacements(1), setup.multipliers(2));
                let mut bu = vec![f64::NAN; x.len()];
                setup.gather.apply(&u, &mut bu);
                assert_close(&column(&bu), &(&b * column(&u.concat())), 1e-14);
                let mut torn = u.clone();
                setup.gather.add_transpose(-2.0, &x, &mut torn);
                assert_close(
                    &column(&torn.concat()),
                    &(column(&u.concat()) - 2.0 * (b.transpose() * column(&x))),
                    1e-14,
                );
            });
        }
    }

    #[test]
    fn b_and_its_transpose_are_adjoint_over_any_ranks() {
        for scene in scenes() {
            for ranks in RANKS {
                on_ranks(&scene, ranks, |setup| {
                    let (u, x) = (setup.displacements(1), setup.multipliers(2));
                    let mut bu = vec![0.0; x.len()];
                    setup.gather.apply(&u, &mut bu);
                    let mut torn = setup.gather.zeros();
                    setup.gather.add_transpose(1.0, &x, &mut torn);
                    let local = |(u, f): (&Vec<f64>, &Vec<f64>)| u.iter().zip(f).map(|(u, f)| u * f).sum();
                    let partial: Vec<f64> = u.iter().zip(&torn).map(local).collect();
                    let [over_rows, size] = setup.space.dots(&[(&bu, &x), (&x, &x)])[..] else { panic!() };
                    assert!((over_rows - setup.space.sum(&partial, 1)[0]).abs() < 1e-14 * size);
                });
            }
        }
    }

    #[test]
    fn images_are_the_same_bits_on_any_ranks_and_on_all_that_hold_a_row() {
        for scene in scenes() {
            same_on_any_ranks(&scene, |setup| {
                let mut torn = setup.gather.zeros();
                setup.gather.add_transpose(1.0, &setup.multipliers(3), &mut torn);
                torn.concat()
            });
            let image = |setup: &crate::fixture::Setup| {
                let mut bu = vec![0.0; setup.rows().len()];
                setup.gather.apply(&setup.displacements(4), &mut bu);
                bu
            };
            same_on_any_ranks(&scene, |setup| setup.owned(&image(setup)));
            // Back through B', every holder's copy counts.
            same_on_any_ranks(&scene, |setup| {
                let mut torn = setup.gather.zeros();
                setup.gather.add_transpose(1.0, &image(setup), &mut torn);
                torn.concat()
            });
        }
    }
}
