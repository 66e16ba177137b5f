//! Verification: the program against closed forms, on meshes that get finer.
//!
//! A [`Case`] is a scene with a solution that the program does not know ([`crate::analytic`]). It goes through the whole
//! pipeline, as a user's scene would, on each of its meshes and with each of its elements; a [`Measured`] says what became
//! of its errors, and whether they are as small, or fall as fast, as they must ([`Demand`]).

mod bar;
mod blocks;
mod cylinders;
mod friction;
mod hertz;
mod homogeneous;
mod limits;
mod manufactured;
mod measured;
mod mindlin;
mod mindlin_ball;
mod plate;
mod press_fit;
mod radial;
mod run;
mod sliding;
mod spheres;

use serde::Serialize;

use crate::comm::Comm;
use crate::element::Kind;
use crate::material::VonMises;
use crate::scene::{Scene, SceneError};
use crate::study::StudyError;
pub use measured::{Demand, Error, Measured, Row};
use run::Exact;
pub use run::Run;

/// A scene with a known solution.
pub trait Case: Sync {
    /// What users call it, and what it is in one line.
    fn title(&self) -> [&'static str; 2];

    /// Its scene at level 1 as TOML. Elements are replaced.
    fn scene(&self) -> String;

    /// The meshes to solve it on, as levels of the scene, coarse to fine. If there are none, the element is left out.
    fn levels(&self, element: Kind) -> Vec<usize>;

    /// What acts in the first body instead of the scene's first load, which then is a body force.
    fn force(&self) -> Option<fn([f64; 3]) -> [f64; 3]> {
        None
    }

    /// A distance between all surfaces in contact, beside that of the scene, by place.
    fn gap(&self) -> Option<fn([f64; 3]) -> f64> {
        None
    }

    /// How the history must end.
    fn end(&self, _: Kind) -> End {
        End::Reached
    }

    /// The errors of a run. Collective.
    fn errors(&self, run: &Run) -> Vec<Error>;
}

/// How a history must end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All of it converges.
    Reached,
    /// It goes beyond what can be carried, and must be given up.
    Early,
    /// Nobody knows.
    Either,
}

/// Every case, cheapest first.
pub fn cases() -> Vec<&'static dyn Case> {
    let mut cases: Vec<&'static dyn Case> = Vec::new();
    cases.extend(homogeneous::CASES.iter().map(|case| case as &dyn Case));
    cases.extend(blocks::CASES.iter().map(|case| case as &dyn Case));
    cases.extend(friction::BLOCKS.iter().map(|case| case as &dyn Case));
    let rubbing: [&dyn Case; 6] =
        [&sliding::Dragged, &sliding::Incline, &sliding::Wedge, &press_fit::Pressed, &plate::Plate, &mindlin::Cylinder];
    cases.extend(bar::BARS.iter().map(|case| case as &dyn Case));
    cases.extend(rubbing);
    cases.extend(manufactured::CASES.iter().map(|case| case as &dyn Case));
    cases.extend(spheres::HOLLOW.iter().map(|case| case as &dyn Case));
    cases.push(&spheres::Nested);
    cases.extend(cylinders::CASES.iter().map(|case| case as &dyn Case));
    cases.extend(limits::WALLS.iter().map(|case| case as &dyn Case));
    cases.push(&limits::Footing);
    cases.push(&hertz::Ball);
    cases.push(&mindlin_ball::Ball);
    cases
}

/// The cases of these names, all if there are none.
///
/// # Errors
/// A name that no case has, with a list of those there are.
pub fn select(names: &[String]) -> Result<Vec<&'static dyn Case>, String> {
    let known = cases();
    if let Some(unknown) = names.iter().find(|name| known.iter().all(|case| case.title()[0] != *name)) {
        let line = |[name, about]: [&str; 2]| format!("\n  {name:<24}{about}");
        let listed: String = known.iter().map(|case| line(case.title())).collect();
        return Err(format!("there is no case `{unknown}`: known are{listed}"));
    }
    Ok(known.into_iter().filter(|case| names.is_empty() || names.iter().any(|name| name == case.title()[0])).collect())
}

/// Tolerances that leave the error of the mesh alone.
const TIGHT: [&str; 3] =
    ["solver.newton_tolerance=1e-9", "solver.residual_tolerance=1e-9", "solver.qp_tolerance=1e-12"];

/// Solves a case on all its meshes with an element, and tells of each. Collective.
///
/// # Errors
/// If the scene of the case has no discrete problem.
pub fn measure(
    case: &dyn Case,
    element: Kind,
    comm: &dyn Comm,
    tell: &mut dyn FnMut(&Measured),
) -> Result<Measured, StudyError> {
    let [name, about] = case.title();
    let mut measured = Measured { case: name, about, element, rows: Vec::new(), verdicts: Vec::new() };
    for level in case.levels(element) {
        let scene = at_level(case, element, level, &TIGHT).expect("scenes of cases are sound");
        let run = Run::new(case, scene, level, comm)?;
        measured.rows.push(run.row(case.errors(&run), case.end(element)));
        tell(&measured);
    }
    measured.verdicts = measured.judge();
    Ok(measured)
}

fn at_level(case: &dyn Case, element: Kind, level: usize, more: &[&str]) -> Result<Scene, SceneError> {
    let text = case.scene();
    let plain = Scene::from_text(&text, case.title()[0], 1, &[])?;
    let name = element.name();
    let elements = plain.body.keys().map(|body| format!("body.{body}.element={name}"));
    let sets: Vec<String> = elements.chain(more.iter().map(|&set| set.to_owned())).collect();
    Scene::from_text(&text, case.title()[0], level, &sets)
}

/// The paper's steel, in MPa.
const PAPER: VonMises = VonMises {
    young: 210_000.0,
    poisson: 0.29,
    yield_stress: Some(450.0),
    hardening: 10_000.0,
    kinematic_hardening: 0.0,
};

/// A material as a line of a scene.
fn material_line(name: &str, material: &VonMises) -> String {
    let VonMises { young, poisson, yield_stress, hardening, .. } = material;
    let limit = yield_stress.map_or(String::new(), |limit| format!(", yield_stress = {limit:?}"));
    format!("material.{name} = {{ young = {young:?}, poisson = {poisson:?}{limit}, hardening = {hardening:?} }}")
}

/// Errors of a run whose field is known. The first two have orders. A plastic front, where second derivatives jump, costs up to
/// half an order; linear elements feel it in the displacement only. The last is the error estimate over the error, on every mesh.
///
/// The estimate is left out where no error or no stress is known: homogeneous states and blocks are exact, Hill's cylinder is
/// Tresca's and has another stress along the axis once it yields, Hertz' ball is on a half space, limit loads tell nothing of
/// the stress.
fn convergence(run: &Run, exact: &dyn Exact, has_front: bool) -> Vec<Error> {
    let [energy, displacement] = run.norms(exact);
    let orders = match (run.element().degree(), has_front) {
        (1, false) => [1.0, 2.0],
        (1, true) => [1.0, 1.5],
        (_, false) => [2.0, 3.0],
        (_, true) => [1.5, 2.5],
    };
    vec![
        Error::new("energy norm", energy, Demand::Order(orders[0])),
        Error::new("displacement", displacement, Demand::Order(orders[1])),
        Error::new("effectivity", run.effectivity(exact), Demand::Between(0.5, 2.0)),
    ]
}

/// Levels whose cells are halved twice.
fn halved(element: Kind) -> Vec<usize> {
    if element.degree() == 1 { vec![4, 8, 16] } else { vec![2, 4, 8] }
}

/// Elements in the order of the report.
pub const ELEMENTS: [Kind; 3] = [Kind::Tet4, Kind::Hex8, Kind::Tet10];

/// All results, for scripts.
#[derive(Debug, Default, Serialize)]
pub struct Report {
    /// One for each case and element.
    pub cases: Vec<Measured>,
    /// Whether all demands are met.
    pub passed: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::record::state::State;

    #[test]
    fn names_are_unique_and_select() {
        let names: Vec<&str> = cases().iter().map(|case| case.title()[0]).collect();
        let mut unique = names.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), names.len());
        let one = select(&[names[1].to_owned()]).expect("it is known");
        assert_eq!(one.iter().map(|case| case.title()[0]).collect::<Vec<_>>(), [names[1]]);
        assert_eq!(select(&[]).expect("all").len(), names.len());
        let refusal = select(&["none".to_owned()]).err().expect("it is unknown");
        assert!(refusal.contains("`none`") && names.iter().all(|name| refusal.contains(name)), "{refusal}");
    }

    /// Yielding in one step, so that all runs solve the same discrete problem; with and without contact.
    const YIELDING: [&str; 4] = ["patch-plastic", "manufactured-front", "sphere-plastic", "nested-spheres"];

    /// Ways to stop too early.
    const LOOSE: [&[&str]; 4] = [
        &["solver.newton_limit=1"],
        &["solver.newton_limit=2"],
        &["solver.newton_limit=3"],
        &["solver.newton_tolerance=0.1", "solver.residual_tolerance=0.1", "solver.qp_tolerance=0.1"],
    ];

    #[test]
    fn no_energy_is_farther_from_its_minimum_than_the_gap() {
        for case in select(&YIELDING.map(str::to_owned)).expect("they are known") {
            for element in ELEMENTS {
                let level = if element == Kind::Tet10 { 1 } else { 2 };
                for subdomains in [2, 4] {
                    let subdomains = format!("decomposition.subdomains={subdomains}");
                    let state = |solver: &[&str]| {
                        let scene = at_level(case, element, level, &[&[subdomains.as_str()], solver].concat());
                        let run = Run::new(case, scene.expect("it is sound"), level, &Solo).expect("it is held");
                        run.summary().state.clone()
                    };
                    let name = format!("{} {} {subdomains}", case.title()[0], element.name());
                    let least = state(&TIGHT).energy.expect("it was solved");
                    let mut farthest = 0.0_f64;
                    for loose in LOOSE {
                        let State { energy, internal_energy, errors, .. } = state(loose);
                        let (beyond, size) =
                            (energy.expect("it was solved") - least, internal_energy.expect("it was solved"));
                        let gap = errors.duality_gap.expect("it was certified");
                        assert_eq!(errors.algebraic_is_bound, Some(true), "{name}, {loose:?}");
                        assert!(beyond <= gap + 1e-12 * size, "{name}, {loose:?}: {beyond:e} {gap:e} of {size:e}");
                        farthest = farthest.max(beyond / size);
                    }
                    assert!(farthest > 1e-6, "{name}: some runs stop far from the minimum: {farthest:e}");
                }
            }
        }
    }

    #[test]
    fn every_scene_is_sound_with_every_element_and_level() {
        for case in cases() {
            for element in ELEMENTS {
                for level in case.levels(element) {
                    at_level(case, element, level, &TIGHT)
                        .unwrap_or_else(|error| panic!("{}: {error}", case.title()[0]));
                }
            }
        }
    }
}
