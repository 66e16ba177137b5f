//! Whether supports, contacts and loads hold all bodies: known before anything is factorised.

use super::discrete::Discrete;
use super::{StudyError, conditions, report};
use crate::comm::Comm;
use crate::feti::coarse::Coarse;
use crate::feti::gather::Gather;
use crate::feti::kernel::{self, RigidModes};
use crate::feti::space::RowSpace;
use crate::newton::loading::Stage;
use crate::newton::{equilibrium, recover};
use crate::scene::Scene;

/// Looks for a motion that nothing holds, as solving does first. Collective.
///
/// # Errors
/// If there is one.
pub fn held(scene: &Scene, discrete: &Discrete, comm: &dyn Comm) -> Result<(), StudyError> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let (shares, subdomains) = (&decomposition.shares, &decomposition.subdomains[..]);
    let gather = Gather::new(comm, shares, constraints, subdomains.iter().map(|s| s.dofs()).collect());
    let space = RowSpace::new(comm, shares, constraints);
    let modes = kernel::of_clusters(decomposition.clusters.of_rank(comm.rank()), subdomains);
    let mut coarse = Coarse::new(comm, &decomposition.clusters, subdomains, &modes, constraints, &gather);
    let (_, stages) = conditions::stages(scene, discrete, &|| gather.zeros());
    at_all_stages(scene, discrete, &mut coarse, &space, &modes, &stages)
}

/// As [`held`], with what solving needs too. Leaves the coarse problem factorised. Collective.
pub(super) fn at_all_stages(
    scene: &Scene,
    discrete: &Discrete,
    coarse: &mut Coarse,
    space: &RowSpace,
    modes: &[RigidModes],
    stages: &[Stage],
) -> Result<(), StudyError> {
    let subdomains = &discrete.decomposition.subdomains;
    let resultants = |stage: usize| recover::resultants(subdomains, modes, coarse, &stages[stage].end.loads);
    equilibrium::check(coarse, space, &discrete.constraints, stages.len(), resultants)
        .map_err(|unheld| StudyError::Unheld(report::unheld(scene, &unheld)))?;
    Ok(coarse.factorise()?)
}
