//! Load histories: loading, unloading, reloading of homogeneous states against their closed form, residual states of
//! bodies in contact, increments that are cut back, and the series of results.

use crate::common::fields::Fields;
use crate::common::{
    COARSE, COARSEST, assert_close, assert_residuals, number, scene_file, solve, solve_tightly, vector,
};
use fetiplast::analytic::cycle::Cycle;
use fetiplast::material::VonMises;
use serde_json::Value;

const RANKS: usize = 2;
const EXACT: f64 = 1e-8;

/// Isotropic, kinematic, both: as `--set`s and as the material of the closed form.
fn hardenings() -> [([String; 2], VonMises); 3] {
    [(10000.0, 0.0), (0.0, 10000.0), (3000.0, 9000.0)].map(|(hardening, kinematic_hardening)| {
        let keys = [
            format!("material.steel.hardening={hardening}"),
            format!("material.steel.kinematic_hardening={kinematic_hardening}"),
        ];
        let yield_stress = Some(450.0);
        (keys, VonMises { yield_stress, hardening, kinematic_hardening, ..VonMises::elastic(210_000.0, 0.29) })
    })
}

/// Fails unless all values are the expected one, relative to `scale`.
#[track_caller]
fn assert_all(what: &str, values: impl IntoIterator<Item = f64>, expected: f64, scale: f64) {
    let errors = values.into_iter().map(|value| ((value - expected) / scale).abs());
    let worst = errors.fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a });
    assert!(worst <= EXACT, "{what}: relative error {worst:.2e} against {expected}");
}

/// Stresses at the ends of the steps: beyond yield, off, beyond yield on the other side, back, on.
const PATH: [f64; 6] = [500.0, 0.0, -620.0, 300.0, 700.0, 0.0];

fn steps(of: impl Fn(f64) -> String) -> String {
    format!("step=[{}]", PATH.map(of).join(", "))
}

#[test]
fn a_bar_follows_its_cycles_under_every_hardening() {
    for (keys, material) in hardenings() {
        let steps = steps(|stress| format!("{{amplitude={}}}", stress / 500.0));
        let run = solve_tightly(RANKS, "bar", &[&keys[0], &keys[1], &steps]);
        assert_eq!(Fields::times(&run.result()).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let summary = run.summary();
        let mut exact = Cycle::new(material);
        for (index, stress) in PATH.into_iter().enumerate() {
            exact.load(stress);
            let ([along, across], fields) = (exact.uniaxial(), Fields::at(&run.result(), index));
            let moved = fields.displacement.iter().zip(&fields.points);
            let errors = moved.flat_map(|(u, x)| [u[0] - along * x[0], u[1] - across * x[1], u[2] - across * x[2]]);
            assert_all("displacement", errors, 0.0, exact.uniaxial()[0].abs() * 1000.0);
            assert_all("stress", fields.of_elements("von_mises"), stress.abs(), 500.0);
            assert_all("kappa", fields.of_elements("equivalent_plastic_strain"), exact.kappa, exact.kappa);
            let row = &summary["steps"][index];
            assert_all("reaction", [vector(&row["reactions"]["back"])[0]], -stress * 250_000.0, 500.0 * 250_000.0);
            assert_eq!((&row["step"], &row["time"]), (&(index + 1).into(), &(index as f64 + 1.0).into()));
        }
        let last = &summary["steps"][PATH.len() - 1];
        assert_eq!((&summary["energy"], &summary["reactions"]), (&last["energy"], &last["reactions"]));
    }
}

/// Loads and displacement change by factors of their own: the shear of the closed form is not proportional to its stress.
#[test]
fn a_sheared_block_follows_its_cycles_under_every_hardening() {
    for (keys, material) in hardenings() {
        let root = 3_f64.sqrt();
        let mut exact = Cycle::new(material);
        let mut states = Vec::new();
        for stress in PATH {
            exact.load(stress);
            states.push(exact);
        }
        let step = |state: &Cycle| {
            let (load, top) = (state.stress / root / 300.0, state.shear() / 1.574342794511481e-2);
            format!("{{amplitude={load}, support={{top={top}}}}}")
        };
        let steps = format!("step=[{}]", states.iter().map(step).collect::<Vec<_>>().join(", "));
        let run = solve_tightly(RANKS, "shear", &[&keys[0], &keys[1], &steps]);
        for (index, state) in states.iter().enumerate() {
            let fields = Fields::at(&run.result(), index);
            let moved = fields.displacement.iter().zip(&fields.points);
            let errors = moved.flat_map(|(u, x)| [u[0] - state.shear() * x[1], u[1], u[2]]);
            assert_all("displacement", errors, 0.0, state.shear().abs() * 1000.0);
            assert_all("stress", fields.of_elements("von_mises"), state.stress.abs(), 500.0);
            assert_all("kappa", fields.of_elements("equivalent_plastic_strain"), state.kappa, state.kappa);
        }
    }
}

/// Two blocks pushed together beyond yield and drawn apart again: the gap that is left is twice the plastic strain.
#[test]
fn contact_opens_by_the_plastic_imprint_and_closes_again() {
    let steps = "step=[{increments=3}, {amplitude=0}, {amplitude=0.5}, {amplitude=1.2}]";
    let run = solve_tightly(RANKS, "patch", &["support.top.displacement.2=-10", steps]);
    let summary = run.summary();
    let mut exact = Cycle::new(hardenings()[0].1);
    let mut index = 0;
    for (push, rows) in [(10.0, 3), (0.0, 1), (5.0, 1), (12.0, 1)] {
        index += rows;
        let row = &summary["steps"][index - 1];
        // Contact carries no tension: beyond the imprint the blocks are apart.
        exact.stretch((-push / 2000.0_f64).min(exact.plastic));
        let gap = if exact.plastic < -push / 2000.0 { -2000.0 * exact.plastic - push } else { 0.0 };
        let fields = Fields::at(&run.result(), index - 1);
        assert_all("stress", fields.of_elements("von_mises"), -exact.stress, 450.0);
        let gaps = fields.of_points("contact_gap").into_iter().filter(|gap| gap.is_finite());
        assert_all("gap", gaps, gap, 10.0);
        assert_all("contact force", [vector(&row["contact_force"])[2]], -exact.stress * 1e6, 450.0 * 1e6);
        assert_eq!(row["active_contacts"], if gap > 0.0 { 0 } else { 25 });
    }
    assert!(exact.plastic < -0.002, "the blocks have yielded");
}

/// Elastic bodies forget: after loading and unloading in increments nothing is left, and halves add up.
#[test]
fn an_elastic_history_ends_where_it_began() {
    let steps = "step=[{increments=2}, {amplitude=0}]";
    let run = solve_tightly(RANKS, "two-blocks-elastic", &[&COARSE[..], &[steps]].concat());
    let once = solve_tightly(RANKS, "two-blocks-elastic", &COARSE).summary();
    let rows = run.summary()["steps"].clone();
    let energy = |row: &Value| number(row, "energy");
    assert_close("full load", energy(&rows[1]), energy(&once), 1e-9);
    assert!(number(&rows[2], "max_displacement") < 1e-9 * number(&once, "max_displacement"));
    assert!(energy(&rows[2]).abs() < 1e-15 * energy(&once).abs());
}

/// One step from zero is one step from zero, however it is written.
#[test]
fn a_single_step_is_the_scene_without_steps() {
    let sets = |step: &'static str| [&COARSE[..], &[step]].concat();
    let (plain, stepped) = (solve(RANKS, "two-blocks", &COARSE), solve(RANKS, "two-blocks", &sets("step=[{}]")));
    let (plain_fields, stepped_fields) = (Fields::read(&plain.result()), Fields::read(&stepped.result()));
    let groups = ["VTKHDF/PointData", "VTKHDF/CellData", "convergence"];
    assert!(plain_fields.bits(&groups) == stepped_fields.bits(&groups));
    let rows = [plain.summary(), stepped.summary()].map(|summary| summary["steps"].clone());
    assert_eq!(rows[0], rows[1]);
    assert_eq!(rows[0].as_array().unwrap().len(), 1);
    assert_eq!(rows[0][0]["energy"], plain.summary()["energy"]);
}

/// Loaded, unloaded and loaded again a structure is where it was: what yields has hardened enough.
#[test]
fn reloading_returns_to_the_loaded_state() {
    let steps = "step=[{increments=2}, {amplitude=0}, {}]";
    let run = solve_tightly(RANKS, "two-blocks", &[&COARSE[..], &[steps]].concat());
    let (loaded, unloaded, again) =
        (Fields::at(&run.result(), 1), Fields::at(&run.result(), 2), Fields::at(&run.result(), 3));
    let size = loaded.displacement.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let changes = again.displacement.as_flattened().iter().zip(loaded.displacement.as_flattened());
    assert_all("displacement", changes.map(|(a, b)| a - b), 0.0, size);
    let kappa = |fields: &Fields| fields.of_elements("equivalent_plastic_strain");
    assert_all("kappa", kappa(&again).iter().zip(kappa(&unloaded)).map(|(a, b)| a - b), 0.0, 1e-3);
    assert!(unloaded.of_elements("von_mises").iter().any(|&stress| stress > 50.0), "residual stresses stay");
    for row in run.summary()["steps"].as_array().unwrap() {
        assert_residuals(row, 1e-11);
    }
}

#[test]
fn a_history_gives_the_same_bits_on_1_2_and_3_ranks() {
    let steps = "step=[{increments=2}, {amplitude=0}, {amplitude=1.1}]";
    let sets = [&COARSE[..], &["material.upper.kinematic_hardening=5000", steps]].concat();
    let results = [1, 2, 3].map(|ranks| {
        let run = solve(ranks, "two-blocks", &sets).converged();
        let fields = Fields::at(&run.result(), 0);
        let mut bits = fields.bits(&["VTKHDF/PointData", "VTKHDF/CellData", "convergence"]);
        bits.retain(|(name, _)| name != "VTKHDF/CellData/rank");
        bits.sort();
        (bits, run.summary()["steps"].clone())
    });
    assert!(results[0].0.len() > 10 && results[0].1.as_array().is_some_and(|rows| rows.len() == 4));
    for (ranks, (bits, rows)) in (1..).zip(&results) {
        assert!(*bits == results[0].0, "fields differ on {ranks} ranks");
        assert_eq!(*rows, results[0].1, "{ranks} ranks");
    }
}

/// A limit that the full step exceeds and its halves keep: the same end as with increments of the scene's own.
#[test]
fn an_increment_that_fails_is_halved_until_it_converges() {
    let cut = solve(RANKS, "two-blocks", &[&COARSE[..], &["step=[{}]", "solver.newton_limit=5"]].concat()).converged();
    let rows = cut.summary()["steps"].as_array().unwrap().clone();
    let cuts = cut.stdout.matches("the increment is halved").count();
    assert!(cuts > 1, "{}", cut.stdout);
    assert!(rows.len() > 1 && rows.iter().all(|row| row["converged"] == true));
    let last = rows.last().unwrap();
    assert_eq!(last["halvings"], cuts);
    assert_eq!((&last["time"], &last["increment"]), (&1.0.into(), &1.into()));
    let times: Vec<f64> = rows.iter().map(|row| number(row, "time")).collect();
    assert_eq!(Fields::times(&cut.result()).unwrap(), times);
    // The same parts, asked for: each is reached from the same state, so the end is the same.
    let parts: Vec<String> = times.iter().map(|time| format!("{{amplitude={time}}}")).collect();
    let parts = format!("step=[{}]", parts.join(", "));
    let asked = solve(RANKS, "two-blocks", &[&COARSE[..], &[&parts]].concat()).converged();
    assert_close("energy", number(&cut.summary(), "energy"), number(&asked.summary(), "energy"), 1e-8);
    let newton = cut.summary()["newton"].as_array().unwrap().len();
    assert!(newton > asked.summary()["newton"].as_array().unwrap().len(), "failed attempts are counted");
}

/// Perfectly plastic, the bar carries 450 and no more, 0.9 of the load: the series ends within 2^-4 below it.
#[test]
fn a_history_beyond_the_limit_load_ends_just_below_it() {
    let sets = ["material.steel.hardening=0", "solver.newton_limit=20", "step=[{halvings=4, name=\"pull\"}]"];
    let run = solve(RANKS, "bar", &sets);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let summary = run.summary();
    assert_eq!(summary["converged"], false);
    let error = summary["error"].as_str().unwrap();
    assert!(
        error.starts_with("load step 1 (pull), up to 0.9375 of the step: no equilibrium was found above time 0.8750"),
        "{error}"
    );
    assert!(error.contains("limit load"), "{error}");
    let rows = summary["steps"].as_array().unwrap();
    assert!(rows.iter().all(|row| row["converged"] == true), "only states that converged are kept");
    let last = rows.last().unwrap();
    assert_eq!(last["time"], 0.875);
    assert_close("stress", number(last, "max_von_mises"), 0.875 * 500.0, 1e-6);
    assert_eq!(Fields::times(&run.result()).unwrap().last(), Some(&0.875));
}

#[test]
fn without_a_state_that_converged_the_last_attempt_is_shown() {
    let run = solve(RANKS, "bar", &["solver.newton_limit=1", "step=[{halvings=2, amplitude=4}, {amplitude=0}]"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let summary = run.summary();
    assert_eq!(summary["steps"].as_array().unwrap().len(), 1);
    assert_eq!((&summary["steps"][0]["converged"], &summary["steps"][0]["halvings"]), (&false.into(), &2.into()));
    assert!(summary["error"].as_str().unwrap().contains("solver.newton_limit"));
    assert_eq!(Fields::read(&run.result()).points.len(), 54);
}

#[test]
fn the_log_names_the_steps() {
    let run = solve(RANKS, "bar", &["step=[{name=\"pull\", increments=2}, {amplitude=0}]"]).converged();
    for line in ["load step 1 (pull), increment 1 of 2\n", "load step 1 (pull), increment 2 of 2\n", "load step 2\n"] {
        assert_eq!(run.stdout.matches(line).count(), 1, "{line}: {}", run.stdout);
    }
    let plain = solve(RANKS, "bar", &[]).converged();
    assert!(!plain.stdout.contains("load step"), "{}", plain.stdout);
}

#[test]
fn the_summary_of_a_history_tells_of_its_flow_though_it_ends_by_unloading() {
    let summary = solve(RANKS, "two-blocks", &[&COARSEST[..], &["step=[{}, {amplitude=0.5}]"]].concat());
    let summary = summary.converged().summary();
    let rows = summary["steps"].as_array().unwrap();
    let flowing: Vec<f64> = rows.iter().map(|row| number(row, "plastic_elements")).collect();
    assert!(flowing[0] > 0.0 && flowing[1] == 0.0, "{flowing:?}");
    assert_eq!(number(&summary, "plastic_elements"), flowing[0]);
    assert_eq!(number(&summary, "plastic_fraction"), flowing[0] / number(&summary, "elements"));
    assert_eq!(summary["contact_force"], rows[1]["contact_force"]);
}

/// Cylinders that are pressed into each other by far more than they bear: what is told is not of loads, which there are not.
#[test]
fn a_press_fit_that_fails_is_not_told_of_loads() {
    let directory = tempfile::tempdir().unwrap();
    let mut text = String::from("material.soft = { young = 1000.0, poisson = 0.3, yield_stress = 1e-3 }\n");
    for (body, inner) in [("inner", 1.0), ("outer", 2.0)] {
        let shape = format!("{{ inner = {inner:?}, outer = {:?}, height = 0.5, cells = [8, 4, 2] }}", inner + 1.0);
        text += &format!("body.{body} = {{ material = 'soft', element = 'tet4', cylinder = {shape} }}\n");
        for (surface, axis) in [("x0", "x"), ("y0", "y"), ("bottom", "z"), ("top", "z")] {
            text += &format!("support.{body}-{surface} = {{ surface = '{body}.{surface}', fix = ['{axis}'] }}\n");
        }
    }
    text += "contact.fit = { surfaces = ['inner.outer', 'outer.inner'], gap = -0.2 }\nsolver.newton_limit = 5\n";
    let run = solve(RANKS, &scene_file(directory.path(), &text), &[]);
    assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
    let summary = run.summary();
    assert!(!run.stdout.contains("load") && !run.stdout.contains("halved"), "{}", run.stdout);
    assert!(summary["error"].as_str().unwrap().contains("solver.newton_limit"), "{}", summary["error"]);
    assert_eq!(number(&summary, "newton_iterations"), 5.0);
    // The state is that of the only attempt.
    let rows = summary["steps"].as_array().unwrap();
    assert!(rows.len() == 1 && rows[0]["converged"] == false);
    assert!(number(&summary, "max_displacement") > 0.1 && number(&summary, "plastic_fraction") > 0.3);
}
