//! Whether supports, contacts and loads hold all bodies: known before anything is factorised.

use super::ModelError;
use super::discrete::Discrete;
use super::history::{self, Stage};
use crate::comm::Comm;
use crate::feti::coarse::Coarse;
use crate::feti::coarse::equilibrium::Unheld;
use crate::feti::coarse::{equilibrium, recover};
use crate::feti::dual::Interconnection;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::kernel::RigidModes;
use crate::scene::Scene;

/// Looks for a motion that nothing holds, as solving does first. Collective.
///
/// # Errors
/// If there is one.
pub fn held(scene: &Scene, discrete: &Discrete, comm: &dyn Comm) -> Result<(), ModelError> {
    let Discrete { decomposition, constraints, .. } = discrete;
    let connection = Interconnection::new(comm, decomposition, constraints);
    let mut coarse = Coarse::new(comm, decomposition, constraints, &connection);
    let (_, stages) = history::stages(scene, discrete, &|| connection.gather.zeros());
    at_all_stages(scene, discrete, &mut coarse, &connection.space, connection.modes(), &stages)
}

/// As [`held`], with what solving needs too. Leaves the coarse problem factorised. Collective.
pub fn at_all_stages(
    scene: &Scene,
    discrete: &Discrete,
    coarse: &mut Coarse,
    space: &RowSpace,
    modes: &[RigidModes],
    stages: &[Stage],
) -> Result<(), ModelError> {
    let subdomains = &discrete.decomposition.subdomains;
    let resultants = |stage: usize| recover::resultants(subdomains, modes, coarse, &stages[stage].end.loads);
    let friction = |stage: usize| stages[stage].end.friction.clone();
    equilibrium::check(coarse, space, &discrete.constraints, stages.len(), (resultants, friction))
        .map_err(|unheld| ModelError::Unheld(refusal(scene, &unheld)))?;
    Ok(coarse.factorise()?)
}

/// Why a scene is refused whose supports, contacts and loads do not hold its bodies.
fn refusal(scene: &Scene, unheld: &Unheld) -> String {
    let Unheld { body, piece, motion, stage, driven } = unheld;
    let mut body = scene.body.keys().nth(*body).expect("it is one of the bodies").clone();
    if let Some([x, y, z]) = piece {
        body += &format!(", its piece around ({x:.6}, {y:.6}, {z:.6})");
    }
    let when = load_step(scene, *stage).map_or(String::new(), |step| format!(" at the end of {step}"));
    if *driven {
        format!(
            "body.{body}: loads drive its {motion}{when}, and neither supports nor contacts resist: add a support, or a load \
             that presses it against a contact"
        )
    } else {
        format!(
            "body.{body}: nothing determines its {motion}{when}: supports leave it free, and no load presses it against a \
             contact on that way; add a support"
        )
    }
}

/// A load step in words; nothing where all acts at once.
pub fn load_step(scene: &Scene, stage: usize) -> Option<String> {
    let name = &scene.step.get(stage)?.name;
    Some(if name.is_empty() { format!("load step {}", stage + 1) } else { format!("load step {} ({name})", stage + 1) })
}
