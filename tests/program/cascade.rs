//! A start from coarser levels saves work and changes nothing else.

use std::sync::OnceLock;

use crate::common::{COARSEST, assert_close, assert_residuals, number, solve_level, solve_with};
use serde_json::Value;

fn solve(ranks: usize, level: usize, cascade: &str) -> Value {
    solve_with(ranks, "two-blocks", level, &COARSEST, &["--cascade", cascade]).converged().summary()
}

/// On two ranks, solved once for all tests.
fn warm(level: usize) -> &'static Value {
    static LEVELS: [OnceLock<Value>; 2] = [const { OnceLock::new() }; 2];
    LEVELS[level - 2].get_or_init(|| solve(2, level, "on"))
}

#[test]
fn it_saves_work_and_gives_the_same_solution() {
    for level in [2, 3] {
        let (cold, warm) = (solve(2, level, "off"), warm(level));
        for key in ["energy", "internal_energy", "external_work", "max_displacement"] {
            assert_close(key, number(warm, key), number(&cold, key), 1e-6);
        }
        for key in ["plastic_elements", "active_contacts"] {
            assert_eq!(warm[key], cold[key], "{key} at level {level}");
        }
        assert_residuals(warm, 1e-6);
        assert!(number(warm, "newton_iterations") < number(&cold, "newton_iterations"));
        assert!(number(warm, "hessian_multiplications") < 0.9 * number(&cold, "hessian_multiplications"));
        assert_eq!(cold["cascade"].as_array().unwrap().len(), 0);
    }
}

#[test]
fn it_goes_by_halves_and_tells_what_it_took() {
    let rows = warm(3)["cascade"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["level"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(rows[0]["subdomains"], 4);
    assert_eq!(rows[1]["subdomains"], 32);
    assert!(rows.iter().all(|row| row["hessian_multiplications"].as_u64() > Some(10)));
}

#[test]
fn ranks_change_no_bit_of_it() {
    let bits = |summary: &Value| {
        let numbers = ["energy", "max_displacement", "max_von_mises", "residual_equilibrium"];
        let counts = ["newton_iterations", "hessian_multiplications", "factorisations", "plastic_elements"];
        (numbers.map(|key| number(summary, key).to_bits()), counts.map(|key| summary[key].as_u64().unwrap()))
    };
    let alone = bits(&solve(1, 2, "on"));
    assert_eq!((bits(warm(2)), bits(&solve(3, 2, "on"))), (alone, alone));
}

/// Bodies that are no bricks have no coarser level to start from: they are solved at once.
#[test]
fn only_bricks_have_it() {
    let cells = ["inner", "outer"].map(|body| format!("body.{body}.sphere.cells=[2, 1]"));
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/precision/nested-spheres.toml");
    for way in ["auto", "on"] {
        let run = solve_with(2, scene, 2, &[&cells[0], &cells[1]], &["--cascade", way]);
        assert_eq!(run.converged().summary()["cascade"].as_array().unwrap().len(), 0, "{way}");
    }
}

#[test]
fn it_is_on_where_the_problem_is_not_linear() {
    for scene in ["patch", "shear"] {
        let summary = solve_level(2, scene, 2, &[]).converged().summary();
        assert_eq!(summary["cascade"].as_array().unwrap().len(), 1, "{scene}");
    }
}
