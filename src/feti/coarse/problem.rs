//! `G = R'B'` and the coarse problem `G G' a = r`: six unknowns a cluster of subdomains, which in plain Total FETI is one.
//!
//! `G x` is local to each cluster; one all-gather brings it to every rank, each of which holds the sparse Cholesky
//! factor of `G G'` and solves redundantly: ranks agree to the last bit, and `G'a` needs no further exchange.

use std::cell::OnceCell;
use std::ops::Range;
use std::rc::Rc;

use thiserror::Error;

use super::bodies::BodyMotions;
use super::factor::{Blocks, CoarseAnalysis, CoarseFactor};
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::{Constraints, Kind, Row};
use crate::decomposition::{Clusters, Decomposition, Subdomain};
use crate::feti::dual::Interconnection;
use crate::feti::dual::gather::Gather;
use crate::feti::inverse::kernel::{MODES, RigidModes};

/// The constraints leave a rigid motion free.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "the supports and contacts do not hold all bodies: the coarse problem is singular near subdomain {subdomain}; \
     add a support, or bring the contact surfaces together"
)]
pub struct Floating {
    /// Where the factorisation of `G G'` broke down.
    pub subdomain: usize,
}

/// A row that acts on a cluster, with a copy of its slot's modes: what is summed lies side by side.
struct Acting {
    row: u32,
    modes: [f64; MODES],
}

/// `G` and the factor of `G G'`.
pub struct Coarse<'a> {
    comm: &'a dyn Comm,
    clusters: Clusters,
    /// Own clusters, as ranges of own subdomains.
    members: Vec<Range<usize>>,
    transposed: Transposed,
    /// What acts on each own cluster, in row order: equalities, and inequalities.
    acting: [Vec<Vec<Acting>>; 2],
    /// `G G'` of the equalities, on every rank.
    equalities: OnceCell<Blocks>,
    motions: BodyMotions,
    /// One over the squared length of each row, and whether rows are of unequal length.
    unit: Vec<f64>,
    uneven: bool,
    /// Analysis for all rows; it fits every choice of them.
    symbolic: OnceCell<Rc<CoarseAnalysis>>,
    /// Of all rows; present once the coarse problem is set up.
    factor: Option<CoarseFactor>,
}

/// `G'` by rows: for each slot of each row the cluster, and the values of its six modes. Gluing within a cluster has none.
#[derive(Default)]
struct Transposed {
    /// First slot of each row, and the end.
    begin: Vec<u32>,
    cluster: Vec<u32>,
    modes: Vec<[f64; MODES]>,
    /// Rows with slots.
    moving: Vec<u32>,
}

impl Transposed {
    /// One neighbour exchange.
    fn new(
        clusters: &Clusters,
        subdomains: &[Subdomain],
        modes: &[RigidModes],
        constraints: &Constraints,
        gather: &Gather,
    ) -> Self {
        let mut result = Self { begin: vec![0], ..Self::default() };
        gather.exchange(
            MODES,
            |own, slots| {
                for entry in gather.entries(own) {
                    let (node, axis) = (entry.dof as usize / 3, entry.dof as usize % 3);
                    let row = modes[own].at(subdomains[own].points[node])[axis];
                    let at = MODES * entry.slot as usize;
                    slots[at..at + MODES].iter_mut().zip(row).for_each(|(s, r)| *s += entry.value * r);
                }
            },
            |row, values| {
                let cluster = |slot: usize| clusters.of(constraints.slot_subdomain[slot] as usize) as u32;
                let slots = constraints.slots(row).map(cluster).zip(values.as_chunks::<MODES>().0);
                result.push(row, &constraints.rows[row], slots);
            },
        );
        result
    }

    /// Adds the next row, with the clusters and modes' values of its slots.
    fn push<'s>(&mut self, row: usize, of: &Row, slots: impl Iterator<Item = (u32, &'s [f64; MODES])>) {
        let begin = self.cluster.len();
        for (cluster, six) in slots {
            // Copies of one node, unless it is contact.
            let is_copy = of.law().always_holds() && self.cluster[begin..].last() == Some(&cluster);
            if let Some(sum) = self.modes.last_mut().filter(|_| is_copy) {
                sum.iter_mut().zip(six).for_each(|(s, x)| *s += x);
            } else {
                self.cluster.push(cluster);
                self.modes.push(*six);
            }
        }
        if of.kind == Kind::Gluing && self.cluster.len() == begin + 1 {
            self.cluster.truncate(begin);
            self.modes.truncate(begin);
        }
        if self.cluster.len() > begin {
            self.moving.push(row as u32);
        }
        self.begin.push(self.cluster.len() as u32);
    }

    /// What acts on each of `count` own clusters, of which this is the `first`: equalities, and inequalities.
    fn acting(&self, constraints: &Constraints, first: usize, count: usize) -> [Vec<Vec<Acting>>; 2] {
        let mut acting = [(); 2].map(|()| (0..count).map(|_| Vec::new()).collect::<Vec<Vec<Acting>>>());
        for (row, of) in constraints.rows.iter().enumerate() {
            let acting = &mut acting[usize::from(!of.law().always_holds())];
            for slot in self.slots(row) {
                if let Some(own) = (self.cluster[slot] as usize).checked_sub(first).filter(|&own| own < count) {
                    acting[own].push(Acting { row: row as u32, modes: self.modes[slot] });
                }
            }
        }
        acting
    }

    /// Number of rows.
    fn rows(&self) -> usize {
        self.begin.len() - 1
    }

    fn slots(&self, row: usize) -> Range<usize> {
        self.begin[row] as usize..self.begin[row + 1] as usize
    }
}

impl<'a> Coarse<'a> {
    /// Computes `G = R'B'`. Nothing is solved before [`Coarse::factorise`]. Collective.
    pub fn new(
        comm: &'a dyn Comm,
        Decomposition { clusters, subdomains, .. }: &Decomposition,
        constraints: &Constraints,
        Interconnection { gather, modes, .. }: &Interconnection,
    ) -> Self {
        let members: Vec<Range<usize>> = clusters.of_rank(comm.rank()).collect();
        let transposed = Transposed::new(clusters, subdomains, modes, constraints, gather);
        let acting = transposed.acting(constraints, clusters.shares.begin(comm.rank()), members.len());
        Self {
            comm,
            motions: BodyMotions::new(comm, clusters, subdomains, modes),
            clusters: clusters.clone(),
            members,
            unit: constraints.rows.iter().map(|row| (row.length * row.length).recip()).collect(),
            uneven: constraints.uneven,
            transposed,
            acting,
            equalities: OnceCell::new(),
            symbolic: OnceCell::new(),
            factor: None,
        }
    }

    /// Factorises `G G'` of all rows. Collective.
    ///
    /// # Errors
    /// If it is singular: on every rank.
    pub fn factorise(&mut self) -> Result<(), Floating> {
        self.factor = Some(self.restricted(|_| true)?);
        Ok(())
    }

    /// The factor of `G G'` with only the kept rows of the constraints. Collective.
    ///
    /// # Errors
    /// If these rows leave a rigid motion free: on every rank.
    pub fn restricted(&self, kept: impl Fn(usize) -> bool) -> Result<CoarseFactor, Floating> {
        self.factor_of(&self.blocks(&kept), || self.unit_blocks(&kept))
    }

    /// The factor of blocks, which need not be those of some rows. `unit` are the blocks if all rows were unit vectors: where
    /// stiffness jumps, they tell free motions from those that something soft holds. Collective.
    ///
    /// # Errors
    /// If they are singular: on every rank.
    pub fn factor_of(&self, blocks: &Blocks, unit: impl FnOnce() -> Blocks) -> Result<CoarseFactor, Floating> {
        let clusters = self.clusters.total();
        let symbolic = self.symbolic.get_or_init(|| Rc::new(CoarseAnalysis::new(&self.blocks(|_| true), clusters)));
        let fitting = if symbolic.holds(blocks) { symbolic } else { &Rc::new(CoarseAnalysis::new(blocks, clusters)) };
        let factor = CoarseFactor::new(fitting, blocks);
        let sound = factor.and_then(|factor| {
            let checked = factor.check_rank();
            let held = |_| CoarseFactor::new(fitting, &unit())?.check_rank();
            if self.uneven { checked.or_else(held) } else { checked }.map(|()| factor)
        });
        sound.map_err(|cluster| Floating { subdomain: self.clusters.first(cluster) })
    }

    /// The blocks of `G G'` of the kept rows, which are all equalities and some inequalities; lower triangle, on every rank.
    /// Collective.
    pub fn blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        let [equalities, inequalities] = &self.acting;
        let constant = || self.products(equalities, |_| 1.0).into_iter().collect();
        let mut blocks: Blocks = self.equalities.get_or_init(constant).clone();
        add(&mut blocks, self.products(inequalities, |row| f64::from(kept(row))));
        blocks
    }

    /// Rigid motions of whole bodies, orthonormal, that the kept rows, all equalities among them, leave free. They do not
    /// depend on how long rows are. Collective.
    pub fn free(&self, kept: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
        self.motions.free(&self.unit_blocks(kept))
    }

    /// As [`Coarse::blocks`], were all rows unit vectors. Collective.
    pub fn unit_blocks(&self, kept: impl Fn(usize) -> bool) -> Blocks {
        let mut blocks = Blocks::new();
        for acting in &self.acting {
            add(&mut blocks, self.products(acting, |row| if kept(row) { self.unit[row] } else { 0.0 }));
        }
        blocks
    }

    /// `G' motion` of all rows, of six numbers a cluster. Local.
    pub fn moved(&self, motion: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.transposed.rows()];
        self.add_transpose(1.0, motion, &mut rows);
        rows
    }

    /// Rigid motions of whole bodies.
    pub fn motions(&self) -> &BodyMotions {
        &self.motions
    }

    /// Force of a row's unit multiplier on the bodies, six numbers each. Local.
    pub fn force_on_bodies(&self, row: usize) -> Vec<f64> {
        let mut forces = vec![0.0; MODES * self.motions.bodies()];
        for slot in self.transposed.slots(row) {
            self.motions.add_force(self.transposed.cluster[slot] as usize, &self.transposed.modes[slot], &mut forces);
        }
        forces
    }

    /// Blocks of `G W G'` of some rows, given for each own cluster, with the diagonal `W`; lower triangle, those of all ranks
    /// on every rank. Complete: every row that a subdomain takes part in is on its rank. Collective.
    fn products(
        &self,
        acting: &[Vec<Acting>],
        weight: impl Fn(usize) -> f64,
    ) -> Vec<((usize, usize), [f64; MODES * MODES])> {
        let first = self.clusters.shares.begin(self.comm.rank());
        let mut message = Vec::new();
        for (cluster, acting) in (first..).zip(acting) {
            // A cluster has few neighbours.
            let (mut columns, mut blocks): (Vec<u32>, Vec<[f64; MODES * MODES]>) = Default::default();
            for Acting { row, modes } in acting {
                let weight = weight(*row as usize);
                if weight == 0.0 {
                    continue;
                }
                let modes = modes.map(|g| weight * g);
                for other in self.transposed.slots(*row as usize) {
                    let column = self.transposed.cluster[other];
                    if column as usize > cluster {
                        continue;
                    }
                    let at = columns.iter().position(|c| *c == column).unwrap_or_else(|| {
                        blocks.push([0.0; MODES * MODES]);
                        columns.push(column);
                        columns.len() - 1
                    });
                    for (a, products) in modes.iter().zip(blocks[at].as_chunks_mut::<MODES>().0) {
                        products.iter_mut().zip(&self.transposed.modes[other]).for_each(|(p, b)| *p += a * b);
                    }
                }
            }
            for (column, block) in columns.iter().zip(&blocks) {
                message.extend([cluster as u64, u64::from(*column)]);
                message.extend(block.map(f64::to_bits));
            }
        }
        let all = all_gather_u64(self.comm, &message);
        let blocks = all.as_chunks::<{ 2 + MODES * MODES }>().0.iter();
        blocks.map(|&[row, column, block @ ..]| ((row as usize, column as usize), block.map(f64::from_bits))).collect()
    }

    /// `G rows`, whole on every rank. One all-gather.
    pub fn apply(&self, rows: &[f64]) -> Vec<f64> {
        self.comm.all_gather(self.resultants(rows).as_flattened(), &self.clusters.shares.counts(MODES))
    }

    /// As [`Coarse::apply`], and in the same all-gather the sums over all subdomains of `width` numbers, given for each own
    /// one.
    pub fn apply_with_sums(&self, rows: &[f64], partial: &[f64], width: usize) -> (Vec<f64>, Vec<f64>) {
        let partial = self.over_members(partial, width);
        let mut mine = Vec::with_capacity((MODES + width) * self.members.len());
        for (six, values) in self.resultants(rows).iter().zip(partial.chunks_exact(width)) {
            mine.extend_from_slice(six);
            mine.extend_from_slice(values);
        }
        let all = self.comm.all_gather(&mine, &self.clusters.shares.counts(MODES + width));
        let mut sums = vec![0.0; width];
        let mut result = Vec::with_capacity(MODES * self.clusters.total());
        for of_cluster in all.chunks_exact(MODES + width) {
            let (six, values) = of_cluster.split_at(MODES);
            result.extend_from_slice(six);
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        (result, sums)
    }

    /// `G rows` of the own clusters, each summed over the equalities, then the inequalities, in the order of the rows.
    fn resultants(&self, rows: &[f64]) -> Vec<[f64; MODES]> {
        let [equalities, inequalities] = &self.acting;
        let of_cluster = |(equalities, inequalities): (&Vec<Acting>, &Vec<Acting>)| {
            let mut sum = [0.0; MODES];
            for Acting { row, modes } in equalities.iter().chain(inequalities) {
                let x = rows[*row as usize];
                sum.iter_mut().zip(modes).for_each(|(s, g)| *s += g * x);
            }
            sum
        };
        equalities.iter().zip(inequalities).map(of_cluster).collect()
    }

    /// Sums six numbers an own subdomain over each cluster and brings them to every rank.
    pub fn share(&self, mine: &[f64]) -> Vec<f64> {
        self.comm.all_gather(&self.over_members(mine, MODES), &self.clusters.shares.counts(MODES))
    }

    /// Sums of `width` numbers an own subdomain over each own cluster.
    fn over_members(&self, mine: &[f64], width: usize) -> Vec<f64> {
        let mut sums = Vec::with_capacity(width * self.members.len());
        for members in &self.members {
            let begin = sums.len();
            sums.extend_from_slice(&mine[width * members.start..][..width]);
            for of_member in mine[width * (members.start + 1)..width * members.end].chunks_exact(width) {
                sums[begin..].iter_mut().zip(of_member).for_each(|(s, x)| *s += x);
            }
        }
        sums
    }

    /// Of six numbers a cluster, those for a subdomain.
    pub fn of_subdomain<'b>(&self, subdomain: usize, amplitudes: &'b [f64]) -> &'b [f64] {
        &amplitudes[MODES * self.clusters.of(subdomain)..][..MODES]
    }

    /// `(G G')^-1 a`, in place. Local.
    pub fn solve(&self, a: &mut [f64]) {
        self.factor.as_ref().expect("factorised").solve(a);
    }

    /// `rows += factor G' a`. Local.
    pub fn add_transpose(&self, factor: f64, a: &[f64], rows: &mut [f64]) {
        let a = a.as_chunks::<MODES>().0;
        for &row in &self.transposed.moving {
            let of_slot = |slot: usize| dot(&self.transposed.modes[slot], &a[self.transposed.cluster[slot] as usize]);
            rows[row as usize] += factor * self.transposed.slots(row as usize).map(of_slot).sum::<f64>();
        }
    }
}

fn add(blocks: &mut Blocks, products: Vec<((usize, usize), [f64; MODES * MODES])>) {
    for (place, product) in products {
        let block = blocks.entry(place).or_insert([0.0; MODES * MODES]);
        block.iter_mut().zip(product).for_each(|(b, p)| *b += p);
    }
}

/// The sum of products, as three chains of additions.
fn dot(g: &[f64; MODES], a: &[f64; MODES]) -> f64 {
    (g[0] * a[0] + g[3] * a[3]) + (g[1] * a[1] + g[4] * a[4]) + (g[2] * a[2] + g[5] * a[5])
}
