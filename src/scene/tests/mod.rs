//! Every check by its message, levels, places, and the library.

use super::*;

mod bodies;
mod conditions;
mod idle;
mod overrides;
mod settings;

const ONE: &str = r#"
title = "one brick"
[material.steel]
young = 210000
poisson = 0.3
[body.block]
material = "steel"
element = "tet4"
brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }
[support.base]
surface = "block.zmin"
fix = ["x", "y", "z"]
[decomposition]
cells = [2, 2, 2]
"#;

fn sets(list: &[&str]) -> Vec<String> {
    list.iter().map(ToString::to_string).collect()
}

fn one(list: &[&str]) -> Result<Scene, SceneError> {
    Scene::from_text(ONE, "one.toml", 1, &sets(list))
}

fn two_blocks(list: &[&str]) -> Result<Scene, SceneError> {
    Scene::load("two-blocks", 1, &sets(list))
}

#[track_caller]
fn assert_says(outcome: Result<Scene, SceneError>, parts: &[&str]) {
    let message = outcome.expect_err("should be refused").to_string();
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    assert!(!message.contains('\n'), "one paragraph: {message}");
}

/// The scene is refused after these changes, and the message has these parts.
#[track_caller]
fn refuses(changes: &[&str], parts: &[&str]) {
    assert_says(one(changes), parts);
}

#[track_caller]
fn refuses_text(from: &str, to: &str, parts: &[&str]) {
    assert!(ONE.contains(from));
    assert_says(Scene::from_text(&ONE.replace(from, to), "one.toml", 1, &[]), parts);
}

#[test]
fn the_library_loads_at_several_levels() {
    for name in library::names() {
        for level in [1, 2, 3] {
            let scene = Scene::load(name, level, &[]).unwrap();
            assert!(scene.warnings().is_empty(), "{name}");
            assert!(!scene.title.is_empty() && !scene.units.is_empty());
        }
    }
}

fn traction(scene: &Scene, load: &str) -> [f64; 3] {
    let Load::Traction { traction, .. } = scene.load[load] else { panic!("{load} is no traction") };
    traction
}

#[test]
fn two_blocks_is_the_benchmark() {
    let scene = two_blocks(&[]).unwrap();
    let upper = &scene.body["upper"];
    assert_eq!(
        *upper.brick().unwrap(),
        Brick { origin: [600.0, 0.0, 1000.0], size: [3000.0, 1000.0, 1000.0], cells: [30, 10, 10] }
    );
    assert_eq!(scene.body.values().map(|body| body.brick().unwrap().cell_count()).sum::<usize>(), 6000);
    assert_eq!(scene.material["upper"], scene.material["lower"]);
    assert_eq!(traction(&scene, "top"), [0.0, 0.0, -150.0]);
    assert_eq!(scene.contact["joint"].surfaces().next().unwrap().to_string(), "upper.zmin");
    assert_eq!(scene.decomposition.method, Method::Bricks { cells: PAPER_CELLS });
    assert_eq!(scene.solver, Solver::default());
}

#[test]
fn the_elastic_variant_differs_in_load_and_yielding_only() {
    let mut plastic = two_blocks(&["load.top.traction.2=-30"]).unwrap();
    for material in plastic.material.values_mut() {
        let Material::VonMises(law) = material;
        (law.yield_stress, law.hardening) = (None, 0.0);
    }
    let elastic = Scene::load("two-blocks-elastic", 1, &[]).unwrap();
    assert!(elastic.material.values().all(|material| !material.yields()));
    plastic.title.clone_from(&elastic.title);
    assert_eq!(plastic, elastic);
}

#[test]
fn effective_scenes_round_trip() {
    for name in library::names() {
        let scene = Scene::load(name, 2, &[]).unwrap();
        let text = scene.to_toml();
        assert_eq!(Scene::from_text(&text, "echo", 1, &[]).unwrap(), scene, "{text}");
    }
    let metis =
        two_blocks(&["decomposition.subdomains=7", "decomposition.cluster=3", "solver.precision=double"]).unwrap();
    assert_eq!(Scene::from_text(&metis.to_toml(), "echo", 1, &[]).unwrap(), metis);
    let steps = two_blocks(&["step=[{load={top=0.5}, increments=3}, {name='off', amplitude=0}]"]).unwrap();
    assert_eq!(Scene::from_text(&steps.to_toml(), "echo", 1, &[]).unwrap(), steps);
}

#[test]
fn levels_refine_cells_but_not_subdomains() {
    let scene = Scene::load("two-blocks", 3, &[]).unwrap();
    assert_eq!(scene.body["lower"].brick().unwrap().cells, [90, 30, 30]);
    assert_eq!(scene.decomposition.method, Method::Bricks { cells: PAPER_CELLS });
    assert_says(Scene::load("two-blocks", 0, &[]), &["level 0"]);
    assert_says(Scene::load("two-blocks", usize::MAX, &[]), &["body.lower.brick.cells", "too many"]);
}

#[test]
fn unknown_scenes_list_the_known() {
    assert_says(
        Scene::load("three-blocks", 1, &[]),
        &["three-blocks", "bar, patch, shear, step-42, two-blocks", "path"],
    );
    assert_says(Scene::load("no/such.toml", 1, &[]), &["no/such.toml"]);
}

#[test]
fn files_are_read() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), ONE).unwrap();
    let scene = Scene::load(file.path().to_str().unwrap(), 1, &[]).unwrap();
    let directory = file.path().parent().unwrap().to_path_buf();
    assert_eq!(scene, Scene { directory, ..one(&[]).unwrap() });
}

#[test]
fn syntax_and_type_errors_have_a_place() {
    refuses_text("poisson = 0.3", "poisson = ", &["one.toml, line 5, column 1"]);
    refuses_text("poisson = 0.3", "poisson = \"a\"", &["one.toml, line 5, column 11", "expected a number"]);
    refuses_text("poisson = 0.3", "poison = 0.3", &["line 5, column 1", "unknown key `poison`", "poisson"]);
    refuses_text("poisson = 0.3", "", &["line 3", "missing key `poisson`"]);
    refuses_text("tet4", "hex27", &["line 8", "hex27", "tet4"]);
    refuses_text("[support.base]", "[suport.base]", &["line 10", "unknown key `suport`"]);
    refuses_text("[2, 2, 2] }", "[2, 2] }", &["line 9", "3"]);
    refuses_text("[2, 2, 2] }", "[2, 2, -2] }", &["line 9", "-2", "expected a count"]);
}

#[test]
fn failed_checks_have_a_place() {
    refuses_text("poisson = 0.3", "poisson = 0.5", &["one.toml, line 5, column 1: material.steel.poisson = 0.5: "]);
    refuses(&["material.steel.poisson=0.5"], &["--set material.steel.poisson=0.5: material.steel.poisson = 0.5: "]);
    refuses(
        &["body.block.brick.size.1=0"],
        &["--set body.block.brick.size.1=0: body.block.brick.size = [1.0, 0.0, 1.0]"],
    );
}
