//! The coarse problem: `G = R'B'` and `G G'`, six unknowns a cluster of subdomains, which in plain Total FETI is one.
//!
//! `G x` is local to each cluster; one all-gather brings it to every rank. Each rank holds the factors of the equalities
//! ([`super::base`]) and, where a program asks for them, of all rows ([`super::projector`]). All ranks get the whole solution, to the
//! same bits, and `G'a` needs no further exchange.

use std::cell::OnceCell;
use std::rc::Rc;

use thiserror::Error;

use super::base::Base;
use super::bodies::BodyMotions;
use super::contacts::Contacts;
use super::equalities::Equalities;
use super::face::CoarseFace;
use super::factor::{CoarseAnalysis, CoarseFactor};
use super::sliding::Weight;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::Constraints;
use crate::decomposition::{Clusters, Decomposition};
use crate::feti::dual::Interconnection;
use crate::feti::dual::blocks::{Block, Blocks, Place, add_block, pack, unpack};
use crate::feti::dual::levels::Tree;
use crate::feti::inverse::kernel::MODES;
use crate::work;

/// The constraints leave a rigid motion free.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "the supports and contacts do not hold all bodies: the coarse problem is singular near subdomain {subdomain}; \
     add a support, or bring the contact surfaces together"
)]
pub struct Floating {
    /// Where the factorisation of `G G'` broke down, or what moves.
    pub subdomain: usize,
}

/// `G` and the coarse problem.
pub struct Coarse<'a> {
    comm: &'a dyn Comm,
    clusters: &'a Clusters,
    tree: &'a Tree<'a>,
    equalities: Equalities<'a>,
    contacts: Contacts,
    motions: BodyMotions,
    /// One over the squared length of each row, and whether rows are of unequal length.
    unit: Vec<f64>,
    uneven: bool,
    /// `G G'` of the equalities, on every rank.
    permanent: OnceCell<Blocks>,
    /// Analysis for all rows; it fits every choice of them.
    symbolic: OnceCell<Rc<CoarseAnalysis>>,
    /// Of the equalities; present once the coarse problem is set up.
    base: Option<Rc<Base>>,
    /// Of all rows, from when it is asked for.
    pub(super) whole: OnceCell<CoarseFactor>,
}

impl<'a> Coarse<'a> {
    /// Computes `G = R'B'`. Nothing is solved before [`Coarse::factorise`]. Collective.
    pub fn new(
        comm: &'a dyn Comm,
        decomposition: &'a Decomposition,
        constraints: &'a Constraints,
        connection: &'a Interconnection<'a>,
    ) -> Self {
        let tree = &connection.tree;
        Self {
            comm,
            motions: BodyMotions::new(tree, &decomposition.subdomains, connection.modes()),
            equalities: Equalities::new(decomposition, constraints, connection),
            contacts: Contacts::new(decomposition, constraints, connection),
            clusters: &decomposition.clusters,
            tree,
            unit: constraints.rows.iter().map(|row| (row.length * row.length).recip()).collect(),
            uneven: constraints.uneven,
            permanent: OnceCell::new(),
            symbolic: OnceCell::new(),
            base: None,
            whole: OnceCell::new(),
        }
    }

    /// Factorises the coarse problem of the equalities. Collective.
    ///
    /// # Errors
    /// If all rows together leave a rigid motion free: on every rank.
    pub fn factorise(&mut self) -> Result<(), Floating> {
        self.base = Some(Rc::new(Base::of_equalities(self)?));
        let all = CoarseFace::loose(self, vec![true; self.unit.len()]);
        all.free().first().map_or(Ok(()), |motion| {
            let most = (0..motion.len()).max_by(|&a, &b| motion[a].abs().total_cmp(&motion[b].abs()));
            Err(self.floating(most.unwrap_or(0) / MODES))
        })
    }

    /// The coarse problem of the equalities.
    ///
    /// # Panics
    /// Before [`Coarse::factorise`].
    pub(super) fn base(&self) -> &Rc<Base> {
        self.base.as_ref().expect("factorised")
    }

    fn floating(&self, cluster: usize) -> Floating {
        Floating { subdomain: self.clusters.first(cluster) }
    }

    /// The factor of some blocks, which need not be those of some rows. `unit` are the blocks if all rows were unit vectors: where
    /// stiffness jumps, they tell free motions from those that something soft holds. Collective.
    ///
    /// # Errors
    /// If they are singular: on every rank.
    pub(super) fn factor_of(&self, blocks: &Blocks, unit: impl FnOnce() -> Blocks) -> Result<CoarseFactor, Floating> {
        let clusters = self.clusters.total();
        let analysis =
            self.symbolic.get_or_init(|| Rc::new(CoarseAnalysis::new(&self.blocks(|_| 1.0.into()), clusters)));
        let fitting = if analysis.holds(blocks) { analysis } else { &Rc::new(CoarseAnalysis::new(blocks, clusters)) };
        let factor = CoarseFactor::new(self.comm, fitting, blocks);
        let sound = factor.and_then(|factor| {
            let checked = factor.check_rank(self.comm);
            let held = |_| CoarseFactor::new(self.comm, fitting, &unit())?.check_rank(self.comm);
            if self.uneven { checked.or_else(held) } else { checked }.map(|()| factor)
        });
        sound.map_err(|cluster| self.floating(cluster))
    }

    /// Blocks of `G W G'` of the equalities and the contacts with these weights `W`, those of all ranks on every rank; lower
    /// triangle. Collective.
    pub(super) fn blocks(&self, weight: impl Fn(usize) -> Weight) -> Blocks {
        let mut blocks = self.permanent.get_or_init(|| self.gathered(self.equalities.products(|_| 1.0))).clone();
        add(&mut blocks, self.gathered(self.contacts.products(weight)));
        blocks
    }

    /// As [`Coarse::blocks`], were all rows unit vectors. Collective.
    pub(super) fn unit_blocks(&self, weight: impl Fn(usize) -> Weight) -> Blocks {
        let mut blocks = self.gathered(self.equalities.products(|row| self.unit[row]));
        add(&mut blocks, self.gathered(self.contacts.products(|row| self.as_unit(row, weight(row)))));
        blocks
    }

    /// Blocks of `G W G'` of the contacts alone, and those if these rows were unit vectors. Collective.
    pub(super) fn contact_blocks(&self, weight: impl Fn(usize) -> Weight) -> [Blocks; 2] {
        let unit = self.contacts.products(|row| self.as_unit(row, weight(row)));
        [self.contacts.products(weight), unit].map(|parts| self.gathered(parts))
    }

    /// The weight of a row, were it a unit vector.
    fn as_unit(&self, row: usize, Weight { own, other }: Weight) -> Weight {
        let beside = |(other, weight): (usize, f64)| (other, weight * (self.unit[row] * self.unit[other]).sqrt());
        Weight { own: own * self.unit[row], other: other.map(beside) }
    }

    /// Solves with the factor of the equalities, in place: six numbers a cluster, equal on all ranks. Collective.
    ///
    /// # Panics
    /// Before [`Coarse::factorise`].
    pub fn solve(&self, a: &mut [f64]) {
        self.base().solve(self.comm, a);
    }

    /// Numbers in the factor of the equalities.
    ///
    /// # Panics
    /// Before [`Coarse::factorise`].
    pub fn factor_length(&self) -> usize {
        self.base().length()
    }

    /// Whether any contact, on any rank, is among the kept rows. Collective.
    pub(super) fn has_contacts(&self, kept: &[bool]) -> bool {
        !self.gathered(self.contacts.products(|row| f64::from(kept[row]).into())).is_empty()
    }

    /// Number of clusters.
    pub(super) fn clusters(&self) -> usize {
        self.clusters.total()
    }

    pub(super) fn comm(&self) -> &dyn Comm {
        self.comm
    }

    /// Sums of the blocks that own subdomains have a part in, those of all ranks. Collective.
    fn gathered(&self, mut of_clusters: Vec<(Place, Block)>) -> Blocks {
        if !self.clusters.are_single() {
            of_clusters = self.brought_home(of_clusters);
        }
        unpack(&all_gather_u64(self.comm, &pack(&of_clusters))).collect()
    }

    /// Sums of the blocks that subdomains have a part in, on the rank where the row's cluster is at home, in the order of the
    /// subdomains. Collective.
    fn brought_home(&self, parts: Vec<(Place, Block)>) -> Vec<(Place, Block)> {
        let mut outgoing = vec![Vec::new(); self.comm.size()];
        for part in parts {
            let home = self.tree.home(self.clusters.first(part.0.0));
            outgoing[home].extend(pack(&[part]));
        }
        let mut sums = Blocks::new();
        for theirs in self.comm.all_to_all(outgoing) {
            unpack(&theirs).for_each(|(place, block)| add_block(&mut sums, place, block));
        }
        sums.into_iter().collect()
    }

    /// Rigid motions of whole bodies, orthonormal, that equalities leave free. They do not depend on how long rows are. Collective.
    pub fn free(&self) -> Vec<Vec<f64>> {
        self.motions.free(&self.unit_blocks(|_| 0.0.into()))
    }

    /// `G' motion` of all rows, of six numbers a cluster. Local.
    pub fn moved(&self, motion: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.unit.len()];
        self.add_transpose(1.0, motion, &mut rows);
        rows
    }

    /// Rigid motions of whole bodies.
    pub fn motions(&self) -> &BodyMotions {
        &self.motions
    }

    /// Force of a contact's unit multiplier on the bodies, six numbers each. Local.
    pub fn force_on_bodies(&self, row: usize) -> Vec<f64> {
        let mut forces = vec![0.0; MODES * self.motions.bodies()];
        self.contacts.forces(row).for_each(|(cluster, modes)| self.motions.add_force(cluster, modes, &mut forces));
        forces
    }

    /// `G rows`, whole on every rank. One all-gather.
    pub fn apply(&self, rows: &[f64]) -> Vec<f64> {
        let mut mine = self.equalities.resultants(rows);
        for (sum, of_contacts) in mine.iter_mut().zip(self.contacts.resultants(|row| rows[row])) {
            sum.iter_mut().zip(of_contacts).for_each(|(sum, x)| *sum += x);
        }
        self.share(mine.as_flattened())
    }

    /// `G_B x`, `G_X x` and `G_X r` with the rows B of a base and all others X, and the sums over all subdomains of `width`
    /// numbers, given for each own one; all whole on every rank. `r` may be empty. One all-gather.
    pub(super) fn apply_each(
        &self,
        base: &Base,
        (x, r): (&[f64], &[f64]),
        partial: &[f64],
        width: usize,
    ) -> ([Vec<f64>; 3], Vec<f64>) {
        let outside = |row: usize, x: &[f64]| if base.has_contact(row) { 0.0 } else { x[row] };
        let mut inside = self.contacts.resultants(|row| if base.has_contact(row) { x[row] } else { 0.0 });
        let mut contacts = self.contacts.resultants(|row| outside(row, x));
        let mut beside = self.contacts.resultants(|row| if r.is_empty() { 0.0 } else { outside(row, r) });
        let length = 3 * MODES + width;
        let mut mine = Vec::with_capacity(length * self.tree.own());
        for (own, e) in self.equalities.resultants(x).into_iter().enumerate() {
            mine.extend(e.iter().zip(inside.next().unwrap_or_default()).map(|(e, i)| e + i));
            mine.extend(contacts.next().into_iter().chain(beside.next()).flatten());
            mine.extend_from_slice(&partial[width * own..][..width]);
        }
        let all = self.over_clusters(&mine, length);
        work::each(all.len(), 1, size_of::<f64>());
        let mut sums = vec![0.0; width];
        let mut parts = [(); 3].map(|()| Vec::with_capacity(MODES * self.clusters.total()));
        for of_cluster in all.chunks_exact(length) {
            let (sixes, values) = of_cluster.split_at(3 * MODES);
            parts.iter_mut().zip(sixes.chunks_exact(MODES)).for_each(|(part, six)| part.extend_from_slice(six));
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        (parts, sums)
    }

    /// Sums six numbers an own subdomain over each cluster and brings them to every rank.
    pub fn share(&self, mine: &[f64]) -> Vec<f64> {
        self.over_clusters(mine, MODES)
    }

    /// Sums of `width` numbers an own subdomain over each cluster, of all clusters on every rank. Collective.
    fn over_clusters(&self, mine: &[f64], width: usize) -> Vec<f64> {
        self.tree.of_clusters(&self.tree.sum(self.tree.levels(), mine, width), width)
    }

    /// Of six numbers a cluster, those for a subdomain.
    pub fn of_subdomain(&self, subdomain: usize, amplitudes: &[f64]) -> [f64; MODES] {
        amplitudes.as_chunks().0[self.clusters.of(subdomain)]
    }

    /// `rows += factor G'a`. Local.
    pub fn add_transpose(&self, factor: f64, a: &[f64], rows: &mut [f64]) {
        self.equalities.add_transpose(factor, a, rows);
        self.contacts.add_transpose(|_| true, factor, a, rows);
    }

    /// As [`Coarse::add_transpose`], in the rows of a base. Local.
    pub(super) fn add_transpose_in(&self, base: &Base, factor: f64, a: &[f64], rows: &mut [f64]) {
        self.equalities.add_transpose(factor, a, rows);
        self.contacts.add_transpose(|row| base.has_contact(row), factor, a, rows);
    }

    /// As [`Coarse::add_transpose`], in the rows outside a base. Local.
    pub(super) fn add_transpose_outside(&self, base: &Base, factor: f64, a: &[f64], rows: &mut [f64]) {
        self.contacts.add_transpose(|row| !base.has_contact(row), factor, a, rows);
    }
}

fn add(blocks: &mut Blocks, more: Blocks) {
    more.into_iter().for_each(|(place, product)| add_block(blocks, place, product));
}
