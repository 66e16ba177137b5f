//! What friction costs, in applications of F, which depend on no machine.

use crate::common::fields::Fields;
use crate::common::{assert_close, number, solve, solve_level};

#[test]
fn no_friction_costs_nothing() {
    let bits = |sets: &[&str]| {
        let run = solve(2, "two-blocks", sets).converged();
        (number(&run.summary(), "hessian_multiplications"), Fields::read(&run.result()).bits(&["VTKHDF/PointData"]))
    };
    let (without, plain) = bits(&[]);
    assert_eq!(bits(&["contact.joint.friction=0.0"]), (without, plain));
}

/// Asserts how many applications of F friction costs beside none, on boxes and on parts of any shape.
fn assert_few_more_applications(coulomb: &[f64], tresca: &[u32]) {
    let applications = |law: &str, cut: &str| {
        let run = solve(2, "two-blocks", &[law, cut]).converged();
        number(&run.summary(), "hessian_multiplications")
    };
    let coulomb = coulomb.iter().map(|friction| (format!("friction={friction}"), 2.0));
    let laws: Vec<_> = coulomb.chain(tresca.iter().map(|limit| (format!("shear_limit={limit}"), 1.6))).collect();
    for cut in ["bricks", "metis"] {
        let cut = format!("decomposition.method=\"{cut}\"");
        let plain = applications("contact.joint.friction=0.0", &cut);
        for (law, most) in &laws {
            let found = applications(&format!("contact.joint.{law}"), &cut);
            assert!(found <= *most * plain, "{law}, {cut}: {found} beside {plain}");
        }
    }
}

#[test]
fn friction_costs_few_more_applications_of_the_dual_operator() {
    assert_few_more_applications(&[0.3], &[7, 30]);
}

#[test]
#[ignore = "slow: scripts/many"]
fn friction_of_any_strength_costs_few_more_applications_of_the_dual_operator() {
    assert_few_more_applications(&[0.3, 0.8], &[2, 7, 10, 13, 14, 25, 30, 100]);
}

/// Asserts that SMALSE-M alone finds the same, and takes few times the applications of F of the active set.
fn assert_safeguard(laws: &[&str], level: usize) {
    for law in laws {
        let law = format!("contact.joint.{law}");
        let [fast, safe] = ["active-set", "smalse-m"].map(|qp| {
            let summary =
                solve_level(2, "two-blocks", level, &[&law, &format!("solver.qp={qp}")]).converged().summary();
            (number(&summary, "hessian_multiplications"), number(&summary, "energy"))
        });
        assert!(safe.0 <= 4.0 * fast.0, "{law}, level {level}: {} beside {}", safe.0, fast.0);
        assert_close(&law, safe.1, fast.1, 1e-6);
    }
}

#[test]
fn the_safeguard_takes_four_times_the_applications_at_most() {
    assert_safeguard(&["friction=0.0", "friction=0.3", "friction=0.8", "shear_limit=10.0"], 1);
}

#[test]
#[ignore = "slow: scripts/many"]
fn the_safeguard_takes_four_times_the_applications_at_most_on_finer_meshes() {
    assert_safeguard(&["friction=0.3", "shear_limit=10.0"], 2);
}
