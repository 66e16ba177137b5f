//! Whether contact and supports can hold all bodies, before anything is solved.
//!
//! Of rigid motions `v` of whole bodies that supports leave free, loads do the work `w'v` and contact row `i` is opened by
//! `-(a_i'v)` to first order. A solution exists if and only if no motion is driven by the loads and resisted by no contact,
//! that is (Farkas) if `w` is a sum of pushes `a_i` of the contacts, which nonnegative least squares tell; their residual
//! is such a motion otherwise. Nothing can be moved for free in addition if `-w` and the pushes can make up any force.
//! Loads change in straight lines and what can be held is convex, so the ends of the steps stand for all between them.
//!
//! Contacts with friction can exert more: [`super::cones`].
//!
//! Gaps play no part: a body may first have to move to where a contact holds it.

use super::Coarse;
use super::bodies::{BodyMotions, Motion};
use super::cones::{Balance, CUTS, Cones, unit};
use super::nnls;
use crate::constraint::Constraints;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::kernel::MODES;
use crate::scene::Friction;
use crate::span::complement;
use crate::vector::{dot, length};

/// A motion that supports and contacts do not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Unheld {
    /// Index of the body that moves, or moves most.
    pub body: usize,
    /// Centre of the piece that moves, if the body has several.
    pub piece: Option<[f64; 3]>,
    /// How it moves.
    pub motion: Motion,
    /// The stage at whose end nothing holds it.
    pub stage: usize,
    /// Whether loads drive it; else nothing keeps it where it is.
    pub driven: bool,
}

/// Forces smaller than this share of all are nothing.
const NOTHING: f64 = 1e-9;

/// Whether all bodies are held at the end of each stage, where loads have the resultants `R'f` (six numbers a cluster,
/// collective), which are asked for only if supports leave some body free. Collective.
///
/// # Errors
/// The first motion that is not held: on every rank.
pub fn check(
    coarse: &Coarse,
    space: &RowSpace,
    constraints: &Constraints,
    stages: usize,
    (resultants, friction): (impl Fn(usize) -> Vec<f64>, impl Fn(usize) -> Vec<Option<Friction>>),
) -> Result<(), Box<Unheld>> {
    let is_contact = |row: usize| constraints.rows[row].law().opens();
    let motions = coarse.motions();
    let free = coarse.free();
    if free.is_empty() {
        return Ok(());
    }
    let along = |force: &[f64]| -> Vec<f64> { free.iter().map(|motion| dot(motion, force)).collect() };
    let pushes = space.gather(free.len(), |row| is_contact(row).then(|| along(&coarse.force_on_bodies(row))));
    let normals: Vec<Vec<f64>> = pushes.into_iter().map(unit).filter(|push| length(push) > 0.0).collect();
    let unheld = |motion: &[f64], stage: usize, driven: bool| {
        let mut whole = vec![0.0; MODES * motions.bodies()];
        for (mode, along) in free.iter().zip(motion) {
            whole.iter_mut().zip(mode).for_each(|(w, x)| *w += along * x);
        }
        let (body, piece, motion) = motions.describe(&whole);
        Err(Box::new(Unheld { body, piece, motion, stage, driven }))
    };
    for (stage, resultants) in (0..stages).map(|stage| (stage, resultants(stage))) {
        let (force, all) = on_bodies(motions, &resultants);
        let load = along(&force);
        let cones = Cones::new(coarse, space, constraints, (&friction(stage), free.len()), along);
        let Balance { mut pushes, left } = cones.balance(&normals, &load, NOTHING * all);
        if length(&left) > NOTHING * all {
            return unheld(&left, stage, true);
        }
        pushes.extend(cones.along_discs());
        // The load keeps bodies where they are as a push the other way would.
        let kept = (length(&load) > NOTHING * all).then(|| unit(load.iter().map(|f| -f).collect()));
        for _ in 0..CUTS {
            let Some(motion) = nothing_resists(&pushes, kept.as_ref(), free.len()) else { break };
            // Of cones only those generators are known that bear the load.
            let more = cones.against(&motion);
            if more.is_empty() {
                return unheld(&motion, stage, false);
            }
            pushes.extend(more);
        }
    }
    Ok(())
}

/// A motion that is free in one direction, where pushes and what the load keeps cannot make up any force.
fn nothing_resists(pushes: &[Vec<f64>], kept: Option<&Vec<f64>>, motions: usize) -> Option<Vec<f64>> {
    let all_pushes: Vec<Vec<f64>> = pushes.iter().chain(kept).cloned().collect();
    if let Some(motion) = complement(&all_pushes, motions).first() {
        return Some(motion.clone());
    }
    let mut opposite = vec![0.0; motions];
    all_pushes.iter().for_each(|push| opposite.iter_mut().zip(push).for_each(|(o, p)| *o -= p));
    let mut spread = nnls::solve(&all_pushes, &opposite);
    // A load that has to be this large holds by rounding only.
    if spread.x.iter().any(|x| *x * NOTHING > length(&opposite)) {
        spread = nnls::solve(pushes, &opposite);
    }
    (length(&spread.residual) > NOTHING * length(&opposite)).then_some(spread.residual)
}

/// Forces and moments on all bodies from those on clusters, and the sum of their sizes.
fn on_bodies(motions: &BodyMotions, resultants: &[f64]) -> (Vec<f64>, f64) {
    let (mut force, mut all) = (vec![0.0; MODES * motions.bodies()], 0.0);
    for (cluster, modes) in resultants.chunks_exact(MODES).enumerate() {
        let mut of_cluster = vec![0.0; force.len()];
        motions.add_force(cluster, modes, &mut of_cluster);
        all += length(&of_cluster);
        force.iter_mut().zip(of_cluster).for_each(|(f, s)| *f += s);
    }
    (force, all)
}
