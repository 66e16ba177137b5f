//! What bodies are: shapes, materials, mesh files, names of their surfaces.

use super::*;

#[test]
fn a_scene_of_bricks_has_no_other_body() {
    let brick = "brick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }";
    let sphere = ONE.replace(brick, "sphere = { inner = 1, outer = 2, cells = [1, 1] }").replace("zmin", "z0");
    let sphere = sphere.replace("cells = [2, 2, 2]", "method = \"metis\"");
    assert!(one(&[]).unwrap().is_of_bricks());
    assert!(!Scene::from_text(&sphere, "one.toml", 1, &[]).unwrap().is_of_bricks());
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
    let plain =
        Gmsh { file: "part.msh".into(), volume: None, scale: 1.0, rotate: None, translate: [0.0; 3], faceted: false };
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
