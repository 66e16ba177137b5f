//! `--set`.

use super::*;

#[test]
fn overrides_reach_every_kind_of_value() {
    let changes = [
        "title=two words",
        "units='m, N, Pa'",
        "material.steel.hardening=5",
        "material.steel.yield_stress=1",
        "body.block.brick.origin=[1, 2, 3]",
        "body.block.brick.size.2=0.5",
        "support.base.surface=block.xmin",
        "\"load\".\"on top\" = {surface = \"block.zmax\", traction = [0, 0, 1]}",
    ];
    let scene = one(&changes).unwrap();
    assert_eq!((scene.title.as_str(), scene.units.as_str()), ("two words", "m, N, Pa"));
    let crate::material::Material::VonMises(steel) = scene.material["steel"];
    assert_eq!(steel.hardening, 5.0);
    let Brick { origin, size, .. } = *scene.body["block"].brick().unwrap();
    assert_eq!((origin, size), ([1.0, 2.0, 3.0], [1.0, 1.0, 0.5]));
    assert_eq!(scene.support["base"].surface.face(), Some(Face::Xmin));
    assert_eq!(traction(&scene, "on top"), [0.0, 0.0, 1.0]);
}

#[test]
fn later_overrides_win_and_build_on_earlier_ones() {
    let changes =
        ["title=a", "title=b", "load.new.surface=block.zmax", "load.new.traction=[0, 0, 1]", "load.new.traction.2=2"];
    let scene = one(&changes).unwrap();
    assert_eq!(scene.title, "b");
    assert_eq!(traction(&scene, "new")[2], 2.0);
}

#[test]
fn overrides_may_complete_a_file() {
    let incomplete = ONE.replace("poisson = 0.3", "");
    assert!(Scene::from_text(&incomplete, "one.toml", 1, &sets(&["material.steel.poisson=0.3"])).is_ok());
    assert_says(Scene::from_text(&incomplete, "one.toml", 1, &sets(&["title=a"])), &["one.toml, line 3", "poisson"]);
}

#[test]
fn overrides_that_do_not_fit_are_named() {
    refuses(&["title=a", "solver.newton_tol=1e-3"], &["--set solver.newton_tol=1e-3: ", "unknown key `newton_tol`"]);
    refuses(&["solvr.qp=smalse-m"], &["--set solvr.qp=smalse-m", "unknown key `solvr`"]);
    refuses(
        &["body.blok.brick.size=[1, 1, 1]"],
        &["--set body.blok.brick.size=[1, 1, 1]: unknown key `body.blok`: [body] has block", "missing key"],
    );
    refuses(&["solver.qp_limit=many"], &["solver.qp_limit=many", "invalid type", "in `solver.qp_limit`"]);
    refuses(
        &["load.a.surface=block.xmin", "load.a.tractoin=[0, 0, 1]"],
        &["load.a.tractoin", ": unknown key `tractoin`"],
    );
    refuses(&["load.a.surface=block.xmin"], &["unknown key `load.a`: [load] is empty; a new entry", "`traction`"]);
    refuses(&["title"], &["--set title: write dotted.path=value"]);
    refuses(&["a b=1"], &["`a b` is not a dotted path"]);
    refuses(&["=1"], &["not a dotted path"]);
    refuses(&["title="], &["not a TOML value"]);
    refuses(&["support.base.fix=[x]"], &["`[x]` is not a TOML value"]);
    refuses(&["title.length=3"], &["`title` is a single string, it has no `length`"]);
    refuses(&["body.block.brick.size.3=3"], &["`body.block.brick.size` is an array of 3", "`3` is no index"]);
}
