//! Files read in parts against the same files read whole.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::element::Kind as Element;
use crate::mesh::SolidMesh;
use crate::random::Random;

const FILES: [&[u8]; 6] = [
    include_bytes!("../../../../tests/meshes/tets-41-binary.msh"),
    include_bytes!("../../../../tests/meshes/tets-41-parametric.msh"),
    include_bytes!("../../../../tests/meshes/tets-41.msh"),
    include_bytes!("../../../../tests/meshes/tets-22-binary.msh"),
    include_bytes!("../../../../tests/meshes/hexes-and-prisms.msh"),
    include_bytes!("../../../../tests/meshes/quarters.msh"),
];

/// What a mesh is, whatever ranks have of it: elements with nodes, region and piece, by number; points by node; surfaces.
type Plain = (Vec<(u32, Vec<u32>, u32, u32)>, BTreeMap<u32, [u64; 3]>, Vec<Vec<Vec<u32>>>, usize);

fn plain(parts: &[SolidMesh]) -> Plain {
    let (mut elements, mut points) = (Vec::new(), BTreeMap::new());
    let mut surfaces = vec![Vec::new(); parts[0].surfaces.len()];
    for mesh in parts {
        for (at, &number) in mesh.portion.numbers.iter().enumerate() {
            let nodes = mesh.portion.elements.get(at).iter().map(|&node| mesh.portion.nodes[node as usize]).collect();
            elements.push((number, nodes, mesh.portion.wholes[at], mesh.pieces[at]));
        }
        let places = mesh.portion.points.iter().map(|x| x.map(f64::to_bits));
        points.extend(mesh.portion.nodes.iter().copied().zip(places));
        surfaces.iter_mut().zip(&mesh.surfaces).for_each(|(all, own)| all.extend(own.faces.clone()));
        assert_eq!((mesh.piece_count, mesh.counts), (parts[0].piece_count, parts[0].counts));
    }
    elements.sort_unstable();
    surfaces.iter_mut().for_each(|faces| faces.sort_unstable());
    (elements, points, surfaces, parts[0].piece_count)
}

/// Reads a file on so many ranks; files of so many bytes in parts.
fn read(path: &Path, ranks: usize, large: u64, volumes: &[&str], surfaces: &[&str]) -> Plain {
    let body = |comm: &dyn Comm| Msh::read(comm, path, large)?.body(comm, volumes, surfaces, Element::Tet4);
    let parts: Result<Vec<SolidMesh>, Problem> = threads::run(ranks, body).into_iter().collect();
    plain(&parts.expect("the file is sound"))
}

#[test]
fn files_read_in_parts_are_those_read_whole_on_any_ranks() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("mesh.msh");
    for bytes in FILES {
        fs::write(&path, bytes).unwrap();
        let whole = Msh::parse(bytes, bytes.len() as u64).unwrap();
        let volumes: Vec<String> = whole.volume_names().into_iter().collect();
        let volumes: Vec<&str> = volumes.iter().map(|name| &name[..]).collect();
        let surface = [if volumes.contains(&"block") { "base" } else { "x0" }];
        // Two volumes touch, but have no nodes in common.
        for volumes in [&volumes[..1], &volumes[..]].into_iter().filter(|v| v.len() != 2) {
            let expected = plain(&[whole.body(&Solo, volumes, &surface, Element::Tet4).unwrap()]);
            for ranks in [1, 2, 3, 5] {
                for large in [0, u64::MAX] {
                    assert!(read(&path, ranks, large, volumes, &surface) == expected, "{ranks} ranks, {volumes:?}");
                }
            }
        }
    }
}

/// A node with its number, and a tetrahedron by such.
type Node = (u64, [f64; 3]);
type Tet = [u64; 4];

/// A binary file of these nodes, with their numbers, and a block of tetrahedra by numbers.
fn binary(nodes: &[Node], cells: &[Tet]) -> Vec<u8> {
    let mut bytes = b"$MeshFormat\n4.1 1 8\n".to_vec();
    let ints = |bytes: &mut Vec<u8>, ints: &[i32]| ints.iter().for_each(|n| bytes.extend(n.to_ne_bytes()));
    let sizes = |bytes: &mut Vec<u8>, sizes: &[u64]| sizes.iter().for_each(|n| bytes.extend(n.to_ne_bytes()));
    ints(&mut bytes, &[1]);
    bytes.extend(b"\n$EndMeshFormat\n$Entities\n");
    sizes(&mut bytes, &[0, 0, 0, 1]);
    ints(&mut bytes, &[7]);
    bytes.extend([0; 48]);
    sizes(&mut bytes, &[1]);
    ints(&mut bytes, &[3]);
    sizes(&mut bytes, &[0]);
    bytes.extend(b"\n$EndEntities\n$Nodes\n");
    let count = nodes.len() as u64;
    sizes(&mut bytes, &[2, count, 1, count]);
    for half in [&nodes[..nodes.len() / 2], &nodes[nodes.len() / 2..]] {
        ints(&mut bytes, &[3, 7, 0]);
        sizes(&mut bytes, &[half.len() as u64]);
        half.iter().for_each(|node| sizes(&mut bytes, &[node.0]));
        half.iter().flat_map(|node| node.1).for_each(|x| bytes.extend(x.to_ne_bytes()));
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    sizes(&mut bytes, &[1, cells.len() as u64, 1, cells.len() as u64]);
    ints(&mut bytes, &[3, 7, 4]);
    sizes(&mut bytes, &[cells.len() as u64]);
    (1..).zip(cells).for_each(|(number, cell)| {
        sizes(&mut bytes, &[number]);
        sizes(&mut bytes, cell);
    });
    bytes.extend(b"\n$EndElements\n");
    bytes
}

/// Both readings of some bytes, in parts on three ranks, all of which say the same.
fn both(path: &Path, bytes: &[u8]) -> [Result<Plain, String>; 2] {
    fs::write(path, bytes).unwrap();
    let body = |comm: &dyn Comm, msh: Result<Msh, Problem>| msh?.body(comm, &[], &[], Element::Tet4);
    let whole = body(&Solo, Msh::parse(bytes, bytes.len() as u64));
    let parts = threads::run(3, |comm| body(comm, Msh::read(comm, path, 0)).map_err(|problem| problem.to_string()));
    let texts: Vec<_> = parts.iter().filter_map(|part| part.as_ref().err()).collect();
    assert!(texts.is_empty() || texts.len() == 3 && texts.iter().all(|text| *text == texts[0]), "{texts:?}");
    let parts: Result<Vec<SolidMesh>, String> = parts.into_iter().collect();
    [whole.map(|mesh| plain(&[mesh])).map_err(|problem| problem.to_string()), parts.map(|parts| plain(&parts))]
}

#[test]
fn numbers_of_nodes_may_be_any_and_what_is_wrong_has_the_same_message() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("mesh.msh");
    // Tetrahedra around an axis, with gaps between the numbers of their nodes, which are in no order.
    let number = |k: u64| (k * 7919) % 1009 + (k % 2) * (1 << 40);
    let point = |k: u64| if k < 2 { [0.0, 0.0, k as f64] } else { [(k as f64).cos(), (k as f64).sin(), 0.5] };
    let nodes: Vec<Node> = (0..8).map(|k| (number(k), point(k))).collect();
    let cells: Vec<Tet> = (2..7).map(|k| [0, k, k + 1, 1].map(number)).collect();
    let same = |nodes: &[Node], cells: &[Tet]| {
        let [whole, parts] = both(&path, &binary(nodes, cells));
        assert_eq!(whole, parts);
        whole
    };
    assert_eq!(same(&nodes, &cells).unwrap().0.len(), 5);
    let refused = |change: &dyn Fn(&mut Vec<Node>, &mut Vec<Tet>), part: &str| {
        let (mut nodes, mut cells) = (nodes.clone(), cells.clone());
        change(&mut nodes, &mut cells);
        let text = same(&nodes, &cells).expect_err("something is wrong");
        assert!(text.contains(part), "{text}");
    };
    refused(&|nodes, _| (nodes[3].1[1], nodes[6].1[0]) = (f64::NAN, f64::INFINITY), "not a finite number");
    refused(&|nodes, _| (nodes[5].0, nodes[2].0) = (nodes[7].0, nodes[0].0), "is there twice");
    refused(&|_, cells| (cells[4][1], cells[3][2]) = (5, 6), "node 6, which is not in $Nodes");
    refused(&|_, cells| cells[2] = cells[4], "two elements on the same side");
    refused(&|_, cells| cells[1].swap(0, 1), "1 of 5 elements are inverted");
    refused(&|_, cells| cells[3][2] = cells[3][1], "1 cells have a node twice");
    refused(&|nodes, cells| cells.iter_mut().for_each(|cell| cell[0] = nodes[0].0 + 1), "which is not in");
    // Cells that are left out leave pieces that hang together by the axis.
    refused(&|_, cells| cells.retain(|cell| ![3, 5].map(number).contains(&cell[1])), "nodes alone join parts");
}

#[test]
fn damaged_files_have_the_same_message_in_parts_as_whole() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("mesh.msh");
    let mut random = Random::new(5);
    for bytes in &FILES[..2] {
        for turn in 0..600 {
            let mut damaged = bytes.to_vec();
            let mut place = |length: usize| (random.number().abs() * length as f64) as usize;
            match turn % 3 {
                0 => damaged.truncate(place(bytes.len())),
                _ => damaged[place(bytes.len())] = place(256) as u8,
            }
            fs::write(&path, &damaged).unwrap();
            let text = |problem: Problem| problem.to_string();
            let whole = Msh::parse(&damaged[..], damaged.len() as u64).map_err(text);
            let parts = Msh::read(&Solo, &path, 0).map_err(text);
            assert_eq!(whole, parts, "turn {turn}");
        }
    }
}
