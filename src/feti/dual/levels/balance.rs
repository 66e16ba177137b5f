//! The forces by which the members of groups hold each other, from their shapes alone.
//!
//! Forces on a group that balance it as a whole need not balance its members. The gluing rows between these do it, with multipliers
//! `G'x` of least length: `G G'x = R't`, where `G = R'B'` is of these rows and the modes `R` of the members. The transpose finds
//! the rigid motions of the members that bring jumps `j` of these rows nearest to zero: `G G'a = G j`. Groups are balanced from the
//! highest level downwards, as multipliers between groups are forces on their members; motions are found upwards.
//!
//! Of one group of all subdomains this is the projector of Total FETI; of nested ones it costs as much, and iterations grow
//! slowly with the size of the groups.

use std::ops::{Range, RangeInclusive};
use std::rc::Rc;

use faer::{Mat, Side};

use super::gluing::Gluing;
use super::halo::Halo;
use super::motions::Transfer;
use super::stiffness::{Equalities, Inverse, OfLevel, TOGETHER};
use super::{Motions, Tree};
use crate::constraint::Constraints;
use crate::decomposition::Decomposition;
use crate::feti::dual::Interconnection;
use crate::feti::inverse::kernel::MODES;
use crate::work;

/// Forces between the members of groups, and motions of these.
pub struct Balance<'a> {
    tree: &'a Tree<'a>,
    motions: &'a Motions,
    halo: &'a Halo<'a>,
    gluing: &'a Gluing,
    levels: Vec<Level>,
    /// For each level, from 0, the inverses of the diagonal blocks of `G G'` of its groups that are at home here.
    diagonals: Vec<Vec<Transfer>>,
}

/// The groups of a level that are at home here.
struct Level {
    inverses: Vec<Rc<Inverse>>,
    /// Groups that are worked on together, as they have one inverse.
    batches: Vec<Vec<usize>>,
}

impl<'a> Balance<'a> {
    /// Of all groups of subdomains. Collective.
    ///
    /// # Errors
    /// A subdomain of a group whose members are not held by each other: on every rank.
    pub fn new(
        connection: &'a Interconnection<'a>,
        decomposition: &'a Decomposition,
        constraints: &Constraints,
    ) -> Result<Self, usize> {
        let Decomposition { clusters, subdomains, .. } = decomposition;
        let Interconnection { space, halo, tree, motions, gluing, .. } = connection;
        let equalities = Equalities { clusters, connection, subdomains, constraints };
        let (mut levels, mut diagonals) = (Vec::new(), Vec::new());
        for level in 1..=clusters.levels() {
            let OfLevel { inverses, diagonals: of_members } = equalities.of_level(level);
            let loose = inverses
                .iter()
                .position(Option::is_none)
                .map(|at| clusters.begin(level, tree.groups(level).start + at));
            space.lowest(loose).map_or(Ok(()), Err)?;
            levels.push(Level::new(inverses.into_iter().flatten().collect()));
            diagonals.push(of_members.iter().map(inverse).collect());
        }
        Ok(Self { tree, motions, halo, gluing, levels, diagonals })
    }

    /// Multipliers of the rows inside clusters that take the resultants `R't` of own subdomains, six numbers each, which are in
    /// balance over each cluster; zero in other rows. Collective.
    pub fn forces(&self, mut resultants: Vec<f64>, forces: &mut [f64]) {
        forces.fill(0.0);
        for level in (1..=self.levels.len()).rev() {
            let x = self.solve(level, &resultants);
            self.add_moved(level..=level, 1.0, &x, forces);
            if level > 1 {
                let taken = self.resultants(level..=level, forces);
                resultants.iter_mut().zip(taken).for_each(|(r, t)| *r -= t);
            }
        }
    }

    /// Rigid motions of own subdomains, six numbers each, that bring the jumps of the rows inside clusters nearest to zero, level by
    /// level; those of clusters are left as they are. Jumps are those beside the motions then. Collective.
    pub fn motions(&self, jumps: &mut [f64]) -> Vec<f64> {
        let mut motions = vec![0.0; MODES * self.tree.own()];
        for level in 1..=self.levels.len() {
            if level > 1 {
                self.add_moved(level..=level, -1.0, &motions, jumps);
            }
            let sums = self.resultants(level..=level, jumps);
            motions.iter_mut().zip(self.solve(level, &sums)).for_each(|(a, x)| *a += x);
        }
        motions
    }

    /// Brings multipliers near balance: `rows = (I - G'D^-1 G) rows` for the groups of each level, from the lowest upwards, with the
    /// equalities of higher levels and the diagonal blocks `D` of their `G G'`. Collective.
    pub fn relax(&self, rows: &mut [f64]) {
        (0..self.levels.len()).for_each(|level| self.relax_level(level, rows));
    }

    /// The transpose of [`Balance::relax`]: takes rigid motions of groups out of jumps. Collective.
    pub fn relax_transposed(&self, rows: &mut [f64]) {
        (0..self.levels.len()).rev().for_each(|level| self.relax_level(level, rows));
    }

    fn relax_level(&self, level: usize, rows: &mut [f64]) {
        let above = level + 1..=self.levels.len() + 1;
        let mut motions = self.sums(level, &self.resultants(above.clone(), rows));
        book(&self.diagonals[level]);
        for (six, inverse) in motions.as_chunks_mut::<MODES>().0.iter_mut().zip(&self.diagonals[level]) {
            *six = inverse.map(|line| line.iter().zip(&*six).map(|(a, x)| a * x).sum());
        }
        self.add_moved(above, -1.0, &self.of_members(level, motions), rows);
    }

    /// `G rows` for own subdomains, by the rows of some levels.
    fn resultants(&self, levels: RangeInclusive<usize>, rows: &[f64]) -> Vec<f64> {
        let forces = self.gluing.forces(levels, rows).into_iter().zip(&self.motions.shapes);
        forces.flat_map(|(force, modes)| modes.of_force(force)).collect()
    }

    /// `rows += factor G'a` in the rows of some levels, of six numbers an own subdomain. One neighbour exchange.
    fn add_moved(&self, levels: RangeInclusive<usize>, factor: f64, a: &[f64], rows: &mut [f64]) {
        let motions = a.as_chunks::<MODES>().0.iter().zip(&self.motions.shapes);
        let mut motions: Vec<f64> = motions.flat_map(|(a, modes)| modes.to_motion(*a)).collect();
        self.halo.fill(&mut motions, MODES);
        self.gluing.add_jumps(levels, factor, motions.as_chunks::<MODES>().0, rows);
    }

    /// Motions `(G G')^+ r` of the members of the groups of a level, as motions of own subdomains; `r` are six numbers an own subdomain,
    /// which are summed up over each member.
    fn solve(&self, level: usize, resultants: &[f64]) -> Vec<f64> {
        let mut all = self.tree.up(level, &self.sums(level - 1, resultants), MODES);
        self.levels[level - 1].solve(self.tree.members(level), &mut all);
        self.of_members(level - 1, self.tree.down(level, &all, MODES))
    }

    /// Sums of resultants of own subdomains for the groups of a level that are at home here.
    fn sums(&self, level: usize, resultants: &[f64]) -> Vec<f64> {
        let sum = |of: Vec<f64>, level| self.restricted(level, &self.tree.up(level, &of, MODES));
        (1..=level).fold(resultants.to_vec(), sum)
    }

    /// Motions of the groups of a level that are at home here as motions of own subdomains.
    fn of_members(&self, level: usize, motions: Vec<f64>) -> Vec<f64> {
        let down = |of: Vec<f64>, level| self.tree.down(level, &self.prolonged(level, &of), MODES);
        (1..=level).rev().fold(motions, down)
    }

    /// `sum of T_c' r_c` over the children of each group.
    fn restricted(&self, level: usize, of_children: &[f64]) -> Vec<f64> {
        let (children, transfers) = (of_children.as_chunks::<MODES>().0, &self.motions.transfers[level - 1]);
        book(transfers);
        let mut sums = Vec::new();
        for members in self.tree.members(level) {
            let mut sum = [0.0; MODES];
            for (r, transfer) in children[members.clone()].iter().zip(&transfers[members.clone()]) {
                for (r, line) in r.iter().zip(transfer) {
                    sum.iter_mut().zip(line).for_each(|(sum, t)| *sum += t * r);
                }
            }
            sums.extend(sum);
        }
        sums
    }

    /// `T_c a` for the children of each group.
    fn prolonged(&self, level: usize, of_groups: &[f64]) -> Vec<f64> {
        book(&self.motions.transfers[level - 1]);
        let mut motions = Vec::new();
        for (a, members) in of_groups.as_chunks::<MODES>().0.iter().zip(self.tree.members(level)) {
            for transfer in &self.motions.transfers[level - 1][members.clone()] {
                motions.extend(transfer.map(|line| line.iter().zip(a).map(|(t, a)| t * a).sum::<f64>()));
            }
        }
        motions
    }
}

impl Level {
    fn new(inverses: Vec<Rc<Inverse>>) -> Self {
        let mut batches: Vec<Vec<usize>> = Vec::new();
        let mut order: Vec<usize> = (0..inverses.len()).collect();
        order.sort_by_key(|&group| Rc::as_ptr(&inverses[group]));
        for alike in order.chunk_by(|&a, &b| Rc::ptr_eq(&inverses[a], &inverses[b])) {
            batches.extend(alike.chunks(TOGETHER).map(<[usize]>::to_vec));
        }
        Self { inverses, batches }
    }

    /// Overwrites six numbers for each member of each group by their motions.
    fn solve(&self, members: &[Range<usize>], values: &mut [f64]) {
        let values = values.as_chunks_mut::<MODES>().0;
        for groups in &self.batches {
            let inverse = &self.inverses[groups[0]];
            let mut x = vec![[0.0; TOGETHER]; inverse.length];
            for (lane, &group) in groups.iter().enumerate() {
                let of_group = values[members[group].clone()][1..].as_flattened();
                x.iter_mut().zip(of_group).for_each(|(x, value)| x[lane] = *value);
            }
            let y = inverse.multiply(&x, groups.len());
            for (lane, &group) in groups.iter().enumerate() {
                let (first, others) = values[members[group].clone()].split_at_mut(1);
                first[0] = [0.0; MODES];
                others.as_flattened_mut().iter_mut().zip(&y).for_each(|(value, y)| *value = y[lane]);
            }
        }
    }
}

/// Books products of vectors with these matrices.
fn book(matrices: &[Transfer]) {
    work::each(matrices.len(), 2 * MODES * MODES, size_of::<Transfer>());
}

/// The pseudo-inverse of a block: equalities need not hold a subdomain.
fn inverse(block: &[[f64; MODES]; MODES]) -> [[f64; MODES]; MODES] {
    let eigen = Mat::from_fn(MODES, MODES, |i, j| block[i][j]).self_adjoint_eigen(Side::Lower).expect("it is finite");
    let (values, vectors) = (eigen.S(), eigen.U());
    let least = FREE * values[MODES - 1];
    let entry = |i: usize, j: usize| -> f64 {
        (0..MODES).filter(|&k| values[k] > least).map(|k| vectors[(i, k)] * vectors[(j, k)] / values[k]).sum()
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// Motions that equalities resist by less than this share of the most are free.
const FREE: f64 = 1e-9;
