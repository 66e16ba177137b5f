//! Whether contact and supports can hold all bodies, before anything is solved.
//!
//! Of rigid motions `v` of whole bodies that supports leave free, loads do the work `w'v` and contact row `i` is opened by
//! `-(a_i'v)` to first order. A solution exists if and only if no motion is driven by the loads and resisted by no contact,
//! that is (Farkas) if `w` is a sum of pushes `a_i` of the contacts, which nonnegative least squares tell; their residual
//! is such a motion otherwise. Nothing can be moved for free in addition if `-w` and the pushes can make up any force.
//! Loads change in straight lines and what can be held is convex, so the ends of the steps stand for all between them.
//!
//! With Coulomb's friction a contact can exert all forces of a cone. As many of its generators are taken as it takes: a motion
//! that is left over adds to each cone the force that resists it most, until there is none that does. So what is refused cannot be
//! held. Tresca's friction counts with any size here: whether its limit is enough is found out by solving.
//!
//! Gaps play no part: a body may first have to move to where a contact holds it.

use std::collections::HashMap;

use super::Coarse;
use super::bodies::Motion;
use crate::constraint::Constraints;
use crate::constraint::friction::Slider;
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::kernel::MODES;
use crate::qp::nnls;
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
        let (mut force, mut all) = (vec![0.0; MODES * motions.bodies()], 0.0);
        for (cluster, modes) in resultants.chunks_exact(MODES).enumerate() {
            let mut of_cluster = vec![0.0; force.len()];
            motions.add_force(cluster, modes, &mut of_cluster);
            all += length(&of_cluster);
            force.iter_mut().zip(of_cluster).for_each(|(f, s)| *f += s);
        }
        let load = along(&force);
        let cones = Cones::new(coarse, space, constraints, (&friction(stage), free.len()), along);
        let mut pushes = [&normals[..], &cones.sides].concat();
        let mut left = nnls::solve(&pushes, &load).residual;
        for _ in 0..CUTS {
            let more = if length(&left) > NOTHING * all { cones.against(&left) } else { Vec::new() };
            if more.is_empty() {
                break;
            }
            pushes.extend(more);
            left = nnls::solve(&pushes, &load).residual;
        }
        if length(&left) > NOTHING * all {
            return unheld(&left, stage, true);
        }
        // The load keeps bodies where they are as a push the other way would.
        let mut all_pushes = pushes.clone();
        if length(&load) > NOTHING * all {
            all_pushes.push(unit(load.iter().map(|f| -f).collect()));
        }
        if let Some(motion) = complement(&all_pushes, free.len()).first() {
            return unheld(motion, stage, false);
        }
        let mut opposite = vec![0.0; free.len()];
        all_pushes.iter().for_each(|push| opposite.iter_mut().zip(push).for_each(|(o, p)| *o -= p));
        let mut spread = nnls::solve(&all_pushes, &opposite);
        // A load that has to be this large holds by rounding only.
        if spread.x.iter().any(|x| *x * NOTHING > length(&opposite)) {
            spread = nnls::solve(&pushes, &opposite);
        }
        if length(&spread.residual) > NOTHING * length(&opposite) {
            return unheld(&spread.residual, stage, false);
        }
    }
    Ok(())
}

/// Generators are added to cones so many times at most.
const CUTS: usize = 60;

/// What contacts with friction can exert on free motions.
struct Cones {
    /// Of each: along the normal, and along the surface as far as friction goes, for a unit force.
    axes: Vec<[Vec<f64>; 3]>,
    /// Forces that are there in any case: both ways along the surface under Tresca's law, and where cones have sides.
    sides: Vec<Vec<f64>>,
}

impl Cones {
    /// With these laws of friction and so many free motions, `along` which forces are told. Collective.
    fn new(
        coarse: &Coarse,
        space: &RowSpace,
        constraints: &Constraints,
        (friction, motions): (&[Option<Friction>], usize),
        along: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Self {
        if !constraints.has_friction {
            return Self { axes: Vec::new(), sides: Vec::new() };
        }
        let of_row: HashMap<usize, &Slider> =
            constraints.sliders.iter().map(|slider| (slider.normal, slider)).collect();
        let unit_force = |row: usize, factor: f64| {
            let mut force = along(&coarse.force_on_bodies(row));
            force.iter_mut().for_each(|f| *f *= factor / constraints.rows[row].scale);
            force
        };
        let mut width = 3 * motions + 1;
        let cone = |row: usize| {
            let slider = of_row.get(&row)?;
            let (factor, is_given) = match friction[slider.contact]? {
                Friction::Coulomb(coefficient) => (coefficient, 0.0),
                Friction::Tresca(_) => (1.0, 1.0),
            };
            let mut numbers = unit_force(row, 1.0);
            for k in 0..2 {
                let tangent = slider.tangents.get(k);
                numbers.extend(tangent.map_or(vec![0.0; motions], |tangent| unit_force(tangent.row, factor)));
            }
            numbers.push(is_given);
            Some(numbers)
        };
        let all = space.gather(width, cone);
        width -= 1;
        let (mut axes, mut sides) = (Vec::new(), Vec::new());
        for numbers in all {
            let [normal, first, second] = [0, 1, 2].map(|k| numbers[k * motions..][..motions].to_vec());
            if numbers[width] == 1.0 {
                let opposite = |x: &Vec<f64>| x.iter().map(|x| -x).collect::<Vec<f64>>();
                sides.extend([opposite(&first), opposite(&second), first, second]);
            } else {
                axes.push([normal, first, second]);
            }
        }
        // Four sides of each cone, so that it has all its dimensions.
        let cones = Self { axes, sides: Vec::new() };
        for [normal, first, second] in &cones.axes {
            for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                sides.push(combined(normal, (a, first), (b, second)));
            }
        }
        let sides = sides.into_iter().filter(|side| length(side) > 0.0).map(unit).collect();
        Self { sides, ..cones }
    }

    /// The force of each cone that resists a motion most, of those that resist it.
    fn against(&self, motion: &[f64]) -> Vec<Vec<f64>> {
        let most = |[normal, first, second]: &[Vec<f64>; 3]| {
            let (a, b) = (dot(first, motion), dot(second, motion));
            let size = a.hypot(b);
            if size == 0.0 {
                return None;
            }
            let force = unit(combined(normal, (a / size, first), (b / size, second)));
            (dot(&force, motion) > RESISTS * length(motion)).then_some(force)
        };
        self.axes.iter().filter_map(most).collect()
    }
}

/// A force resists a motion if it is along it by more than this share.
const RESISTS: f64 = 1e-8;

/// `x + a y + b z`.
fn combined(x: &[f64], (a, y): (f64, &[f64]), (b, z): (f64, &[f64])) -> Vec<f64> {
    x.iter().zip(y).zip(z).map(|((x, y), z)| x + a * y + b * z).collect()
}

fn unit(mut x: Vec<f64>) -> Vec<f64> {
    let size = length(&x);
    x.iter_mut().for_each(|x| *x /= if size > 0.0 { size } else { 1.0 });
    x
}
