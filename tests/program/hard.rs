//! Scenes that are hard for the method: near incompressibility, perfect plasticity, degenerate contact, bodies that only contact holds,
//! decompositions into shreds or into whole bodies.

use crate::common::{
    COARSE, Run, assert_close, assert_near, assert_residuals, number, scene_file, solve, solve_level, solve_with,
    vector,
};
use serde_json::Value;

pub const RANKS: usize = 2;

/// Newton steps and applications of F in which every scene here must be solved.
const MOST_STEPS: f64 = 15.0;
const MOST_MULTIPLICATIONS: f64 = 3000.0;

/// Fails unless the run converged, well, in a reasonable time, and forces balance.
#[track_caller]
pub fn assert_solved(run: Run) -> Value {
    let summary = run.converged().summary();
    assert_residuals(&summary, 1e-6);
    for (key, most) in [("newton_iterations", MOST_STEPS), ("hessian_multiplications", MOST_MULTIPLICATIONS)] {
        let count = number(&summary, key);
        assert!(count <= most, "{key} is {count}");
    }
    summary
}

pub fn coarse(sets: &[&str]) -> Value {
    assert_solved(solve(RANKS, "two-blocks", &[&COARSE[..], sets].concat()))
}

/// The supports carry the load of the benchmark.
#[track_caller]
pub fn assert_balance(summary: &Value, load: f64) {
    let [left, right] = ["left", "right"].map(|support| vector(&summary["reactions"][support]));
    let sum = std::array::from_fn(|axis| left[axis] + right[axis]);
    assert_near("reactions", sum, [0.0, 0.0, load], 1e-5);
}

#[test]
fn nearly_incompressible_bodies_converge() {
    let summary = coarse(&["material.lower.poisson=0.499", "material.upper.poisson=0.499"]);
    assert_balance(&summary, 4.5e8);
    assert!(number(&summary, "plastic_elements") > 0.0);
}

#[test]
fn almost_perfect_plasticity_below_collapse_converges() {
    let summary =
        coarse(&["material.lower.hardening=0.21", "material.upper.hardening=0.21", "load.top.traction.2=-100"]);
    assert_balance(&summary, 3e8);
    assert!(number(&summary, "plastic_elements") > 0.0);
    // The yield surface grows by next to nothing.
    assert_close("largest stress", number(&summary, "max_von_mises"), 450.0, 1e-4);
}

/// One layer of flat cells between supports, under a rigid cylinder: parts would bend like plates if they floated.
#[test]
fn a_slice_in_plane_strain_takes_few_applications_on_any_mesh() {
    const SLICE: &str = r#"
        material.steel = { young = 210e3, poisson = 0.3 }
        body.block.material = "steel"
        body.block.element = "hex8"
        body.block.brick = { origin = [-50.0, 0.0, -50.0], size = [100.0, 1.0, 50.0], cells = [64, 1, 32] }
        [support]
        bottom = { surface = "block.zmin", fix = ["x", "y", "z"] }
        front = { surface = "block.ymin", fix = ["y"] }
        back = { surface = "block.ymax", fix = ["y"] }
        [contact.roll]
        slave = "block.zmax"
        rigid = { cylinder = { point = [0.0, 0.0, 100.0], axis = [0.0, 1.0, 0.0], radius = 100.0 } }
        displacement = [0.0, 0.0, -0.3]
        [decomposition]
        method = "bricks"
        cells = [8, 1, 8]
    "#;
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), SLICE);
    for level in [1, 2] {
        for friction in [0.0, 0.3] {
            // Without pins clusters took 805 at level 2.
            for (cluster, most) in [(1, 45.0), (8, 130.0)] {
                let sets = [format!("contact.roll.friction={friction}"), format!("decomposition.cluster={cluster}")];
                let run = solve_level(RANKS, &scene, level, &sets.each_ref().map(String::as_str));
                let count = number(&assert_solved(run), "hessian_multiplications");
                assert!(count <= most, "level {level}, friction {friction}, clusters of {cluster}: {count}");
            }
        }
    }
}

/// No history is asked for: the load is halved until there is an equilibrium.
#[test]
fn above_the_limit_load_the_last_equilibrium_is_told_and_kept() {
    // Beyond the limit no program has a solution: it need not be sought for long.
    let sets = [&COARSE[..], &["material.lower.hardening=0", "material.upper.hardening=0"]].concat();
    let sets = [&sets[..], &["load.top.traction.2=-400", "solver.qp_limit=400", "solver.newton_limit=15"]].concat();
    let run = solve(1, "two-blocks", &sets);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let summary = run.summary();
    let error = summary["error"].as_str().unwrap();
    let rows = summary["steps"].as_array().unwrap();
    let last = rows.last().unwrap();
    let time = number(last, "time");
    assert!(rows.iter().all(|row| row["converged"] == true) && time > 0.0 && time < 1.0, "{rows:?}");
    assert!(error.contains("limit load") && error.contains(&format!("{time:.4} of the load")), "{error}");
    assert_balance(last, time * 1.2e9);
    assert_close("largest stress", number(last, "max_von_mises"), 450.0, 1e-6);
}

/// Beyond the limit nothing keeps the wall from flying away; so far away that only round-off is left of the forces, compared with
/// what they are sums of, it is not in equilibrium.
#[test]
fn a_sphere_that_flew_away_is_no_equilibrium() {
    let run = solve(1, concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/precision/limit-sphere.toml"), &[]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let summary = run.summary();
    let last = summary["steps"].as_array().unwrap().last().unwrap();
    // The limit of this mesh; that of the sphere itself is 2 sigma_y ln 2, less.
    let pressure = 560.0 + 160.0 * (number(last, "time") - 1.0);
    assert!(pressure > 900.0 * 2.0_f64.ln() && pressure < 1.08 * 900.0 * 2.0_f64.ln(), "{pressure}");
    assert!(number(&summary, "max_displacement") < 1.0, "{}", summary["max_displacement"]);
}

/// Applications of F that the benchmark takes, and how many times that most hard cases may take.
pub const BENCHMARK: f64 = 73.0;
const TIMES: f64 = 3.0;

/// Layers of cells a thousand times as wide as thick.
#[test]
fn slivers_take_about_as_many_applications_of_f_as_the_benchmark() {
    let summary = assert_solved(solve(RANKS, concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hard/slivers.toml"), &[]));
    assert_balance(&summary, 4.5e8);
    assert!(number(&summary, "active_contacts") > 0.0 && number(&summary, "plastic_elements") > 0.0);
    let count = number(&summary, "hessian_multiplications");
    assert!(count <= TIMES * BENCHMARK, "{count}");
}

/// Flat elements everywhere: a plate 150 times as wide as thick, of one element, and one of elements 25 times as wide as thick.
#[test]
fn plates_take_about_as_many_applications_of_f_as_the_benchmark() {
    let hexahedra = ["body.lower.element=hex8", "body.upper.element=hex8", "decomposition.subdomains=12"];
    let plate = ["body.upper.brick.size.2=20", "body.upper.brick.cells=[30, 10, 1]", "load.top.traction.2=-0.05"];
    let flat = ["body.upper.brick.size.2=40", "load.top.traction.2=-0.1"];
    for (sets, load) in [([&hexahedra[..], &plate].concat(), 1.5e5), (flat.to_vec(), 3e5)] {
        let summary = assert_solved(solve(RANKS, "two-blocks-elastic", &sets));
        assert_balance(&summary, load);
        let count = number(&summary, "hessian_multiplications");
        assert!(count <= TIMES * BENCHMARK, "{sets:?}: {count}");
    }
}

/// What the mesh costs is told, and the solver stops well below it.
#[test]
fn no_more_accuracy_is_bought_than_asked_for() {
    let solved = |more: &[&str]| {
        let summary =
            solve_with(RANKS, "two-blocks", 1, &COARSE, &[&["--cascade", "off"], more].concat()).converged().summary();
        let [algebraic, mesh] = ["error_algebraic", "error_discretisation"].map(|key| number(&summary, key));
        (summary, algebraic, mesh)
    };
    let (whole, algebraic, mesh) = solved(&[]);
    let (short, loose, same_mesh) = solved(&["--accuracy", "0.1"]);
    assert!(algebraic < loose && loose <= 0.1 * same_mesh, "{algebraic:e} {loose:e} {same_mesh:e}");
    assert_close("error of the mesh", same_mesh, mesh, 0.02);
    assert_eq!((&whole["ended_by_accuracy"], &short["ended_by_accuracy"]), (&false.into(), &true.into()));
    assert!(number(&short, "newton_iterations") < number(&whole, "newton_iterations"));
    // The energy is above its minimum by the duality gap at most.
    let above = number(&short, "energy") - number(&whole, "energy");
    assert!(above >= 0.0 && above <= number(&short, "duality_gap"), "{above:e}");
}

#[test]
fn the_decomposition_changes_nothing_where_the_contact_edge_meets_subdomain_corners() {
    let tight = ["solver.newton_tolerance=1e-7", "solver.residual_tolerance=1e-8", "solver.qp_tolerance=1e-9"];
    // The upper body begins at the third cell of the lower one: its edge lies on faces and corners of the cubes of 3
    // cells' length, and inside those of 5.
    let solved = |cells: &str| {
        let decomposition = format!("decomposition.cells={cells}");
        assert_solved(solve(RANKS, "two-blocks", &[&COARSE[..2], &tight, &[&decomposition]].concat()))
    };
    let (on, inside) = (solved("[3, 5, 5]"), solved("[5, 5, 5]"));
    assert_ne!(on["subdomains"], inside["subdomains"]);
    for key in ["plastic_elements", "active_contacts"] {
        assert_eq!(on[key], inside[key], "{key}");
    }
    for key in ["energy", "max_displacement", "max_von_mises"] {
        assert_close(key, number(&on, key), number(&inside, key), 1e-6);
    }
}

#[test]
fn one_subdomain_per_body_needs_no_gluing() {
    let summary =
        assert_solved(solve(RANKS, "two-blocks", &[&COARSE[..2], &["decomposition.cells=[15, 5, 5]"]].concat()));
    assert_eq!(summary["subdomains"], 2);
    assert_eq!(summary["gluing_rows"], 0);
    assert_balance(&summary, 4.5e8);
}

#[test]
fn ragged_parts_of_two_elements_carry_the_contact_patch() {
    let summary = assert_solved(solve(RANKS, "patch", &["decomposition.subdomains=384"]));
    assert!(number(&summary, "subdomains") >= 384.0, "a part is split, never merged");
    assert_close("contact force", vector(&summary["contact_force"])[2], 315e6, 1e-5);
    assert_close("largest stress", number(&summary, "max_von_mises"), 315.0, 1e-4);
}

/// A gap of zero that no force closes: the load pulls the lower body down, away from the upper one.
#[test]
fn contact_that_opens_everywhere_transmits_no_force() {
    let summary =
        assert_solved(solve(RANKS, "two-blocks-elastic", &[&COARSE[..], &["load.top.surface=lower.zmax"]].concat()));
    assert_eq!(summary["active_contacts"], 0);
    assert_eq!(vector(&summary["contact_force"]), [0.0; 3]);
    assert_near("reaction", vector(&summary["reactions"]["left"]), [0.0, 0.0, 9e7], 1e-5);
}

/// The contact patch with a load on the upper block instead of its support: only contact holds it vertically.
fn pressed(traction: f64, sets: &[&str]) -> Run {
    let text = include_str!("../../src/scene/library/patch.toml");
    let support = "[support.top]\nsurface = \"upper.zmax\"\nfix = [\"z\"]\ndisplacement = [0.0, 0.0, -3.0]\n";
    assert!(text.contains(support));
    let load = format!("[load.top]\nsurface = \"upper.zmax\"\ntraction = [0.0, 0.0, {traction:?}]\n");
    let directory = tempfile::tempdir().unwrap();
    solve(RANKS, &scene_file(directory.path(), &text.replace(support, &load)), sets)
}

#[test]
fn a_body_that_only_contact_holds_is_warned_of_and_carried() {
    for gap in [0.0, 5.0] {
        let origin = format!("body.upper.brick.origin.2={}", 1000.0 + gap);
        let summary = assert_solved(pressed(-315.0, &[&origin]));
        let warnings = summary["warnings"].to_string();
        assert!(warnings.contains("body upper") && warnings.contains("only contact can hold"), "{warnings}");
        assert_close("contact force", vector(&summary["contact_force"])[2], 315e6, 1e-6);
        assert_eq!(summary["active_contacts"], 25);
        assert_close("largest stress", number(&summary, "max_von_mises"), 315.0, 1e-5);
        let expected = 3.0 + gap;
        let along_z = (number(&summary, "max_displacement").powi(2) - 2.0 * (0.29 * 1.5_f64).powi(2)).sqrt();
        assert_close("largest displacement", along_z, expected, 1e-5);
    }
}

/// Three walls around the top of a block, so slanted that closing a contact opens another: the active sets come back.
const CYCLE: &str = r#"
[material.block]
young = 1.0
poisson = 0.0
[body.block]
material = "block"
element = "tet4"
brick = { origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0], cells = [1, 1, 2] }
[support.bottom]
surface = "block.zmin"
fix = ["x", "y", "z"]
[load.top]
surface = "block.zmax"
traction = [0.5, -0.9, -0.9]
[contact.first]
slave = "block.zmax"
rigid = { plane = { point = [1.0, 0.1, 0.9], normal = [-0.2, 0.5, -0.8] } }
[contact.second]
slave = "block.zmax"
rigid = { plane = { point = [1.0, 1.0, 1.0], normal = [-0.3, 0.7, -0.7] } }
[contact.third]
slave = "block.zmax"
rigid = { plane = { point = [-0.1, 1.1, 1.1], normal = [0.7, -0.5, -0.4] } }
[decomposition]
method = "metis"
subdomains = 2
[solver]
residual_tolerance = 1e-9
"#;

#[test]
fn where_active_sets_come_back_the_safeguard_ends_with_the_same_solution() {
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), CYCLE);
    let [fast, safe] = ["active-set", "smalse-m"]
        .map(|qp| assert_solved(solve(RANKS, &scene, &[&format!("solver.qp={qp}"), "solver.newton_tolerance=1e-8"])));
    assert!(number(&fast, "active_set_iterations") > 1.0);
    assert!(number(&fast, "smalse_iterations") > 0.0, "no set has come back");
    assert_close("energy", number(&fast, "energy"), number(&safe, "energy"), 1e-8);
    assert_near("contact force", vector(&fast["contact_force"]), vector(&safe["contact_force"]), 1e-8);
}
