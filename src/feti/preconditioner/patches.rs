//! Scaling of large components of conditions, near each subdomain by itself.
//!
//! `A = B D^-1 B'` couples all conditions of a contact whose meshes do not match, but its inverse decays within a few of them. So each
//! subdomain `s` has the inverse of the rows that it [holds](crate::constraint::reach), `A_s = R_s A R_s'`: those that it touches and those around
//! them. With `T_s = D_s^-1 B_s' A_s^-1 R_s` the preconditioner is `sum over s of T_s' S_s T_s`, which is symmetric. Where a subdomain holds
//! all of a component this is the scaling of [`super::scaling`].

use crate::comm::{Comm, Shares};
use crate::constraint::Constraints;
use crate::feti::Torn;
use crate::feti::dual::gather::Gather;
use crate::feti::dual::gram::{Gram, Products};
use crate::feti::dual::slots::Slots;

use super::flexibility::Flexibility;

/// Who holds which rows of parts.
pub struct Patches<'a> {
    /// A slot for each subdomain that holds a row of a part, the copies' slots of other rows.
    slots: Slots<'a>,
    /// Rows of parts.
    rows: Vec<usize>,
    /// Whether each row is of a part.
    is_part: Vec<bool>,
    of_own: Vec<Patch>,
}

/// What an own subdomain holds of parts.
struct Patch {
    /// Places among the rows of parts, ascending.
    places: Vec<u32>,
    /// Its slot of each of them.
    slots: Vec<u32>,
}

impl<'a> Patches<'a> {
    /// Nothing, if no rank has parts.
    pub fn new(comm: &'a dyn Comm, shares: &Shares, constraints: &Constraints) -> Option<Self> {
        if !constraints.has_parts {
            return None;
        }
        let (first, own) = (shares.begin(comm.rank()), shares.0[comm.rank()]);
        let mut of_own: Vec<Patch> = (0..own).map(|_| Patch { places: Vec::new(), slots: Vec::new() }).collect();
        let (mut begin, mut subdomains, mut rows) = (vec![0], Vec::new(), Vec::new());
        let mut is_part = vec![false; constraints.rows.len()];
        let blocks = constraints.blocks.iter().zip(&constraints.block_subdomains).zip(&constraints.is_part);
        for ((of_block, holders), part) in blocks {
            for row in of_block.clone() {
                if *part {
                    is_part[row] = true;
                    for (slot, &holder) in (subdomains.len() as u32..).zip(holders) {
                        if let Some(own) = (holder as usize).checked_sub(first).and_then(|own| of_own.get_mut(own)) {
                            own.places.push(rows.len() as u32);
                            own.slots.push(slot);
                        }
                    }
                    rows.push(row);
                    subdomains.extend(holders);
                } else {
                    subdomains.extend(&constraints.slot_subdomain[constraints.slots(row)]);
                }
                begin.push(subdomains.len() as u32);
            }
        }
        Some(Self { slots: Slots::new(comm, shares, constraints, begin, &subdomains), rows, is_part, of_own })
    }

    /// `A_s` of each own subdomain, which have no factors of it yet; none of those that hold nothing of parts. `known` are those of another
    /// flexibility, if there are any.
    pub fn grams(
        &self,
        constraints: &Constraints,
        flexibility: &Flexibility,
        known: Vec<Option<Gram>>,
    ) -> Vec<Option<Gram>> {
        let all = Products::new(constraints, self.rows.clone(), true, |a, b| flexibility.between(a, b));
        let of = |(patch, known): (&Patch, Option<Gram>)| {
            let products = (!patch.places.is_empty()).then(|| all.principal(&patch.places))?;
            Some(match known {
                Some(known) => known.renew(products),
                None => Gram::new(products),
            })
        };
        self.of_own.iter().zip(known.into_iter().chain(std::iter::repeat_with(|| None))).map(of).collect()
    }

    /// The rows of parts get `sum over s of R_s' A_s^-1 B_s x`, the others `B x`. One neighbour exchange.
    pub fn sum(&self, gather: &Gather, grams: &mut [Option<Gram>], x: &Torn, rows: &mut [f64]) {
        let count = rows.len();
        let fill = |slots: &mut [f64]| {
            let (mut moved, mut found) = (vec![0.0; count], vec![0.0; count]);
            for (own, (patch, gram)) in self.of_own.iter().zip(grams).enumerate() {
                for entry in gather.entries(own) {
                    let (row, value) = (entry.row as usize, entry.value * x[own][entry.dof as usize]);
                    if self.is_part[row] {
                        moved[row] += value;
                    } else {
                        slots[self.slots.of_row(row).start + gather.place(entry)] += value;
                    }
                }
                let Some(gram) = gram else { continue };
                gram.solve(&moved, &mut found);
                for (&place, &slot) in patch.places.iter().zip(&patch.slots) {
                    let row = self.rows[place as usize];
                    (slots[slot as usize], moved[row]) = (found[row], 0.0);
                }
            }
        };
        self.slots.exchange(1, fill, |row, slots| rows[row] = slots.iter().fold(0.0, |sum, slot| sum + slot));
    }

    /// Takes the rows of parts from `from`.
    pub fn copy(&self, from: &[f64], to: &mut [f64]) {
        self.rows.iter().for_each(|&row| to[row] = from[row]);
    }
}
