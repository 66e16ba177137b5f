//! `D^-1`: how easily the unknowns of each subdomain give way, the others held: the inverse of the stiffness' diagonal, or
//! of its blocks for nodes that short edges tie together.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use super::gather::Gather;
use super::gram::Site;
use crate::assembly::pattern::Pattern;
use crate::constraint::ties::Group;
use crate::constraint::{Constraints, Term};

/// A group that gives way so many times as easily as its nodes alone is not held by the others: its nodes count alone.
const LOOSE: f64 = 1e10;

/// `D^-1` of own subdomains, and at the slots of all rows.
#[derive(Default)]
pub struct Flexibility {
    /// Of each own subdomain's unknowns alone.
    alone: Vec<Vec<f64>>,
    /// Of each own subdomain's groups.
    tied: Vec<Vec<Tied>>,
    /// The three components' at the node of each slot.
    of_slot: Vec<[f64; 3]>,
    /// For slots of tied nodes, where their lines begin.
    line_of_slot: Vec<u32>,
    /// Three lines a slot: what forces at all nodes of the group move there.
    lines: Vec<f64>,
    /// Numbers in a line.
    width: usize,
}

/// A group of an own subdomain.
struct Tied {
    /// Unknowns of its nodes on the interface.
    dofs: Vec<u32>,
    /// `D^-1` among them, line by line.
    values: Vec<f64>,
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
        for (own, (pattern, values)) in stiffness.enumerate() {
            let alone: Vec<f64> = pattern.diagonal(values).iter().map(|d| 1.0 / d).collect();
            let groups = constraints.ties.of_own(own).iter();
            result.tied.push(groups.map(|group| Tied::new(group, pattern, values, &alone)).collect());
            result.alone.push(alone);
        }
        result.exchange(constraints, gather);
        result
    }

    /// Brings to each slot what is its node's.
    fn exchange(&mut self, constraints: &Constraints, gather: &Gather) {
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
        let mut count = 0;
        for (row, of_row) in constraints.rows.iter().enumerate() {
            for (slot, part) in constraints.slots(row).zip(of_row.terms.chunk_by(Term::share_slot)) {
                if constraints.ties.place(part[0].subdomain, part[0].node).is_some() {
                    self.line_of_slot[slot] = count;
                    count += 3;
                }
            }
        }
        self.lines = vec![0.0; count as usize * self.width];
        let places: Vec<Vec<(u32, u32)>> = self.tied.iter().map(|groups| places(groups)).collect();
        for column in 0..self.width {
            let Self { tied, line_of_slot, lines, width, .. } = self;
            gather.exchange(
                3,
                |own, slots| {
                    for entry in gather.entries(own) {
                        let node = 3 * (entry.dof / 3);
                        let Ok(at) = places[own].binary_search_by_key(&node, |(dof, _)| *dof) else { continue };
                        let group = &tied[own][places[own][at].1 as usize];
                        if column < group.dofs.len() {
                            let first = group.place(node).expect("it is in the group");
                            for axis in 0..3 {
                                slots[3 * entry.slot as usize + axis] = group.at(first + axis, column);
                            }
                        }
                    }
                },
                |row, values| {
                    for (slot, three) in constraints.slots(row).zip(values.chunks_exact(3)) {
                        let line = line_of_slot[slot];
                        if line != u32::MAX {
                            for (line, value) in (line as usize..).zip(three) {
                                lines[line * *width + column] = *value;
                            }
                        }
                    }
                },
            );
        }
    }

    /// How a unit force at one unknown moves another, which is the same or tied to it.
    pub fn between(&self, a: Site, b: Site) -> f64 {
        match b.tied {
            Some(place) => {
                let line = self.line_of_slot[a.slot as usize] + a.axis;
                self.lines[line as usize * self.width + (3 * place + b.axis) as usize]
            }
            None => self.of_slot[a.slot as usize][a.axis as usize],
        }
    }

    /// `x = D^-1 x` on some unknowns of an own subdomain, ascending; zero elsewhere.
    pub fn apply(&self, own: usize, dofs: &[u32], x: &mut [f64]) {
        let forces: Vec<Vec<f64>> = self.tied[own].iter().map(|group| group.collect(dofs, x)).collect();
        x.iter_mut().zip(dofs).for_each(|(x, &dof)| *x *= self.alone[own][dof as usize]);
        for (group, forces) in self.tied[own].iter().zip(forces) {
            for (line, &dof) in group.dofs.iter().enumerate() {
                if let Ok(at) = dofs.binary_search(&dof) {
                    x[at] = forces.iter().enumerate().map(|(column, force)| group.at(line, column) * force).sum();
                }
            }
        }
    }
}

/// First unknown of each tied node and the number of its group, ascending.
fn places(groups: &[Tied]) -> Vec<(u32, u32)> {
    let of_group = |(number, group): (u32, &Tied)| -> Vec<(u32, u32)> {
        group.dofs.iter().step_by(3).map(|&dof| (dof, number)).collect()
    };
    let mut places: Vec<(u32, u32)> = (0..).zip(groups).flat_map(of_group).collect();
    places.sort_unstable();
    places
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

    fn place(&self, dof: u32) -> Option<usize> {
        self.dofs.binary_search(&dof).ok()
    }

    /// Of values at some unknowns, ascending, those at its own; zero where there are none.
    fn collect(&self, dofs: &[u32], x: &[f64]) -> Vec<f64> {
        self.dofs.iter().map(|dof| dofs.binary_search(dof).map_or(0.0, |at| x[at])).collect()
    }
}
