//! Homogeneous states, which all elements hold exactly on any mesh: uniaxial tension, pure shear, and two blocks in
//! contact, in several subdomains on 2 ranks. Expected values are closed forms: the tensor of strain is
//! `sigma/E + kappa` along a uniaxial stress and `-nu sigma/E - kappa/2` across it, `kappa = (q - sigma_y)/H`.

use crate::common::fields::{EXACT, Fields, assert_displacement, assert_uniform};
use crate::common::{Run, assert_close, number, scene_file, solve, solve_tightly, vector};

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.29;
const YIELD: f64 = 450.0;
const HARDENING: f64 = 10_000.0;

const RANKS: usize = 2;

fn tightly(scene: &str, sets: &[&str]) -> Run {
    solve_tightly(RANKS, scene, sets)
}

/// Strains along and across a uniaxial stress, and the equivalent plastic strain.
fn uniaxial(stress: f64) -> (f64, f64, f64) {
    let plastic = (stress.abs() - YIELD).max(0.0) / HARDENING;
    let kappa = plastic * stress.signum();
    (stress / YOUNG + kappa, -POISSON * stress / YOUNG - kappa / 2.0, plastic)
}

#[track_caller]
fn assert_state(fields: &Fields, stress: f64, kappa: f64) {
    assert_uniform("von Mises stress", fields.of_elements("von_mises"), stress, stress);
    let size = if kappa > 0.0 { kappa } else { 1.0 };
    assert_uniform("equivalent plastic strain", fields.of_elements("equivalent_plastic_strain"), kappa, size);
}

fn assert_bar(stress: f64, sets: &[&str]) {
    let run = tightly("bar", sets);
    let fields = Fields::read(&run.result());
    let (along, across, kappa) = uniaxial(stress);
    assert_displacement(&fields, |node| {
        let [x, y, z] = fields.points[node];
        [along * x, across * y, across * z]
    });
    assert_state(&fields, stress, kappa);
    let summary = run.summary();
    assert_close("reaction", vector(&summary["reactions"]["back"])[0], -stress * 500.0 * 500.0, EXACT);
    assert_eq!(summary["plastic_fraction"], f64::from(stress > YIELD));
}

#[test]
fn a_bar_stretches_by_the_closed_form_below_and_beyond_yield() {
    assert_bar(400.0, &["load.pull.traction.0=400"]);
    assert_bar(500.0, &[]);
    assert_bar(600.0, &["load.pull.traction.0=600"]);
    // The numbers themselves, in case the formula above is wrong.
    let (along, across, _) = uniaxial(600.0);
    assert_close("strain along", along, 1.785714285714e-2, 1e-12);
    assert_close("strain across", across, -8.328571428571e-3, 1e-12);
}

/// Every element is a subdomain, and the coarse problem tells the solution: what is left for the programs is rounding. No increment
/// takes that for a load.
#[test]
fn where_the_coarse_problem_tells_all_the_programs_end_at_once() {
    let directory = tempfile::tempdir().unwrap();
    let path = scene_file(
        directory.path(),
        "step = [{ increments = 2 }, { amplitude = -0.2 }]\nmaterial.m = { young = 210000.0, poisson = 0.0 }\n\
         support.s = { surface = \"b.zmin\", fix = [\"x\", \"y\", \"z\"] }\n\
         load.l = { surface = \"b.zmax\", traction = [0.0, 0.0, -100.0] }\n\
         [body.b]\nmaterial = \"m\"\nelement = \"hex8\"\n\
         brick = { origin = [0.0, 0.0, 0.0], size = [4.0, 4.0, 2.0], cells = [2, 1, 3] }\n",
    );
    for precision in ["double", "mixed"] {
        let precision = format!("solver.precision={precision}");
        let summary = tightly(&path, &["decomposition.cells=[1, 1, 1]", &precision]).summary();
        // -(sigma^2/2E) V
        assert_close("energy", number(&summary, "energy"), -20.0 * 20.0 / (2.0 * YOUNG) * 32.0, 1e-12);
        assert!(number(&summary, "hessian_multiplications") < 60.0, "{}", summary["steps"]);
    }
}

#[test]
fn a_bar_in_one_subdomain_or_many_stretches_the_same() {
    assert_bar(500.0, &["decomposition.cells=[4, 2, 2]"]);
    assert_bar(500.0, &["decomposition.cells=[1, 1, 1]"]);
    assert_bar(500.0, &["decomposition.subdomains=7"]);
}

/// Elements other than the default.
const ELEMENTS: [&str; 2] = ["hex8", "tet10"];

#[test]
fn a_bar_of_other_elements_stretches_the_same() {
    for element in ELEMENTS {
        let element = format!("body.bar.element={element}");
        assert_bar(500.0, &[&element]);
        assert_bar(400.0, &["load.pull.traction.0=400", &element, "decomposition.subdomains=7"]);
    }
}

#[test]
fn pure_shear_beyond_yield_is_the_closed_form() {
    assert_shear(&[]);
    for element in ELEMENTS {
        assert_shear(&[&format!("body.block.element={element}")]);
    }
}

fn assert_shear(sets: &[&str]) {
    let run = tightly("shear", sets);
    let fields = Fields::read(&run.result());
    let gamma = 1.574342794511e-2;
    assert_close("angle", 15.74342794511481 / 1000.0, gamma, 1e-12);
    assert_displacement(&fields, |node| [15.74342794511481 / 1000.0 * fields.points[node][1], 0.0, 0.0]);
    let equivalent = 3.0_f64.sqrt() * 300.0;
    assert_state(&fields, equivalent, (equivalent - YIELD) / HARDENING);
    assert_close("reaction", vector(&run.summary()["reactions"]["top"])[0], 300.0 * 1e6, EXACT);
}

/// Two blocks of height 1000, `gap` apart, the top pushed down by `push`: both carry `-stress`.
fn assert_blocks(push: f64, gap: f64, stress: f64, sets: &[&str]) {
    let (displacement, origin) =
        (format!("support.top.displacement.2={}", -push), format!("body.upper.brick.origin.2={}", 1000.0 + gap));
    let run = tightly("patch", &[&[displacement.as_str(), &origin], sets].concat());
    let fields = Fields::read(&run.result());
    let bodies = fields.body_of_points();
    let (along, across, kappa) = uniaxial(-stress);
    assert_displacement(&fields, |node| {
        let [x, y, z] = fields.points[node];
        let down = if bodies[node] == 0 { along * z } else { along * (z - 2000.0 - gap) - push };
        [across * x, across * y, down]
    });
    assert_state(&fields, stress, kappa);

    let (pressure, distance) = (fields.of_points("contact_pressure"), fields.of_points("contact_gap"));
    let slaves: Vec<usize> = (0..bodies.len()).filter(|&node| distance[node].is_finite()).collect();
    let on_slave = |node: &usize| bodies[*node] == 1 && fields.points[*node][2] == 1000.0 + gap;
    assert!(slaves.iter().all(on_slave) && slaves.len() >= 25, "{} slave nodes", slaves.len());
    let mut places: Vec<_> =
        (0..bodies.len()).filter(on_slave).map(|node| fields.points[node].map(f64::to_bits)).collect();
    places.sort_unstable();
    places.dedup();
    assert_uniform("contact pressure", slaves.iter().map(|&node| pressure[node]), stress, stress);
    assert_uniform("gap", slaves.iter().map(|&node| distance[node]), 0.0, push);

    let summary = run.summary();
    let force = stress * 1e6;
    // Quadratic faces that do not match carry their conditions at corners.
    let corners = sets.contains(&"body.upper.element=tet10") && summary["contacts"][0]["rule"] == "mortar";
    let conditions = &summary["contacts"][0]["conditions"];
    assert!(corners || *conditions == places.len());
    assert_eq!(summary["active_contacts"], *conditions);
    assert_close("contact force", vector(&summary["contact_force"])[2], force, EXACT);
    assert_close("reaction of the bottom", vector(&summary["reactions"]["bottom"])[2], force, EXACT);
    assert_close("reaction of the top", vector(&summary["reactions"]["top"])[2], -force, EXACT);
}

#[test]
fn two_elastic_blocks_share_the_push() {
    assert_blocks(3.0, 0.0, 315.0, &[]);
    assert_blocks(3.0, 0.0, 315.0, &["solver.qp=active-set"]);
}

#[test]
fn two_yielding_blocks_share_the_push() {
    assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &[]);
}

#[test]
fn two_blocks_of_other_elements_share_the_push() {
    for element in ELEMENTS {
        let [lower, upper] = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
        assert_blocks(10.0, 1.0, 472.5, &[&lower, &upper]);
        assert_blocks(3.0, 0.0, 315.0, &[&lower, &upper, "decomposition.subdomains=9"]);
    }
}

#[test]
fn hexahedra_that_do_not_match_share_the_push() {
    let [lower, upper] = ["body.lower.element=hex8", "body.upper.element=hex8"];
    // The same nodes as tetrahedra, but other faces. And nodes that do not match.
    assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &[upper]);
    assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &[lower]);
    let other = ["body.lower.brick.cells=[6, 5, 2]", "decomposition.subdomains=8"];
    assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &[&other[..], &[lower, upper]].concat());
}

#[test]
fn quadratic_elements_that_do_not_match_share_the_push() {
    let [lower, upper] = ["body.lower.element=tet10", "body.upper.element=tet10"];
    let other = ["body.lower.brick.cells=[3, 5, 2]", "body.upper.brick.cells=[4, 4, 2]", "decomposition.subdomains=7"];
    for elements in [&[lower, upper][..], &[lower], &[upper, "body.lower.element=hex8"]] {
        assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &[&other[..], elements].concat());
    }
    assert_blocks(10.0, 1.0, 472.5, &[&other[..], &[lower, upper, "solver.qp=smalse-m"]].concat());
}

#[test]
fn a_gap_takes_its_part_of_the_push() {
    assert_blocks(10.0, 1.0, 472.5, &[]);
    assert_blocks(10.0, 1.0, 472.5, &["solver.qp=active-set"]);
}

#[test]
fn a_gap_that_the_scene_adds_is_one_between_the_meshes() {
    assert_blocks(10.0, 0.0, 472.5, &["contact.joint.gap=1"]);
    assert_blocks(2.5, 0.0, 315.0, &["contact.joint.gap=-0.5"]);
    assert_blocks(10.0, 0.25, 472.5, &["contact.joint.gap=0.75", "body.lower.brick.cells=[6, 4, 4]"]);
}

#[test]
fn push_and_gap_shifted_alike_give_the_same_stress() {
    assert_blocks(3.0 + 0.75, 0.75, 315.0, &[]);
}

#[test]
fn blocks_cut_by_metis_or_solved_with_a_preconditioner_share_the_push_alike() {
    assert_blocks(10.0, 1.0, 472.5, &["decomposition.subdomains=9"]);
    assert_blocks(10.0, 1.0, 472.5, &["solver.preconditioner=lumped"]);
    assert_blocks(10.0, 1.0, 472.5, &["solver.preconditioner=dirichlet"]);
}

#[test]
fn blocks_whose_meshes_do_not_match_share_the_push_alike() {
    let cells = |of: &'static str| [of, "decomposition.cells=[2, 1, 2]"];
    for qp in ["solver.qp=active-set", "solver.qp=smalse-m"] {
        for of in ["body.upper.brick.cells=[6, 5, 4]", "body.lower.brick.cells=[6, 5, 4]"] {
            let sets = [&cells(of)[..], &[qp]].concat();
            assert_blocks(10.0, 0.0, 477.272_727_272_727_3, &sets);
        }
        let fine = "body.lower.brick.cells=[8, 8, 4]";
        assert_blocks(10.0, 1.0, 472.5, &[qp, fine, "decomposition.subdomains=9"]);
    }
    // In overlap, and without a preconditioner.
    assert_blocks(2.5, -0.5, 315.0, &cells("body.upper.brick.cells=[6, 5, 4]"));
    assert_blocks(3.0, 0.0, 315.0, &["body.upper.brick.cells=[6, 6, 4]", "solver.preconditioner=none"]);
}

/// Both blocks are free of stress: the lower one rests, the upper one has moved by `push` and is `left` above it.
fn assert_apart(push: f64, gap: f64, left: f64) {
    let (displacement, origin) =
        (format!("support.top.displacement.2={}", -push), format!("body.upper.brick.origin.2={}", 1000.0 + gap));
    let run = solve(RANKS, "patch", &[&displacement, &origin]).converged();
    let fields = Fields::read(&run.result());
    let bodies = fields.body_of_points();
    assert_displacement(&fields, |node| [0.0, 0.0, if bodies[node] == 0 { 0.0 } else { -push }]);
    // Relative to the stress that the same push gives without a gap.
    let stress = YOUNG * push / 2000.0;
    assert_uniform("von Mises stress", fields.of_elements("von_mises"), 0.0, stress);
    assert_uniform("contact pressure", fields.of_points("contact_pressure"), 0.0, stress);
    let distance = fields.of_points("contact_gap");
    assert_uniform("gap", distance.into_iter().filter(|distance| distance.is_finite()), left, push);
    let summary = run.summary();
    assert!(number(&summary, "energy").abs() <= EXACT * stress * push * 1e6, "energy {}", summary["energy"]);
    assert_eq!(summary["plastic_elements"], 0);
}

#[test]
fn blocks_that_stay_apart_are_free_of_stress() {
    assert_apart(1.0, 3.0, 2.0);
}

#[test]
fn blocks_that_just_touch_are_free_of_stress() {
    assert_apart(3.0, 3.0, 0.0);
}
