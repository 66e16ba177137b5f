//! `fetiplast verify`: what is cheap to verify is met, on any number of ranks; other names are refused with a list.

use serde_json::Value;

use crate::common::{assert_refused, run_misused, verify};

const CHEAP: [&str; 6] = ["uniaxial", "biaxial", "shear", "plane-strain", "patch-elastic", "patch-plastic"];

#[test]
fn homogeneous_states_are_exact_with_every_element() {
    let run = verify(2, &CHEAP);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let summary = run.summary();
    assert_eq!(summary["passed"], true);
    let cases = summary["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 3 * CHEAP.len());
    for case in cases {
        for row in case["rows"].as_array().unwrap() {
            for (name, error) in row["errors"].as_object().unwrap() {
                assert!(error.as_f64().unwrap() <= 1e-8, "{name} in {case}");
            }
        }
    }
}

/// The whole pipeline converges as its elements promise, on bricks and on curved bodies.
#[test]
fn smooth_solutions_have_the_orders_of_their_elements() {
    let run = verify(2, &["manufactured-elastic", "sphere-elastic"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.summary()["cases"].as_array().unwrap().len(), 6);
}

/// Between bodies and with obstacles, where all slips and where some sticks.
#[test]
fn friction_is_that_of_closed_forms() {
    let cases = ["dragged", "incline", "wedge", "press-fit", "plate"].map(|name| format!("friction-{name}"));
    let run = verify(2, &cases.each_ref().map(String::as_str));
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.summary()["cases"].as_array().unwrap().len() >= 2 * cases.len());
    let run = verify(2, &["friction-bar-back", "friction-cylinder", "--element", "tet4"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
}

#[test]
#[ignore = "slow: scripts/many"]
fn friction_is_that_of_closed_forms_with_every_element() {
    let run = verify(2, &["friction-bar-back", "friction-cylinder"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
}

#[test]
fn errors_are_the_same_on_any_number_of_ranks() {
    let [alone, both] = [1, 2].map(|ranks| verify(ranks, &["--element", "tet10", "sphere-elastic"]).summary());
    let rows = |summary: &Value| {
        let rows = summary["cases"][0]["rows"].as_array().unwrap().clone();
        rows.into_iter().map(|row| (row["errors"].clone(), row["hessian_multiplications"].clone())).collect::<Vec<_>>()
    };
    assert_eq!(rows(&alone), rows(&both));
    assert!(rows(&both).len() > 1);
}

#[test]
fn an_unknown_case_is_refused_with_the_known_ones() {
    for ranks in [1, 2] {
        let parts = [&["there is no case `typo`", "manufactured-plastic"][..], &CHEAP].concat();
        assert_refused(&run_misused(ranks, &["verify", "uniaxial", "typo"]), 64, &parts);
    }
    assert_refused(&run_misused(1, &["verify", "--element", "tet5"]), 64, &["tet4, hex8 or tet10"]);
}
