//! Friction: closed forms, an independent program's numbers, and what must be refused.

use crate::common::fields::{Fields, state_at};
use crate::common::{
    assert_close, assert_near, check, number, run_briefly, run_misused, scene_file, solve, solve_tightly, vector,
};
use serde_json::Value;

/// A cube of 1000 mm on a plane with friction, pressed with 100 MPa, its top moved along x; nu = 0. `tau` are the shear tractions
/// of a homogeneous state.
fn block(element: &str, law: &str, moved: f64, tau: f64) -> String {
    format!(
        r#"
        [material.steel]
        young = 210000.0
        poisson = 0.0
        [body.cube]
        material = "steel"
        element = "{element}"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 1000.0], cells = [4, 2, 2] }}
        [support.top]
        surface = "cube.zmax"
        fix = ["x"]
        displacement = [{moved:?}, 0.0, 0.0]
        [support.side]
        surface = "cube.ymin"
        fix = ["y"]
        [load]
        top = {{ surface = "cube.zmax", traction = [0.0, 0.0, -100.0] }}
        right = {{ surface = "cube.xmax", traction = [0.0, 0.0, {tau:?}] }}
        left = {{ surface = "cube.xmin", traction = [0.0, 0.0, {:?}] }}
        [contact.floor]
        slave = "cube.zmin"
        rigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }} }}
        {law}
        [decomposition]
        cells = [2, 2, 2]
        "#,
        -tau
    )
}

fn rubbed<'a>(summary: &'a Value, contact: &str, key: &str) -> &'a Value {
    &summary["friction"][contact][key]
}

/// Sticks below `U* = mu p h / G`, slips by `U - U*` beyond.
#[test]
fn a_block_sticks_up_to_the_threshold_and_slips_by_what_is_beyond() {
    let directory = tempfile::tempdir().unwrap();
    for element in ["tet4", "hex8"] {
        let scene = scene_file(directory.path(), &block(element, "friction = 0.3", 0.2, 21.0));
        let run = solve_tightly(2, &scene, &[]);
        let summary = run.summary();
        assert_eq!(
            (rubbed(&summary, "floor", "slipping"), rubbed(&summary, "floor", "sticking")),
            (&0.into(), &15.into())
        );
        assert_near("force of the floor", vector(&summary["contact_force"]), [-21e6, 0.0, 100e6], 1e-9);

        let scene = scene_file(directory.path(), &block(element, "friction = 0.3", 1.0, 30.0));
        let run = solve_tightly(2, &scene, &[]);
        let summary = run.summary();
        assert_eq!(rubbed(&summary, "floor", "slipping"), &15, "{element}");
        assert_near("friction", vector(rubbed(&summary, "floor", "force")), [-30e6, 0.0, 0.0], 1e-9);
        let dissipation = rubbed(&summary, "floor", "dissipation").as_f64().unwrap();
        assert_close("dissipation", dissipation, 30e6 * 5.0 / 7.0, 1e-9);
        let fields = Fields::read(&run.result());
        let (slip, status) = (fields.of_points("slip"), fields.integers_of_points("contact_status"));
        for (slip, status) in slip.chunks_exact(3).zip(status) {
            assert!(status == -1 || (status == 2 && (slip[0] - 5.0 / 7.0).abs() < 1e-9 && slip[1].abs() < 1e-9));
        }
        assert!(number(&summary, "residual_friction") < 1e-9);
        // The safeguard alone, at the usual tolerances.
        let summary = solve(2, &scene, &["solver.qp=smalse-m"]).converged().summary();
        assert_near("friction", vector(rubbed(&summary, "floor", "force")), [-30e6, 0.0, 0.0], 1e-5);
    }
    // Tresca's law with the limit mu p is the same where pressures are uniform.
    let scene = scene_file(directory.path(), &block("hex8", "shear_limit = 30.0", 1.0, 30.0));
    let summary = solve_tightly(1, &scene, &[]).summary();
    assert_near("Tresca", vector(&summary["contact_force"]), [-30e6, 0.0, 100e6], 1e-9);
}

/// The plane drags the block instead: its motion counts as slip. The same at a step of its own, and back again.
#[test]
fn an_obstacle_drags() {
    let directory = tempfile::tempdir().unwrap();
    let text = block("hex8", "friction = 0.3\ndisplacement = [-1.0, 0.0, 0.0]", 0.0, 30.0);
    let summary = solve_tightly(2, &scene_file(directory.path(), &text), &[]).summary();
    assert_near("friction", vector(rubbed(&summary, "floor", "force")), [-30e6, 0.0, 0.0], 1e-9);
    let dissipation = rubbed(&summary, "floor", "dissipation").as_f64().unwrap();
    assert_close("dissipation", dissipation, 30e6 * 5.0 / 7.0, 1e-9);
}

/// Whatever the pressures, all that slips has a friction of `mu N`.
#[test]
fn a_dragged_plate_is_held_by_mu_times_the_normal_force() {
    let directory = tempfile::tempdir().unwrap();
    let text = r#"
        [material.steel]
        young = 210000.0
        poisson = 0.0
        [body.plate]
        material = "steel"
        element = "hex8"
        brick = { origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 200.0], cells = [10, 10, 2] }
        [support.top]
        surface = "plate.zmax"
        fix = ["x", "y"]
        displacement = [1.0, 0.0, 0.0]
        [load.top]
        surface = "plate.zmax"
        traction = [0.0, 0.0, -100.0]
        [contact.floor]
        slave = "plate.zmin"
        rigid = { plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }
        friction = 0.3
        [decomposition]
        cells = [5, 5, 2]
        "#;
    let summary = solve_tightly(2, &scene_file(directory.path(), text), &[]).summary();
    let [x, _, z] = vector(&summary["contact_force"]);
    // Mean dilatation turns slips by half a thousandth.
    assert_close("T / N", -x / z, 0.3, 1e-6);
    assert_eq!(rubbed(&summary, "floor", "sticking"), &0);
}

/// A block on a plane that leans by `angle` (degrees), which nothing else holds.
fn incline(angle: f64) -> String {
    let (sine, cosine) = angle.to_radians().sin_cos();
    format!(
        r#"
        [material.steel]
        young = 210000.0
        poisson = 0.3
        [body.block]
        material = "steel"
        element = "hex8"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [400.0, 400.0, 100.0], cells = [4, 4, 2] }}
        [load.weight]
        body = "block"
        body_force = [{:?}, 0.0, {:?}]
        [contact.floor]
        slave = "block.zmin"
        rigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }} }}
        friction = 0.3
        [decomposition]
        cells = [2, 2, 2]
        "#,
        1e-3 * sine,
        -1e-3 * cosine
    )
}

#[test]
fn a_block_on_an_incline_sticks_up_to_the_angle_of_friction_and_is_refused_beyond() {
    let directory = tempfile::tempdir().unwrap();
    let limit = 0.3_f64.atan().to_degrees();
    for angle in [5.0, limit - 0.5] {
        let summary = solve(2, &scene_file(directory.path(), &incline(angle)), &[]).converged().summary();
        let weight = 1e-3 * 400.0 * 400.0 * 100.0;
        let (sine, cosine) = angle.to_radians().sin_cos();
        let expected = [-weight * sine, 0.0, weight * cosine];
        assert_near("force of the floor", vector(&summary["contact_force"]), expected, 1e-5);
    }
    for angle in [limit + 0.01, 30.0] {
        let run = run_briefly(2, &["solve", &scene_file(directory.path(), &incline(angle))]);
        assert_eq!(run.code, 65, "{}", run.stderr);
        assert!(run.stderr.contains("loads drive its translation along (0.958, 0.000, 0.287)"), "{}", run.stderr);
    }
}

/// A bar between two planes with friction, pulled at its end and let go: slip lengths `P / q` and `P / 2 q`. Exact at nodes where
/// that is a whole number of elements (Coulomb's law with uniform pressure).
#[test]
fn a_pulled_bar_slips_as_far_as_friction_takes_and_keeps_half_of_it() {
    let directory = tempfile::tempdir().unwrap();
    let gap = -100.0 * 50.0 / 210_000.0;
    let text = format!(
        r#"
        [material.steel]
        young = 210000.0
        poisson = 0.0
        [body.bar]
        material = "steel"
        element = "hex8"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 100.0, 100.0], cells = [20, 1, 1] }}
        [support.end]
        surface = "bar.xmin"
        fix = ["x"]
        [support.front]
        surface = "bar.ymin"
        fix = ["y"]
        [support.back]
        surface = "bar.ymax"
        fix = ["y"]
        [load.pull]
        surface = "bar.xmax"
        traction = [300.0, 0.0, 0.0]
        [contact.low]
        slave = "bar.zmin"
        rigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }} }}
        gap = {gap:?}
        friction = 0.3
        [contact.high]
        slave = "bar.zmax"
        rigid = {{ plane = {{ point = [0.0, 0.0, 100.0], normal = [0.0, 0.0, -1.0] }} }}
        gap = {gap:?}
        friction = 0.3
        [[step]]
        name = "pull"
        [[step]]
        name = "let go"
        load.pull = 0.0
        [decomposition]
        cells = [5, 1, 1]
        "#
    );
    let scene = scene_file(directory.path(), &text);
    let runs = [1, 3].map(|ranks| solve_tightly(ranks, &scene, &[]));
    for (time, expected) in [(0, 9e12 / (2.0 * 210_000.0 * 1e4 * 6000.0)), (1, 9e12 / (4.0 * 210_000.0 * 1e4 * 6000.0))]
    {
        let end = state_at(&runs[0].result(), time).0.values().map(|u| u[0]).fold(0.0, f64::max);
        assert_close("displacement of the end", end, expected, 1e-9);
    }
    let bits = |k: usize| Fields::at(&runs[k].result(), 1).bits(&["VTKHDF/PointData"]);
    assert_eq!(bits(0), bits(1), "the same bits on any ranks");
}

#[test]
fn contradictory_friction_is_refused() {
    for (set, message) in [
        (&["contact.joint.friction=-0.1"][..], "must be a finite number that is not negative"),
        (&["contact.joint.friction=0.1", "contact.joint.shear_limit=1.0"], "two laws of friction"),
        (&["contact.joint.shear_limit=nan"], "must be a finite number"),
        (&["contact.joint.friction=0.3", "solver.error=0.01"], "there is no energy that is least"),
        (
            &["contact.joint.friction=0.3", "limit.tolerance=0.01", "material.lower.hardening=0.0"],
            "remove friction and shear_limit",
        ),
    ] {
        let mut arguments = vec!["solve", "two-blocks"];
        set.iter().for_each(|set| arguments.extend(["--set", set]));
        let run = run_misused(2, &arguments);
        assert_eq!(run.code, 65, "{}", run.stderr);
        assert!(run.stderr.contains(message), "{}", run.stderr);
    }
}

/// Energy of a summary.
fn energy(summary: &Value, name: &str) -> f64 {
    summary["energies"][name].as_f64().unwrap_or_else(|| panic!("no {name} in {}", summary["energies"]))
}

/// To the threshold and on: what comes in is stored or rubbed away, and nothing is left for the size of the increments.
#[test]
fn energies_of_a_block_that_slips_are_those_of_the_closed_form() {
    let directory = tempfile::tempdir().unwrap();
    let threshold = 0.3 * 100.0 * 1000.0 / 105_000.0;
    let text = block("hex8", "friction = 0.3", 1.0, 30.0)
        + &format!(
            "\n[[step]]\nsupport = {{ top = {threshold:?} }}\n[[step]]\nsupport = {{ top = 1.0 }}\nincrements = 3\n"
        );
    let summary = solve_tightly(2, &scene_file(directory.path(), &text), &[]).summary();
    // A cube of 1 m, in N mm: 100 MPa down, 30 MPa of shear.
    let stored = 1e9 * (100.0 * 100.0 / (2.0 * 210_000.0) + 30.0 * 30.0 / (2.0 * 105_000.0));
    let friction = 30e6 * (1.0 - threshold);
    assert_close("stored", energy(&summary, "stored"), stored, 1e-8);
    assert_close("friction", energy(&summary, "friction"), friction, 1e-8);
    assert_close("external", energy(&summary, "external"), stored + friction, 1e-8);
    assert!(energy(&summary, "closing").abs() < 1e-8 * friction, "{}", summary["energies"]);
    assert!(energy(&summary, "plastic").abs() < 1e-8 * friction, "{}", summary["energies"]);
    assert!(number(&summary, "residual_energies") < 1e-8);
}

/// Supports that hold the slave's nodes while the obstacle moves take the friction there, and all of the limit is left for what is free.
#[test]
fn what_supports_slide_along_each_other_is_told() {
    let directory = tempfile::tempdir().unwrap();
    let held = "\n[support.low]\nsurface = \"cube.zmin\"\nfix = [\"x\"]\n";
    let warned = |law: &str, more: &str| {
        let text = block("hex8", law, 0.0, 0.0) + more;
        let run = check(2, &scene_file(directory.path(), &text), 1, &[]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        run.stdout.contains(
            "contact.floor: at 15 nodes supports hold both sides and slide along each other, by up to 5.000e-1",
        )
    };
    let moved = |x: f64| format!("friction = 0.3\ndisplacement = [{x:?}, 0.0, 0.0]");
    assert!(warned(&moved(0.5), held));
    assert!(warned(&moved(0.5), &format!("{held}[[step]]\ncontact.floor = 0.0\n[[step]]\ncontact.floor = -1.0\n")));
    assert!(!warned(&moved(0.0), held) && !warned(&moved(0.5), ""));
    assert!(!warned(&moved(0.5).replace("friction = 0.3", ""), held), "without friction nothing is missing");
}

/// With yielding bodies, a moving obstacle that drags, and a way back: energies balance in each increment, and on any ranks and
/// resumed they are the same bits.
#[test]
fn energies_balance_where_bodies_yield_and_obstacles_drag() {
    let directory = tempfile::tempdir().unwrap();
    let text = r#"
        material.steel = { young = 210000.0, poisson = 0.3, yield_stress = 200.0, hardening = 5000.0 }
        [body.cube]
        material = "steel"
        element = "hex8"
        brick = { origin = [0.0, 0.0, 0.0], size = [100.0, 100.0, 50.0], cells = [4, 4, 2] }
        [support.bottom]
        surface = "cube.zmin"
        fix = ["x", "y", "z"]
        [contact.punch]
        slave = "cube.zmax"
        rigid = { plane = { point = [0.0, 0.0, 50.0], normal = [0.0, 0.0, -1.0] } }
        displacement = [0.1, 0.02, -0.2]
        friction = 0.4
        [[step]]
        increments = 3
        [[step]]
        amplitude = 0.4
        increments = 2
        [decomposition]
        cells = [2, 2, 2]
        "#;
    let scene = scene_file(directory.path(), text);
    let summary = solve_tightly(2, &scene, &[]).summary();
    let steps = summary["steps"].as_array().expect("increments");
    assert_eq!(steps.len(), 5);
    for step in steps {
        assert!(number(step, "residual_energies") < 1e-8, "{}", step["energies"]);
    }
    assert!(energy(&summary, "plastic") > 0.0 && energy(&summary, "friction") > 0.0, "{}", summary["energies"]);
    let total: f64 = steps.iter().map(|step| rubbed(step, "punch", "dissipation").as_f64().unwrap()).sum();
    assert_close("friction", energy(&summary, "friction"), total, 1e-9);
    // The sum of small increments is the integral: closing loses its share.
    let fine = solve_tightly(2, &scene, &["step.0.increments=12", "step.1.increments=8"]).summary();
    let share = |summary: &Value| energy(summary, "closing").abs() / energy(summary, "external").abs();
    assert!(share(&fine) < 0.5 * share(&summary), "{} {}", share(&fine), share(&summary));
    let other = solve_tightly(3, &scene, &[]).summary();
    assert_eq!(other["energies"], summary["energies"]);
}
