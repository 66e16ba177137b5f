//! Nothing that is said is ignored: keys without effect are refused or told.

use super::*;

/// All that acts on the block, so that nothing else is told.
const PRESSED: &str = "load.top={surface='block.zmax', pressure=1}";
const FLOOR: &str = "contact.floor={slave='block.zmin', rigid={plane={point=[0, 0, 0], normal=[0, 0, 1]}}}";

/// The warnings of the brick under pressure after these changes.
fn told(list: &[&str]) -> Vec<String> {
    one(&[&[PRESSED], list].concat()).unwrap().warnings()
}

#[test]
fn what_has_no_effect_is_told_by_its_key() {
    let cases: [(&[&str], &str); 17] = [
        (&["material.spare={young=1, poisson=0}"], "material.spare: no body"),
        (&["load.side={surface='block.xmax', traction=[0, 0, 0]}"], "load.side is zero"),
        (&["load.side={surface='block.xmax', pressure=0}"], "load.side is zero"),
        (&["load.side={body='block', body_force=[0, 0, 0]}"], "load.side is zero"),
        (&["step=[{load={top=0}}, {amplitude=0}]"], "load.top: its factor is zero in every step"),
        (
            &["support.base.displacement=[0, 0, 1]", "step=[{support={base=0}}]"],
            "support.base.displacement: its factor",
        ),
        (&["support.also={surface='block.zmin', fix=['z']}"], "support.also: other supports of block.zmin fix all"),
        (&["step=[{support={base=2}}]"], "step.0.support.base: support.base prescribes no displacement"),
        (&["step=[{}, {amplitude=2, load={top=1}}]"], "step.1.amplitude: the step names"),
        (&["decomposition.method=metis", "decomposition.cells=[2, 2, 2]"], "decomposition.cells: method = \"metis\""),
        (&["decomposition.method=auto", "decomposition.cells=[2, 2, 2]"], "decomposition.cells: method = \"auto\""),
        (&["solver.qp=smalse-m"], "solver.qp: without contact"),
        (&["solver.error_of=stress"], "solver.error_of: without solver.error"),
        (&["solver.max_unknowns=100"], "solver.max_unknowns: without solver.error"),
        (&["support.also={surface='block.zmin', fix=['x', 'y', 'z']}"], "support.base: other supports"),
        (&["load.top={surface='block.zmax', traction=[0, 0, 0]}"], "load.top is zero"),
        (
            &[FLOOR, "contact.floor.displacement=[0, 0, 1]", "step=[{contact={floor=0}}]"],
            "contact.floor.displacement: its factor is zero",
        ),
    ];
    for (changes, part) in cases {
        let warnings = told(changes);
        assert!(warnings.len() == 1 && warnings[0].starts_with(part), "{changes:?}: {warnings:?}");
    }
    let alone = one(&[]).unwrap().warnings();
    assert!(alone.len() == 1 && alone[0].starts_with("body.block: nothing acts on it"), "{alone:?}");
    let still = one(&["step=[{}, {}]"]).unwrap().warnings();
    assert!(still.len() == 2 && still[1].starts_with("step: the scene has no loads"), "{still:?}");
}

#[test]
fn what_has_an_effect_is_not_told() {
    let cases: [&[&str]; 12] = [
        &[],
        &["step=[{amplitude=0}, {}]"],
        &["step=[{amplitude=0.5, load={top=1}}]", "load.other={surface='block.xmax', pressure=1}"],
        &["support.base.displacement=[0, 0, 1]", "step=[{support={base=0}}, {}]"],
        &["support.base.fix=['z']", "support.also={surface='block.zmin', fix=['x', 'y']}"],
        &["decomposition.subdomains=4"],
        &["decomposition.method=metis"],
        &["decomposition.method=auto"],
        &[FLOOR, "solver.qp=smalse-m"],
        &[FLOOR, "contact.floor.displacement=[0, 0, 1]", "step=[{amplitude=0, contact={floor=1}}, {}]"],
        &["initial={result='a.vtkhdf'}", "load.top={surface='block.zmax', pressure=-1}"],
        &["material.steel.yield_stress=1", "material.steel.hardening=1"],
    ];
    for changes in cases {
        assert_eq!(told(changes), Vec::<String>::new(), "{changes:?}");
    }
    assert_eq!(one(&["initial={result='a.vtkhdf'}"]).unwrap().warnings(), Vec::<String>::new());
}

#[test]
fn lists_that_are_too_long_are_refused() {
    for key in
        ["body.block.brick.origin", "body.block.brick.size", "body.block.brick.cells", "support.base.displacement"]
    {
        refuses(&[&format!("{key}=[1, 1, 1, 1]")], &["invalid length 4, expected fewer values", key]);
    }
    for (from, to, parts) in [
        ("size = [1, 1, 1]", "size = [1, 1, 1, 1]", ["line 9", "length 4", "body.block.brick.size"]),
        ("fix = [", "displacement = [0, 0, 1, 2]\nfix = [", ["line 12", "length 4", "support.base.displacement"]),
        ("cells = [2, 2, 2]\n", "cells = [2, 2, 2, 2, 2]\n", ["line 14", "length 5", "decomposition.cells"]),
        (
            "[decomposition]",
            "[contact.floor]\nsurfaces = ['block.zmin', 'block.zmax', 'block.xmin']\n[decomposition]",
            ["line 14", "length 3", "contact.floor.surfaces"],
        ),
        (
            "[decomposition]",
            "[load.top]\nsurface = 'block.zmax'\ntraction = [0, 0, 1, 2]\n[decomposition]",
            ["line 15", "length 4", "load.top.traction"],
        ),
        (
            "[decomposition]",
            "[contact.a]\nslave = 'block.zmin'\nrigid.sphere = {centre = [0, 0, 0, 0], radius = 1}\n[decomposition]",
            ["line 15", "length 4", "contact.a.rigid"],
        ),
    ] {
        refuses_text(from, to, &parts);
    }
}

#[test]
fn what_contradicts_itself_is_refused() {
    for key in ["hardening", "kinematic_hardening"] {
        let parts = [&format!("material.steel.{key} = 1.0")[..], "add yield_stress"];
        refuses(&[&format!("material.steel.{key}=1")], &parts);
    }
    let twin = FLOOR.replace("contact.floor", "contact.ground");
    refuses(&[FLOOR, &twin], &["contact.ground.slave = \"block.zmin\"", "contact.floor is the same obstacle"]);
    assert!(one(&[FLOOR, &twin.replace("[0, 0, 0]", "[0, 0, -1]")]).is_ok());
    refuses(&["initial={result='a', bodies=['block', 'block']}"], &["initial.bodies", "once"]);
}

#[test]
fn boxes_whose_coordinates_tell_no_cells_apart_are_refused() {
    for axis in 0..3 {
        let far = format!("body.block.brick.origin.{axis}=1e13");
        refuses(&[&far], &["body.block.brick.origin", "nearer to the origin"]);
    }
    assert!(one(&["body.block.brick.origin=[1e11, -1e11, 1e11]"]).is_ok());
}
