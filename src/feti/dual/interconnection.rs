//! What interconnects the torn subdomains: `B`, inner products of its rows, and `R`.
//!
//! All follow from the decomposition and the rows alone: no material, no load.

use super::gather::Gather;
use super::space::RowSpace;
use crate::comm::Comm;
use crate::constraint::Constraints;
use crate::decomposition::{Decomposition, Subdomain};
use crate::feti::inverse::kernel::{self, RigidModes};

/// `B`, the space of the multipliers and `R` of one rank.
pub struct Interconnection<'a> {
    /// `B` and its transpose.
    pub gather: Gather<'a>,
    /// Inner products of multipliers.
    pub space: RowSpace<'a>,
    /// `R`: rigid modes of each own subdomain, those of its cluster.
    pub modes: Vec<RigidModes>,
}

impl<'a> Interconnection<'a> {
    /// Of one rank's subdomains and rows. Collective.
    pub fn new(comm: &'a dyn Comm, decomposition: &Decomposition, constraints: &Constraints) -> Self {
        let Decomposition { shares, clusters, subdomains, .. } = decomposition;
        let dofs = subdomains.iter().map(Subdomain::dofs).collect();
        Self {
            gather: Gather::new(comm, shares, constraints, dofs),
            space: RowSpace::new(comm, shares, constraints),
            modes: kernel::of_clusters(clusters.of_rank(comm.rank()), subdomains),
        }
    }
}
