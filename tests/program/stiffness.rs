//! Bodies of very unlike stiffness: that stand on each other, that hardly bend before they flow, with cores of another material.

use crate::common::{
    COARSEST, assert_close, assert_near, assert_residuals, assert_scene_refused, number, scene_file, solve, solve_with,
    vector,
};
use crate::hard::{BENCHMARK, RANKS, assert_balance, assert_solved, coarse};

/// A body that begins to flow everywhere at once may take so many times the applications of F of the benchmark.
const MOST_TIMES: f64 = 6.0;

#[test]
fn a_million_times_stiffer_body_converges_with_scaling() {
    for stiff in ["material.upper.young=2.1e11", "material.lower.young=2.1e11"] {
        let summary = coarse(&[stiff, "load.top.traction.2=-30", "solver.preconditioner=lumped"]);
        assert_balance(&summary, 9e7);
    }
}

/// Two columns, the upper one standing on the lower one by contact alone, under uniaxial stress: the sum of what both give way.
#[test]
fn bodies_of_any_ratio_of_stiffness_stand_on_each_other_as_in_the_closed_form() {
    let directory = tempfile::tempdir().unwrap();
    for element in ["tet4", "hex8"] {
        for exponent in [-15, -12, -10, -9, -6, -3, 3, 6, 9, 10, 12, 15] {
            let ratio = 10.0_f64.powi(exponent);
            let text = columns(element, 1e3, 1e3 * ratio);
            let summary = solve(1, &scene_file(directory.path(), &text), &[]).converged().summary();
            assert_residuals(&summary, 1e-6);
            assert_near("contact force", vector(&summary["contact_force"]), [0.0, 0.0, 1.0], 1e-6);
            assert_close("displacement", number(&summary, "max_displacement"), 1e-3 * (1.0 + 1.0 / ratio), 1e-5);
        }
    }
    // What slides is refused with that reason, whatever the ratio.
    for stiff in [1e3, 1e15, 1e18] {
        let slides = columns("hex8", 1e3, stiff).replace("fix = [\"x\"]", "fix = [\"y\"]");
        let parts = ["body.upper: nothing determines its translation along +x"];
        assert_scene_refused(&scene_file(directory.path(), &slides), &[], 65, &parts);
    }
}

fn columns(element: &str, lower: f64, upper: f64) -> String {
    format!(
        r#"
        material.lower = {{ young = {lower:e}, poisson = 0.0 }}
        material.upper = {{ young = {upper:e}, poisson = 0.0 }}
        body.lower = {{ material = "lower", element = "{element}", brick = {{ origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0], cells = [2, 2, 4] }} }}
        body.upper = {{ material = "upper", element = "{element}", brick = {{ origin = [0.0, 0.0, 1.0], size = [1.0, 1.0, 1.0], cells = [2, 2, 4] }} }}
        support.base = {{ surface = "lower.zmin", fix = ["x", "y", "z"] }}
        support.along-x = {{ surface = "upper.xmin", fix = ["x"] }}
        support.along-y = {{ surface = "upper.ymin", fix = ["y"] }}
        load.press = {{ surface = "upper.zmax", traction = [0.0, 0.0, -1.0] }}
        contact.joint = {{ slave = "upper.zmin", master = "lower.zmax" }}
        decomposition.cells = [2, 2, 2]
        "#
    )
}

/// Asserts how a body converges that is as strong as before, and a million times stiffer than strong: it begins to flow everywhere at
/// once. Where steps go depends on rounding, and so on the processor; Newton's tangent takes more than 50, of which 16 are cut.
fn assert_a_rigid_body_flows(sets: &[&str]) {
    let sets = [&["material.lower.young=2.1e11"], sets].concat();
    let run = solve_with(RANKS, "two-blocks", 1, &sets, &["--cascade", "off"]);
    let summary = run.converged().summary();
    assert_residuals(&summary, 1e-6);
    assert_balance(&summary, 4.5e8);
    for (key, most) in [("newton_iterations", 30.0), ("hessian_multiplications", MOST_TIMES * BENCHMARK)] {
        let count = number(&summary, key);
        assert!(count <= most, "{key} is {count}");
    }
    let steps = summary["newton"].as_array().unwrap();
    assert!(steps.iter().filter(|step| number(step, "damping") < 0.25).count() <= 3, "{steps:?}");
}

/// Without deluxe scaling of faces linear tetrahedra take 22 times the applications of F of the benchmark.
#[test]
fn a_rigid_body_that_flows_converges_with_few_cut_steps_and_few_applications_of_f() {
    assert_a_rigid_body_flows(&[]);
}

#[test]
#[ignore = "slow: scripts/many"]
fn a_rigid_body_of_hexahedra_that_flows_converges_with_few_cut_steps_and_few_applications_of_f() {
    assert_a_rigid_body_flows(&["body.lower.element=hex8", "body.upper.element=hex8"]);
}

/// A stiff body that flows, held at both ends, of which one is moved: supports hold its subdomains still, and what they carry is the
/// same as where a lumped preconditioner knows nothing of that.
#[test]
fn supports_that_hold_subdomains_still_carry_and_move_as_others_do() {
    let moved = "{ surface = 'lower.xmax', fix = ['x', 'y', 'z'], displacement = [0.3, 0.2, -0.4] }";
    let bent = format!("support.bent={moved}");
    let tight = ["solver.newton_tolerance=1e-9", "solver.residual_tolerance=1e-9", "solver.qp_tolerance=1e-11"];
    let sets = [&COARSEST[..], &["material.lower.young=2.1e9", "load.top.traction.2=-50", &bent], &tight].concat();
    let [held, plain] = ["dirichlet", "lumped"].map(|name| {
        let name = format!("solver.preconditioner={name}");
        let run = solve(RANKS, "two-blocks", &[&sets[..], &[&name]].concat());
        run.converged().summary()
    });
    assert!(number(&held, "hessian_multiplications") < 0.7 * number(&plain, "hessian_multiplications"));
    assert_close("energy", number(&held, "energy"), number(&plain, "energy"), 1e-9);
    for support in ["left", "right", "bent"] {
        let [held, plain] = [&held, &plain].map(|summary| vector(&summary["reactions"][support]));
        assert_near(support, held, plain, 1e-6);
    }
}

/// A core in each body, one of them up to the contact: stiffness jumps between subdomains that are glued.
#[test]
fn a_million_times_stiffer_or_softer_core_converges_as_fast() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hard/cores.toml");
    let solved = |sets: &[&str], load: f64| {
        let summary = assert_solved(solve(RANKS, scene, sets));
        assert_balance(&summary, load);
        number(&summary, "hessian_multiplications")
    };
    let load = "load.top.traction.2=-30";
    let plain = solved(&[load], 9e7);
    let around = "material.steel.young=2.1e11";
    // Two are soft up to the contact: active sets wander where they are corrected too soon.
    let soft = ["material.core.young=0.21"];
    for jump in
        [&["material.core.young=2.1e11"][..], &[around, "body.upper.material.upper-core=steel"], &[around], &soft]
    {
        let count = solved(&[jump, &[load]].concat(), 9e7);
        assert!(count <= 3.0 * plain, "{jump:?}: {count} applications of F, {plain} without a jump");
    }
}
