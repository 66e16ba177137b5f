//! The limits of the theory as users meet them: warnings in log and summary, and none where there is nothing to say.

use crate::common::fields::Fields;
use crate::common::{COARSE, check, scene_file, solve, solve_tightly};

fn warnings(summary: &serde_json::Value) -> Vec<String> {
    serde_json::from_value(summary["warnings"].clone()).unwrap()
}

/// Two cubes on each other, of other meshes, free to expand, pressed so that they are strained by a millionth.
fn cubes(origin: f64, element: &str) -> String {
    let mut text = String::from("material.soft = { young = 1000.0, poisson = 0.3 }\n");
    for (body, z, cells) in [("lower", 0.0, 3), ("upper", 1.0, 4)] {
        text += &format!(
            "[body.{body}]\nmaterial = \"soft\"\nelement = \"{element}\"\n\
             brick = {{ origin = [{origin:?}, {origin:?}, {:?}], size = [1.0, 1.0, 1.0], cells = [{cells}, {cells}, 2] }}\n",
            origin + z
        );
        for (face, axis) in [("xmin", "x"), ("ymin", "y")] {
            text += &format!("[support.{body}-{axis}]\nsurface = \"{body}.{face}\"\nfix = [\"{axis}\"]\n");
        }
    }
    text + "[support.ground]\nsurface = \"lower.zmin\"\nfix = [\"z\"]\n\
            [load.top]\nsurface = \"upper.zmax\"\npressure = 1e-3\n\
            [contact.joint]\nsurfaces = [\"lower.zmax\", \"upper.zmin\"]\n[decomposition]\nsubdomains = 4\n"
}

#[test]
fn pressures_do_not_depend_on_where_the_scene_is() {
    let directory = tempfile::tempdir().unwrap();
    for element in ["tet4", "hex8", "tet10"] {
        for origin in [0.0, 1e3, 5e7, -1e9] {
            let file = scene_file(directory.path(), &cubes(origin, element));
            let run = solve_tightly(1, &file, &[]);
            let fields = Fields::read(&run.result());
            let (pressure, status) =
                (fields.of_points("contact_pressure"), fields.integers_of_points("contact_status"));
            for (pressure, _) in pressure.iter().zip(status).filter(|(_, status)| *status >= 0) {
                assert!((pressure / 1e-3 - 1.0).abs() < 1e-5, "{element} at {origin}: {pressure}");
            }
        }
    }
}

#[test]
fn what_is_beyond_the_theory_is_told_in_log_and_summary_on_any_ranks() {
    let sets = ["body.upper.brick.origin.2=500", "support.top.displacement.2=-1200"];
    let mut seen: Vec<Vec<String>> = Vec::new();
    for ranks in [1, 2] {
        let run = solve(ranks, "patch", &sets);
        seen.push(warnings(&run.summary()));
        for part in ["overlap by 500 near", "the strain of body", "the displacement, in its sizes, of body"] {
            assert!(seen[0].iter().any(|text| text.contains(part)), "{part}: {seen:?}");
        }
        assert!(seen[0].iter().all(|text| run.stdout.contains(text)), "{}", run.stdout);
    }
    assert_eq!(seen[0], seen[1]);
    assert!(warnings(&check(1, "patch", 1, &sets[..1]).summary())[0].contains("overlap by 500"));
}

#[test]
fn small_strains_are_not_told() {
    for (scene, sets) in [("bar", &[][..]), ("shear", &[]), ("patch", &[]), ("two-blocks", &COARSE)] {
        let found = warnings(&solve(1, scene, sets).converged().summary());
        assert!(found.is_empty(), "{scene}: {found:?}");
    }
    let hertz = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hertz.toml");
    assert_eq!(warnings(&check(1, hertz, 1, &[]).summary()), Vec::<String>::new());
}

/// Press fit of two cylinders whose facets do not match, unless their number is the same.
#[test]
fn facets_that_do_not_resolve_a_press_fit_ask_for_a_clearance() {
    let told = |cells: [usize; 2], element: &str, keys: &str| {
        let mut text = String::from("material.soft = { young = 1000.0, poisson = 0.3 }\n");
        for (body, inner, cells) in [("hub", 1.0, cells[0]), ("ring", 2.0, cells[1])] {
            text += &format!(
                "[body.{body}]\nmaterial = \"soft\"\nelement = \"{element}\"\n\
                 cylinder = {{ inner = {inner:?}, outer = {:?}, height = 0.5, cells = [{cells}, 2, 2] }}\n",
                inner + 1.0
            );
            for (face, axis) in [("x0", "x"), ("y0", "y"), ("bottom", "z")] {
                text += &format!("[support.{body}-{axis}]\nsurface = \"{body}.{face}\"\nfix = [\"{axis}\"]\n");
            }
        }
        text += &format!("[contact.fit]\nsurfaces = [\"hub.outer\", \"ring.inner\"]\n{keys}\n");
        let directory = tempfile::tempdir().unwrap();
        warnings(&check(1, &scene_file(directory.path(), &text), 1, &[]).summary())
    };
    for (cells, element, keys) in
        [([8, 10], "tet4", "gap = -0.005"), ([30, 37], "hex8", "gap = -0.005"), ([9, 5], "tet4", "")]
    {
        let found = told(cells, element, keys);
        assert!(found.len() == 1 && found[0].contains("as in clearance = "), "{cells:?} {found:?}");
    }
    for (cells, element, keys) in [
        ([8, 10], "tet4", "clearance = -0.005"),
        ([8, 8], "tet4", "gap = -0.005"),
        ([8, 10], "tet10", "gap = -0.005"),
        ([30, 37], "tet4", "gap = -0.1"),
    ] {
        assert_eq!(told(cells, element, keys), Vec::<String>::new(), "{cells:?} {element} {keys}");
    }
}
