//! Runs that start from the result of an earlier one: they go on as one history would.

use std::path::Path;

use crate::common::fields::{Fields, State, difference, state_at};
use crate::common::{
    Run, assert_near, assert_refused, assert_scene_refused, check, number, scene_file, solve, solve_tightly, vector,
};
use fetiplast::analytic::cycle::Cycle;
use fetiplast::material::VonMises;
use hdf5_metno::File;
use serde_json::Value;

/// Two blocks in contact, coarse, and with both kinds of hardening.
fn blocks(element: &str) -> Vec<String> {
    let mut sets = vec!["material.upper.kinematic_hardening=5000".to_owned()];
    for body in ["lower", "upper"] {
        sets.push(format!("body.{body}.brick.cells=[5, 2, 2]"));
        sets.push(format!("body.{body}.element={element}"));
    }
    sets
}

fn from(result: &Path) -> String {
    format!("initial.result=\"{}\"", result.display())
}

/// The last state of a file.
fn last(path: &Path) -> State {
    state_at(path, last_time(path))
}

/// Which of its times is the last.
fn last_time(path: &Path) -> usize {
    Fields::times(path).map_or(0, |times| times.len() - 1)
}

/// Pressed in one run and released in another, cut otherwise: as in one history, for every element.
#[test]
fn a_run_goes_on_from_the_result_of_another_as_one_history() {
    for element in ["tet4", "hex8", "tet10"] {
        let sets = blocks(element);
        let solve = |ranks: usize, more: &[&str]| {
            let sets: Vec<&str> = sets.iter().map(String::as_str).chain(more.iter().copied()).collect();
            solve_tightly(ranks, "two-blocks", &sets)
        };
        let (four, seven) = ("decomposition.subdomains=4", "decomposition.subdomains=7");
        let pressed = solve(2, &[four]);
        let history = solve(1, &[four, "step=[{}, {amplitude=0.2}]"]);
        let (moved, answers) = last(&history.result());
        assert!(answers.values().any(|[_, kappa]| *kappa > 1e-4), "nothing flows");
        let start = from(&pressed.result());
        let released = [1, 2, 3].map(|ranks| solve(ranks, &[seven, "step=[{amplitude=0.2}]", &start]));
        for run in &released {
            let (moved_1, answers_1) = last(&run.result());
            let errors = [difference(&moved_1, &moved), difference(&answers_1, &answers)];
            assert!(errors.iter().all(|error| *error < 1e-10), "{element}: {errors:?}");
        }
        let bits = released.each_ref().map(|run| {
            let mut bits = Fields::read(&run.result()).bits(&["VTKHDF/PointData", "VTKHDF/CellData", "convergence"]);
            bits.retain(|(name, _)| name != "VTKHDF/CellData/rank");
            let strain: Vec<f64> =
                File::open(run.result()).unwrap().dataset("state/plastic_strain").unwrap().read_raw().unwrap();
            bits.push(("strain".into(), strain.into_iter().map(f64::to_bits).collect()));
            bits
        });
        assert!(bits[0] == bits[1] && bits[0] == bits[2], "{element}: bits depend on the ranks");
    }
}

/// Cycles of a bar, a run for each half: strain and stress of the closed form all along.
#[test]
fn cycles_of_a_bar_may_be_taken_one_run_at_a_time() {
    let hardening = ["material.steel.hardening=3000", "material.steel.kinematic_hardening=9000"];
    let yield_stress = Some(450.0);
    let material =
        VonMises { yield_stress, hardening: 3000.0, kinematic_hardening: 9000.0, ..VonMises::elastic(210_000.0, 0.29) };
    let mut exact = Cycle::new(material);
    let mut before: Option<Run> = None;
    for (stress, parts) in [(500.0, 2), (0.0, 3), (-620.0, 5), (300.0, 2), (0.0, 4)] {
        exact.load(stress);
        let (load, parts) = (format!("load.pull.traction.0={stress}"), format!("decomposition.subdomains={parts}"));
        let start = before.as_ref().map(|run| from(&run.result()));
        let sets = hardening.into_iter().chain([&load[..], &parts[..]]).chain(start.as_deref());
        let run = solve_tightly(2, "bar", &sets.collect::<Vec<_>>());
        let fields = Fields::read(&run.result());
        let [along, across] = exact.uniaxial();
        let errors = fields.displacement.iter().zip(&fields.points);
        let errors = errors.flat_map(|(u, x)| [u[0] - along * x[0], u[1] - across * x[1], u[2] - across * x[2]]);
        let worst = errors.fold(0.0_f64, |worst, error| worst.max(error.abs())) / (along.abs() * 1000.0);
        assert!(worst < 1e-8, "displacement at {stress}: {worst:.1e}");
        for kappa in fields.of_elements("equivalent_plastic_strain") {
            assert!((kappa / exact.kappa - 1.0).abs() < 1e-8, "{kappa} at {stress}, not {}", exact.kappa);
        }
        before = Some(run);
    }
}

/// What has slid is where friction goes on from, and energies count from the end of the earlier run.
#[test]
fn friction_and_energies_go_on_from_the_result_of_another_run() {
    let sets = blocks("hex8");
    let solve = |more: &[&str]| {
        let sets = sets.iter().map(String::as_str).chain(["contact.joint.friction=0.3"]).chain(more.iter().copied());
        solve_tightly(2, "two-blocks", &sets.collect::<Vec<_>>())
    };
    let (four, seven) = ("decomposition.subdomains=4", "decomposition.subdomains=7");
    let pressed = solve(&[four]);
    let start = from(&pressed.result());
    let energy = |summary: &Value, name: &str| number(&summary["energies"], name);
    for amplitude in [1.0, 0.2] {
        let history = solve(&[four, &format!("step=[{{}}, {{amplitude={amplitude}}}]")]);
        let run = solve(&[seven, &format!("step=[{{amplitude={amplitude}}}]"), &start]);
        let errors = [last(&history.result()), last(&run.result())];
        assert!(difference(&errors[0].0, &errors[1].0) < 1e-9, "at {amplitude}");
        let [summary, whole, before] = [&run, &history, &pressed].map(Run::summary);
        assert_near("contact force", vector(&summary["contact_force"]), vector(&whole["contact_force"]), 1e-8);
        assert!(number(&summary, "residual_energies") < 1e-9, "{}", summary["energies"]);
        for name in ["stored", "plastic", "friction"] {
            let since = energy(&whole, name) - energy(&before, name);
            let off = (energy(&summary, name) - since).abs() / energy(&before, "external");
            assert!(off < 1e-9, "{name} at {amplitude}: {} and {since}", energy(&summary, name));
        }
    }
}

/// A way out in one run and back in another, of an obstacle or of a body whose surface supports move: as in one history.
#[test]
fn what_moves_goes_on_from_where_an_earlier_run_left_it() {
    let directory = tempfile::tempdir().unwrap();
    let of = |others: &str| {
        let text = format!(
            r#"
            material.steel = {{ young = 210000.0, poisson = 0.3, yield_stress = 200.0, hardening = 5000.0 }}
            [body.cube]
            material = "steel"
            element = "hex8"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [100.0, 100.0, 50.0], cells = [4, 4, 2] }}
            [support.bottom]
            surface = "cube.zmin"
            fix = ["x", "y", "z"]
            {others}
            friction = 0.4
            [decomposition]
            cells = [2, 2, 2]
            "#
        );
        scene_file(directory.path(), &text)
    };
    let obstacle = r#"
        [contact.punch]
        slave = "cube.zmax"
        rigid = { plane = { point = [0.0, 0.0, 50.0], normal = [0.0, 0.0, -1.0] } }
        displacement = [0.1, 0.02, -0.2]"#;
    let plate = r#"
        [body.plate]
        material = "steel"
        element = "hex8"
        brick = { origin = [-10.0, -10.0, 50.0], size = [120.0, 120.0, 20.0], cells = [6, 6, 2] }
        [support.plate]
        surface = "plate.zmin"
        fix = ["x", "y", "z"]
        displacement = [0.1, 0.02, -0.2]
        [contact.punch]
        slave = "cube.zmax"
        master = "plate.zmin""#;
    let (out, back) = ("{increments=3}", "{amplitude=0.4, increments=2}");
    for others in [obstacle, plate] {
        let scene = of(others);
        let whole = solve_tightly(2, &scene, &[&format!("step=[{out}, {back}]")]);
        let first = solve_tightly(2, &scene, &[&format!("step=[{out}]")]);
        let start = from(&first.result());
        let second = solve_tightly(3, &scene, &[&format!("step=[{back}]"), &start]);
        let states = [last(&whole.result()), last(&second.result())];
        assert!(difference(&states[0].0, &states[1].0) < 1e-9, "displacement");
        let slips = [&whole, &second].map(|run| {
            let path = run.result();
            Fields::at(&path, last_time(&path)).of_points("slip")
        });
        let size = slips[0].iter().fold(0.0_f64, |size, slip| size.max(slip.abs()));
        let off = slips[0].iter().zip(&slips[1]).fold(0.0_f64, |off, (a, b)| off.max((a - b).abs()));
        assert!(size > 1e-3 && off < 1e-7 * size, "slips of {size} differ by {off}");
        assert!(number(&second.summary(), "residual_energies") < 1e-8);
        let [whole, first, second] = [whole, first, second].map(|run| run.summary()["energies"].clone());
        for name in ["stored", "plastic", "friction"] {
            let since = number(&whole, name) - number(&first, name);
            let off = (number(&second, name) - since).abs() / number(&first, "external");
            assert!(off < 1e-7, "{name}: {} instead of {since}", number(&second, name));
        }
    }
}

#[test]
fn bodies_that_are_not_named_start_from_rest() {
    let sets = ["body.lower.brick.cells=[5, 2, 2]", "body.upper.brick.cells=[5, 2, 2]", "decomposition.subdomains=4"];
    let pressed = solve(2, "two-blocks", &sets).converged();
    let (start, step) = (from(&pressed.result()), "step=[{amplitude=0.01}]");
    let run = solve(2, "two-blocks", &[&sets[..], &[step, &start, "initial.bodies=[\"upper\"]"]].concat()).converged();
    let fields = [&pressed, &run].map(|run| Fields::read(&run.result()));
    let of_body = |fields: &Fields, body: i64| -> Vec<f64> {
        let bodies = fields.integers_of_elements("body").into_iter();
        let kappa = fields.of_elements("equivalent_plastic_strain").into_iter();
        kappa.zip(bodies).filter(|(_, of)| *of == body).map(|(kappa, _)| kappa).collect()
    };
    assert!(of_body(&fields[1], 0).iter().all(|kappa| *kappa == 0.0));
    let (before, after) = (of_body(&fields[0], 1), of_body(&fields[1], 1));
    assert!(before.iter().any(|kappa| *kappa > 1e-4));
    assert!(before.iter().zip(&after).all(|(before, after)| (before - after).abs() < 1e-12), "nothing flows anew");
}

#[test]
fn results_of_other_meshes_and_files_that_are_none_are_refused() {
    let sets = ["body.bar.brick.cells=[3, 2, 2]", "decomposition.subdomains=2"];
    let run = solve(1, "bar", &sets).converged();
    let start = from(&run.result());
    let refused = |more: &[&str], parts: &[&str]| {
        assert_scene_refused("bar", &[&[&start[..]], more].concat(), 65, &[&["initial.result = "], parts].concat());
    };
    refused(&[sets[1], "body.bar.brick.cells=[4, 2, 2]"], &["body bar has 36 nodes and 72 elements there, 45 and 96"]);
    refused(&[&sets[..], &["body.bar.element=hex8"]].concat(), &["body bar is of tet4 there and of hex8 here"]);
    refused(&[&sets[..], &["body.bar.brick.size.2=501"]].concat(), &["nodes of body bar are at other places"]);
    let strangers = ["initial.bodies=[\"bolt\"]", &start];
    assert_scene_refused("bar", &strangers, 65, &["initial.bodies", "no such body: known are bar"]);
    let of_blocks = solve(1, "patch", &[]).converged();
    assert_scene_refused("bar", &[&from(&of_blocks.result())], 65, &["it has no body bar, but lower, upper"]);
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let refused = |path: &Path, code: i32, parts: &[&str]| assert_scene_refused("bar", &[&from(path)], code, parts);
    refused(&at("missing.vtkhdf"), 74, &["cannot read the result file", "missing.vtkhdf", "No such file"]);
    std::fs::write(at("text"), "solid").unwrap();
    refused(&at("text"), 65, &["this is no result file"]);
    let bytes = std::fs::read(run.result()).unwrap();
    std::fs::write(at("half"), &bytes[..bytes.len() / 2]).unwrap();
    refused(&at("half"), 65, &["this is no result file"]);
    std::fs::write(at("old.vtkhdf"), &bytes).unwrap();
    File::open_rw(at("old.vtkhdf")).unwrap().unlink("state").unwrap();
    refused(&at("old.vtkhdf"), 65, &["it has no state to start from"]);
    let end = check(2, "bar", 1, &[&start, "body.bar.brick.cells=[4, 2, 2]"]);
    assert_refused(&end, 65, &["body bar has 36 nodes"]);
}
