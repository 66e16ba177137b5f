use std::sync::Mutex;

use crate::comm::threads;
use crate::fixture::{Stopper, two_bricks};
use crate::model;
use crate::monitor::timing::Timer;
use crate::record::summary::Summary;
use crate::restart;
use crate::results::piece::Piece;
use crate::scene::Scene;
use crate::study;

const METHODS: [[&str; 2]; 5] = [
    ["solver.qp=\"smalse-m\"", "solver.preconditioner=\"none\""],
    ["solver.qp=\"smalse-m\"", "solver.preconditioner=\"dirichlet\""],
    ["solver.qp=\"active-set\"", "solver.preconditioner=\"none\""],
    ["solver.qp=\"active-set\"", "solver.preconditioner=\"lumped\""],
    ["solver.qp=\"active-set\"", "solver.preconditioner=\"dirichlet\""],
];

/// Loaded until much of the lower brick yields.
fn plastic(sets: &[&str]) -> Scene {
    let common = ["load.top.traction=[0.0, 0.0, -0.35]", "support.right.displacement=[0.0, 0.0, 0.0]"];
    two_bricks(&[&common, sets].concat())
}

/// What is known after the solve, and the displacements of all ranks.
fn solve(scene: &Scene, ranks: usize) -> (Summary, Vec<u64>) {
    let parts = threads::run(ranks, |comm| {
        let discrete = model::discretise(scene, comm).expect("the scene has a discrete problem");
        let solved = study::solve(scene, &discrete, comm, study::Begin::Rest, &Timer::start(), &mut ())
            .expect("the bodies are held");
        let u = solved.piece.last("displacement").expect("it is recorded").to_vec();
        (solved.summary, u)
    });
    let displacements = parts.iter().flat_map(|(_, u)| u).map(|u| u.to_bits()).collect();
    (parts.into_iter().next().expect("rank 0").0, displacements)
}

fn energies(summary: &Summary) -> Vec<f64> {
    summary.newton.iter().map(|row| row.energy).collect()
}

#[test]
fn all_methods_give_one_solution() {
    let exact = |method: &[&str]| {
        plastic(&[method, &["solver.qp_tolerance=1e-11", "solver.residual_tolerance=1e-10"]].concat())
    };
    let found = METHODS.map(|method| solve(&exact(&method), 2).0);
    for (summary, method) in found.iter().zip(METHODS) {
        assert_eq!(summary.converged, Some(true), "{method:?}: {:?}", summary.error);
        let (own, first) = (summary.state.energy.unwrap(), found[0].state.energy.unwrap());
        assert!((own / first - 1.0).abs() < 1e-10, "{method:?}: {own} {first}");
        assert_eq!(summary.state.plastic_elements, found[0].state.plastic_elements);
        assert_eq!(summary.state.active_contacts, found[0].state.active_contacts);
    }
    assert!(found[0].state.plastic_elements > Some(10) && found[0].state.active_contacts > Some(1));
    assert!(found[0].state.active_contacts < Some(found[0].sizes.contact_rows), "part of the contact is open");
}

#[test]
fn ranks_change_no_bit() {
    for method in METHODS {
        let scene = plastic(&method);
        let (alone, displacements) = solve(&scene, 1);
        for ranks in [2, 3, 5] {
            let (summary, others) = solve(&scene, ranks);
            assert_eq!(others, displacements, "{method:?} on {ranks} ranks");
            assert_eq!((summary.counters.clone(), energies(&summary)), (alone.counters.clone(), energies(&alone)));
        }
    }
}

/// Eight boxes a body, in clusters of about so many.
fn clustered(cluster: usize, sets: &[&str]) -> Scene {
    let cells = ["body.lower.brick.cells=[8, 4, 2]", "body.upper.brick.cells=[8, 4, 2]"];
    plastic(&[&cells[..], &[&format!("decomposition.cluster={cluster}")], sets].concat())
}

/// The same solution with clusters and without.
#[track_caller]
fn solved_alike_by_clusters(sets: &[&str]) -> Summary {
    let exact = [sets, &["solver.qp_tolerance=1e-11", "solver.residual_tolerance=1e-10"]].concat();
    let [single, hybrid] = [1, 4].map(|cluster| solve(&clustered(cluster, &exact), 2).0);
    assert_eq!((single.sizes.clusters, hybrid.sizes.clusters), (16, 4));
    assert_eq!(single.sizes.dual_dofs, hybrid.sizes.dual_dofs);
    for summary in [&single, &hybrid] {
        assert_eq!(summary.converged, Some(true), "{sets:?}: {:?}", summary.error);
    }
    let [one, other] = [&single.state, &hybrid.state];
    assert!((other.energy.unwrap() / one.energy.unwrap() - 1.0).abs() < 1e-10, "{sets:?}");
    assert_eq!(other.plastic_elements, one.plastic_elements);
    assert_eq!(other.active_contacts, one.active_contacts);
    hybrid
}

#[test]
fn clusters_lead_to_the_solution_of_single_subdomains() {
    let by_metis = ["decomposition.subdomains=16", "solver.preconditioner=\"dirichlet\""];
    for method in METHODS.iter().chain([&by_metis]) {
        let found = solved_alike_by_clusters(method).state;
        assert!(found.plastic_elements > Some(10) && found.active_contacts > Some(1));
    }
}

#[test]
fn clusters_of_nearly_incompressible_bodies_stay_closed_where_factors_are_refined() {
    let found = solved_alike_by_clusters(&["material.hard.poisson=0.4999", "material.soft.poisson=0.4999"]);
    let gluing = found.state.residuals.gluing.expect("it is known");
    assert!(gluing < 1e-12, "{gluing:e}");
}

#[test]
fn clusters_change_no_bit_on_any_ranks_and_none_when_stopped() {
    for method in [METHODS[0], METHODS[4]] {
        let scene = clustered(4, &method);
        let (alone, displacements) = solve(&scene, 1);
        for ranks in [2, 3, 5] {
            let (summary, others) = solve(&scene, ranks);
            assert_eq!(others, displacements, "{method:?} on {ranks} ranks");
            assert_eq!((summary.counters.clone(), energies(&summary)), (alone.counters.clone(), energies(&alone)));
        }
        stopped_anywhere_it_arrives_at_the_same_bits(&scene, 2);
    }
}

#[test]
fn the_energy_falls_in_every_step_and_the_end_is_quadratic() {
    let scene = plastic(&[&METHODS[4][..], &["solver.qp_tolerance=1e-13", "solver.residual_tolerance=1e-11"]].concat());
    let (summary, _) = solve(&scene, 1);
    assert_eq!(summary.converged, Some(true), "{:?}", summary.error);
    assert!(summary.newton.len() >= 4);
    let energies = energies(&summary);
    let noise = 1e-13 * energies[0].abs();
    assert!(energies.windows(2).all(|e| e[1] <= e[0] + noise), "{energies:?}");
    // Once the plastic elements are found, the residual falls at least with the power that the inner accuracy allows, down to rounding.
    let residuals: Vec<f64> = summary.newton.iter().map(|row| row.residual).collect();
    let found: Vec<&[f64]> = residuals.windows(2).filter(|pair| pair[0] < 1e-4 && pair[0] > 1e-10).collect();
    assert!(!found.is_empty() && found.iter().all(|pair| pair[1] < 1e-3 * pair[0]), "{:?}", summary.newton);
}

#[test]
fn too_few_steps_or_products_end_as_outcomes() {
    for (limit, word) in [("solver.newton_limit=2", "newton_limit"), ("solver.qp_limit=2", "qp_limit")] {
        for method in METHODS {
            let (summary, _) = solve(&plastic(&[&method[..], &[limit]].concat()), 2);
            assert_eq!(summary.converged, Some(false), "{method:?}");
            assert!(summary.error.as_ref().is_some_and(|e| e.contains(word)), "{:?}", summary.error);
        }
    }
}

#[test]
fn numbers_without_end_are_an_outcome() {
    for method in METHODS {
        let (summary, _) = solve(&plastic(&[&method[..], &["load.top.traction=[0.0, 0.0, -1e300]"]].concat()), 2);
        assert_eq!(summary.converged, Some(false));
        assert!(summary.error.as_ref().is_some_and(|e| e.contains("not finite")), "{:?}", summary.error);
    }
}

/// All that a solve leaves: the summary without its times, and all fields, of all ranks.
fn leave(scene: &Scene, ranks: usize, begin: impl Fn(usize) -> study::Begin + Sync, stop: usize) -> Left {
    let parts = threads::run(ranks, |comm| {
        let discrete = model::discretise(scene, comm).expect("the scene has a discrete problem");
        let mut stopper = Stopper::new(stop);
        let solved = study::solve(scene, &discrete, comm, begin(comm.rank()), &Timer::start(), &mut stopper);
        (solved.ok().map(|solved| (solved.summary, solved.piece)), stopper.stood)
    });
    let (solved, stood): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    Left { solved: solved.into_iter().collect(), stood: stood.into_iter().collect() }
}

struct Left {
    solved: Option<Vec<(Summary, Piece)>>,
    stood: Option<Vec<restart::Standing>>,
}

impl Left {
    /// Everything that ought to be the same bits.
    fn bits(self) -> String {
        let parts = self.solved.expect("it was not stopped").into_iter().map(|(mut summary, piece)| {
            summary.newton.iter_mut().for_each(|row| row.seconds = 0.0);
            // Texts of numbers read back to the same bits.
            format!("{summary:?} {piece:?}")
        });
        parts.collect()
    }
}

/// Stops a solve before every one of its Newton steps in turn and goes on from there.
#[track_caller]
fn stopped_anywhere_it_arrives_at_the_same_bits(scene: &Scene, ranks: usize) -> usize {
    let whole = leave(scene, ranks, |_| study::Begin::Rest, usize::MAX).bits();
    for stop in 1.. {
        let left = leave(scene, ranks, |_| study::Begin::Rest, stop);
        let Some(stood) = left.stood else { return stop - 1 };
        let stood: Vec<_> = stood.into_iter().map(|standing| Mutex::new(Some(Box::new(standing)))).collect();
        let take = |rank: usize| stood[rank].lock().unwrap().take().expect("each rank takes its own, once");
        let resumed = leave(scene, ranks, |rank| study::Begin::At(take(rank)), usize::MAX).bits();
        assert!(resumed == whole, "stopped before step {stop}\n{resumed}\n{whole}");
    }
    unreachable!()
}

#[test]
fn a_stopped_solve_goes_on_to_the_same_bits() {
    for method in METHODS {
        let steps = stopped_anywhere_it_arrives_at_the_same_bits(&plastic(&method), 2);
        assert!(steps > 3, "{steps}");
    }
}

#[test]
fn a_stopped_history_goes_on_to_the_same_bits() {
    let history = "step=[{increments=3}, {amplitude=-0.5, increments=2}]";
    let twins = "decomposition.cells=[1, 1, 1]";
    for set in [twins, "decomposition.cells=[2, 2, 2]"] {
        let steps = stopped_anywhere_it_arrives_at_the_same_bits(&plastic(&[history, set]), 2);
        assert!(steps > 10, "{steps}");
    }
}

#[test]
fn a_history_stopped_after_halvings_goes_on_to_the_same_bits() {
    let history = ["step=[{}, {amplitude=-0.5}]", "solver.newton_limit=4"];
    let scene = plastic(&history);
    let whole = leave(&scene, 1, |_| study::Begin::Rest, usize::MAX).solved.expect("it was not stopped");
    assert!(whole[0].0.steps.iter().any(|row| row.halvings > 0), "{:?}", whole[0].0.steps);
    stopped_anywhere_it_arrives_at_the_same_bits(&scene, 1);
}

/// A body far stiffer than it is strong begins to flow everywhere at once: strains grow a million times. Newton's tangent alone
/// is cut step after step there.
#[test]
fn a_rigid_body_begins_to_flow_with_hardly_a_step_being_cut() {
    let scene = plastic(&["material.hard.young=2.1e8", "load.top.traction=[0.0, 0.0, -0.5]"]);
    let (summary, _) = solve(&scene, 1);
    assert_eq!(summary.converged, Some(true), "{:?}", summary.error);
    let cut = summary.newton.iter().filter(|row| row.damping < 1.0).count();
    assert!(cut <= 1, "{:?}", summary.newton);
    let energies = energies(&summary);
    assert!(energies.windows(2).all(|e| e[1] <= e[0] + 1e-9 * e[0].abs()), "{energies:?}");
    stopped_anywhere_it_arrives_at_the_same_bits(&scene, 2);
}

/// A bar under tension bears its yield stress, whatever the mesh.
#[test]
fn above_the_limit_load_the_last_equilibrium_is_kept_and_named() {
    const BAR: &str = r#"
        [material.bar]
        young = 210.0
        poisson = 0.29
        yield_stress = 0.45
        [body.bar]
        material = "bar"
        element = "hex8"
        brick = { origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 4.0], cells = [2, 2, 4] }
        [support.x]
        surface = "bar.xmin"
        fix = ["x"]
        [support.y]
        surface = "bar.ymin"
        fix = ["y"]
        [support.z]
        surface = "bar.zmin"
        fix = ["z"]
        [load.top]
        surface = "bar.zmax"
        traction = [0.0, 0.0, 0.6]
        [decomposition]
        cells = [2, 2, 2]
    "#;
    let sets = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        Scene::from_text(BAR, "bar", 1, &sets).expect("the scene is sound")
    };
    let (summary, _) = solve(&sets(&[]), 2);
    assert_eq!(summary.converged, Some(false));
    let last = summary.steps.last().expect("there is an equilibrium");
    let limit = 0.45 / 0.6;
    assert!(last.converged && last.time <= limit && last.time > limit - 1.0 / 16.0, "{}", last.time);
    assert!(summary.state.max_von_mises.is_some_and(|s| (s / (0.6 * last.time) - 1.0).abs() < 1e-6), "{summary:?}");
    let error = summary.error.expect("it is told");
    assert!(error.contains(&format!("{:.4} of the load", last.time)) && error.contains("limit load"), "{error}");

    let (below, _) = solve(&sets(&["load.top.traction=[0.0, 0.0, 0.44]"]), 2);
    assert_eq!((below.converged, below.steps.len()), (Some(true), 1));
}
