//! Counts against problems that were built.

use super::{Counted, contacts, local};
use crate::comm::solo::Solo;
use crate::decomposition::{Bodies, Shape, Subdomain, number_bodies};
use crate::element::Kind;
use crate::feti::inverse::factor::Symbolic;
use crate::mesh::Brick;
use crate::model;
use crate::model::discrete::Discrete;
use crate::random::Random;
use crate::record::counts::Sizes;
use crate::scene::Scene;
use crate::sizing;

const ELEMENTS: [&str; 3] = ["tet4", "hex8", "tet10"];
const FACES: [&str; 6] = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];

fn scene(text: &str) -> Scene {
    Scene::from_text(text, "test", 1, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Counted sizes, and those of the built problem with its rows of contact.
fn both(scene: &Scene) -> (Sizes, Sizes, Discrete) {
    let discrete = model::discretise(scene, &Solo).unwrap_or_else(|error| panic!("{error}\n{}", scene.to_toml()));
    let counted = Counted::new(scene).expect("bodies are structured");
    (counted.sizes(), sizing::sizes(&discrete, &Solo), discrete)
}

/// A whole number in `low..=high`.
fn pick(random: &mut Random, low: usize, high: usize) -> usize {
    low + ((0.5 * random.number() + 0.5) * (high - low + 1) as f64) as usize
}

/// Two bricks whose cells meet, one above the other along some axis, held here and there, one of them at a rigid plane.
fn random_scene(random: &mut Random) -> String {
    let axis = pick(random, 0, 2);
    let element = ELEMENTS[pick(random, 0, 2)];
    let boxes = [0; 3].map(|_| pick(random, 1, 2));
    let width = [0.5, 0.7, 1.1];
    let cells = [[0; 3]; 2].map(|zeros| zeros.map(|_| pick(random, 1, 3)));
    let cells = cells.map(|cells| [0, 1, 2].map(|a| boxes[a] * cells[a]));
    let mut origin = [0.0; 3];
    for a in 0..3 {
        // In common is a cell at least.
        let shift = pick(random, 0, cells[0][a] + cells[1][a] - 2) as f64 - (cells[1][a] as f64 - 1.0);
        origin[a] = if a == axis { width[a] * cells[0][a] as f64 } else { width[a] * shift };
    }
    let mut text = String::from("[material.m]\nyoung = 100.0\npoisson = 0.3\n");
    for (name, origin, cells) in [("low", [0.0; 3], cells[0]), ("high", origin, cells[1])] {
        let size = [0, 1, 2].map(|a| width[a] * cells[a] as f64);
        text += &format!(
            "[body.{name}]\nmaterial = \"m\"\nelement = \"{element}\"\nbrick = {{ origin = {origin:?}, size = {size:?}, \
             cells = {cells:?} }}\n"
        );
    }
    for k in 0..pick(random, 1, 4) {
        let body = ["low", "high"][pick(random, 0, 1)];
        let (face, fix) = (FACES[pick(random, 0, 5)], ["'x'", "'y'", "'z'", "'x', 'z'"][pick(random, 0, 3)]);
        text += &format!("[support.s{k}]\nsurface = \"{body}.{face}\"\nfix = [{fix}]\n");
    }
    let [upper, lower] = [FACES[2 * axis], FACES[2 * axis + 1]];
    text += &match pick(random, 0, 2) {
        0 => format!("[contact.c]\nslave = \"high.{upper}\"\nmaster = \"low.{lower}\"\n"),
        1 => format!("[contact.c]\nslave = \"low.{lower}\"\nmaster = \"high.{upper}\"\n"),
        _ => format!("[contact.c]\nsurfaces = [\"low.{lower}\", \"high.{upper}\"]\n"),
    };
    let beside = FACES[2 * ((axis + 1) % 3)];
    let mut normal = [0.3, 0.0, 0.2];
    normal[(axis + 1) % 3] = 1.0;
    text += &format!(
        "[contact.wall]\nslave = \"low.{beside}\"\nrigid = {{ plane = {{ point = [-9.0, -9.0, -9.0], normal = {normal:?} }} }}\n"
    );
    let cluster = pick(random, 1, 4);
    text + &format!("[decomposition]\ncells = {boxes:?}\ncluster = {cluster}\n")
}

#[test]
fn bricks_in_boxes_are_counted_exactly() {
    let mut random = Random::new(7);
    for _ in 0..120 {
        let text = random_scene(&mut random);
        let scene = scene(&text);
        let (mut counted, built, discrete) = both(&scene);
        assert!(counted.estimated.is_empty());
        for (contact, row) in scene.contact.values().zip(&discrete.contacts.rows) {
            let found =
                contacts::count(&scene, contact).unwrap_or_else(|| panic!("{} is not counted\n{text}", row.name));
            assert_eq!((found.rule, found.all), (&row.rule[..], row.conditions), "{}\n{text}", row.name);
            counted.contact_rows += found.rows;
        }
        counted.dual_dofs += counted.contact_rows;
        assert_eq!(counted, built, "{text}");
    }
}

#[test]
fn meshes_that_do_not_meet_are_not_counted() {
    let text = random_scene(&mut Random::new(3));
    for (key, value) in [("body.high.brick.size", "[7.1, 7.3, 7.7]"), ("body.high.element", "'tet4'")] {
        let sets = [format!("{key}={value}"), "body.low.element='hex8'".to_owned()];
        let scene = Scene::from_text(&text, "test", 1, &sets).unwrap();
        assert_eq!(contacts::count(&scene, &scene.contact["c"]), None, "{key}");
    }
}

#[test]
fn nodes_and_supports_of_curved_bodies_are_counted_exactly() {
    let bodies = [
        ("sphere = { inner = 1.0, outer = 2.0, cells = [2, 3] }", &["inner", "outer", "x0", "y0", "z0"][..]),
        ("cylinder = { inner = 1.0, outer = 2.0, height = 1.0, cells = [4, 3, 2] }", &["outer", "x0", "y0", "bottom"]),
        ("grid = { x = [0.0, 1.0, 3.0], y = [0.0, 1.0], z = [0.0, 2.0, 3.0, 4.5] }", &["xmin", "xmax", "zmin"]),
    ];
    for element in ELEMENTS {
        for (shape, surfaces) in bodies {
            let mut text = format!(
                "[material.m]\nyoung = 1.0\npoisson = 0.3\n[body.b]\nmaterial = \"m\"\nelement = \"{element}\"\n{shape}\n"
            );
            for (k, surface) in surfaces.iter().enumerate() {
                let fix = ["'x'", "'x', 'y'", "'y', 'z'", "'x', 'y', 'z'"][k % 4];
                text += &format!("[support.s{k}]\nsurface = \"b.{surface}\"\nfix = [{fix}]\n");
            }
            let scene = scene(&text);
            let (counted, built, _) = both(&scene);
            for (found, expected) in [
                (counted.nodes, built.nodes),
                (counted.cells, built.cells),
                (counted.elements, built.elements),
                (counted.dirichlet_rows, built.dirichlet_rows),
            ] {
                assert_eq!(found, expected, "{text}");
            }
        }
    }
}

const BLOCKS: &str = "two-blocks";

fn blocks(level: usize, element: &str, sets: &[&str]) -> Scene {
    let elements = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
    let sets: Vec<String> = elements.into_iter().chain(sets.iter().map(|set| set.to_string())).collect();
    Scene::load(BLOCKS, level, &sets).unwrap()
}

fn memory_of(scene: &Scene) -> [f64; 2] {
    let discrete = model::discretise(scene, &Solo).unwrap();
    let (counted, built) = (Counted::new(scene).unwrap().memory(), sizing::memory(scene, &discrete, &Solo));
    [counted.total_mb(1), built.total_mb(1)]
}

#[test]
fn memory_from_counts_is_that_of_the_built_problem() {
    for (level, element, sets, tolerance) in [
        (1, "tet4", &[][..], 0.03),
        (1, "hex8", &["decomposition.cells=[5, 5, 5]"], 0.03),
        (1, "tet10", &["decomposition.cells=[5, 5, 5]"], 0.03),
        (2, "tet4", &["decomposition.cells=[20, 20, 20]"], 0.2),
        (2, "hex8", &["decomposition.cells=[4, 4, 4]"], 0.05),
        (1, "tet4", &["decomposition.subdomains=24"], 0.2),
        (2, "tet4", &["decomposition.subdomains=48"], 0.2),
        (2, "hex8", &["decomposition.subdomains=24"], 0.2),
        (1, "tet10", &["decomposition.subdomains=48"], 0.2),
    ] {
        let [counted, built] = memory_of(&blocks(level, element, sets));
        assert!((counted / built - 1.0).abs() < tolerance, "{element} {sets:?}: {counted} MiB instead of {built}");
    }
}

#[test]
fn what_is_cut_into_parts_is_estimated() {
    for (level, element, parts) in
        [(1, "tet4", 12), (1, "tet4", 48), (2, "tet4", 48), (2, "hex8", 96), (1, "tet10", 24)]
    {
        let set = format!("decomposition.subdomains={parts}");
        let (counted, built, _) = both(&blocks(level, element, &[&set]));
        for (what, found, expected, tolerance) in [
            ("subdomains", counted.subdomains, built.subdomains, 0.1),
            ("gluing", counted.gluing_rows, built.gluing_rows, 0.15),
            ("primal", counted.primal_dofs, built.primal_dofs, 0.1),
            ("contact", counted.contact_subdomains, built.contact_subdomains, 0.5),
        ] {
            let ratio = found as f64 / expected as f64;
            assert!((ratio - 1.0).abs() < tolerance, "{element} {parts} {what}: {found} instead of {expected}");
            assert!(counted.estimated.iter().any(|key| key == "gluing_rows"));
        }
        assert_eq!((counted.nodes, counted.dirichlet_rows), (built.nodes, built.dirichlet_rows));
    }
}

#[test]
fn factors_of_large_boxes_follow_from_small_ones() {
    for (kind, cells) in [(Kind::Tet4, [16, 16, 16]), (Kind::Hex8, [30, 15, 15]), (Kind::Tet10, [8, 8, 8])] {
        let brick = Brick { origin: [0.0; 3], size: cells.map(|n| n as f64), cells };
        let bodies = number_bodies([(kind, Shape::Brick(brick), vec![0])]);
        let all = Bodies { bodies: &bodies, surfaces: &[] };
        let elements: Vec<u64> = (0..bodies[0].counts().elements).collect();
        let symbolic = Symbolic::new(&Subdomain::of_brick(0, &all, 0, &elements));
        let found = local::of_box(kind, cells);
        let ratio = found.factor / symbolic.analysis().factor_length() as f64;
        assert!((0.75..1.35).contains(&ratio), "{kind:?} {cells:?}: {ratio}");
        let ratio = found.matrix / symbolic.pattern.rows.len() as f64;
        assert!((0.9..1.1).contains(&ratio), "{kind:?} {cells:?}: {ratio}");
    }
}

#[test]
fn scenes_of_any_size_are_counted() {
    let huge = ["body.lower.brick.cells=[10000, 10000, 100000]", "body.upper.brick.cells=[1000000000, 1, 1]"];
    for (element, cells) in [("tet4", "[1, 1, 1]"), ("tet10", "[10000, 1, 1]"), ("hex8", "[10, 1, 1]")] {
        let cells = format!("decomposition.cells={cells}");
        let counted = blocks(1, element, &[&huge[..], &[&cells]].concat());
        let counted = Counted::new(&counted).unwrap();
        let sizes = counted.sizes();
        assert_eq!(sizes.cells, 10_001_000_000_000);
        assert_eq!(sizes.gluing_rows, sizes.primal_dofs - 3 * sizes.nodes);
        assert!(counted.memory().total_mb(1) > 1e9);
    }
}
