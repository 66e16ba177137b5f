//! Every check by its message, overrides, levels, places, and the library.

use super::*;

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
        (material.yield_stress, material.hardening) = (None, 0.0);
    }
    let elastic = Scene::load("two-blocks-elastic", 1, &[]).unwrap();
    assert!(elastic.material.values().all(|material| !material.is_plastic()));
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
        two_blocks(&["decomposition.subdomains=7", "decomposition.cluster=3", "solver.expansion=fixed"]).unwrap();
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

#[test]
fn materials_are_checked() {
    for young in ["0", "-1.0", "nan", "inf"] {
        refuses(&[&format!("material.steel.young={young}")], &["material.steel.young = "]);
    }
    for poisson in ["0.5", "-1", "nan", "inf"] {
        refuses(&[&format!("material.steel.poisson={poisson}")], &["material.steel.poisson = ", "below 0.5"]);
    }
    for stress in ["0", "-450", "nan", "inf"] {
        refuses(&[&format!("material.steel.yield_stress={stress}")], &["material.steel.yield_stress = "]);
    }
    for hardening in ["-1", "nan", "inf"] {
        for key in ["hardening", "kinematic_hardening"] {
            refuses(&[&format!("material.steel.{key}={hardening}")], &[&format!("material.steel.{key} = ")]);
        }
    }
}

#[test]
fn bodies_are_checked() {
    refuses(&["body.block.material=wood"], &["body.block.material = \"wood\"", "known are steel"]);
    refuses(&["body.block.brick.origin.0=nan"], &["body.block.brick.origin = [NaN, 0.0, 0.0]"]);
    for size in ["0", "-1", "inf", "nan"] {
        refuses(&[&format!("body.block.brick.size.2={size}")], &["body.block.brick.size = "]);
    }
    refuses(&["body.block.brick.cells.0=0"], &["body.block.brick.cells = [0, 2, 2]", "at least 1"]);
    assert_says(Scene::from_text("", "empty.toml", 1, &[]), &["empty.toml: body: ", "at least one body"]);
}

#[test]
fn structured_bodies_are_read_refined_and_checked() {
    let other = |shape: &str, surface: &str, level: usize| {
        let text = ONE.replace("brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }", shape);
        let text = text.replace("[decomposition]\ncells = [2, 2, 2]\n", "").replace("block.zmin", surface);
        Scene::from_text(&text, "one.toml", level, &[])
    };
    let sphere = "sphere = { inner = 1, outer = 2, cells = [3, 4] }";
    let cylinder = "cylinder = { inner = 1, outer = 2, height = 3, cells = [4, 5, 6] }";
    let grid = "grid = { x = [0, 1, 4], y = [0, 2], z = [-1, 0] }";
    for (shape, surface, refined) in [
        (sphere, "block.outer", Shape::Sphere(Sphere { inner: 1.0, outer: 2.0, cells: [6, 8] })),
        (cylinder, "block.top", Shape::Cylinder(Cylinder { inner: 1.0, outer: 2.0, height: 3.0, cells: [8, 10, 12] })),
        (
            grid,
            "block.zmin",
            Shape::Grid(Grid { x: vec![0.0, 0.5, 1.0, 2.5, 4.0], y: vec![0.0, 1.0, 2.0], z: vec![-1.0, -0.5, 0.0] }),
        ),
    ] {
        let scene = other(shape, surface, 2).unwrap();
        assert_eq!(scene.body["block"].shape, refined);
        assert_eq!(Scene::from_text(&scene.to_toml(), "again.toml", 1, &[]).unwrap(), scene);
    }
    let refused = |shape: &str, surface: &str, parts: &[&str]| assert_says(other(shape, surface, 1), parts);
    refused(sphere, "block.top", &["`top` is not a face", "a sphere has inner, outer, x0"]);
    refused(cylinder, "block.zmax", &["`zmax` is not a face", "a cylinder has", "bottom"]);
    refused(grid, "block.inner", &["`inner` is not a face", "a grid has xmin"]);
    refused(&sphere.replace("outer = 2", "outer = 1"), "block.inner", &["sphere.outer = 1", "larger"]);
    refused(&sphere.replace("[3, 4]", "[0, 4]"), "block.inner", &["sphere.cells = [0, 4]", "at least 1"]);
    refused(&sphere.replace("[3, 4]", "[30000, 4]"), "block.inner", &["sphere.cells", "too many"]);
    refused(&cylinder.replace("inner = 1", "inner = 0"), "block.inner", &["cylinder.inner = 0", "positive"]);
    refused(&cylinder.replace("height = 3", "height = inf"), "block.inner", &["cylinder.height"]);
    refused(&grid.replace("[0, 2]", "[2, 0]"), "block.zmin", &["grid.y = [2.0, 0.0]", "ascending"]);
    refused(&grid.replace("[0, 2]", "[2]"), "block.zmin", &["grid.y", "at least two"]);
    refused(&(grid.to_owned() + "\n" + sphere), "block.zmin", &["both sphere and grid"]);
}

#[test]
fn bodies_from_mesh_files_are_checked() {
    let gmsh = |rest: &str| {
        let text = ONE.replace("brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }", rest);
        let text = text.replace("[decomposition]\ncells = [2, 2, 2]\n", "").replace("block.zmin", "block.the bottom");
        Scene::from_text(&text, "dir/one.toml", 1, &[])
    };
    let scene = gmsh("gmsh = { file = 'part.msh' }").unwrap();
    let plain = Gmsh { file: "part.msh".into(), volume: None, scale: 1.0, rotate: None, translate: [0.0; 3] };
    assert_eq!((scene.body["block"].gmsh(), scene.directory.to_str()), (Some(&plain), Some("dir")));
    assert_eq!(scene.support["base"].surface.surface, "the bottom");
    let all = "gmsh = { file = 'p.msh', volume = 'a b', scale = 1e3, rotate = { axis = [0, 0, 1], angle_deg = -30 }, \
               translate = [1, 2, 3] }";
    let scene = gmsh(all).unwrap();
    assert_eq!(Scene::from_text(&scene.to_toml(), "dir/again.toml", 1, &[]).unwrap(), scene);

    let refused = |rest: &str, parts: &[&str]| assert_says(gmsh(rest), parts);
    refused("", &["line 6", "needs a shape", "brick = {", "gmsh = {"]);
    refused("brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }\ngmsh = { file = 'a' }", &["both"]);
    refused("gmsh = { volume = 'a' }", &["line 9", "missing key `file`"]);
    refused("gmsh = { file = 'a', turn = 3 }", &["line 9", "unknown key `turn`", "rotate"]);
    refused("gmsh = { file = '' }", &["body.block.gmsh.file"]);
    refused("gmsh = { file = 'a', scale = 0 }", &["body.block.gmsh.scale = 0.0", "positive"]);
    refused("gmsh = { file = 'a', translate = [0, nan, 0] }", &["body.block.gmsh.translate", "finite"]);
    let turned =
        |axis: &str, angle: &str| format!("gmsh = {{ file = 'a', rotate = {{ axis = {axis}, angle_deg = {angle} }} }}");
    refused(&turned("[0, 0, 0]", "3"), &["body.block.gmsh.rotate.axis", "not all zero"]);
    refused(&turned("[0, 0, 1]", "inf"), &["body.block.gmsh.rotate.angle_deg", "finite"]);
    refused("gmsh = { file = 'a' }\n[decomposition]\ncells = [1, 1, 1]", &["body block is no brick", "metis"]);
    let text = scene.to_toml();
    assert_says(Scene::from_text(&text, "one.toml", 2, &[]), &["level 2", "body block", "gmsh -refine"]);
}

#[test]
fn materials_go_by_the_volumes_of_a_mesh_file() {
    const TWO: &str = "{ core = \"copper\", shell = \"steel\" }";
    let part = |material: &str, volume: &str, list: &[&str]| {
        let shape = format!("gmsh = {{ file = 'part.msh'{volume} }}");
        let text = ONE.replace("brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }", &shape);
        let text = text.replace("[decomposition]\ncells = [2, 2, 2]\n", "").replace("\"steel\"", material);
        let copper = "[material.copper]\nyoung = 1\npoisson = 0.3\n[body.block]";
        Scene::from_text(&text.replace("[body.block]", copper), "one.toml", 1, &sets(list))
    };
    let both = ", volume = ['shell', 'core']";
    let of = |scene: Scene, volume: &str| scene.body["block"].material.of(volume).map(str::to_owned);
    for (material, volume, core) in [
        (TWO, both, "copper"),
        ("\"steel\"", both, "steel"),
        ("{ core = \"copper\" }", ", volume = 'core'", "copper"),
        ("\"steel\"", ", volume = ['core']", "steel"),
    ] {
        let scene = part(material, volume, &[]).unwrap();
        assert_eq!(Scene::from_text(&scene.to_toml(), "again.toml", 1, &[]).unwrap(), scene, "{}", scene.to_toml());
        assert_eq!(of(scene, "core").as_deref(), Some(core));
    }
    let changed = part(TWO, both, &["body.block.material.core=steel"]).unwrap();
    assert_eq!(changed.body["block"].material.names().into_iter().collect::<Vec<_>>(), ["steel"]);
    let (before, now) = (part(TWO, both, &[]).unwrap().to_toml(), changed.to_toml());
    assert_eq!(changes(&before, &now), ["body.block.material.core was \"copper\", is \"steel\""]);
    assert_eq!(of(part(TWO, both, &["body.block.material=steel"]).unwrap(), "core").as_deref(), Some("steel"));

    let refused = |material: &str, volume: &str, list: &[&str], parts: &[&str]| {
        assert_says(part(material, volume, list), parts);
    };
    let key = "body.block.material";
    refused(TWO, "", &[], &["one.toml, line 10", key, "gmsh.volume = [\"core\", \"shell\"]"]);
    refused("{ core = \"steel\" }", both, &[], &[key, "no material for volume `shell`"]);
    let parts = ["line 10, column 31: body.block.material.shel = \"steel\": no such volume", "known are shell, core"];
    refused("{ core = \"copper\", shel = \"steel\" }", both, &[], &parts);
    refused(
        TWO,
        both,
        &["body.block.material.shel=steel"],
        &["--set body.block.material.shel=steel: ", "no such volume"],
    );
    let parts = ["--set body.block.material.core=wood: body.block.material.core = \"wood\"", "known are copper, steel"];
    refused(TWO, both, &["body.block.material.core=wood"], &parts);
    refused("\"steel\"", both, &["body.block.material.core=copper"], &["is a single string, it has no `core`"]);
    refused("[\"steel\"]", both, &[], &["line 10", "the name of a material, or a table with one for each volume"]);
    refused("\"steel\"", ", volume = 3", &[], &["the name of a volume, or a list of names"]);
    refused("\"steel\"", ", volume = []", &[], &["body.block.gmsh.volume = []", "at least one"]);
    refused("\"steel\"", ", volume = ['core', 'core']", &[], &["body.block.gmsh.volume", "once"]);
    refuses_text("\"steel\"", TWO, &["body.block.material", "one name"]);
    refused(TWO, both, &["decomposition.subdomains=1"], &["each material of each body", "which are 2"]);
}

#[test]
fn names_of_bodies_and_surfaces_may_have_dots() {
    let text = ONE.replace("body.block", "body.'a.b'").replace("block.zmin", "a.b.zmin");
    let surface = |text: &str| Scene::from_text(text, "one.toml", 1, &[]).unwrap().support["base"].surface.clone();
    assert_eq!(surface(&text), SurfaceName { body: "a.b".into(), surface: "zmin".into() });
    let brick = "brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }";
    let text =
        text.replace(brick, "gmsh = { file = 'a' }").replace("a.b.zmin", "a.b.c.d.e").replace("cells = [2, 2, 2]", "");
    assert_eq!(surface(&text), SurfaceName { body: "a.b".into(), surface: "c.d.e".into() });
}

#[test]
fn surfaces_are_checked() {
    refuses(&["support.base.surface=blok.zmin"], &["support.base.surface = \"blok.zmin\"", "known are block"]);
    refuses_text(
        "block.zmin",
        "block.bottom",
        &["line 11", "`bottom`", "`block`", "xmin, xmax, ymin, ymax, zmin, zmax"],
    );
    refuses_text("block.zmin", "block", &["line 11", "`block` is not a surface", "body.surface"]);
    refuses_text("block.zmin", ".zmin", &["line 11", "is not a surface"]);
    let surface: SurfaceName = "part.v2.ymax".parse().unwrap();
    assert_eq!((surface.body.as_str(), surface.face()), ("part.v2", Some(Face::Ymax)));
}

#[test]
fn faces_know_their_normal_and_name() {
    for face in Face::ALL {
        let side = if face.is_max() { "max" } else { "min" };
        assert_eq!(face.name(), format!("{}{side}", face.axis()));
    }
}

#[test]
fn supports_are_checked() {
    refuses(&["support.base.fix=[]"], &["support.base.fix = []", "at least one"]);
    refuses(&["support.base.fix=['x', 'y', 'x']"], &["support.base.fix = [\"x\", \"y\", \"x\"]", "at most once"]);
    refuses(&["support.base.displacement=[0, nan, 0]"], &["support.base.displacement = ", "finite"]);
    let partly = ["support.base.fix=['x', 'y']", "support.base.displacement=[0, 1, 2]"];
    refuses(&partly, &["support.base.displacement = [0.0, 1.0, 2.0]", "component z is not fixed"]);
    let scene = one(&["support.base.displacement=[0, 1, 2]"]).unwrap();
    assert_eq!(Axis::ALL.map(|axis| scene.support["base"].prescribed(axis)), [Some(0.0), Some(1.0), Some(2.0)]);
}

#[test]
fn supports_must_agree_where_they_meet() {
    let side = |surface: &str, x: f64| {
        let side = format!("support.side={{surface = '{surface}', fix = ['x'], displacement = [{x}, 0, 0]}}");
        one(&[&side])
    };
    assert_says(side("block.xmin", 1.0), &["support.side", "support.base", "1.0 along x", "0.0"]);
    assert_says(side("block.zmin", 1.0), &["support.side", "support.base"]);
    assert!(side("block.zmax", 1.0).is_ok());
    assert!(side("block.xmin", 0.0).is_ok());
}

#[test]
fn loads_are_checked() {
    refuses(&["load.top={surface = 'block.zmax', traction = [0, 0, inf]}"], &["load.top.traction = [0.0, 0.0, inf]"]);
    refuses(&["load.top={surface = 'cube.zmax', traction = [0, 0, 1]}"], &["load.top.surface", "known are block"]);
    refuses(&["load.top={surface = 'cube.zmax', pressure = 1}"], &["load.top.surface", "known are block"]);
    refuses(&["load.top={surface = 'block.zmax', pressure = nan}"], &["load.top.pressure = NaN", "finite"]);
    refuses(&["load.own={body = 'cube', body_force = [0, 0, 1]}"], &["load.own.body", "no such body", "block"]);
    refuses(&["load.own={body = 'block', body_force = [0, nan, 1]}"], &["load.own.body_force", "finite"]);
    for (keys, part) in [
        ("", "missing key `surface`"),
        ("surface = 'block.zmax', body = 'block', body_force = [0, 0, 1]", "remove either surface or body"),
        ("surface = 'block.zmax'", "missing key `traction` or `pressure`"),
        ("surface = 'block.zmax', traction = [0, 0, 1], pressure = 1", "either a traction or a pressure"),
        ("surface = 'block.zmax', body_force = [0, 0, 1]", "give body = "),
        ("body = 'block'", "missing key `body_force`"),
        ("body = 'block', pressure = 1", "give surface = "),
        ("body = 'block', bodyforce = [0, 0, 1]", "unknown key `bodyforce`"),
    ] {
        refuses(&[&format!("load.top={{{keys}}}")], &["load.top", part]);
    }
}

#[test]
fn loads_of_every_kind_read_back() {
    let loads = [
        ("{surface = 'block.zmax', traction = [0, 0, 1]}", Some("block.zmax")),
        ("{surface = 'block.zmax', pressure = 3}", Some("block.zmax")),
        ("{body = 'block', body_force = [0, 0, -9.81]}", None),
    ];
    for (load, surface) in loads {
        let scene = one(&[&format!("load.top={load}")]).unwrap();
        assert_eq!(scene.load["top"].surface().map(SurfaceName::to_string).as_deref(), surface);
        assert_eq!(Scene::from_text(&scene.to_toml(), "again", 1, &[]).unwrap(), scene);
    }
}

#[test]
fn contact_pairs_are_checked() {
    assert_says(two_blocks(&["contact.joint.slave=middle.zmin"]), &["contact.joint.slave", "known are lower, upper"]);
    assert_says(two_blocks(&["contact.joint.master=middle.zmin"]), &["contact.joint.master"]);
    assert_says(two_blocks(&["contact.joint.master=upper.zmax"]), &["contact.joint.master", "does not touch itself"]);
    assert_says(two_blocks(&["contact.joint.gap=nan"]), &["contact.joint.gap", "finite"]);
    assert_says(two_blocks(&["contact.joint.clearance=inf"]), &["contact.joint.clearance", "finite"]);
    assert_says(
        two_blocks(&["contact.joint.clearance=0", "contact.joint.gap=1"]),
        &["contact.joint.clearance", "remove gap"],
    );
    let again = "contact.more={surfaces = ['lower.zmax', 'upper.zmin']}";
    assert_says(two_blocks(&[again]), &["contact.more.surfaces", "contact.joint is between the same two"]);
}

#[test]
fn a_contact_may_leave_open_which_surface_is_the_slave() {
    let either = |with: &str| two_blocks(&[&format!("contact.more={{{with}}}")]);
    let scene = either("surfaces = ['lower.xmax', 'upper.xmin'], gap = -0.5").unwrap();
    let Contact { sides, gap, .. } = &scene.contact["more"];
    let names = |text: &str| text.parse::<SurfaceName>().unwrap();
    assert_eq!((sides, *gap), (&Sides::Either(["lower.xmax", "upper.xmin"].map(names)), -0.5));
    assert_says(either("surfaces = ['lower.xmax', 'lower.xmin']"), &["contact.more.surfaces", "does not touch itself"]);
    assert_says(either("surfaces = ['lower.xmax', 'middle.xmin']"), &["contact.more.surfaces", "no body `middle`"]);
    assert_says(either("surfaces = ['lower.xmax']"), &["contact.more"]);
    assert_says(either("surfaces = ['lower.xmax', 'upper.xmin'], slave = 'upper.zmin'"), &["remove slave"]);
    assert_says(either("master = 'lower.xmax'"), &["needs a slave", "two surfaces"]);
}

#[test]
fn a_contact_has_one_second_side() {
    let ground = "{plane = {point = [0, 0, 0], normal = [0, 0, 1]}}";
    let rigid = |with: &str| one(&[&format!("contact.ground={{slave = 'block.zmin', {with}}}")]);
    assert!(rigid(&format!("rigid = {ground}")).is_ok());
    assert_says(rigid(""), &["master (a surface) or rigid (an obstacle)"]);
    assert_says(rigid(&format!("master = 'block.zmax', rigid = {ground}")), &["remove either master or rigid"]);
    assert_says(rigid("rigid = {cone = {point = [0, 0, 0]}}"), &["cone", "plane", "sphere", "cylinder", "heightfield"]);
    assert_says(rigid("rigid = {sphere = {centre = [0, 0, 0], diameter = 1}}"), &["diameter", "radius"]);
    assert_says(rigid("rigid = {sphere = {centre = [0, 0, 0]}}"), &["missing key", "radius"]);
    let text =
        rigid("gap = 0.25, rigid = {cylinder = {point = [0, 0, 0], axis = [1, 0, 0], radius = 2, inside = true}}")
            .unwrap();
    assert_eq!(Scene::from_text(&text.to_toml(), "echo", 1, &[]).unwrap(), text);
}

#[test]
fn obstacles_are_checked() {
    let says = |rigid: &str, parts: &[&str]| {
        let set = format!("contact.ground={{slave = 'block.zmin', rigid = {{{rigid}}}}}");
        refuses(&[&set], &[&["contact.ground.rigid."], parts].concat());
    };
    says("plane = {point = [0, nan, 0], normal = [0, 0, 1]}", &["plane.point", "finite"]);
    says("plane = {point = [0, 0, 0], normal = [0, 0, 0]}", &["plane.normal", "point somewhere"]);
    for radius in ["0", "-1", "inf", "nan"] {
        says(&format!("sphere = {{centre = [0, 0, 0], radius = {radius}}}"), &["sphere.radius = ", "positive"]);
    }
    says("sphere = {centre = [inf, 0, 0], radius = 1}", &["sphere.centre", "finite"]);
    says("cylinder = {point = [0, 0, 0], axis = [0, 0, 0], radius = 1}", &["cylinder.axis"]);
    says("cylinder = {point = [0, 0, 0], axis = [0, 0, 1], radius = -1}", &["cylinder.radius"]);
    let field = |spacing: &str, heights: &str| {
        format!("heightfield = {{origin = [0, 0], spacing = {spacing}, heights = {heights}}}")
    };
    says(&field("[1, 0]", "[[0, 0], [0, 0]]"), &["heightfield.spacing = [1.0, 0.0]", "positive"]);
    for heights in ["[]", "[[0, 0]]", "[[0], [0]]", "[[0, 0], [0, 0, 0]]"] {
        says(&field("[1, 1]", heights), &["heightfield.heights", "equal length"]);
    }
    says(&field("[1, 1]", "[[0, 0], [0, nan]]"), &["heightfield.heights", "finite"]);
}

#[test]
fn steps_are_checked() {
    let step = |text: &str| one(&["load.top={surface='block.zmax', traction=[0, 0, 1]}", &format!("step=[{text}]")]);
    assert_says(step("{amplitude=nan}"), &["step.0.amplitude = NaN", "finite"]);
    assert_says(step("{}, {increments=0}"), &["step.1.increments = 0", "at least 1"]);
    assert_says(step("{halvings=31}"), &["step.0.halvings = 31", "at most 30"]);
    assert_says(step("{load={bottom=1}}"), &["step.0.load.bottom", "no such load", "known are top"]);
    assert_says(step("{load={top=inf}}"), &["step.0.load.top", "finite"]);
    assert_says(step("{support={top=1}}"), &["step.0.support.top", "no such support", "known are base"]);
    assert_says(step("{amplitud=1}"), &["unknown key `amplitud`"]);
    refuses(&["step=[{load={top=1}}]"], &["no such load", "the scene has none"]);
    let text = format!("{ONE}[[step]]\n[[step]]\nname = 'off'\namplitude = inf\n");
    assert_says(Scene::from_text(&text, "one.toml", 1, &[]), &["one.toml, line 18", "step.1.amplitude = inf"]);
    let changed = Scene::from_text(&text, "one.toml", 1, &sets(&["step.1.amplitude=0"])).unwrap();
    assert_eq!((changed.step.len(), changed.step[1].amplitude, changed.step[1].name.as_str()), (2, 0.0, "off"));
}

#[test]
fn only_obstacles_are_moved_by_contacts() {
    let plane = |more: &str| {
        format!("contact.floor={{slave='block.zmin', rigid={{plane={{point=[0, 0, 0], normal=[0, 0, 1]}}}}{more}}}")
    };
    let step = "step=[{amplitude=0, contact={floor=2}}]";
    let moved = one(&[&plane(", displacement=[0, 0, 1]"), step]).unwrap();
    assert_eq!(moved.contact["floor"].displacement(), [0.0, 0.0, 1.0]);
    assert_eq!((moved.step[0].of_contact("floor"), moved.step[0].of_contact("other")), (2.0, 0.0));
    assert_eq!(Scene::from_text(&moved.to_toml(), "again.toml", 1, &[]).unwrap().contact, moved.contact);
    assert_eq!(one(&[&plane("")]).unwrap().contact["floor"].displacement(), [0.0; 3]);
    refuses(&[&plane(""), step], &["step.0.contact.floor", "no such contact whose obstacle has a displacement"]);
    refuses(&[&plane(", displacement=[0, inf, 1]")], &["contact.floor.displacement", "finite"]);
    assert_says(two_blocks(&["contact.joint.displacement=[0, 0, 1]"]), &["displacement moves a rigid obstacle"]);
}

#[test]
fn the_state_to_start_from_is_checked() {
    let start = |text: &str| one(&[&format!("initial={text}")]);
    let scene = start("{result='out/earlier.vtkhdf', bodies=['block']}").unwrap();
    assert_eq!(Scene::from_text(&scene.to_toml(), "again.toml", 1, &[]).unwrap().initial, scene.initial);
    assert_eq!(one(&[]).unwrap().initial, None);
    assert_says(start("{result=''}"), &["initial.result", "path of a result file"]);
    assert_says(start("{}"), &["missing key `result`"]);
    assert_says(start("{result='a', step=1}"), &["unknown key `step`"]);
    assert_says(start("{result='a', bodies=[]}"), &["initial.bodies = []", "at least one"]);
    assert_says(start("{result='a', bodies=['bolt']}"), &["initial.bodies = \"bolt\"", "known are block"]);
}

#[test]
fn steps_scale_what_they_do_not_name_by_their_amplitude() {
    let scene = one(&["step=[{amplitude=2, support={base=3}}, {}]"]).unwrap();
    let [first, second] = scene.steps() else { panic!("two steps") };
    assert_eq!((first.of_load("any"), first.of_support("base"), first.of_support("other")), (2.0, 3.0, 2.0));
    assert_eq!((second.of_load("any"), second.increments), (1.0, 1));
    let at_once = one(&[]).unwrap();
    let [whole] = at_once.steps() else { panic!("one step") };
    assert_eq!((whole.of_load("any"), whole.increments, whole.halvings), (1.0, 1, 0));
}

#[test]
fn supports_must_agree_in_every_step() {
    let side = "support.side={surface='block.xmin', fix=['x'], displacement=[1, 0, 0]}";
    let base = "support.base.displacement=[1, 0, 0]";
    assert!(one(&[side, base]).is_ok());
    assert!(one(&[side, base, "step=[{}, {amplitude=0.5}]"]).is_ok());
    assert_says(one(&[side, base, "step=[{}, {support={side=0.5}}]"]), &["support.side", "0.5 along x", "1.0"]);
}

#[test]
fn decompositions_are_checked() {
    refuses(&["decomposition.cells=[0, 2, 2]"], &["decomposition.cells = [0, 2, 2]"]);
    refuses(
        &["decomposition.cells=[2, 3, 2]"],
        &["decomposition.cells = [2, 3, 2]: 3 does not divide the 2 cells", "body block", "along y"],
    );
    assert_says(two_blocks(&["decomposition.subdomains=1"]), &["decomposition.subdomains = 1", "2 bodies"]);
    refuses(&["decomposition.subdomains=49"], &["decomposition.subdomains = 49", "48 elements"]);
    assert!(one(&["decomposition.subdomains=48"]).is_ok());
    refuses(&["decomposition.cluster=0"], &["decomposition.cluster = 0", "at least 1"]);
    assert_eq!(one(&["decomposition.cluster=8"]).unwrap().decomposition.cluster, Some(8));
}

#[test]
fn the_method_follows_the_keys() {
    let metis = |subdomains| Method::Metis { subdomains: Some(subdomains) };
    let bricks = Method::Bricks { cells: PAPER_CELLS };
    let cut = |text: &str, list: &[&str]| {
        let text = ONE.replace("cells = [2, 2, 2]\n", text);
        Scene::from_text(&text, "one.toml", 5, &sets(list)).map(|scene| scene.decomposition.method)
    };
    assert_eq!(cut("", &[]).unwrap(), Method::default());
    assert_eq!(cut("subdomains = 4", &[]).unwrap(), metis(4));
    assert_eq!(cut("method = 'metis'\ncells = [9, 9, 9]\nsubdomains = 4", &[]).unwrap(), metis(4));
    let both = cut("method = 'bricks'\nsubdomains = 4", &[]).unwrap_err().to_string();
    assert!(both.contains("line 13") && both.contains("method = \"bricks\" is given"), "{both}");
    assert_eq!(cut("method = 'metis'", &[]).unwrap(), Method::Metis { subdomains: None });
    assert_eq!(cut("method = 'bricks'", &[]).unwrap(), bricks);
    assert_eq!(cut("method = 'auto'", &[]).unwrap(), Method::Auto);
    assert!(cut("method = 'auto'\nsubdomains = 4", &[]).is_err());

    assert_eq!(cut("method = 'bricks'", &["decomposition.subdomains=4"]).unwrap(), metis(4));
    assert_eq!(cut("subdomains = 4", &["decomposition.method=bricks"]).unwrap(), bricks);
    assert_eq!(cut("subdomains = 4", &["decomposition.method=auto"]).unwrap(), Method::Auto);
    assert!(cut("", &["decomposition.method=bricks", "decomposition.subdomains=4"]).is_err());
    let supplied = ["decomposition.subdomains=4", "decomposition.method=metis"];
    assert_eq!(cut("method = 'bricks'", &supplied).unwrap(), metis(4));
}

#[test]
fn solver_settings_are_checked() {
    for key in ["newton_tolerance", "residual_tolerance", "qp_tolerance", "accuracy"] {
        for value in ["0", "1", "-1e-4", "nan", "inf"] {
            refuses(&[&format!("solver.{key}={value}")], &[&format!("solver.{key} = "), "above 0 and below 1"]);
        }
    }
    for key in ["newton_limit", "qp_limit"] {
        refuses(&[&format!("solver.{key}=0")], &[&format!("solver.{key} = 0"), "at least 1"]);
    }
    refuses(&["solver.qp=simplex"], &["solver.qp=simplex", "smalse-m", "active-set"]);
    let scene = one(&["solver.qp=active-set", "solver.preconditioner=dirichlet", "solver.expansion=fixed"]).unwrap();
    let Solver { qp, preconditioner, expansion, .. } = scene.solver;
    assert_eq!((qp, preconditioner, expansion), (Qp::ActiveSet, Preconditioner::Dirichlet, Expansion::Fixed));
}

#[test]
fn bodies_must_be_held() {
    refuses(
        &["support.base.fix=['x', 'y']"],
        &["body.block", "translation along z, rotation about x, rotation about y:"],
    );
    refuses(&["support.base.fix=['z']"], &["translation along x, translation along y, rotation about z:"]);
    let mut hinge = sets(&["support.base.fix=['z']"]);
    hinge.push("support.back={surface = 'block.xmin', fix = ['x']}".to_owned());
    assert_says(Scene::from_text(ONE, "one.toml", 1, &hinge), &["against translation along y:"]);
    hinge.push("support.side={surface = 'block.ymin', fix = ['y']}".to_owned());
    assert!(Scene::from_text(ONE, "one.toml", 1, &hinge).is_ok(), "three planes of symmetry hold a body");
    let floor = "contact.floor={slave = 'block.zmin', rigid = {plane = {point = [0, 0, 0], normal = [0, 0, 1]}}}";
    let loose = one(&["support.base.fix=['x', 'y']", floor]).unwrap();
    assert!(loose.warnings()[0].contains("translation along z"), "{:?}", loose.warnings());
    hinge[1] = "support.back={surface = 'block.zmax', fix = ['y']}".to_owned();
    assert_says(Scene::from_text(ONE, "one.toml", 1, &hinge), &["against translation along x:"]);
}

#[test]
fn thin_bodies_are_held_like_thick_ones() {
    let clamp = "support.base.surface=block.xmin";
    for size in ["[1e9, 1e-9, 1]", "[1, 1e-12, 1e-12]"] {
        assert!(one(&[clamp, &format!("body.block.brick.size={size}")]).is_ok());
    }
}

#[test]
fn contact_may_hold_a_body() {
    assert!(two_blocks(&[]).unwrap().warnings().is_empty());
    let loose = two_blocks(&["support.right.fix=['x', 'y']"]).unwrap();
    let warnings = loose.warnings();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("body upper"), "{warnings:?}");
    assert!(warnings[0].contains("1 rigid motion that only contact can hold: translation along z"), "{warnings:?}");
}

#[test]
fn overrides_reach_every_kind_of_value() {
    let changes = [
        "title=two words",
        "units='m, N, Pa'",
        "material.steel.hardening=5",
        "body.block.brick.origin=[1, 2, 3]",
        "body.block.brick.size.2=0.5",
        "support.base.surface=block.xmin",
        "\"load\".\"on top\" = {surface = \"block.zmax\", traction = [0, 0, 1]}",
    ];
    let scene = one(&changes).unwrap();
    assert_eq!((scene.title.as_str(), scene.units.as_str()), ("two words", "m, N, Pa"));
    assert_eq!(scene.material["steel"].hardening, 5.0);
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
