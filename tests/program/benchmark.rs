//! The paper's benchmark: sizes of its Table 2, and solutions against those of an independent monolithic solver.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use crate::common::fields::Fields;
use crate::common::{
    Run, assert_close, assert_near, assert_residuals, check, distance, number, solve, solve_level, solve_tightly,
    vector,
};
use serde_json::Value;

/// Hessian multiplications that the paper reports at level 1.
const PAPER_MULTIPLICATIONS: f64 = 1951.0;

fn reference(name: &str) -> Value {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/{name}.json"));
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Everything that the reference has, to 1e-6, and the counts exactly.
fn assert_agrees(run: &Run, name: &str) {
    let (summary, expected) = (run.summary(), reference(name));
    for key in ["plastic_elements", "active_contacts"] {
        assert_eq!(summary[key], expected[key], "{key}");
    }
    for key in ["energy", "external_work", "internal_energy", "max_displacement", "max_von_mises"] {
        assert_close(key, number(&summary, key), number(&expected, key), 1e-6);
    }
    assert_near("contact force", vector(&summary["contact_force"]), vector(&expected["contact_force"]), 1e-6);
    for support in ["left", "right"] {
        let [found, expected] = [&summary, &expected].map(|s| vector(&s["reactions"][support]));
        assert_near(&format!("reaction of {support}"), found, expected, 1e-6);
    }

    let fields = Fields::read(&run.result());
    let bodies = fields.body_of_points();
    let points = expected["points"].as_array().unwrap();
    assert!(!points.is_empty());
    for point in points {
        let (body, at) = (i64::from(point["body"] == "upper"), vector(&point["at"]));
        let copies: Vec<usize> =
            (0..bodies.len()).filter(|&copy| bodies[copy] == body && fields.points[copy] == at).collect();
        assert!(!copies.is_empty(), "no node at {at:?}");
        for copy in copies {
            let what = format!("displacement of {} at {at:?}", point["body"]);
            assert_near(&what, fields.displacement[copy], vector(&point["displacement"]), 1e-6);
        }
    }
}

#[test]
fn sizes_are_those_of_table_2_at_all_four_levels() {
    let keys = [
        "nodes",
        "cells",
        "elements",
        "subdomains",
        "primal_dofs",
        "gluing_rows",
        "dirichlet_rows",
        "contact_rows",
        "dual_dofs",
    ];
    let table: [[u64; 9]; 4] = [
        [7502, 6000, 36000, 6, 23958, 1452, 726, 275, 2453],
        [53802, 48000, 288000, 48, 191664, 30258, 2646, 1029, 33933],
        [174902, 162000, 972000, 162, 646866, 122160, 5766, 2263, 130189],
        [406802, 384000, 2304000, 384, 1533312, 312906, 10086, 3977, 326969],
    ];
    for (level, row) in (1..).zip(table) {
        let run = check(2, "two-blocks", level, &[]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        let summary = run.summary();
        for (key, size) in keys.iter().zip(row) {
            assert_eq!(summary[key], size, "{key} at level {level}");
        }
        assert_eq!(summary["level"], level);
        assert_eq!(summary["converged"], Value::Null, "a check solves nothing");
    }
}

#[test]
fn the_papers_tolerances_give_small_residuals_at_a_third_of_the_papers_multiplications() {
    let summary = solve(2, "two-blocks", &[]).converged().summary();
    assert_residuals(&summary, 1e-6);
    let newton = number(&summary, "newton_iterations");
    assert!((5.0..=7.0).contains(&newton), "{newton} Newton iterations; the paper has 6");
    let multiplications = number(&summary, "hessian_multiplications");
    assert!(multiplications <= PAPER_MULTIPLICATIONS / 3.0, "{multiplications} multiplications");
    let expected = reference("level1");
    assert_close("energy", number(&summary, "energy"), number(&expected, "energy"), 1e-6);
}

#[test]
fn level_1_agrees_with_the_monolithic_solver() {
    let tight = ["solver.newton_tolerance=1e-8", "solver.residual_tolerance=1e-9", "solver.qp_tolerance=1e-10"];
    let run = solve(2, "two-blocks", &tight).converged();
    assert_agrees(&run, "level1");
    assert_residuals(&run.summary(), 1e-9);
}

#[test]
fn a_fifth_of_the_load_agrees_with_the_monolithic_solver_elastic_or_not() {
    let tight = ["solver.residual_tolerance=1e-9", "solver.qp_tolerance=1e-10", "solver.preconditioner=dirichlet"];
    let run = solve(2, "two-blocks-elastic", &tight).converged();
    assert_agrees(&run, "level1-elastic");
    let sets = [&tight[..], &["load.top.traction.2=-30"]].concat();
    assert_agrees(&solve(2, "two-blocks", &sets).converged(), "level1-elastic");
}

#[test]
fn level_2_agrees_with_the_monolithic_solver() {
    let sets = [
        "solver.newton_tolerance=1e-8",
        "solver.residual_tolerance=1e-8",
        "solver.qp_tolerance=1e-9",
        "solver.preconditioner=dirichlet",
    ];
    assert_agrees(&solve_level(2, "two-blocks", 2, &sets).converged(), "level2");
}

/// With friction, node by node, too.
#[test]
fn level_1_with_friction_agrees_with_the_monolithic_solver() {
    let reference = reference("level1-friction");
    let cases = reference["cases"].as_array().unwrap();
    let of_nodes = |case: &Value| -> Vec<[f64; 5]> {
        let node = |node: &Value| std::array::from_fn(|k| node[k].as_f64().unwrap());
        case["nodes"].as_array().unwrap().iter().map(node).collect()
    };
    // Where all slips at a given limit, forces are that times the area of the node.
    let limit = number(&reference, "shear_limit");
    let given =
        of_nodes(&cases[2]).into_iter().map(|[x, y, fx, fy, _]| ([x, y].map(f64::to_bits), fx.hypot(fy) / limit));
    let area: BTreeMap<[u64; 2], f64> = given.collect();
    for case in cases {
        let sets: Vec<&str> = case["sets"].as_array().unwrap().iter().map(|set| set.as_str().unwrap()).collect();
        let run = solve_tightly(2, "two-blocks", &sets);
        let summary = run.summary();
        let rubbed = &summary["friction"]["joint"];
        for key in ["energy", "external_work", "max_displacement", "max_von_mises"] {
            assert_close(key, number(&summary, key), number(case, key), 1e-9);
        }
        assert_near("contact force", vector(&summary["contact_force"]), vector(&case["contact_force"]), 1e-9);
        let dissipation = number(rubbed, "dissipation");
        assert_close("dissipation", dissipation, number(case, "dissipation"), 1e-9);
        assert_eq!(summary["plastic_elements"], case["plastic_elements"]);
        let nodes = of_nodes(case);
        let found = ["sticking", "slipping"].map(|key| rubbed[key].as_u64().unwrap());
        assert_eq!(found, [0, nodes.len() as u64], "{sets:?}");

        let fields = Fields::read(&run.result());
        let (bodies, pressure) = (fields.body_of_points(), fields.of_points("contact_pressure"));
        let traction = fields.of_points("friction_traction");
        let largest = nodes.iter().flat_map(|node| &node[2..]).fold(0.0, |most, force| force.abs().max(most));
        for [x, y, force @ ..] in nodes {
            let is_upper = |k: &usize| bodies[*k] == 1 && fields.points[*k] == [x, y, 1000.0];
            let copies: Vec<usize> = (0..bodies.len()).filter(is_upper).collect();
            assert!(!copies.is_empty(), "no node at {x}, {y}");
            for copy in copies {
                let [tx, ty, _] = traction.as_chunks::<3>().0[copy];
                let found = [tx, ty, pressure[copy]].map(|stress| stress * area[&[x, y].map(f64::to_bits)]);
                let off = distance(found, force) / largest;
                assert!(off < 1e-9, "{sets:?} at {x}, {y}: {found:?}, not {force:?}");
            }
        }
    }
}
