//! Hard cases of friction between bodies: strong and weak, on any elements and meshes, through a reversal of the load.

use crate::common::{assert_close, assert_near, number, run_briefly, scene_file, solve, solve_tightly, vector};
use serde_json::Value;

/// A block that is pressed onto a larger one, pushed along x and pulled back; along y nothing but friction holds it. `turned` names
/// the axes that x and y become, with a sign.
fn blocks(turned: [(usize, f64); 2]) -> String {
    let place = |[x, y, z]: [f64; 3]| {
        let mut placed = [0.0, 0.0, z];
        turned.iter().zip([x, y]).for_each(|((axis, sign), value)| placed[*axis] = sign * value);
        placed
    };
    let brick = |low: [f64; 3], high: [f64; 3], cells: [usize; 3]| {
        let (a, b) = (place(low), place(high));
        let origin: [f64; 3] = std::array::from_fn(|k| a[k].min(b[k]));
        let size: [f64; 3] = std::array::from_fn(|k| (b[k] - a[k]).abs());
        let mut turned_cells = cells;
        turned.iter().zip(cells).for_each(|((axis, _), n)| turned_cells[*axis] = n);
        format!("{{ origin = {origin:?}, size = {size:?}, cells = {turned_cells:?} }}")
    };
    let along = ["x", "y"][turned[0].0];
    format!(
        r#"
        material.low = {{ young = 210000.0, poisson = 0.3 }}
        material.high = {{ young = 210000.0, poisson = 0.3 }}
        [body.low]
        material = "low"
        element = "hex8"
        brick = {}
        [body.high]
        material = "high"
        element = "hex8"
        brick = {}
        [support]
        bottom = {{ surface = "low.zmin", fix = ["x", "y", "z"] }}
        press = {{ surface = "high.zmax", fix = ["z"], displacement = [0.0, 0.0, -0.05] }}
        push = {{ surface = "high.zmax", fix = ["{along}"], displacement = {:?} }}
        [contact.joint]
        slave = "high.zmin"
        master = "low.zmax"
        friction = 0.3
        [[step]]
        support = {{ press = 1.0, push = 0.0 }}
        [[step]]
        support = {{ press = 1.0, push = 1.0 }}
        increments = 2
        [[step]]
        support = {{ press = 1.0, push = -1.0 }}
        increments = 2
        [decomposition]
        cells = [2, 2, 3]
        "#,
        brick([0.0, 0.0, 0.0], [100.0, 100.0, 40.0], [8, 8, 3]),
        brick([25.0, 25.0, 40.0], [75.0, 75.0, 80.0], [4, 4, 3]),
        place([0.06, 0.0, 0.0]),
    )
}

/// As it stands.
const STRAIGHT: [(usize, f64); 2] = [(0, 1.0), (1, 1.0)];

/// Checks each increment: the law holds, energies balance, friction takes energy, and no more than the law allows is held.
fn assert_sound(summary: &Value, friction: f64, name: &str) {
    for step in summary["steps"].as_array().expect("increments") {
        assert!(number(step, "residual_friction") < 1e-6, "{name}: {step}");
        assert!(number(step, "residual_energies") < 1e-5, "{name}: {step}");
        let rubbed = &step["friction"]["joint"];
        let [dissipation, external] =
            [&rubbed["dissipation"], &step["energies"]["external"]].map(|of| of.as_f64().unwrap());
        assert!(dissipation >= -1e-6 * external.abs(), "{name}: {rubbed}");
        let [x, y, z] = vector(&step["contact_force"]);
        assert!(z >= 0.0 && x.hypot(y) <= friction * z * (1.0 + 1e-6), "{name}: {x} {y} {z}");
    }
}

#[test]
fn friction_of_any_strength_holds_its_law_on_any_bodies() {
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &blocks(STRAIGHT));
    let perfect = ["material.low.yield_stress=150.0", "material.low.hardening=0.0"];
    let soft = ["material.high.poisson=0.499", "material.high.young=10.0"];
    let quadratic = ["body.low.element=\"tet10\"", "body.high.element=\"tet10\""];
    let linear = ["body.low.element=\"tet4\"", "body.high.element=\"tet4\""];
    let other_meshes = ["body.high.brick.cells=[6, 6, 3]", "body.high.brick.origin=[20.0, 25.0, 40.0]"];
    let parts = ["decomposition.method=\"metis\"", "decomposition.subdomains=7"];
    let cases: [(f64, &[&str]); 12] = [
        (1e-6, &[]),
        (0.1, &[]),
        (0.6, &[]),
        (1.0, &parts),
        (0.3, &["material.low.young=1e11"]),
        (0.3, &["material.high.young=1e11"]),
        (0.3, &soft),
        (0.3, &perfect),
        (0.8, &perfect),
        (0.3, &quadratic),
        (0.5, &linear),
        (0.3, &other_meshes),
    ];
    for (friction, more) in cases {
        let law = format!("contact.joint.friction={friction}");
        let sets: Vec<&str> = [law.as_str()].into_iter().chain(more.iter().copied()).collect();
        let summary = solve(1, &scene, &sets).converged().summary();
        let name = sets.join(" ");
        assert_sound(&summary, friction, &name);
        assert_eq!(summary["smalse_iterations"], 0, "{name}: sets of contact come back");
        assert_eq!(summary["steps"].as_array().unwrap().len(), 5, "{name}: no increment is halved");
    }
}

#[test]
fn turned_and_mirrored_scenes_agree() {
    let directory = tempfile::tempdir().unwrap();
    let found = |turned: [(usize, f64); 2]| {
        let summary = solve_tightly(1, &scene_file(directory.path(), &blocks(turned)), &[]).summary();
        let force = vector(&summary["contact_force"]);
        let back = |k: usize| turned[k].1 * force[turned[k].0];
        (summary["energies"].clone(), [back(0), back(1), force[2]])
    };
    let (energies, force) = found(STRAIGHT);
    for turned in [[(0, -1.0), (1, 1.0)], [(1, 1.0), (0, -1.0)], [(1, -1.0), (0, -1.0)]] {
        let (other, turned_force) = found(turned);
        assert_near(&format!("{turned:?}"), turned_force, force, 1e-9);
        for name in ["external", "stored", "friction"] {
            let [a, b] = [&energies, &other].map(|energies| energies[name].as_f64().unwrap());
            assert_close(name, b, a, 1e-9);
        }
    }
}

/// On meshes that do not match, the friction row across a plane of symmetry has free nodes of the master in it, which count for nothing.
#[test]
fn half_of_a_scene_is_half_of_it() {
    let directories = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let whole = scene_file(directories[0].path(), &blocks(STRAIGHT));
    let half = blocks(STRAIGHT)
        .replace("100.0, 100.0, 40.0", "100.0, 50.0, 40.0")
        .replace("50.0, 50.0, 40.0", "50.0, 25.0, 40.0")
        + "\n[support.low_mirror]\nsurface = \"low.ymax\"\nfix = [\"y\"]\n[support.high_mirror]\nsurface = \"high.ymax\"\nfix = [\"y\"]\n";
    let half = scene_file(directories[1].path(), &half);
    for [high, low] in [[4, 4], [6, 4], [2, 10]] {
        let of = |scene: &str, times: usize| {
            let high = format!("body.high.brick.cells=[6, {}, 3]", times * high);
            let low = format!("body.low.brick.cells=[8, {}, 3]", times * low);
            let summary = solve_tightly(1, scene, &[&high, &low]).summary();
            let [x, _, z] = vector(&summary["contact_force"]);
            ([2.0 * x / times as f64, 0.0, 2.0 * z / times as f64], number(&summary, "hessian_multiplications"))
        };
        let ((all, products), (twice, products_of_half)) = (of(&whole, 2), of(&half, 1));
        assert_near(&format!("{high}, {low}"), twice, all, 1e-7);
        assert!(products_of_half <= 1.3 * products, "{high}, {low}: {products_of_half} applications of F, {products}");
    }
}

#[test]
fn strong_friction_sticks_everywhere_and_weak_friction_nowhere() {
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &blocks(STRAIGHT));
    let counts = |law: &str| {
        let rubbed = solve(2, &scene, &[law]).converged().summary()["friction"]["joint"].clone();
        [&rubbed["sticking"], &rubbed["slipping"]].map(|count| count.as_u64().unwrap())
    };
    assert_eq!(counts("contact.joint.friction=10.0"), [25, 0]);
    assert_eq!(counts("contact.joint.friction=0.05"), [0, 25]);
}

/// Masing's rule: where pressures stay, forces of friction turn by twice what half of the way made of a body that had none.
#[test]
fn friction_that_turns_back_follows_masing() {
    let text = r#"
        step = [{ support.base = 0.0, friction.roll = 0.0 }, { increments = 2 }, { support.base = -1.0, increments = 4 }, { increments = 4 }]
        material.steel = { young = 150000.0, poisson = 0.45 }
        contact.roll = { slave = "block.zmax", friction = 0.3, rigid = { cylinder = { point = [0.0, 0.0, 49.95], axis = [0.0, 1.0, 0.0], radius = 50.0 } } }
        [support]
        base = { surface = "block.zmin", fix = ["x", "z"], displacement = [0.015, 0.0, 0.0] }
        front = { surface = "block.ymin", fix = ["y"] }
        back = { surface = "block.ymax", fix = ["y"] }
        [body.block]
        material = "steel"
        element = "hex8"
        grid = { x = [-9.0, -5.0, -3.0, -2.0, -1.6, -1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 3.0, 5.0, 9.0], y = [0.0, 0.4], z = [-8.0, -4.0, -2.0, -1.0, -0.5, 0.0] }"#;
    let directory = tempfile::tempdir().unwrap();
    let summary = solve(2, &scene_file(directory.path(), text), &[]).converged().summary();
    let steps = summary["steps"].as_array().unwrap();
    let force: Vec<f64> = steps.iter().map(|step| vector(&step["contact_force"])[0]).collect();
    let pressed = vector(&steps[2]["contact_force"])[2].abs();
    // Part of what touches slips.
    assert!(force[2] < -0.4 * 0.3 * pressed && force[2] > -0.9 * 0.3 * pressed, "{force:?}");
    for k in 1..=2 {
        let way = [0.0, force[1], force[2]][k];
        assert!((force[2 + 2 * k] - (force[2] - 2.0 * way)).abs() < 1e-4 * force[2].abs(), "{force:?}");
        assert!((force[6 + 2 * k] - (force[6] + 2.0 * way)).abs() < 1e-4 * force[2].abs(), "{force:?}");
    }
}

/// Where nothing presses, surfaces do not rub: bodies move as they are told, free of stress, and soon.
#[test]
fn without_pressure_there_is_no_friction() {
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &blocks(STRAIGHT));
    let touching = ["step.0.support.press=0.0", "step.1.support.press=0.0", "step.2.support.press=0.0"];
    let held = [&touching[..], &["support.push.fix=[\"x\", \"y\"]"]].concat();
    let summary = solve(1, &scene, &held).converged().summary();
    assert!(number(&summary, "max_von_mises") < 1e-5, "{}", summary["max_von_mises"]);
    assert!(number(&summary, "hessian_multiplications") < 300.0, "{}", summary["hessian_multiplications"]);
    // A load along y is borne by friction where the block is pressed, and by nothing where it is not.
    let pulled = scene_file(
        directory.path(),
        &(blocks(STRAIGHT) + "\n[load.pull]\nbody = \"high\"\nbody_force = [0.0, 1e-3, 0.0]\n"),
    );
    solve(1, &pulled, &[]).converged();
    let lifted = ["solve", &pulled, "--set", "support.press.displacement=[0.0, 0.0, 0.05]"];
    let run = run_briefly(2, &lifted);
    assert_eq!(run.code, 1, "nothing holds the block along y: {}", run.stdout);
    assert!(run.stdout.contains("nothing balances the loads on a body"), "{}", run.stdout);
}

/// Tresca's limit acts where surfaces are opposite, whichever is the slave: on 1000 - 330 by 600 - 2 * 70 here, which ends within
/// faces on either side.
#[test]
fn what_overhangs_is_not_rubbed() {
    let directory = tempfile::tempdir().unwrap();
    for element in ["tet4", "hex8", "tet10"] {
        for sides in [["upper.zmin", "lower.zmax"], ["lower.zmax", "upper.zmin"]] {
            let text = format!(
                r#"
                [material.steel]
                young = 210000.0
                poisson = 0.3
                [body.lower]
                material = "steel"
                element = "{element}"
                brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 600.0, 200.0], cells = [5, 3, 1] }}
                [body.upper]
                material = "steel"
                element = "{element}"
                brick = {{ origin = [330.0, 70.0, 200.0], size = [1000.0, 460.0, 200.0], cells = [4, 3, 1] }}
                [support.floor]
                surface = "lower.zmin"
                fix = ["x", "y", "z"]
                [support.top]
                surface = "upper.zmax"
                fix = ["x", "y", "z"]
                displacement = [20.0, 0.0, -0.1]
                [contact.joint]
                slave = "{}"
                master = "{}"
                shear_limit = 30.0
                "#,
                sides[0], sides[1]
            );
            let summary = solve_tightly(2, &scene_file(directory.path(), &text), &[]).summary();
            let force = vector(&summary["friction"]["joint"]["force"]);
            let size = 30.0 * (1000.0 - 330.0) * (600.0 - 2.0 * 70.0);
            assert_close(&format!("{element}, slave {}", sides[0]), force[0].abs(), size, 1e-4);
        }
    }
}

/// A plate of these cells along x and y on one of others and of this stiffness, pressed and pushed askew, so that it sticks here and slips
/// there.
fn plates([low, high]: [usize; 2], young: f64, sides: &str) -> String {
    let plate = |name: &str, cells: usize, z: f64| {
        format!(
            "[body.{name}]\nmaterial = \"{name}\"\nelement = \"hex8\"\nbrick = {{ origin = [0.0, 0.0, {z}], size = [1.0, 1.0, 0.2], \
             cells = [{cells}, {cells}, 3] }}\n"
        )
    };
    format!(
        "material.low = {{ young = 210e3, poisson = 0.3 }}
        material.high = {{ young = {young:?}, poisson = 0.3 }}
        {}{}
        [support]
        foot = {{ surface = \"low.zmin\", fix = [\"x\", \"y\", \"z\"] }}
        side = {{ surface = \"high.xmin\", fix = [\"x\"] }}
        front = {{ surface = \"high.ymin\", fix = [\"y\"] }}
        [load.top]
        surface = \"high.zmax\"
        traction = [1.0, 0.5, -10.0]
        [contact.joint]
        {sides}
        friction = 0.3
        [decomposition]
        subdomains = 32
        ",
        plate("low", low, 0.0),
        plate("high", high, 0.2)
    )
}

#[test]
fn a_plate_a_million_times_as_soft_as_its_base_rubs_in_few_iterations() {
    let directory = tempfile::tempdir().unwrap();
    let run = |cells, young, sides| {
        let summary = solve(1, &scene_file(directory.path(), &plates(cells, young, sides)), &[]).converged().summary();
        let name = format!("{cells:?} {young} {sides}");
        assert!(number(&summary, "residual_friction") < 1e-6, "{name}");
        let force = vector(&summary["contact_force"]).map(f64::abs);
        let reactions = ["side", "front"].map(|name| vector(&summary["reactions"][name]));
        let other = std::array::from_fn(|k| (reactions[0][k] + reactions[1][k] + [1.0, 0.5, -10.0][k]).abs());
        assert_near(&name, force, other, 1e-6);
        assert!(force[0].hypot(force[1]) <= 0.3 * force[2], "{name}: {force:?}");
        (number(&summary, "hessian_multiplications"), number(&summary, "energy"))
    };
    let [one, other] = ["slave = 'low.zmax'\nmaster = 'high.zmin'", "slave = 'high.zmin'\nmaster = 'low.zmax'"];
    // Slips that were judged by the next radius took 661 and 3,330 multiplications.
    for (young, most) in [(210.0, 400.0), (0.21, 800.0)] {
        let ((taken, energy), turned) = (run([12, 12], young, one), run([12, 12], young, other));
        assert!(taken.max(turned.0) <= most, "{young}: {taken} and {}", turned.0);
        assert_close("whichever is the slave", turned.1, energy, 1e-6);
    }
    // The finer plate is the hard one, and so not the slave that the program chooses.
    let (taken, energy) = run([12, 7], 0.21, "surfaces = ['low.zmax', 'high.zmin']");
    assert!(taken <= 250.0, "{taken}");
    assert_close("named by hand", run([12, 7], 0.21, other).1, energy, 1e-12);
    let hard = scene_file(directory.path(), &plates([12, 7], 210.0, one));
    let warned = solve(1, &hard, &["contact.joint.friction=2.0"]).summary();
    assert!(warned["warnings"].to_string().contains("exchange slave and master"), "{}", warned["warnings"]);
}
