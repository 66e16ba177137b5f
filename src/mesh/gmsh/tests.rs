//! Files that Gmsh wrote (tests/meshes/make.py), and what becomes of them when they are damaged.

use super::*;
use crate::comm::solo::Solo;
use crate::decomposition::{BodyMesh, Shape, number_bodies};
use crate::element::tet4::Tet4;
use crate::element::{Element, Kind};
use crate::mesh::brick::indices;
use crate::mesh::surface::area_vector;
use crate::mesh::{Brick, Face, SolidMesh};

const TEXT: &[u8] = include_bytes!("../../../tests/meshes/tets-41.msh");
const BINARY: &[u8] = include_bytes!("../../../tests/meshes/tets-41-binary.msh");
const TEXT_2: &[u8] = include_bytes!("../../../tests/meshes/tets-22.msh");
const BINARY_2: &[u8] = include_bytes!("../../../tests/meshes/tets-22-binary.msh");
const PARAMETRIC: &[u8] = include_bytes!("../../../tests/meshes/tets-41-parametric.msh");
const HEXAHEDRA: &[u8] = include_bytes!("../../../tests/meshes/hexes-and-prisms.msh");

fn parse(bytes: &[u8]) -> Result<Msh, Problem> {
    Msh::parse(bytes, bytes.len() as u64)
}

fn volume(mesh: &SolidMesh) -> f64 {
    let place = |tet: &[u32; 4]| tet.map(|n| mesh.portion.points[n as usize]);
    mesh.portion.elements.of().iter().map(|tet| Tet4::points(&place(tet))[0].weight).sum()
}

/// Area times normal of a surface, and the number of its triangles.
fn area(mesh: &SolidMesh, surface: usize) -> ([f64; 3], usize) {
    let faces = &mesh.surfaces[surface].faces;
    let place = |face: &Vec<u32>| std::array::from_fn(|k| mesh.portion.points[face[k] as usize]);
    let vectors = faces.iter().map(|face| area_vector(&place(face)));
    (vectors.fold([0.0; 3], |sum, v| std::array::from_fn(|a| sum[a] + v[a])), faces.len())
}

#[track_caller]
fn assert_area(found: ([f64; 3], usize), area: [f64; 3], triangles: usize) {
    assert!(found.0.iter().zip(area).all(|(a, b)| (a - b).abs() < 1e-13), "{found:?}");
    assert_eq!(found.1, triangles);
}

/// Equal but for the last digit of coordinates.
#[track_caller]
fn assert_same(found: &[SolidMesh], expected: &[SolidMesh]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((&found.portion.elements, &found.surfaces) == (&expected.portion.elements, &expected.surfaces));
        let pairs = found.portion.points.as_flattened().iter().zip(expected.portion.points.as_flattened());
        assert!(
            found.portion.points.len() == expected.portion.points.len()
                && pairs.fold(0.0_f64, |d, (a, b)| d.max((a - b).abs())) < 1e-15
        );
    }
}

#[test]
fn every_format_gives_the_same_bodies() {
    let of = |bytes: &[u8]| {
        let msh = parse(bytes).unwrap();
        let block = msh.body(&Solo, &["block"], &["base", "both sides", "top"], Kind::Tet4).unwrap();
        (block, msh.body(&Solo, &["the rod"], &["both sides", "9"], Kind::Tet4).unwrap())
    };
    let (block, rod) = of(TEXT);
    assert_eq!((block.counts.cells, rod.counts.cells, rod.portion.len()), (90, 42, 42));
    assert!((volume(&block) - 2.0).abs() < 1e-13 && (volume(&rod) - 0.25).abs() < 1e-13);
    assert_area(area(&block, 0), [0.0, 0.0, -2.0], 14);
    assert_area(area(&block, 1), [0.0, 0.0, 2.0], 14);
    assert_area(area(&block, 2), [0.0, 0.0, 2.0], 14);
    assert_area(area(&rod, 0), [0.0, 0.0, -0.25], 4);
    assert_area(area(&rod, 1), [0.0, 0.0, 0.25], 4);
    // Text has 16 digits.
    assert_same(&[of(BINARY).0, of(BINARY).1], &[block, rod]);
    assert_eq!(of(PARAMETRIC), of(BINARY));
    // Version 2 orders nodes and cells in its own way.
    let (block_2, rod_2) = of(TEXT_2);
    assert_same(&[of(BINARY_2).0, of(BINARY_2).1], &[block_2.clone(), rod_2.clone()]);
    assert_eq!((block_2.portion.len(), rod_2.portion.len()), (90, 42));
    assert!((volume(&block_2) - 2.0).abs() < 1e-13);
    assert_area(area(&block_2, 1), [0.0, 0.0, 2.0], 14);
}

#[test]
fn hexahedra_and_prisms_are_split_alike_on_both_sides_of_their_faces() {
    let mesh = parse(HEXAHEDRA).unwrap().body(&Solo, &[], &["base", "top"], Kind::Tet4).unwrap();
    assert_eq!((mesh.counts.cells, mesh.portion.elements.len()), (81, 27 * 6 + 54 * 3));
    assert!((volume(&mesh) - 2.0).abs() < 1e-13);
    assert_area(area(&mesh, 0), [0.0, 0.0, -2.0], 18 + 18);
    assert_area(area(&mesh, 1), [0.0, 0.0, 2.0], 18 + 18);
    let outer = crate::mesh::faces::Neighbours::new(mesh.portion.points.len(), &mesh.portion.elements)
        .outer(&mesh.portion.elements)
        .count();
    // Quadrangles: 9 at the end of the hexahedra, 9 at that of the prisms, 18 on each long side.
    assert_eq!(outer, 2 * (9 + 9 + 2 * 18) + 2 * 36);
}

/// The text with this changed, and what is wrong with it then.
#[track_caller]
fn damaged(from: &str, to: &str) -> String {
    let text = String::from_utf8(TEXT.to_vec()).unwrap();
    assert!(text.contains(from), "`{from}` is not in the file");
    let text = text.replacen(from, to, 1);
    let msh = Msh::parse(text.as_bytes(), text.len() as u64);
    let used = msh.and_then(|msh| msh.body(&Solo, &["block"], &["base"], Kind::Tet4));
    let message = used.expect_err("should be refused").to_string();
    assert!(!message.contains('\n'), "one paragraph: {message}");
    message
}

#[track_caller]
fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

#[test]
fn formats_that_are_not_read_are_named() {
    assert_says(&damaged("$MeshFormat", "cl__1 = 1;"), &["not a Gmsh mesh", "gmsh -3"]);
    assert_says(&damaged("4.1 0 8", "4 0 8"), &["version 4 ", "Mesh.MshFileVersion = 4.1;"]);
    assert_says(&damaged("4.1 0 8", "4.1 0 4"), &["8 bytes", "Mesh.Binary = 0;"]);
    let mut swapped = BINARY.to_vec();
    let one = swapped.iter().position(|&b| b == 1).unwrap();
    swapped[one..one + 4].reverse();
    assert_says(&parse(&swapped).unwrap_err().to_string(), &["byte order", "Mesh.Binary = 0;"]);
    assert_says(&damaged("$Nodes", "$PartitionedEntities\n1\n$Nodes"), &["partitioned", "UnpartitionMesh"]);
}

#[test]
fn what_does_not_fit_the_format_has_its_line() {
    assert_says(&damaged("\n0 0 1\n", "\n0 zero 1\n"), &["line ", "expected y", "`zero`"]);
    assert_says(&damaged("\n0 0 1\n", "\n0 nan 1\n"), &["node 1 ", "not a finite number"]);
    assert_says(&damaged("3 1 \"block\"", "3 1 block"), &["line 10", "quotation marks", "`block`"]);
    assert_says(&damaged("$EndNodes", "$EndNodse"), &["$EndNodes", "`$EndNodse`"]);
    assert_says(&damaged("$EndEntities", ""), &["$EndEntities", "`$Nodes`"]);
    assert_says(&damaged("$EndElements", "$EndElements\nrubbish"), &["beginning of a section", "`rubbish`"]);
}

#[test]
fn missing_sections_are_named() {
    let text = String::from_utf8(TEXT.to_vec()).unwrap();
    let cut = |from: &str, to: &str| {
        let (head, rest) = text.split_once(from).unwrap();
        let text = format!("{head}{}", rest.split_once(to).unwrap().1);
        Msh::parse(text.as_bytes(), text.len() as u64)
    };
    assert_says(&cut("$Nodes", "$EndNodes\n").unwrap_err().to_string(), &["no section $Nodes"]);
    assert_says(&cut("$Elements", "$EndElements\n").unwrap_err().to_string(), &["no section $Elements"]);
    let untagged = cut("$Entities", "$EndEntities\n").unwrap().body(&Solo, &["block"], &[], Kind::Tet4);
    assert_says(&untagged.unwrap_err().to_string(), &["132 of 132 volume cells", "{1, 2}"]);
}

#[test]
fn a_file_that_is_cut_short_says_where_and_none_panics() {
    for bytes in [TEXT, BINARY, TEXT_2, BINARY_2, PARAMETRIC, HEXAHEDRA] {
        for length in 0..bytes.len() - 14 {
            let problem = parse(&bytes[..length]).expect_err("something is missing");
            assert!(!problem.to_string().is_empty());
        }
    }
    let nodes = BINARY.windows(9).position(|w| w == b"$EndNodes").unwrap();
    let message = parse(&BINARY[..nodes - 30]).unwrap_err().to_string();
    assert_says(&message, &["ends inside $Nodes", "of 66 nodes", "save it again"]);
}

#[test]
fn damaged_bytes_are_refused_or_read_but_never_take_memory_or_panic() {
    let mut random = crate::random::Random::new(11);
    for bytes in [TEXT, BINARY, TEXT_2, BINARY_2, PARAMETRIC, HEXAHEDRA] {
        for _ in 0..2000 {
            let mut damaged = bytes.to_vec();
            for _ in 0..1 + (random.number().abs() * 3.0) as usize {
                let place = (random.number().abs() * bytes.len() as f64) as usize;
                damaged[place] = (random.number().abs() * 256.0) as u8;
            }
            if let Ok(msh) = parse(&damaged) {
                let _ = msh.body(&Solo, &["block"], &["base", "top"], Kind::Tet4);
            }
        }
    }
}

#[test]
fn counts_are_not_believed() {
    assert_says(&damaged("$Nodes\n46 66 ", "$Nodes\n46 99999999999 "), &["99999999999 nodes", "can hold"]);
    assert_says(&damaged("$Nodes\n46 66 ", "$Nodes\n46 67 "), &["announces 67 nodes but has 66"]);
    assert_says(&damaged("$Nodes\n46 66 ", "$Nodes\n46 60 "), &["announces 60 nodes but has"]);
}

/// A file of version 2.2 with these physical volumes and surfaces, nodes and elements (all of a line but its number).
fn version_2(names: &[&str], nodes: &[[f64; 3]], elements: &[&str]) -> Result<Msh, Problem> {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", names.len());
    names.iter().for_each(|name| text += &format!("{name}\n"));
    text += &format!("$EndPhysicalNames\n$Nodes\n{}\n", nodes.len());
    (1..).zip(nodes).for_each(|(k, [x, y, z])| text += &format!("{k} {x} {y} {z}\n"));
    text += &format!("$EndNodes\n$Elements\n{}\n", elements.len());
    (1..).zip(elements).for_each(|(k, rest)| text += &format!("{k} {rest}\n"));
    text += "$EndElements\n";
    Msh::parse(text.as_bytes(), text.len() as u64)
}

/// Two tetrahedra on the triangle of nodes 1, 2, 3, with apexes 4 and 5.
const NODES: [[f64; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, 1.0], [0.2, 0.2, -1.0], [0.2, 0.2, 2.0]];
const NAMES: [&str; 4] = ["3 1 \"upper\"", "3 2 \"lower\"", "2 1 \"middle\"", "2 2 \"side\""];
const UPPER: &str = "4 2 1 1 1 2 3 4";
const LOWER: &str = "4 2 2 2 1 3 2 5";

/// What is wrong with a body of these elements.
#[track_caller]
fn assert_refused(elements: &[&str], volume: Option<&str>, surface: &str, parts: &[&str]) {
    let msh = version_2(&NAMES, &NODES, elements).unwrap();
    let problem =
        msh.body(&Solo, volume.as_slice(), &[surface], Kind::Tet4).expect_err("should be refused").to_string();
    assert_says(&problem, parts);
    assert!(!problem.contains('\n'), "one paragraph: {problem}");
}

#[test]
fn a_surface_between_two_volumes_belongs_to_both_with_either_sense() {
    let msh = version_2(&NAMES, &NODES, &[UPPER, LOWER, "2 2 1 7 1 2 3", "2 2 1 7 1 2 3"]).unwrap();
    let mut up = msh.body(&Solo, &["upper"], &["middle"], Kind::Tet4).unwrap();
    let mut down = msh.body(&Solo, &["lower"], &["middle"], Kind::Tet4).unwrap();
    assert_area(area(&up, 0), [0.0, 0.0, -0.5], 1);
    assert_area(area(&down, 0), [0.0, 0.0, 0.5], 1);
    (up.surfaces, down.surfaces) = (Vec::new(), Vec::new());
    assert_eq!((up.portion.points.len(), down.portion.points[3]), (4, NODES[4]));
}

#[test]
fn several_volumes_are_the_regions_of_one_body() {
    let msh = version_2(&NAMES, &NODES, &[LOWER, UPPER, "2 2 2 8 1 2 4", "2 2 1 7 1 2 3"]).unwrap();
    let body = |volumes: &[&str], surface: &str| msh.body(&Solo, volumes, &[surface], Kind::Tet4);
    let mesh = body(&["upper", "lower"], "side").unwrap();
    assert_eq!((mesh.portion.points.len(), mesh.portion.elements.len(), &mesh.portion.wholes[..]), (5, 2, &[1, 0][..]));
    assert_eq!(body(&["lower", "upper"], "side").unwrap().portion.wholes, [0, 1]);
    let alone = body(&["upper"], "side").unwrap();
    assert_eq!(alone.portion.wholes, [0]);
    // What is a boundary of each volume is none of both.
    let inner = body(&["upper", "lower"], "middle").unwrap_err().to_string();
    assert_says(&inner, &["1 of 1 triangles", "`middle`", "inside volume `upper` + `lower`"]);
    let none = body(&["upper", "core"], "side").unwrap_err().to_string();
    assert_says(&none, &["no physical volume `core`", "`lower` (1 cells), `upper` (1 cells)"]);
}

#[test]
fn volumes_that_make_no_body_are_refused() {
    // These have an edge in common, and go through each other.
    let msh = version_2(&NAMES, &NODES, &[UPPER, "4 2 2 2 1 5 3 6"]).unwrap();
    let torn = msh.body(&Solo, &["upper", "lower"], &[], Kind::Tet4).unwrap_err().to_string();
    let parts = ["volumes `upper` and `lower`, first near (", "torn", "cross", "BooleanFragments", "with a contact"];
    assert_says(&torn, &parts);
    let mut msh = version_2(&NAMES, &NODES, &[UPPER, LOWER]).unwrap();
    msh.blocks[1].groups.push(1);
    let shared = msh.body(&Solo, &["upper", "lower"], &[], Kind::Tet4).unwrap_err().to_string();
    assert_says(&shared, &["`upper` and `lower` share 1 cells", "Gmsh's volume 2", "take that volume out"]);
    assert_eq!(msh.body(&Solo, &["upper"], &[], Kind::Tet4).unwrap().portion.len(), 2);
}

#[test]
fn volumes_that_cannot_be_found_are_told_from_those_there_are() {
    let sides = [UPPER, LOWER, "2 2 2 8 1 2 4"];
    let known = "`lower` (1 cells), `upper` (1 cells)";
    assert_refused(&sides, Some("top"), "side", &["`top`", known, "Physical Volume(\"top\") = {1};"]);
    assert_refused(&sides, None, "side", &["2 physical volumes", "gmsh.volume", known]);
    assert_refused(&sides[2..], None, "side", &["no volume cells", "gmsh -3"]);
    let some = [UPPER, "4 2 0 17 1 3 2 5", "4 2 0 18 1 3 2 5"];
    assert_refused(&some, None, "side", &["2 of 3 volume cells", "{17, 18};", "Mesh.SaveAll = 0;"]);
    assert_refused(&some[1..2], None, "side", &["1 of 1 volume cells", "Physical Volume(\"NAME\") = {17};"]);
}

#[test]
fn surfaces_that_cannot_be_found_are_told_from_those_there_are() {
    let both = ["4 2 1 1 1 2 3 4", "4 2 1 2 1 3 2 5", "2 2 1 7 1 2 3", "2 2 2 8 1 2 4"];
    assert_refused(&both, None, "top", &["`top`", "`middle` (1 triangles", "Physical Surface(\"top\")"]);
    assert_refused(&both, None, "middle", &["1 of 1 triangles", "`middle`", "inside volume `upper`"]);
    let elsewhere = [UPPER, LOWER, "2 2 1 7 1 2 3", "2 2 2 8 1 2 4"];
    let parts = ["`side` (1 in all)", "boundary of volume `lower`", "`middle` (1 triangles)"];
    assert_refused(&elsewhere, Some("lower"), "side", &parts);
    assert_refused(&[UPPER, LOWER], Some("lower"), "side", &["there are none"]);
}

#[test]
fn cells_that_cannot_be_computed_with_are_counted() {
    let second_order = "11 2 1 1 1 2 3 4 1 2 3 4 1 2";
    assert_refused(&[second_order, UPPER], None, "side", &["1 10-node tetrahedron", "Mesh.ElementOrder = 1;"]);
    let curved = [UPPER, "9 2 2 8 1 2 4 1 2 4"];
    assert_refused(&curved, None, "side", &["surface `side`", "6-node triangle", "Mesh.ElementOrder = 1;"]);
    let inverted = ["4 2 1 1 1 3 2 4", "4 2 1 1 1 3 2 5", "4 2 1 1 1 2 4 6"];
    let parts = ["1 of 3 elements are inverted and 0 have no volume", "(0.300000, 0.300000, 0.250000)", "Optimize"];
    assert_refused(&inverted, None, "side", &parts);
    let twice = ["`upper`: 1 cells have a node twice, the first is a tetrahedron near (0.000000, 0.000000, 0.000000)"];
    assert_refused(&["4 2 1 1 1 1 2 4"], None, "side", &twice);
    assert_refused(
        &[UPPER, "4 2 1 1 1 2 3 6", LOWER],
        Some("upper"),
        "side",
        &["1 faces", "overlap", "Coherence Mesh;"],
    );
    let types = version_2(&NAMES, &NODES, &["77 2 1 1 1 2 3 4"]).unwrap_err().to_string();
    assert_says(&types, &["line ", "type 77", "Mesh.ElementOrder = 1;"]);
    let nodes = version_2(&NAMES, &NODES, &["4 2 1 1 1 2 3 9"]).unwrap_err().to_string();
    assert_says(&nodes, &["line ", "tetrahedron", "node 9"]);
}

/// A brick of 2 x 2 x 1 cells as a file of elements of this kind, and its upper face.
fn file_of(kind: Kind) -> (Vec<u8>, BodyMesh) {
    let brick = Brick { origin: [0.0; 3], size: [2.0, 3.0, 1.0], cells: [2, 2, 1] };
    let body = number_bodies([(kind, Shape::Brick(brick), vec![0])]).remove(0);
    let lattice = body.lattice().expect("it is a brick");
    let places: Vec<_> = indices(&lattice.all_nodes()).map(|at| lattice.coordinates(at)).collect();
    let (of_volume, of_face) = if kind == Kind::Hex8 { (5, 3) } else { (11, 9) };
    let mut cells = Vec::new();
    for element in 0..body.counts().elements {
        let nodes = body.element(element);
        for face in kind.faces() {
            let nodes: Vec<u64> = face.iter().map(|&k| nodes[k]).collect();
            if nodes.iter().all(|&n| lattice.is_on(Face::ZMax, lattice.node_position(n))) {
                cells.push((of_face, 7, nodes));
            }
        }
        let mut nodes = nodes;
        if kind == Kind::Tet10 {
            nodes.swap(8, 9);
        }
        cells.push((of_volume, 1, nodes));
    }
    let mut text =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"top\"\n3 1 \"block\"\n$EndPhysicalNames\n"
            .to_owned();
    text += &format!("$Nodes\n{}\n", places.len());
    (1..).zip(&places).for_each(|(n, [x, y, z])| text += &format!("{n} {x} {y} {z}\n"));
    text += &format!("$EndNodes\n$Elements\n{}\n", cells.len());
    for (number, (kind, group, nodes)) in (1..).zip(&cells) {
        let nodes: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
        text += &format!("{number} {kind} 2 {group} {group} {}\n", nodes.join(" "));
    }
    (format!("{text}$EndElements\n").into_bytes(), body)
}

#[test]
fn hexahedra_and_quadratic_tetrahedra_are_kept_for_the_elements_that_are_made_of_them() {
    for kind in [Kind::Hex8, Kind::Tet10] {
        let (text, body) = file_of(kind);
        let mesh = parse(&text).unwrap().body(&Solo, &[], &["top"], kind).unwrap();
        assert_eq!(mesh.portion.elements.kind(), kind);
        let expected: Vec<u32> =
            (0..body.counts().elements).flat_map(|e| body.element(e)).map(|node| node as u32).collect();
        assert_eq!(mesh.portion.elements.nodes(), expected);
        let mut sum = [0.0; 3];
        for face in mesh.surface("top") {
            let places: Vec<_> = face.iter().map(|&n| mesh.portion.points[n as usize]).collect();
            crate::mesh::surface::shares(&places).iter().for_each(|s| (0..3).for_each(|i| sum[i] += s[i]));
        }
        assert!(sum[0].abs() + sum[1].abs() + (sum[2] - 6.0).abs() < 1e-13, "{kind:?}: {sum:?}");
    }
}

#[test]
fn other_cells_are_refused_for_them() {
    let of = |text: &[u8], kind| {
        parse(text).unwrap().body(&Solo, &[], &[], kind).expect_err("should be refused").to_string()
    };
    let (hexahedra, quadratic) = (file_of(Kind::Hex8).0, file_of(Kind::Tet10).0);
    let assert_says = |text: String, parts: &[&str]| {
        parts.iter().for_each(|part| assert!(text.contains(part), "`{part}` is not in: {text}"));
    };
    assert_says(of(HEXAHEDRA, Kind::Hex8), &["54 prism cells", "hex8"]);
    assert_says(of(&quadratic, Kind::Hex8), &["24 10-node tetrahedron cells", "first-order"]);
    assert_says(of(&hexahedra, Kind::Tet10), &["4 hexahedron cells", "tet10", "Mesh.ElementOrder = 2"]);
    assert_says(of(&quadratic, Kind::Tet4), &["24 10-node tetrahedron cells", "first-order"]);
}
