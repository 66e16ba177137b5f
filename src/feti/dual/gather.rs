//! `B u` and `B' lambda`.
//!
//! Multipliers live on every rank that holds their row, so `B'` is local. For `B` each subdomain fills its slots of
//! the rows, neighbours exchange slots, and every holder adds a row's slots in subdomain order: the same bits anywhere.

use super::slots::Slots;
use crate::comm::{Comm, Shares};
use crate::constraint::{Constraints, Entry};
use crate::feti::Torn;
use crate::work;

/// The constraint matrix B of one rank.
pub struct Gather<'a> {
    /// Coefficients of each own subdomain.
    entries: Vec<Vec<Entry>>,
    /// Local unknowns of each own subdomain.
    dofs: Vec<usize>,
    slots: Slots<'a>,
}

impl<'a> Gather<'a> {
    /// For subdomains with so many local unknowns each.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints, dofs: Vec<usize>) -> Self {
        let (begin, subdomains) = (constraints.slot_begin.clone(), &constraints.slot_subdomain);
        let slots = Slots::new(comm, shares, constraints, begin, subdomains);
        Self { entries: constraints.entries.clone(), dofs, slots }
    }

    /// Number of rows on this rank.
    pub fn rows(&self) -> usize {
        self.slots.rows()
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
    pub fn exchange(&self, width: usize, fill: impl Fn(usize, &mut [f64]), take: impl FnMut(usize, &[f64])) {
        self.slots.exchange(width, |slots| (0..self.entries.len()).for_each(|own| fill(own, slots)), take);
    }

    /// The place of an entry among the slots of its row.
    pub fn place(&self, entry: &Entry) -> usize {
        entry.slot as usize - self.slots.of_row(entry.row as usize).start
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
