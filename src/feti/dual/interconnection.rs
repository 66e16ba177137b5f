//! What interconnects the torn subdomains: `B`, inner products of its rows, and `R` of all groups.
//!
//! All follow from the decomposition and the rows alone: no material, no load.

use super::gather::Gather;
use super::levels::{Halo, Motions, Tree};
use super::space::RowSpace;
use crate::comm::Comm;
use crate::constraint::Constraints;
use crate::decomposition::{Decomposition, Subdomain};
use crate::feti::inverse::kernel::RigidModes;

/// `B`, the space of the multipliers, groups and `R` of one rank.
pub struct Interconnection<'a> {
    /// `B` and its transpose.
    pub gather: Gather<'a>,
    /// Inner products of multipliers.
    pub space: RowSpace<'a>,
    /// Neighbouring subdomains of other ranks.
    pub halo: Halo<'a>,
    /// Groups of subdomains.
    pub tree: Tree<'a>,
    /// Rigid modes of subdomains and their groups.
    pub motions: Motions,
}

impl<'a> Interconnection<'a> {
    /// Of one rank's subdomains and rows. Collective.
    pub fn new(comm: &'a dyn Comm, decomposition: &Decomposition, constraints: &Constraints) -> Self {
        let Decomposition { shares, clusters, subdomains, .. } = decomposition;
        let tree = Tree::new(comm, clusters, shares);
        let dofs = subdomains.iter().map(Subdomain::dofs).collect();
        Self {
            gather: Gather::new(comm, shares, constraints, dofs),
            space: RowSpace::new(comm, shares, constraints),
            halo: Halo::new(comm, shares, constraints),
            motions: Motions::new(&tree, subdomains),
            tree,
        }
    }

    /// `R`: rigid modes of each own subdomain, those of its cluster.
    pub fn modes(&self) -> &[RigidModes] {
        &self.motions.levels[self.tree.levels()]
    }
}
