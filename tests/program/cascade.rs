//! A start from coarser levels saves work and changes nothing else.

use crate::common::{assert_close, assert_residuals, number, solve_level, solve_with};
use serde_json::Value;

/// The benchmark with cells twice as large.
const COARSE: [&str; 3] =
    ["body.lower.brick.cells=[15, 5, 5]", "body.upper.brick.cells=[15, 5, 5]", "decomposition.cells=[5, 5, 5]"];

fn solve(ranks: usize, level: usize, cascade: &str) -> Value {
    solve_with(ranks, "two-blocks", level, &COARSE, &["--cascade", cascade]).converged().summary()
}

#[test]
fn it_saves_work_and_gives_the_same_solution() {
    for level in [2, 3] {
        let [cold, warm] = ["off", "on"].map(|cascade| solve(2, level, cascade));
        for key in ["energy", "internal_energy", "external_work", "max_displacement"] {
            assert_close(key, number(&warm, key), number(&cold, key), 1e-6);
        }
        for key in ["plastic_elements", "active_contacts"] {
            assert_eq!(warm[key], cold[key], "{key} at level {level}");
        }
        assert_residuals(&warm, 1e-6);
        assert!(number(&warm, "newton_iterations") < number(&cold, "newton_iterations"));
        assert!(number(&warm, "hessian_multiplications") < 0.9 * number(&cold, "hessian_multiplications"));
        assert_eq!(cold["cascade"].as_array().unwrap().len(), 0);
    }
}

#[test]
fn it_goes_by_halves_and_tells_what_it_took() {
    let summary = solve(2, 3, "on");
    let rows = summary["cascade"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["level"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(rows[0]["subdomains"], 6);
    assert_eq!(rows[1]["subdomains"], 48);
    assert!(rows.iter().all(|row| row["hessian_multiplications"].as_u64() > Some(20)));
}

#[test]
fn ranks_change_no_bit_of_it() {
    let bits = |ranks| {
        let summary = solve(ranks, 2, "on");
        let numbers = ["energy", "max_displacement", "max_von_mises", "residual_equilibrium"];
        let counts = ["newton_iterations", "hessian_multiplications", "factorisations", "plastic_elements"];
        (numbers.map(|key| number(&summary, key).to_bits()), counts.map(|key| summary[key].as_u64().unwrap()))
    };
    let alone = bits(1);
    assert_eq!((bits(2), bits(3)), (alone, alone));
}

#[test]
fn it_is_on_where_the_problem_is_not_linear() {
    for scene in ["patch", "shear"] {
        let summary = solve_level(2, scene, 2, &[]).converged().summary();
        assert_eq!(summary["cascade"].as_array().unwrap().len(), 1, "{scene}");
    }
}
