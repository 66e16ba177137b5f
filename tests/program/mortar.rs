//! Contact of meshes that do not match beyond homogeneous states: balance of forces where contact meets supports, and
//! agreement with meshes that match.

use crate::common::{assert_close, assert_residuals, number, scene_file, solve, solve_tightly, vector};
use crate::ranks::assert_independent_of_ranks;
use fetiplast::analytic::press_fit::PressFit;
use serde_json::Value;

/// A block on a larger one, pressed down and held at one side, down to the contact, where that side moves down too. The
/// lower block has `cells` along x and y.
fn summary(cells: [usize; 2], slave: &str, master: &str, sets: &[&str]) -> Value {
    summary_of(cells, &format!("slave = {slave:?}\nmaster = {master:?}"), sets)
}

/// As [`summary`] with these keys of the contact.
fn summary_of(cells: [usize; 2], sides: &str, sets: &[&str]) -> Value {
    let text = format!(
        r#"
        [material.steel]
        young = 210000.0
        poisson = 0.29
        yield_stress = 450.0
        hardening = 10000.0
        [body.lower]
        material = "steel"
        element = "tet4"
        brick = {{ origin = [-200.0, -200.0, 0.0], size = [1200.0, 1200.0, 600.0], cells = [{}, {}, 6] }}
        [body.upper]
        material = "steel"
        element = "tet4"
        brick = {{ origin = [0.0, 0.0, 600.0], size = [800.0, 800.0, 600.0], cells = [8, 8, 6] }}
        [support.ground]
        surface = "lower.zmin"
        fix = ["x", "y", "z"]
        [support.wall]
        surface = "upper.xmin"
        fix = ["x", "y", "z"]
        displacement = [0.0, 0.0, -0.2]
        [load.top]
        surface = "upper.zmax"
        traction = [10.0, 0.0, -200.0]
        [contact.joint]
        {sides}
        [decomposition]
        subdomains = 8"#,
        cells[0], cells[1]
    );
    let directory = tempfile::tempdir().unwrap();
    solve_tightly(2, &scene_file(directory.path(), &text), sets).summary()
}

#[test]
fn forces_balance_where_contact_meets_a_support() {
    let (upper, lower) = ("upper.zmin", "lower.zmax");
    for (slave, master, sign) in [(upper, lower, 1.0), (lower, upper, -1.0)] {
        let summary = summary([7, 10], slave, master, &[]);
        assert_residuals(&summary, 1e-9);
        let contact = vector(&summary["contact_force"]).map(|f| sign * f);
        let (ground, wall) = (vector(&summary["reactions"]["ground"]), vector(&summary["reactions"]["wall"]));
        let load = [10.0, 0.0, -200.0].map(|t| t * 800.0 * 800.0);
        for axis in 0..3 {
            let left = [ground[axis] - contact[axis], wall[axis] + contact[axis] + load[axis]];
            assert!(left.iter().all(|f| f.abs() < 1e-8 * load[2].abs()), "axis {axis}: {left:?} is left");
        }
        assert!(contact[2] > 0.2 * load[2].abs(), "{contact:?}");
    }
}

#[test]
fn the_program_chooses_the_surface_that_supports_do_not_hold() {
    let (upper, lower) = ("upper.zmin", "lower.zmax");
    let named = summary([7, 10], lower, upper, &[]);
    for surfaces in [[upper, lower], [lower, upper]] {
        let chosen = summary_of([7, 10], &format!("surfaces = {surfaces:?}"), &[]);
        assert_eq!(chosen["contacts"], named["contacts"]);
        assert_eq!(chosen["contacts"][0]["slave"], lower);
        assert_eq!(chosen["energy"], named["energy"]);
    }
}

#[test]
fn both_solvers_find_one_solution_and_it_is_near_that_of_meshes_that_match() {
    let found =
        ["solver.qp=active-set", "solver.qp=smalse-m"].map(|qp| summary([14, 10], "upper.zmin", "lower.zmax", &[qp]));
    assert_close("energy", number(&found[0], "energy"), number(&found[1], "energy"), 1e-9);
    assert_eq!(found[0]["active_contacts"], found[1]["active_contacts"]);
    // Without the wall's motion, which would concentrate the contact force at the edge.
    let still = "support.wall.displacement.2=0";
    let [mortar, matching] = [[14, 10], [12, 12]].map(|cells| summary(cells, "upper.zmin", "lower.zmax", &[still]));
    assert_close("energy", number(&mortar, "energy"), number(&matching, "energy"), 0.01);
    let [mortar, matching] = [mortar, matching].map(|summary| vector(&summary["contact_force"])[2]);
    assert_close("contact force", mortar, matching, 0.01);
}

/// A quarter of two rings of tet10 that are pressed together, with so many cells around and through each.
fn press_fit(PressFit { young, radii: [a, b, c], interference, length }: PressFit, cells: [[usize; 2]; 2]) -> String {
    let ring = |name: &str, [inner, outer]: [f64; 2], [around, through]: [usize; 2]| {
        format!(
            r#"
            [body.{name}]
            material = "steel"
            element = "tet10"
            cylinder = {{ inner = {inner}, outer = {outer}, height = {length}, cells = [{around}, {through}, 1] }}
            [support.{name}-x]
            surface = "{name}.x0"
            fix = ["x"]
            [support.{name}-y]
            surface = "{name}.y0"
            fix = ["y"]
            [support.{name}-z]
            surface = "{name}.bottom"
            fix = ["z"]"#
        )
    };
    format!(
        r#"
        [material.steel]
        young = {young:?}
        poisson = 0.3
        {}
        {}
        [contact.fit]
        slave = "inside.outer"
        master = "outside.inner"
        clearance = -{interference}"#,
        ring("inside", [a, b], cells[0]),
        ring("outside", [b, c], cells[1])
    )
}

/// On faces of 30 and 45 degrees: conditions follow the normals of curved surfaces.
#[test]
fn the_energy_of_a_press_fit_is_that_of_the_closed_form_whether_its_meshes_match_or_not() {
    let fit = PressFit { young: 196_000.0, radii: [10.0, 15.0, 22.0], interference: 0.0025, length: 8.0 };
    let (quarter, directory) = (0.25 * fit.force(), tempfile::tempdir().unwrap());
    // A uniform pressure is more on the quarter's arc than what it pushes along an axis.
    let along = quarter / std::f64::consts::FRAC_PI_2;
    let off = |summary: &Value| number(summary, "energy") / (0.5 * quarter * fit.interference) - 1.0;
    for (cells, rule, bounds) in [
        ([[2, 6], [2, 6]], "node to node", [2e-3, 2e-2]),
        ([[3, 6], [2, 6]], "mortar", [5e-4, 5e-3]),
        ([[2, 6], [3, 6]], "mortar", [2e-3, 1e-2]),
    ] {
        let summary = solve(1, &scene_file(directory.path(), &press_fit(fit, cells)), &[]).converged().summary();
        assert_eq!(summary["contacts"][0]["rule"], rule);
        let (energy, force) = (off(&summary), vector(&summary["contact_force"]));
        let force = (force[0].abs() + force[1].abs()) / (2.0 * along) - 1.0;
        assert!(energy.abs() < bounds[0] && force.abs() < bounds[1], "{rule}: {energy:.1e} {force:.1e}");
    }
    // What is asked for is met, from the coarsest meshes.
    let scene = scene_file(directory.path(), &press_fit(fit, [[3, 1], [2, 1]]));
    let summary = solve(2, &scene, &["solver.error=0.005"]).converged().summary();
    assert!(off(&summary).abs() < 0.005, "{:.1e}", off(&summary));
}

/// So many conditions that no rank holds all of them: a block that is pressed on another one stays uniform, and is the same on any ranks,
/// whether both are alike or one is far softer.
#[test]
fn a_large_contact_in_parts_passes_a_uniform_pressure() {
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(
        directory.path(),
        r#"
        material.steel = { young = 210000.0, poisson = 0.3 }
        material.other = { young = 210000.0, poisson = 0.3 }
        [body.lower]
        material = "steel"
        element = "hex8"
        brick = { origin = [0.0, 0.0, 0.0], size = [34.0, 34.0, 2.0], cells = [34, 34, 2] }
        [body.upper]
        material = "other"
        element = "hex8"
        brick = { origin = [0.0, 0.0, 2.0], size = [34.0, 34.0, 3.0], cells = [27, 27, 2] }
        [support]
        ground = { surface = "lower.zmin", fix = ["z"] }
        low-x = { surface = "lower.xmin", fix = ["x"] }
        low-y = { surface = "lower.ymin", fix = ["y"] }
        high-x = { surface = "upper.xmin", fix = ["x"] }
        high-y = { surface = "upper.ymin", fix = ["y"] }
        [load.top]
        surface = "upper.zmax"
        traction = [0.0, 0.0, -100.0]
        [contact.joint]
        slave = "lower.zmax"
        master = "upper.zmin"
        [decomposition]
        subdomains = 60
        "#,
    );
    for (young, ranks) in [(210000.0, &[2][..]), (210.0, &[1, 2, 5])] {
        let sets = [&format!("material.other.young={young:?}"), "solver.qp_tolerance=1e-10"];
        let summary = Value::Object(assert_independent_of_ranks(&file, &sets, ranks));
        let conditions = summary["contacts"][0]["conditions"].as_u64();
        assert_eq!(conditions, Some(35 * 35), "{}", summary["contacts"]);
        let energy = -0.5 * 100.0_f64.powi(2) * 34.0 * 34.0 * (2.0 / 210_000.0 + 3.0 / young);
        assert_close("energy", number(&summary, "energy"), energy, 1e-7);
        let most = 30.0;
        assert!(number(&summary, "hessian_multiplications") <= most, "{}", summary["hessian_multiplications"]);
    }
}
