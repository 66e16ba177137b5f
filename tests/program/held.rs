//! Bodies that only contact holds: solved where loads press them against it, refused with the free motion where not.

use crate::common::fields::{EXACT, Fields, assert_displacement, assert_uniform};
use crate::common::{
    self, assert_close, assert_near, assert_program_refuses, assert_scene_refused, check, number, scene_file, solve,
    solve_tightly, vector,
};
use crate::twins::{Block, UPPER_SLAVE};
use serde_json::Value;

const YOUNG: f64 = 210_000.0;
const POISSON: f64 = 0.29;
const BAD_SCENE: i32 = 65;
const SOLVERS: [&str; 2] = ["solver.qp=active-set", "solver.qp=smalse-m"];

/// A floor body, fixed below, and blocks of 1000 x 1000 x 500 stacked on it, each in contact with the one below.
fn stack(blocks: usize, rest: &str) -> String {
    let mut text = format!(
        r#"
        material.steel = {{ young = {YOUNG:?}, poisson = {POISSON:?} }}
        [body.b0]
        material = "steel"
        element = "tet4"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 500.0], cells = [4, 4, 2] }}
        [support.bottom]
        surface = "b0.zmin"
        fix = ["z"]
        [support.b0x]
        surface = "b0.xmin"
        fix = ["x"]
        [support.b0y]
        surface = "b0.ymin"
        fix = ["y"]
        "#
    );
    for k in 1..=blocks {
        text += &format!(
            r#"
            [body.b{k}]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, {}.0], size = [1000.0, 1000.0, 500.0], cells = [4, 4, 2] }}
            [contact.c{k}]
            slave = "b{k}.zmin"
            master = "b{}.zmax"
            "#,
            500 * k,
            k - 1
        );
    }
    text + rest + "\n[decomposition]\ncells = [2, 2, 2]\n"
}

/// Planes of symmetry of a block.
fn guides(block: usize) -> String {
    format!(
        "support.x{block} = {{ surface = 'b{block}.xmin', fix = ['x'] }}\n\
         support.y{block} = {{ surface = 'b{block}.ymin', fix = ['y'] }}\n"
    )
}

/// Scenes begin with their dotted keys, before any table.
fn scene(blocks: usize, keys: &str, rest: &str) -> String {
    keys.to_owned() + &stack(blocks, rest)
}

fn assert_refused(text: &str, sets: &[&str], parts: &[&str]) {
    let directory = tempfile::tempdir().unwrap();
    assert_scene_refused(&scene_file(directory.path(), text), sets, BAD_SCENE, parts);
}

/// All blocks carry the pressure on the last one: every strain is the same.
fn assert_uniaxial(text: &str, top: f64, stress: f64, sets: &[&str]) -> Value {
    let directory = tempfile::tempdir().unwrap();
    let run = solve_tightly(2, &scene_file(directory.path(), text), sets);
    let fields = Fields::read(&run.result());
    let (along, across) = (-stress / YOUNG, POISSON * stress / YOUNG);
    assert_displacement(&fields, |node| {
        let [x, y, z] = fields.points[node];
        assert!(z <= top);
        [across * x, across * y, along * z]
    });
    assert_uniform("von Mises stress", fields.of_elements("von_mises"), stress, stress);
    run.summary()
}

#[test]
fn blocks_that_rest_on_each_other_carry_the_pressure_on_the_last() {
    for qp in SOLVERS {
        for (blocks, cut) in [(1, "decomposition.cells=[2, 2, 2]"), (3, "decomposition.subdomains=9")] {
            let press = format!("load.press = {{ surface = 'b{blocks}.zmax', pressure = 100 }}\n");
            let keys = (1..=blocks).map(guides).collect::<String>() + &press;
            let top = 500.0 * (blocks as f64 + 1.0);
            let summary = assert_uniaxial(&scene(blocks, &keys, ""), top, 100.0, &[qp, cut]);
            for contact in 1..=blocks {
                let force = vector(&summary["contact_forces"][format!("c{contact}")]);
                assert_close("contact force", force[2], 1e8, EXACT);
            }
        }
    }
}

#[test]
fn a_block_with_three_free_motions_stands_on_contact_alone() {
    // Held at the top against sliding and turning about z, free to rise and to tilt.
    let guide = "support.top = { surface = 'b1.zmax', fix = ['x', 'y'] }\n\
                 load.press = { surface = 'b1.zmax', pressure = 10 }\n\
                 load.weight = { body = 'b1', body_force = [0.001, 0.0, -0.01] }\n";
    let text = scene(1, guide, "");
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &text);
    let mut energies = Vec::new();
    for qp in SOLVERS {
        for cut in ["decomposition.cells=[2, 2, 2]", "decomposition.subdomains=5"] {
            let summary = solve_tightly(2, &file, &[qp, cut]).summary();
            // Pressure and weight.
            let weight = 0.01 * 5e8;
            assert_close("contact force", vector(&summary["contact_force"])[2], 1e7 + weight, 1e-9);
            assert_close("reaction", vector(&summary["reactions"]["top"])[0], -0.1 * weight, 1e-7);
            energies.push(number(&summary, "energy"));
        }
    }
    energies.iter().for_each(|energy| assert_close("energy", *energy, energies[0], 1e-8));
    let steps = "step=[{increments=2}, {amplitude=0.01}, {amplitude=0.5}]";
    let rows = solve_tightly(2, &file, &[steps]).summary()["steps"].clone();
    for (row, amplitude) in [0.5, 1.0, 0.01, 0.5].into_iter().enumerate() {
        assert_close("contact force", vector(&rows[row]["contact_force"])[2], amplitude * (1e7 + 0.01 * 5e8), 1e-8);
    }
    assert_close("energy", number(&rows[1], "energy"), energies[0], 1e-8);
}

/// A brick in a groove of two planes, pushed into it: each plane takes its component of the weight.
#[test]
fn a_brick_in_a_groove_is_held_by_both_sides() {
    let text = format!(
        r#"
        material.steel = {{ young = {YOUNG:?}, poisson = {POISSON:?} }}
        support.guide = {{ surface = "brick.ymin", fix = ["y"] }}
        load.weight = {{ body = "brick", body_force = [-0.01, 0.0, -0.03] }}
        contact.side = {{ slave = "brick.xmin", rigid = {{ plane = {{ point = [0, 0, 0], normal = [1, 0, 0] }} }} }}
        contact.floor = {{ slave = "brick.zmin", rigid = {{ plane = {{ point = [0, 0, -0.25], normal = [0, 0, 1] }} }} }}
        [body.brick]
        material = "steel"
        element = "tet4"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 500.0], cells = [4, 4, 2] }}
        [decomposition]
        cells = [2, 2, 2]
        "#
    );
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &text);
    for qp in SOLVERS {
        let summary = solve_tightly(2, &file, &[qp]).summary();
        let [side, floor] = ["side", "floor"].map(|name| vector(&summary["contact_forces"][name]));
        assert_close("side", side[0], 0.01 * 5e8, 1e-9);
        assert_close("floor", floor[2], 0.03 * 5e8, 1e-9);
    }
}

/// Walls on both sides of a pressed block without lateral contraction carry nothing, touching or not.
#[test]
fn contacts_without_force_leave_the_block_where_it_is() {
    let walls = |gap: f64| {
        format!(
            "support.y1 = {{ surface = 'b1.ymin', fix = ['y'] }}\n\
             load.press = {{ surface = 'b1.zmax', pressure = 100 }}\n\
             contact.left = {{ slave = 'b1.xmin', rigid = {{ plane = {{ point = [{:?}, 0, 0], normal = [1, 0, 0] }} }} }}\n\
             contact.right = {{ slave = 'b1.xmax', rigid = {{ plane = {{ point = [{:?}, 0, 0], normal = [-1, 0, 0] }} }} }}\n",
            -gap,
            1000.0 + gap
        )
    };
    let cork = "material.steel.poisson=0";
    for qp in SOLVERS {
        for gap in [0.0, 2.0] {
            let directory = tempfile::tempdir().unwrap();
            let run = solve_tightly(2, &scene_file(directory.path(), &scene(1, &walls(gap), "")), &[qp, cork]);
            let fields = Fields::read(&run.result());
            assert_uniform("von Mises stress", fields.of_elements("von_mises"), 100.0, 100.0);
            for (u, x) in fields.displacement.iter().zip(&fields.points) {
                assert!((u[2] + 100.0 / YOUNG * x[2]).abs() < 1e-9 && u[0].abs() < gap + 1e-9);
            }
            let summary = run.summary();
            for wall in ["left", "right"] {
                assert!(vector(&summary["contact_forces"][wall])[0].abs() < 1e-9 * 1e8, "{summary}");
            }
        }
    }
}

#[test]
fn free_motions_are_chosen_the_same_on_any_ranks() {
    let walls = "support.y1 = { surface = 'b1.ymin', fix = ['y'] }\n\
                 load.press = { surface = 'b1.zmax', pressure = 100 }\n\
                 contact.left = { slave = 'b1.xmin', rigid = { plane = { point = [3, 0, 0], normal = [1, 0, 0] } } }\n\
                 contact.right = { slave = 'b1.xmax', rigid = { plane = { point = [1007, 0, 0], normal = [-1, 0, 0] } } }\n";
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &scene(1, walls, ""));
    let [one, two, three] = [1, 2, 3].map(|ranks| {
        let run = solve_tightly(ranks, &file, &[]);
        let fields = Fields::read(&run.result());
        // The left wall overlaps by 3, the right one is 7 away: in between the place is not determined.
        let smallest = fields.displacement.iter().zip(fields.body_of_points()).filter(|(_, body)| *body == 1);
        let smallest = smallest.fold(f64::INFINITY, |smallest, (u, _)| smallest.min(u[0]));
        assert!((3.0 - 1e-9..7.0).contains(&smallest), "{smallest}");
        fields.bits(&["VTKHDF/PointData"])
    });
    assert!(one == two && two == three && !one.is_empty());
}

/// A block between a floor and a lid that moves: nothing but the lid's push moves it, and nothing resists.
#[test]
fn a_block_is_pushed_along_without_force() {
    let keys = "support.lid = { surface = 'b2.zmax', fix = ['x', 'y', 'z'], displacement = [0.0, 0.0, -3.0] }\n"
        .to_owned()
        + &guides(1);
    let text = scene(2, &keys, "").replace("origin = [0.0, 0.0, 500.0]", "origin = [0.0, 0.0, 505.0]");
    let text = text.replace("origin = [0.0, 0.0, 1000.0]", "origin = [0.0, 0.0, 1006.0]");
    let directory = tempfile::tempdir().unwrap();
    // Without stress nothing but round-off is left for the solvers to reduce.
    for qp in [&SOLVERS[..1], &["solver.qp=smalse-m", "solver.precision=double"]] {
        let run = solve(2, &scene_file(directory.path(), &text), qp).converged();
        let fields = Fields::read(&run.result());
        // The lid reaches the block after 1 and leaves it anywhere between 2 down and the floor, 5 down, in one piece.
        let place = fields.displacement.iter().zip(fields.body_of_points()).find(|(_, body)| *body == 1).unwrap().0[2];
        assert!((-5.0 - 1e-7..-2.0 + 1e-7).contains(&place), "{place}");
        for (u, body) in fields.displacement.iter().zip(fields.body_of_points()) {
            let expected = [0.0, 0.0, [0.0, place, -3.0][body as usize]];
            assert!(u.iter().zip(expected).all(|(u, e)| (u - e).abs() < 1e-7), "{u:?} of body {body}");
        }
        // Beside the stress of the same push against a floor.
        let largest = fields.of_elements("von_mises").into_iter().fold(0.0, f64::max);
        assert!(largest < 1e-7 * YOUNG * 3.0 / 500.0, "{largest:e}");
    }
}

#[test]
fn bodies_that_loads_drive_away_are_refused_with_their_motion() {
    let pulled = guides(1) + "load.pull = { surface = 'b1.zmax', traction = [0, 0, 5] }\n";
    let directory = tempfile::tempdir().unwrap();
    let file = scene_file(directory.path(), &scene(1, &pulled, ""));
    let parts = ["body.b1", "loads drive its translation along +z", "add a support"];
    assert_program_refuses(&file, &[], BAD_SCENE, &parts);
    // Not only where it is solved.
    common::assert_refused(&check(2, &file, 1, &[]), BAD_SCENE, &parts);

    // Without friction nothing holds a block sideways.
    let pushed = "support.y1 = { surface = 'b1.ymin', fix = ['y'] }\n\
                  load.push = { surface = 'b1.xmin', traction = [5, 0, 0] }\n\
                  load.press = { surface = 'b1.zmax', pressure = 100 }\n";
    assert_refused(&scene(1, pushed, ""), &[], &["body.b1", "translation along +x", "neither supports nor contacts"]);

    // Beyond its middle over the edge at x = 1000, the block tips over it.
    let weight = guides(1).replace("xmin", "zmax") + "load.weight = { body = 'b1', body_force = [0, 0, -1] }\n";
    let text = scene(1, &weight, "").replace("origin = [0.0, 0.0, 500.0]", "origin = [750.0, 0.0, 500.0]");
    assert_refused(&text, &[], &["body.b1", "rotation about +y through (1000, 500, "]);
}

#[test]
fn bodies_that_nothing_keeps_in_place_are_refused() {
    let rests = guides(1);
    assert_refused(&scene(1, &rests, ""), &[], &["body.b1", "nothing determines its translation along +z"]);

    let slides =
        "support.y1 = { surface = 'b1.ymin', fix = ['y'] }\nload.press = { surface = 'b1.zmax', pressure = 100 }\n";
    assert_refused(&scene(1, slides, ""), &[], &["body.b1", "nothing determines its translation along", "x"]);

    let steps = "step = [{ name = \"press\" }, { name = \"release\", amplitude = 0 }]\n".to_owned()
        + &guides(1)
        + "load.press = { surface = 'b1.zmax', pressure = 100 }\n";
    assert_refused(&scene(1, &steps, ""), &[], &["translation along +z at the end of load step 2 (release)"]);
}

/// A block of 50 x 50 that only contact holds, pressed with 50 and pushed with 5 on its top, bears limits of friction above 5.
#[test]
fn what_a_limit_of_friction_cannot_hold_is_refused() {
    let low = Block {
        begin: [0.0; 2],
        size: [100.0; 2],
        cells: [8, 8],
        height: 40.0,
        layers: 3,
        element: "hex8",
        young: 210_000.0,
    };
    let high = Block { begin: [25.0; 2], size: [50.0; 2], cells: [4, 4], height: 20.0, layers: 2, ..low };
    let text = format!(
        "decomposition.subdomains = 4
        support.bottom = {{ surface = \"low.zmin\", fix = [\"x\", \"y\", \"z\"] }}
        load.press = {{ surface = \"high.zmax\", traction = [5.0, 0.0, -50.0] }}
        contact.joint = {{ slave = \"high.zmin\", master = \"low.zmax\", shear_limit = 5.1 }}
        {}{}",
        low.toml("low", 0.0),
        high.toml("high", low.height),
    );
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &text);
    let summary = solve(2, &scene, &[]).converged().summary();
    assert_near("contact force", vector(&summary["contact_force"]), [-12_500.0, 0.0, 125_000.0], 1e-6);
    // Its area is that of all conditions, whatever the elements, and where meshes do not match.
    let quadratic = ["body.high.element=tet10", "body.low.element=tet10"];
    let other = ["body.high.brick.cells=[3, 3, 2]"];
    for sets in [&[][..], &quadratic, &other, &[&quadratic[..], &other].concat()] {
        for limit in [5.1, 4.99] {
            let limit_set = format!("contact.joint.shear_limit={limit}");
            let run = check(1, &scene, 1, &[sets, &[&limit_set[..]]].concat());
            assert_eq!(run.code, if limit > 5.0 { 0 } else { BAD_SCENE }, "{sets:?}, {limit}: {}", run.stderr);
        }
    }
    assert_scene_refused(
        &scene,
        &["contact.joint.shear_limit=3"],
        BAD_SCENE,
        &["body.high: loads drive its translation along +x"],
    );
}

/// Pushed by 0.4 % less than what friction bears, on a mesh with few conditions.
#[test]
fn what_friction_just_holds_is_not_refused() {
    let lower = Block {
        begin: [0.0; 2],
        size: [1.262, 1.07],
        cells: [4, 5],
        height: 1.101,
        layers: 3,
        element: "tet10",
        young: 1000.0,
    };
    let upper = Block {
        begin: [0.4248408, -0.4706952],
        size: [0.923, 1.937],
        cells: [4, 3],
        height: 0.5786,
        layers: 2,
        element: "tet4",
        ..lower
    };
    let text = format!(
        "decomposition.subdomains = 2
        support.ground = {{ surface = \"lower.zmin\", fix = [\"x\", \"y\", \"z\"] }}
        load.press = {{ surface = \"upper.zmax\", traction = [-0.0004, 0.0996, -1.0] }}
        contact.joint = {{ {}, friction = 0.1 }}
        {}{}",
        UPPER_SLAVE.replace('\n', ", "),
        lower.toml("lower", 0.0),
        upper.toml("upper", lower.height),
    );
    let directory = tempfile::tempdir().unwrap();
    let scene = scene_file(directory.path(), &text);
    assert_eq!(check(1, &scene, 1, &[]).code, 0);
    let beyond = ["load.press.traction=[-0.0004, 0.1004, -1.0]"];
    assert_scene_refused(&scene, &beyond, BAD_SCENE, &["body.upper: loads drive"]);
}
