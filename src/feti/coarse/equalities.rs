//! `G` of the equalities: clusters against each other and their supports ([`Gluing`](crate::feti::dual::levels::gluing)'s level above all).
//!
//! Rows act on subdomains with a force and a moment about the subdomain's centre, and these on its cluster.

use std::collections::HashMap;

use crate::constraint::Constraints;
use crate::decomposition::Decomposition;
use crate::feti::dual::Interconnection;
use crate::feti::dual::blocks::{Block, FewBlocks, Place, add_product};
use crate::feti::dual::levels::levers::Six;
use crate::feti::inverse::kernel::{MODES, RigidModes, moved_force, moved_motion};
use crate::work;

/// Numbers that tell where a subdomain is in its cluster.
const NUMBERS: usize = 17;

/// `G` of one rank's equalities.
pub(super) struct Equalities<'a> {
    decomposition: &'a Decomposition,
    constraints: &'a Constraints,
    connection: &'a Interconnection<'a>,
    /// The level of the rows.
    level: usize,
    /// Clusters of all subdomains of rows here, with their modes.
    clusters: Vec<(usize, RigidModes)>,
    /// For each of these subdomains, own ones first, which cluster it is in, and how far its centre is from the cluster's.
    places: Vec<(u32, [f64; 3])>,
}

impl<'a> Equalities<'a> {
    /// Of the rows of this rank. One neighbour exchange.
    pub fn new(
        decomposition: &'a Decomposition,
        constraints: &'a Constraints,
        connection: &'a Interconnection<'a>,
    ) -> Self {
        let Interconnection { halo, motions, tree, .. } = connection;
        let of_own = decomposition.subdomains.iter().zip(&motions.levels[0]).zip(connection.modes());
        let mut numbers: Vec<f64> = of_own
            .flat_map(|((subdomain, own), modes)| {
                let cluster = decomposition.clusters.of(subdomain.id) as f64;
                modes.to_numbers().into_iter().chain(modes.arm(own)).chain([cluster])
            })
            .collect();
        halo.fill(&mut numbers, NUMBERS);
        let (mut clusters, mut places, mut known) = (Vec::new(), Vec::new(), HashMap::new());
        for [modes @ .., x, y, z, cluster] in numbers.as_chunks::<NUMBERS>().0 {
            let number = *known.entry(*cluster as usize).or_insert_with(|| {
                clusters.push((*cluster as usize, RigidModes::from_numbers(modes)));
                clusters.len() - 1
            });
            places.push((number as u32, [*x, *y, *z]));
        }
        Self { decomposition, constraints, connection, level: tree.levels() + 1, clusters, places }
    }

    /// What own subdomains add to `G x`.
    pub fn resultants(&self, x: &[f64]) -> Vec<Six> {
        let forces = self.connection.gluing.forces(self.level..=self.level, x);
        let on_cluster = |(force, (cluster, arm)): (Six, &(u32, [f64; 3]))| {
            self.clusters[*cluster as usize].1.of_force(moved_force(force, *arm))
        };
        forces.into_iter().zip(&self.places).map(on_cluster).collect()
    }

    /// `rows += factor G'a`.
    pub fn add_transpose(&self, factor: f64, a: &[f64], rows: &mut [f64]) {
        let a = a.as_chunks::<MODES>().0;
        let motions: Vec<Six> = self.clusters.iter().map(|(cluster, modes)| modes.to_motion(a[*cluster])).collect();
        let of_place = |(cluster, arm): &(u32, [f64; 3])| moved_motion(motions[*cluster as usize], *arm);
        let motions: Vec<Six> = self.places.iter().map(of_place).collect();
        self.connection.gluing.add_jumps(self.level..=self.level, factor, &motions, rows);
    }

    /// Blocks of `G W G'` with a weight of each row: for each own subdomain its cluster, and what it adds to the lower blocks of that line,
    /// by column. Complete: every row that a subdomain takes part in is on its rank. One neighbour exchange.
    pub fn products(&self, weight: impl Fn(usize) -> f64) -> Vec<(Place, Block)> {
        let (Decomposition { clusters, subdomains, .. }, modes) = (self.decomposition, self.connection.modes());
        let constraints = self.constraints;
        let mut blocks: Vec<FewBlocks> = (0..subdomains.len()).map(|_| FewBlocks::default()).collect();
        let of_dof = |own: usize, node: usize, axis| modes[own].along(axis, subdomains[own].points[node]);
        let is_mine = |row: usize| self.connection.gluing.level(row) == Some(self.level);
        self.connection.gather.moved(is_mine, of_dof, |row, sixes| {
            let weight = weight(row);
            let slots = &constraints.slot_subdomain[constraints.slots(row)];
            for (&subdomain, six) in slots.iter().zip(sixes) {
                let Some(blocks) = blocks.get_mut(self.connection.halo.place(subdomain) as usize) else { continue };
                let (cluster, six) = (clusters.of(subdomain as usize), six.map(|g| weight * g));
                for (&other, beside) in slots.iter().zip(sixes) {
                    let column = clusters.of(other as usize);
                    if column <= cluster {
                        work::add(2 * MODES * MODES, size_of::<Six>());
                        add_product(blocks.at((cluster, column)), &six, beside);
                    }
                }
            }
        });
        blocks.into_iter().flat_map(FewBlocks::into_blocks).collect()
    }
}
