use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::feti::dual::Interconnection;
use crate::fixture::{RANKS, two_bricks};
use crate::model;
use crate::newton;
use crate::study::solver;

/// Quadratic tetrahedra, whose goal is this number, solved as exactly as can be.
fn bricks(goal: &str, sets: &[&str]) -> Scene {
    let goal = format!("solver.error_of={goal}");
    let common = [
        "body.lower.element=tet10",
        "body.upper.element=tet10",
        "contact.joint.gap=-0.1",
        "support.right.displacement=[0.0, 0.0, 0.0]",
        "solver.error=0.1",
        "solver.residual_tolerance=1e-9",
        "solver.newton_tolerance=1e-8",
        "solver.qp_tolerance=1e-10",
        "solver.precision=double",
        &goal,
    ];
    two_bricks(&[&common, sets].concat())
}

/// What is measured where a scene is solved: the row, the sum of the sizes again, and the work of the loads on the dual solution.
fn measured(scene: &Scene, comm: &dyn Comm) -> (GoalRow, f64, f64) {
    solver::with_newton(scene, comm, |newton, discrete, timer| {
        while newton.outcome().is_none() {
            newton.step(timer, &|_, _| {});
        }
        assert_eq!(newton.outcome(), Some(&newton::Outcome::Converged));
        let gather = newton.problem().gather;
        let mut goal = Goal::new(scene, discrete, comm, &|| gather.zeros()).unwrap().unwrap();
        let (row, sizes) = goal.measure(newton, timer).unwrap();
        let dual = newton.response((&goal.forces, &goal.openings), 1e-3 * DROP, timer);
        let problem = newton.problem();
        let of = |own: usize| [sizes[own].iter().sum::<f64>(), dot(&problem.loads[own], &dual.v[own])];
        let partial: Vec<[f64; 2]> = (0..sizes.len()).map(of).collect();
        let sums = problem.space.sum(partial.as_flattened(), 2);
        (row, sums[0], sums[1])
    })
}

const GOALS: [&str; 5] = [
    "displacement:1.7,0.4,2.1:0,1,-2:upper",
    "displacement:3.3,0.6,0.9:x",
    "reaction:left:z",
    "reaction:left:1,0,1",
    "contact_force",
];

/// The dual solution tells how a number changes with the loads, in bodies that yield and touch: finite differences.
#[test]
fn the_dual_solution_is_the_derivative_by_the_loads() {
    for goal in GOALS {
        for (load, tolerance) in [(-0.05, 1e-4), (-0.35, 0.02)] {
            let at = |factor: f64| {
                let load = format!("load.top.traction=[0.0, 0.0, {}]", factor * load);
                measured(&bricks(goal, &[&load]), &Solo)
            };
            let step = 1e-3;
            let [before, here, after] = [1.0 - step, 1.0, 1.0 + step].map(at);
            let slope = (after.0.value - before.0.value) / (2.0 * step);
            assert!((here.2 / slope - 1.0).abs() < tolerance, "{goal} at {load}: {} {slope}", here.2);
        }
    }
}

/// What the solver leaves is added: programs that are solved to a hundredth give the number of exact ones.
#[test]
fn the_number_is_that_of_the_mesh_whatever_the_solver_leaves() {
    for goal in GOALS {
        let loose = ["solver.residual_tolerance=1e-2", "solver.newton_tolerance=1e-1", "solver.qp_tolerance=1e-2"];
        let [exact, loose] = [&[][..], &loose[..]].map(|sets| measured(&bricks(goal, sets), &Solo).0);
        let (error, left) = ((loose.value / exact.value - 1.0).abs(), loose.gap / exact.value.abs());
        assert!(
            exact.gap < 1e-6 * exact.value.abs() && error < 1e-3 && error < 0.5 * left + 1e-6,
            "{goal}: {error} {left}"
        );
    }
}

#[test]
fn ranks_change_no_bit_of_a_number() {
    for goal in ["displacement:1.7,0.4,2.1:0,1,-2:upper", "reaction:left:z", "contact_force"] {
        let scene = bricks(goal, &["decomposition.subdomains=6"]);
        let bits = |row: GoalRow| {
            let GoalRow { value, correction, distance, gap, terms, .. } = row;
            [value, correction, distance, gap, terms].map(f64::to_bits)
        };
        let found = RANKS.map(|ranks| threads::run(ranks, |comm| bits(measured(&scene, comm).0)));
        assert!(found.iter().flatten().all(|other| *other == found[0][0]), "{goal}");
    }
}

#[test]
fn points_that_are_nowhere_or_in_two_bodies_or_held_are_refused() {
    let refused = |goal: &str| {
        let scene = bricks(goal, &["body.upper.brick.origin=[1.0, 0.0, 2.0]"]);
        let told = threads::run(2, |comm| {
            let discrete = model::discretise(&scene, comm).unwrap();
            let connection = Interconnection::new(comm, &discrete.decomposition, &discrete.constraints);
            Goal::new(&scene, &discrete, comm, &|| connection.gather.zeros()).err().map(|error| error.to_string())
        });
        assert!(told[0] == told[1]);
        told[0].clone().unwrap_or_default()
    };
    assert!(refused("displacement:1.7,0.4,9.0:z").contains("[1.7, 0.4, 9.0] is outside of all bodies"));
    assert!(refused("displacement:1.7,0.4,0.3:z:upper").contains("is outside of body upper"));
    assert!(refused("displacement:1.7,0.4,2.0:z").contains("bodies lower and upper both have the point"));
    assert!(refused("displacement:0.0,0.4,0.5:z:lower").contains("supports prescribe the displacement"));
    assert_eq!(refused("displacement:1.7,0.4,2.0:z:lower"), "");
}
