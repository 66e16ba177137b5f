//! `D^-1`: how easily the unknowns of each subdomain give way, the others held: the inverse of the stiffness' diagonal, or
//! of its blocks for nodes that short edges tie together.

use std::collections::HashMap;

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use crate::constraint::ties::Group;
use crate::constraint::{Constraints, Term};
use crate::feti::dual::gather::Gather;
use crate::feti::dual::gram::SlotUnknown;
use crate::sparse::pattern::Pattern;
use crate::work;

/// A group that gives way so many times as easily as its nodes alone is not held by the others: its nodes count alone.
const LOOSE: f64 = 1e10;

/// `D^-1` of own subdomains, and at the slots of all rows.
#[derive(Default)]
pub struct Flexibility {
    /// Of each own subdomain's unknowns alone.
    alone: Vec<Vec<f64>>,
    /// Of each own subdomain's groups, on the unknowns that rows touch.
    tied: Vec<Vec<Touched>>,
    /// The three components' at the node of each slot.
    of_slot: Vec<[f64; 3]>,
    /// For slots of tied nodes, where the lines of their copy begin.
    line_of_slot: Vec<u32>,
    /// Three lines a copy: what forces at all nodes of its group move there.
    lines: Vec<f64>,
    /// Numbers in a line.
    width: usize,
}

impl Flexibility {
    /// From patterns and lower values of the own subdomains' stiffness matrices. `1 + 3 n` neighbour exchanges where groups
    /// have up to `n` nodes on the interface.
    pub fn new<'s>(
        constraints: &Constraints,
        gather: &Gather,
        stiffness: impl Iterator<Item = (&'s Pattern, &'s [f64])>,
    ) -> Self {
        let mut result = Self { width: 3 * constraints.ties.widest(), ..Self::default() };
        let mut tied: Vec<Vec<Tied>> = Vec::new();
        for (own, (pattern, values)) in stiffness.enumerate() {
            let alone: Vec<f64> = pattern.diagonal(values).iter().map(|d| 1.0 / d).collect();
            let groups = constraints.ties.of_own(own).iter();
            tied.push(groups.map(|group| Tied::new(group, pattern, values, &alone)).collect());
            result.alone.push(alone);
        }
        result.exchange(constraints, gather, &tied);
        result.tied = if result.width == 0 {
            tied.iter().map(|_| Vec::new()).collect()
        } else {
            let touched = |(tied, boundary): (&Vec<Tied>, Vec<u32>)| {
                let of_group = tied.iter().map(|group| group.touched(&boundary));
                of_group.filter(|group| !group.places.is_empty()).collect()
            };
            tied.iter().zip(gather.boundaries()).map(touched).collect()
        };
        result
    }

    /// How far a unit multiplier of a row moves its own displacement, if nothing but its nodes moves (length over force, in the
    /// units of the row).
    pub fn of_row(&self, constraints: &Constraints, row: usize) -> f64 {
        let slots = constraints.slots(row).zip(constraints.rows[row].terms.chunk_by(Term::share_slot));
        let of_slot = |(slot, part): (usize, &[Term])| -> f64 {
            part.iter().map(|term| term.value * term.value * self.of_slot[slot][term.axis]).sum()
        };
        slots.map(of_slot).sum()
    }

    /// Brings the flexibility of its node to each slot.
    fn exchange(&mut self, constraints: &Constraints, gather: &Gather, tied: &[Vec<Tied>]) {
        let slots = constraints.slot_subdomain.len();
        self.of_slot = vec![[0.0; 3]; slots];
        // Every slot belongs to one node of its subdomain: three numbers tell the flexibility there.
        let Self { alone, of_slot, .. } = self;
        gather.exchange(
            3,
            |own, slots| {
                for entry in gather.entries(own) {
                    let node = 3 * (entry.dof as usize / 3);
                    slots[3 * entry.slot as usize..][..3].copy_from_slice(&alone[own][node..node + 3]);
                }
            },
            |row, values| {
                for (slot, three) in constraints.slots(row).zip(values.chunks_exact(3)) {
                    of_slot[slot].copy_from_slice(three);
                }
            },
        );
        if self.width == 0 {
            return;
        }
        self.line_of_slot = vec![u32::MAX; slots];
        let mut copies = HashMap::new();
        for (row, of_row) in constraints.rows.iter().enumerate() {
            for (slot, part) in constraints.slots(row).zip(of_row.terms.chunk_by(Term::share_slot)) {
                let copy = (part[0].subdomain, part[0].node);
                if constraints.ties.place(copy.0, copy.1).is_some() {
                    let next = 3 * copies.len() as u32;
                    self.line_of_slot[slot] = *copies.entry(copy).or_insert(next);
                }
            }
        }
        self.lines = vec![0.0; 3 * copies.len() * self.width];
        let sent: Vec<Vec<Sent>> = tied.iter().enumerate().map(|(own, tied)| Sent::all(gather, own, tied)).collect();
        let Self { line_of_slot, lines, width, .. } = self;
        for column in 0..*width {
            gather.exchange(
                3,
                |own, slots| {
                    for &Sent { slot, group, line } in &sent[own] {
                        let group = &tied[own][group];
                        if column < group.dofs.len() {
                            (0..3).for_each(|axis| slots[3 * slot + axis] = group.at(line + axis, column));
                        }
                    }
                },
                |row, values| {
                    for (slot, three) in constraints.slots(row).zip(values.chunks_exact(3)) {
                        let line = line_of_slot[slot];
                        if line != u32::MAX {
                            (line as usize..).zip(three).for_each(|(line, x)| lines[line * *width + column] = *x);
                        }
                    }
                },
            );
        }
    }

    /// How a unit force at one unknown moves another, which is the same or tied to it.
    pub fn between(&self, a: SlotUnknown, b: SlotUnknown) -> f64 {
        match b.tied {
            Some(place) => {
                let line = self.line_of_slot[a.slot as usize] + a.axis;
                self.lines[line as usize * self.width + (3 * place + b.axis) as usize]
            }
            None => self.of_slot[a.slot as usize][a.axis as usize],
        }
    }

    /// `x = D^-1 x` on the unknowns of an own subdomain that rows touch: its `boundary`, ascending.
    pub fn apply(&self, own: usize, boundary: &[u32], x: &mut [f64]) {
        let forces: Vec<Vec<f64>> = self.tied[own].iter().map(|group| group.collect(x)).collect();
        work::each(boundary.len(), 1, size_of::<f64>());
        self.tied[own].iter().for_each(|group| work::each(group.values.len(), 2, size_of::<f64>()));
        x.iter_mut().zip(boundary).for_each(|(x, &dof)| *x *= self.alone[own][dof as usize]);
        for (Touched { places, values }, forces) in self.tied[own].iter().zip(forces) {
            for (&place, line) in places.iter().zip(values.chunks_exact(places.len())) {
                x[place as usize] = line.iter().zip(&forces).map(|(value, force)| value * force).sum();
            }
        }
    }
}

/// A slot of a tied node.
struct Sent {
    slot: usize,
    /// Number of the group of its subdomain.
    group: usize,
    /// First line of the node in the group.
    line: usize,
}

impl Sent {
    /// All of an own subdomain.
    fn all(gather: &Gather, own: usize, tied: &[Tied]) -> Vec<Self> {
        let mut place = HashMap::new();
        for (group, Tied { dofs, .. }) in tied.iter().enumerate() {
            dofs.iter().enumerate().for_each(|(line, &dof)| assert!(place.insert(dof, (group, line)).is_none()));
        }
        let mut all = Vec::new();
        for entry in gather.entries(own) {
            if let Some(&(group, line)) = place.get(&(3 * (entry.dof / 3))) {
                all.push(Self { slot: entry.slot as usize, group, line });
            }
        }
        all
    }
}

/// A group of an own subdomain.
struct Tied {
    /// Unknowns of its nodes on the interface.
    dofs: Vec<u32>,
    /// `D^-1` among them, line by line.
    values: Vec<f64>,
}

impl Tied {
    fn new(group: &Group, pattern: &Pattern, values: &[f64], alone: &[f64]) -> Self {
        let all: Vec<u32> = group.nodes.iter().flat_map(|node| (0..3).map(move |axis| 3 * node + axis)).collect();
        let places: Vec<usize> =
            group.on_interface.iter().flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis)).collect();
        let stiffness = Mat::from_fn(all.len(), all.len(), |i, j| pattern.value(values, all[i], all[j]));
        let inverse = stiffness.llt(Side::Lower).ok().map(|factor| factor.inverse());
        let is_held =
            |inverse: &Mat<f64>| all.iter().enumerate().all(|(k, &dof)| inverse[(k, k)] < LOOSE * alone[dof as usize]);
        let inverse = inverse.filter(is_held);
        let value = |(i, j): (usize, usize)| match &inverse {
            Some(inverse) => inverse[(i.max(j), i.min(j))],
            None => f64::from(u8::from(i == j)) * alone[all[i] as usize],
        };
        let pairs = places.iter().flat_map(|&i| places.iter().map(move |&j| (i, j)));
        Self { values: pairs.map(value).collect(), dofs: places.iter().map(|&k| all[k]).collect() }
    }

    fn at(&self, line: usize, column: usize) -> f64 {
        self.values[line * self.dofs.len() + column]
    }

    /// What is left of it where only the boundary, ascending, has forces.
    fn touched(&self, boundary: &[u32]) -> Touched {
        let lines: Vec<usize> =
            (0..self.dofs.len()).filter(|&line| boundary.binary_search(&self.dofs[line]).is_ok()).collect();
        let place = |&line: &usize| boundary.partition_point(|&dof| dof < self.dofs[line]) as u32;
        let values = lines.iter().flat_map(|&line| lines.iter().map(move |&column| self.at(line, column))).collect();
        Touched { places: lines.iter().map(place).collect(), values }
    }
}

/// The unknowns of a group that rows touch.
struct Touched {
    /// Their places on the boundary.
    places: Vec<u32>,
    /// `D^-1` among them, line by line.
    values: Vec<f64>,
}

impl Touched {
    fn collect(&self, x: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&place| x[place as usize]).collect()
    }
}
