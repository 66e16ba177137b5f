use super::{CLEAR, TURNS};
use crate::assembly::{Region, stress};
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::fixture::{not_matching, two_bricks, two_meshes};
use crate::material::Law;
use crate::model;
use crate::monitor::timing::Timer;
use crate::newton::Newton;
use crate::record::summary::Summary;
use crate::scene::Scene;
use crate::study::{self, solver};
use crate::tensor::Voigt;

/// What a scene leads to: the summary and, point by point, weight, stress and material.
struct Solution {
    summary: Summary,
    stresses: Vec<(f64, Voigt, crate::material::Material)>,
}

fn solve(scene: &Scene, ranks: usize) -> Solution {
    let parts = threads::run(ranks, |comm| {
        let discrete = model::discretise(scene, comm).expect("the scene has a discrete problem");
        let solved = study::solve(scene, &discrete, comm, study::Begin::Rest, &Timer::start(), &mut ())
            .expect("the bodies are held");
        let mut stresses = Vec::new();
        for (subdomain, u) in discrete.decomposition.subdomains.iter().zip(&solved.u) {
            let material = discrete.materials[subdomain.material];
            let samples = stress::samples(&Region::virgin(subdomain, &material), u);
            stresses.extend(samples.iter().map(|sample| (sample.weight, sample.value, material)));
        }
        (solved.summary, stresses)
    });
    let stresses = parts.iter().flat_map(|(_, stresses)| stresses.clone()).collect();
    Solution { summary: parts.into_iter().next().expect("rank 0").0, stresses }
}

impl Solution {
    /// `int (sigma - other) : C^-1 : (sigma - other)`, to the root; of sigma itself without another.
    fn distance(&self, other: Option<&Self>) -> f64 {
        let square = |(k, (weight, stress, material)): (usize, &(f64, Voigt, crate::material::Material))| {
            let other = other.map_or([0.0; 6], |other| other.stresses[k].1);
            weight * material.hooke().complementary_square(&std::array::from_fn(|i| stress[i] - other[i]))
        };
        self.stresses.iter().enumerate().map(square).sum::<f64>().sqrt()
    }
}

fn sets(scene: fn(&[&str]) -> Scene, sets: &[&[&str]]) -> Scene {
    scene(&sets.concat())
}

/// Name of a scene, and the scene with further settings.
type Case = (&'static str, Box<dyn Fn(&[&str]) -> Scene>);

fn cases() -> Vec<Case> {
    const PLASTIC: [&str; 2] = ["load.top.traction=[0.0, 0.0, -0.35]", "support.right.displacement=[0.0, 0.0, 0.0]"];
    const KINEMATIC: [&str; 2] = ["material.hard.kinematic_hardening=20", "material.hard.hardening=1"];
    const GLUED: [&str; 2] = ["contact.joint.clearance=10.0", "load.top.traction=[0.0, 0.01, -0.02]"];
    vec![
        (
            "elastic, contact",
            Box::new(|more| {
                let more: Vec<String> = more.iter().map(|set| set.to_string()).collect();
                let text = two_meshes(4).to_toml();
                Scene::from_text(&text, "two meshes", 1, &more).expect("the scene is sound")
            }),
        ),
        ("no contact", Box::new(|more| sets(two_bricks, &[&GLUED, more]))),
        ("plastic, contact", Box::new(|more| sets(two_bricks, &[&PLASTIC, more]))),
        ("clusters", Box::new(|more| sets(two_bricks, &[&PLASTIC, &["decomposition.cluster=2"], more]))),
        ("kinematic, contact", Box::new(|more| sets(two_bricks, &[&PLASTIC, &KINEMATIC, more]))),
        ("plastic, mortar", Box::new(|more| sets(not_matching, &[&PLASTIC, more]))),
        (
            "hex8",
            Box::new(|more| {
                let elements = ["body.lower.element=hex8", "body.upper.element=hex8"];
                sets(two_bricks, &[&PLASTIC, &elements, more])
            }),
        ),
    ]
}

const TIGHT: [&str; 4] = [
    "solver.newton_tolerance=1e-11",
    "solver.residual_tolerance=1e-11",
    "solver.qp_tolerance=1e-13",
    "solver.precision=double",
];

/// Ways to stop too early.
const LOOSE: [&[&str]; 7] = [
    &["solver.newton_limit=1"],
    &["solver.newton_limit=2"],
    &["solver.newton_limit=3"],
    &["solver.newton_tolerance=0.5", "solver.residual_tolerance=0.5", "solver.qp_tolerance=0.5"],
    &["solver.newton_tolerance=0.1", "solver.residual_tolerance=0.01", "solver.qp_tolerance=0.1"],
    &[
        "solver.newton_tolerance=0.1",
        "solver.residual_tolerance=1e-3",
        "solver.qp=smalse-m",
        "solver.preconditioner=none",
    ],
    &["solver.accuracy=0.5"],
];

#[test]
fn the_gap_is_never_less_than_the_error() {
    for (name, scene) in cases() {
        let exact = solve(&scene(&TIGHT), 1);
        assert_eq!(exact.summary.converged, Some(true), "{name}: {:?}", exact.summary.error);
        let least = exact.summary.state.energy.unwrap();
        let mut largest = 0.0_f64;
        for loose in LOOSE.into_iter().chain([&[] as &[&str]]) {
            let found = solve(&scene(loose), 1);
            let state = &found.summary.state;
            let (energy, gap) = (state.energy.unwrap(), state.errors.duality_gap.unwrap());
            let rounding = 1e-13 * state.internal_energy.unwrap();
            assert_eq!(state.errors.algebraic_is_bound, Some(true), "{name}, {loose:?}");
            assert!(energy - least <= gap + rounding, "{name}, {loose:?}: {energy} {least} {gap}");
            let error = found.distance(Some(&exact)) / found.distance(None);
            let bound = state.errors.algebraic.unwrap();
            assert!(error <= bound + 1e-9, "{name}, {loose:?}: {error} {bound}");
            largest = largest.max(error);
        }
        assert!(largest > 1e-4, "{name}: some runs stop far from the solution: {largest}");
        // Up to the same rounding, a tight run knows that it is.
        let end = exact.summary.state.errors.duality_gap.unwrap();
        let rounding = 1e-13 * exact.summary.state.internal_energy.unwrap();
        assert!(end < rounding, "{name}: {end} {rounding}");
    }
}

/// After the first step, which leaves much out of balance.
#[test]
fn a_bound_that_is_clearly_enough_or_clearly_not_takes_fewer_turns() {
    let scene = &two_bricks(&["load.top.traction=[0.0, 0.0, -0.35]", "support.right.displacement=[0.0, 0.0, 0.0]"]);
    solver::with_newton(scene, &Solo, |newton, _, timer| {
        newton.step(timer, &|_, _| {}).expect("it is a sound step");
        let Newton { problem, solver, iterate, .. } = newton;
        let mut bound = |wanted| solver.certify(problem, (&iterate.u, &iterate.state), &iterate.lambda, wanted, timer);
        let sharp = bound(None);
        assert_eq!(sharp.solves, TURNS);
        for wanted in [0.01 * sharp.gap, 10.0 * CLEAR * sharp.gap] {
            let found = bound(Some(wanted));
            assert!(found.solves < TURNS && found.is_bound && found.gap >= sharp.gap, "{wanted}: {found:?} {sharp:?}");
            assert_eq!(found.gap <= wanted, sharp.gap <= wanted);
        }
        assert_eq!(bound(Some(sharp.gap)), sharp);
    });
}

/// Without hardening the stress is unique still, and the value an estimate that says so.
#[test]
fn under_perfect_plasticity_it_is_an_estimate() {
    let perfect = [
        "material.hard.hardening=0.0",
        "load.top.traction=[0.0, 0.0, -0.35]",
        "support.right.displacement=[0.0, 0.0, 0.0]",
    ];
    let found = solve(&two_bricks(&perfect), 1).summary;
    assert_eq!(found.converged, Some(true), "{:?}", found.error);
    assert!(found.state.plastic_elements > Some(0));
    assert_eq!(found.state.errors.algebraic_is_bound, Some(false));
    assert!(found.state.errors.algebraic.is_some_and(|error| error < 1e-3), "{:?}", found.state.errors);
}

#[test]
fn errors_are_the_same_bits_on_any_ranks() {
    for (name, scene) in cases().into_iter().skip(2) {
        let alone = solve(&scene(&[]), 1).summary.state.errors;
        for ranks in [2, 3, 5] {
            assert_eq!(solve(&scene(&[]), ranks).summary.state.errors, alone, "{name} on {ranks} ranks");
        }
    }
}

#[test]
fn accuracy_ends_the_run_as_soon_as_the_mesh_is_worse() {
    for (name, scene) in cases() {
        let exact = solve(&scene(&TIGHT), 1);
        let usual = solve(&scene(&[]), 1).summary;
        for accuracy in [0.5, 0.1] {
            let found = solve(&scene(&[&format!("solver.accuracy={accuracy}")]), 1);
            let errors = found.summary.state.errors;
            assert_eq!(found.summary.converged, Some(true), "{name}: {:?}", found.summary.error);
            let allowed = accuracy * errors.discretisation.unwrap();
            let error = found.distance(Some(&exact)) / found.distance(None);
            assert!(error <= allowed, "{name}, {accuracy}: {error} {errors:?}");
            assert!(
                errors.ended_by_accuracy == Some(false) || errors.algebraic.unwrap() <= allowed,
                "{name}: {errors:?}"
            );
            let spent = |summary: &Summary| summary.counters.hessian_multiplications.unwrap();
            assert!(spent(&found.summary) <= spent(&usual), "{name}: no run solves more for it");
        }
    }
}
