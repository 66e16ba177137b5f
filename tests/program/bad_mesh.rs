//! A corpus of bad mesh files and scenes with them: each ends with one message that says what is wrong and how to mend
//! it, on every rank, and earlier results stay as they were.

use std::fs;
use std::path::Path;

use crate::common::msh::{Form, write, write_glued};
use crate::common::{assert_program_refuses, assert_refused, assert_scene_refused, run_briefly, scene_file};
use fetiplast::mesh::Brick;
use tempfile::TempDir;

const BAD: i32 = 65;
const INPUT_OUTPUT: i32 = 74;

const LOWER: Brick = Brick { origin: [0.0; 3], size: [2.0, 2.0, 1.0], cells: [2, 2, 1] };
const UPPER: Brick = Brick { origin: [0.0, 0.0, 1.0], ..LOWER };

/// Nodes of the mesh: those of the lower body, then those of the upper one.
const NODES: usize = 36;
/// Triangles on all faces, and tetrahedra.
const ELEMENTS: usize = 64 + 48;

pub const SCENE: &str = r#"
[material.steel]
young = 210000.0
poisson = 0.3
[body.below]
material = "steel"
element = "tet4"
gmsh = { file = "two.msh", volume = "lower" }
[body.above]
material = "steel"
element = "tet4"
gmsh = { file = "two.msh", volume = "upper" }
[support.base]
surface = "below.zmin"
fix = ["x", "y", "z"]
[support.side]
surface = "above.xmin"
fix = ["x", "y"]
[support.back]
surface = "above.ymin"
fix = ["x"]
[load.press]
surface = "above.zmax"
traction = [0.0, 0.0, -1.0]
[contact.joint]
slave = "above.zmin"
master = "below.zmax"
"#;

pub fn bytes(form: Form) -> Vec<u8> {
    write(&[("lower", LOWER), ("upper", UPPER)], form)
}

fn text(form: Form) -> String {
    String::from_utf8(bytes(form)).unwrap()
}

/// Whether this line of version 2.2 is a tetrahedron.
fn is_tet(line: &str) -> bool {
    line.split(' ').nth(1) == Some("4") && line.split(' ').count() > 8
}

/// The mesh as text with the first `from` replaced.
#[track_caller]
fn changed(from: &str, to: &str) -> String {
    let text = text(Form::Text41);
    assert!(text.contains(from), "`{from}` is not in the mesh");
    text.replacen(from, to, 1)
}

/// A directory with this mesh, and the file of the scene there.
fn files(scene: &str, mesh: &[u8]) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("two.msh"), mesh).unwrap();
    let file = scene_file(directory.path(), scene);
    (directory, file)
}

#[track_caller]
fn refused(scene: &str, mesh: &[u8], sets: &[&str], code: i32, parts: &[&str]) {
    let (_directory, file) = files(scene, mesh);
    assert_scene_refused(&file, sets, code, parts);
}

/// The scene is refused with this mesh.
#[track_caller]
fn mesh_refused(mesh: impl AsRef<[u8]>, parts: &[&str]) {
    refused(SCENE, mesh.as_ref(), &[], BAD, &[&["two.msh"], parts].concat());
}

/// The mesh is fine, but the scene is not with these overrides.
#[track_caller]
fn scene_refused(sets: &[&str], parts: &[&str]) {
    refused(SCENE, &bytes(Form::Binary41), sets, BAD, parts);
}

#[test]
fn the_scene_itself_is_sound() {
    let directory = tempfile::tempdir().unwrap();
    for form in [Form::Text41, Form::Binary22] {
        fs::write(directory.path().join("two.msh"), bytes(form)).unwrap();
        let run = crate::common::solve(2, &scene_file(directory.path(), SCENE), &[]).converged();
        assert_eq!((run.summary()["nodes"].as_u64(), run.summary()["elements"].as_u64()), (Some(36), Some(48)));
    }
}

#[test]
fn files_that_cannot_be_read_are_an_input_error() {
    let scene = SCENE.replace("file = \"two.msh\"", "file = \"three.msh\"");
    let (_directory, file) = files(&scene, b"");
    assert_program_refuses(&file, &[], INPUT_OUTPUT, &["three.msh", "No such file"]);
    let scene = SCENE.replace("file = \"two.msh\"", "file = \"/\"");
    refused(&scene, b"", &[], INPUT_OUTPUT, &["cannot read the mesh file", "directory"]);
}

#[test]
fn other_files_and_formats_are_told() {
    let (_directory, file) = files(SCENE, b"");
    assert_program_refuses(&file, &[], BAD, &["two.msh", "not a Gmsh mesh", "gmsh -3"]);
    mesh_refused("SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 1, 1};\n", &["not a Gmsh mesh", "$MeshFormat"]);
    mesh_refused([0, 159, 146, 150, 255], &["not a Gmsh mesh"]);
    mesh_refused(changed("4.1 0 8", "4 0 8"), &["MSH version 4 ", "Mesh.MshFileVersion = 4.1;"]);
    mesh_refused(changed("4.1 0 8", "4.1 0 4"), &["8 bytes", "Mesh.Binary = 0;"]);
    let mut swapped = bytes(Form::Binary41);
    let one = swapped.windows(4).position(|w| w == 1_i32.to_ne_bytes()).unwrap();
    swapped[one..one + 4].reverse();
    mesh_refused(swapped, &["byte order", "Mesh.Binary = 0;"]);
    mesh_refused(changed("$Nodes", "$PartitionedEntities\n2\n$Nodes"), &["partitioned", "UnpartitionMesh"]);
}

#[test]
fn files_that_are_cut_short_say_where() {
    // Every length of every form is tried where files are parsed.
    for form in [Form::Text41, Form::Binary22] {
        let whole = bytes(form);
        let end = |name: &[u8]| whole.windows(name.len()).position(|w| w == name).unwrap();
        mesh_refused(&whole[..end(b"$EndNodes") - 20], &["ends inside $Nodes", "of 36 nodes", "save it again"]);
        mesh_refused(&whole[..end(b"$EndElements") - 20], &["ends inside $Elements", "of 112 elements"]);
        mesh_refused(&whole[..end(b"$Elements")], &["no section $Elements"]);
    }
}

#[test]
fn counts_that_do_not_fit_are_refused() {
    let counts = format!("1 {NODES} 1 {NODES}");
    mesh_refused(changed(&counts, "1 1000000000000000000 1 1"), &["1000000000000000000 nodes", "can hold"]);
    mesh_refused(changed(&counts, "1 37 1 37"), &["announces 37 nodes but has 36"]);
    let counts = format!("14 {ELEMENTS} 1 {ELEMENTS}");
    mesh_refused(changed(&counts, "14 113 1 113"), &["announces 113 elements but has 112"]);
    mesh_refused(changed(&counts, "14 111 1 111"), &["announces 111 elements but has 112"]);
}

#[test]
fn what_does_not_fit_the_format_has_its_line() {
    mesh_refused(changed("2.0 2.0 2.0 ", "2.0 two 2.0 "), &["line ", "expected y", "`two`"]);
    mesh_refused(changed("3 1 \"lower\"", "3 1 lower"), &["line 12:", "quotation marks"]);
    mesh_refused(changed("$EndNodes", "$EndNods"), &["$EndNodes", "`$EndNods`"]);
    mesh_refused(changed("$Elements", "$Elemants"), &["line ", "section $Elemants has no end"]);
}

#[test]
fn nodes_that_are_missing_twice_or_nowhere_are_named() {
    mesh_refused(changed("2.0 2.0 2.0 ", "2.0 inf 2.0 "), &["node 36", "not a finite number"]);
    mesh_refused(changed("\n35 \n36 \n", "\n35 \n35 \n"), &["node 35 is there twice"]);
    mesh_refused(changed("\n35 \n36 \n", "\n35 \n37 \n"), &["triangle", "node 36", "not in $Nodes"]);
}

#[test]
fn volumes_that_are_not_named_are_told_with_the_line_that_names_them() {
    // Volume 2 is in physical group 2.
    let entity = "2 0.0 0.0 0.0 0.0 0.0 0.0 1 2 0 \n$EndEntities";
    let untagged = changed(entity, "2 0.0 0.0 0.0 0.0 0.0 0.0 0 0 \n$EndEntities");
    mesh_refused(untagged, &["24 of 48 volume cells", "Physical Volume(\"NAME\") = {2};", "Mesh.SaveAll = 0;"]);
    let scene = ["body.above.gmsh.volume=top"];
    let known = "`lower` (24 cells), `upper` (24 cells)";
    scene_refused(&scene, &["body.above: ", "`top`", known, "Physical Volume(\"top\") = {1};"]);
    let none = SCENE.replacen(", volume = \"upper\"", "", 1);
    refused(&none, &bytes(Form::Binary41), &[], BAD, &["2 physical volumes", "gmsh.volume", known]);
    // Triangles only.
    let tets = text(Form::Text22).lines().filter(|l| is_tet(l)).count();
    assert_eq!(tets, 48);
    let flat: Vec<String> = text(Form::Text22).lines().filter(|l| !is_tet(l)).map(str::to_owned).collect();
    mesh_refused(flat.join("\n").replace("$Elements\n112", "$Elements\n64") + "\n", &["no volume cells", "gmsh -3"]);
}

/// A body of both volumes in place of the lower one.
#[test]
fn volumes_that_make_no_body_and_materials_that_fit_none_are_refused() {
    let scene = ["body.below.gmsh.volume=[\"lower\", \"upper\"]"];
    let torn = ["body.below: ", "two.msh", "volumes `lower` and `upper`", "18 nodes coincide", "BooleanFragments"];
    scene_refused(&scene, &torn);
    let known = "`lower` (24 cells), `upper` (24 cells)";
    scene_refused(&["body.below.gmsh.volume=[\"lower\", \"core\"]"], &["body.below: ", "`core`", known]);
    let materials = |table: &str| format!("body.below.material={table}");
    let missing = [scene[0], &materials("{ lower = \"steel\" }")];
    scene_refused(&missing, &["body.below.material", "no material for volume `upper`"]);
    let stranger = [scene[0], &materials("{ lower = \"steel\", uper = \"steel\" }")];
    scene_refused(&stranger, &["body.below.material.uper", "no such volume", "lower, upper"]);
}

/// A body of both volumes, whose meshes meet in part only.
#[test]
fn meshes_that_only_look_whole_are_refused() {
    const PART: &str = r#"
        [material.steel]
        young = 210000.0
        poisson = 0.3
        [body.part]
        material = "steel"
        element = "tet4"
        gmsh = { file = "two.msh", volume = ["lower", "upper"] }
        [support.base]
        surface = "part.ymin"
        fix = ["x", "y", "z"]
        "#;
    let part_refused = |upper: Brick, glued: fn([f64; 3]) -> bool, parts: &[&str]| {
        let mesh = write_glued(&[("lower", LOWER), ("upper", upper)], Form::Binary41, glued);
        let of_both = ["body.part: ", "two.msh: volumes `lower` and `upper`, first near ("];
        refused(PART, &mesh, &[], BAD, &[&of_both, parts].concat());
    };
    part_refused(UPPER, |x| x[0] < 1.5, &["(2.000000, ", "torn", "6 nodes coincide with others", "`Coherence;`"]);
    let fine = Brick { cells: [4, 4, 2], ..UPPER };
    part_refused(fine, |_| true, &["torn", "16 nodes hang in faces or on edges", "with a contact"]);
    let beside = Brick { origin: [2.0, 0.0, 1.0], ..LOWER };
    part_refused(beside, |_| true, &["3 nodes alone join parts that have no face in common"]);
    let within = Brick { origin: [0.3; 3], size: [0.4; 3], cells: [1; 3] };
    part_refused(within, |_| false, &["1 pieces lie inside of others", "BooleanDifference"]);
}

#[test]
fn hexahedra_with_a_node_twice_are_refused() {
    let text = text(Form::Text22).replacen("$Elements\n112\n", "$Elements\n113\n113 5 2 1 1 1 2 5 4 10 11 14 14 \n", 1);
    let parts =
        ["body.below: ", "`lower`: 1 cells have a node twice", "hexahedron near (1.000000, 1.000000, 1.000000)"];
    mesh_refused(text, &parts);
}

#[test]
fn surfaces_that_are_not_there_are_told_from_those_that_are() {
    let parts = ["body.above: ", "`top`", "`zmax` (16 triangles", "Physical Surface(\"top\") = {1};"];
    scene_refused(&["load.press.surface=above.top"], &parts);
    // The face between the bodies is in a group of its own, on the side of the lower one only.
    let mesh =
        changed("2 6 \"zmax\"", "2 6 \"zmax\"\n2 7 \"joint\"").replacen("$PhysicalNames\n8", "$PhysicalNames\n9", 1);
    let mesh = mesh.replacen("6 0.0 0.0 0.0 0.0 0.0 0.0 1 6 0", "6 0.0 0.0 0.0 0.0 0.0 0.0 1 7 0", 1);
    let sets = ["contact.joint.master=below.joint", "load.press.surface=above.joint"];
    let parts = ["body.above: ", "`joint` (8 in all)", "boundary of volume `upper`", "`zmax` (8 triangles)"];
    refused(SCENE, mesh.as_bytes(), &sets, BAD, &parts);
}

#[test]
fn elements_that_cannot_be_computed_with_are_counted() {
    let text = text(Form::Text22);
    let first = text.lines().find(|l| is_tet(l)).unwrap();
    let words: Vec<&str> = first.split(' ').collect();
    let with = |line: String| text.replacen(&format!("\n{first}\n"), &format!("\n{line}\n"), 1);
    let nodes = |order: [usize; 4]| order.map(|k| words[5 + k]).join(" ");
    let head = words[..5].join(" ");
    mesh_refused(
        with(format!("{head} {}", nodes([1, 0, 2, 3]))),
        &["`lower`", "1 of 24", "inverted", "Mesh.Optimize = 1;"],
    );
    let twice = ["`lower`", "1 cells have a node twice", "a tetrahedron near ("];
    mesh_refused(with(format!("{head} {}", nodes([0, 0, 2, 3]))), &twice);
    let second = head.replacen(" 4 ", " 11 ", 1);
    let ten = [nodes([0, 1, 2, 3]), nodes([0, 1, 2, 3]), nodes([0, 1, 2, 3])].join(" ");
    let ten = ten.split(' ').take(10).collect::<Vec<_>>().join(" ");
    mesh_refused(with(format!("{second} {ten}")), &["1 10-node tetrahedron", "Mesh.ElementOrder = 1;"]);
    mesh_refused(with(format!("{} {ten}", head.replacen(" 4 ", " 77 ", 1))), &["line ", "type 77"]);
    let twice = text.replacen(&format!("\n{first}\n"), &format!("\n{first}\n{first}\n"), 1);
    let twice = twice.replacen("$Elements\n112", "$Elements\n113", 1);
    mesh_refused(twice, &["4 faces", "overlap", "Coherence Mesh;"]);
}

#[test]
fn what_the_scene_wants_of_a_mesh_must_be_possible() {
    scene_refused(&["decomposition.cells=[1, 1, 1]"], &["decomposition.cells", "body above is no brick", "metis"]);
    scene_refused(&["decomposition.subdomains=49"], &["decomposition.subdomains = 49", "only 48 elements"]);
    scene_refused(&["body.below.gmsh.translate=[1e30, 0, 0]"], &["body.below", "gmsh.translate", "without volume"]);
    scene_refused(&["body.below.gmsh.scale=0"], &["body.below.gmsh.scale = 0.0", "positive"]);
    scene_refused(&["body.below.gmsh.turn=3"], &["unknown key `turn`", "rotate"]);
    scene_refused(&["body.above.gmsh.translate=[100, 0, 0]"], &["contact.joint", "opposite"]);
    let (_directory, file) = files(SCENE, &bytes(Form::Binary41));
    let conflict = "support.side.displacement=[0.5, 0, 0]";
    assert_program_refuses(&file, &[conflict], BAD, &["back", "side", "along x", "0.5"]);
}

#[test]
fn bodies_that_nothing_holds_are_named_with_their_free_motions() {
    let (scene, _) = SCENE.split_once("[contact.joint]").unwrap();
    let parts = ["body.above", "against translation along z:", "add supports"];
    refused(scene, &bytes(Form::Text22), &[], BAD, &parts);
}

#[test]
fn levels_are_for_bricks() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("two.msh"), bytes(Form::Text41)).unwrap();
    let scene = scene_file(directory.path(), SCENE);
    for ranks in [1, 2] {
        let parts = ["level 2", "body above", "gmsh -refine"];
        assert_refused(&run_briefly(ranks, &["check", &scene, "--level", "2"]), BAD, &parts);
    }
    assert!(Path::new(&scene).exists());
}
