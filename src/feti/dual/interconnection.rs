//! What interconnects the torn subdomains: `B`, inner products of its rows, `R` of all groups, and `G` of the equalities.
//!
//! All follow from the decomposition and the rows alone: no material, no load.

use super::gather::Gather;
use super::levels::gluing::Gluing;
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
    /// What these make of the equalities.
    pub gluing: Gluing,
}

impl<'a> Interconnection<'a> {
    /// Of one rank's subdomains and rows. Collective.
    pub fn new(comm: &'a dyn Comm, decomposition: &Decomposition, constraints: &Constraints) -> Self {
        let Decomposition { shares, clusters, subdomains, .. } = decomposition;
        let dofs = subdomains.iter().map(Subdomain::dofs).collect();
        let (tree, halo) = (Tree::new(comm, clusters, shares), Halo::new(comm, shares, constraints));
        let (gather, motions) = (Gather::new(comm, shares, constraints, dofs), Motions::new(&tree, subdomains));
        let gluing = Gluing::new((&gather, &halo, &tree, &motions), (clusters, subdomains), constraints);
        let space = RowSpace::new(comm, shares, constraints);
        Self { gather, space, halo, tree, motions, gluing }
    }

    /// `R`: rigid modes of each own subdomain, those of its cluster.
    pub fn modes(&self) -> &[RigidModes] {
        &self.motions.levels[self.tree.levels()]
    }
}
