use std::path::{Path, PathBuf};

use hdf5_metno::File;
use tempfile::TempDir;

use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::element;
use crate::mesh::SolidMesh;
use crate::mesh::gmsh::LARGE;

const TEXT: &[u8] = include_bytes!("../../../../tests/meshes/tets-41.msh");

/// Gmsh's mesh as a file in so many pieces, with the cells dealt in turn; numbers of points if `ids`. Cells are of the first of their
/// physical groups.
fn write(directory: &TempDir, msh: &Msh, pieces: usize, ids: bool) -> PathBuf {
    let path = directory.path().join(format!("{pieces}-{ids}.vtkhdf"));
    let cells: Vec<(u8, i64, &[u32])> = msh
        .blocks
        .iter()
        .flat_map(|block| block.own().map(move |nodes| (block, nodes)))
        .map(|(block, nodes)| {
            let vtk = CELLS.iter().find(|(_, number)| *number == block.kind.number).unwrap().0;
            (vtk, block.groups[0].into(), nodes)
        })
        .collect();
    let (mut counts, mut points, mut numbers) = ([const { Vec::new() }; 3], Vec::new(), Vec::new());
    let (mut connectivity, mut offsets, mut types, mut groups) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for piece in 0..pieces {
        let own = || cells.iter().skip(piece).step_by(pieces);
        let mut used: Vec<u32> = own().flat_map(|cell| cell.2).copied().collect();
        used.sort_unstable();
        used.dedup();
        let begin = connectivity.len();
        offsets.push(0);
        for (vtk, group, nodes) in own() {
            connectivity.extend(nodes.iter().map(|node| used.binary_search(node).unwrap() as i64));
            offsets.push((connectivity.len() - begin) as i64);
            types.push(*vtk);
            groups.push(*group);
        }
        points.extend(used.iter().flat_map(|&node| msh.points[node as usize]));
        numbers.extend(used.iter().map(|&node| 1000 - i64::from(node)));
        let of_piece = [used.len(), own().count(), connectivity.len() - begin];
        counts.iter_mut().zip(of_piece).for_each(|(counts, n)| counts.push(n as i64));
    }
    let file = File::create(&path).unwrap();
    let root = file.create_group("VTKHDF").unwrap();
    for (name, counts) in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"].into_iter().zip(&counts) {
        root.new_dataset_builder().with_data(counts).create(name).unwrap();
    }
    let places = root.new_dataset::<f64>().shape((points.len() / 3, 3)).create("Points").unwrap();
    places.write_raw(&points).unwrap();
    root.new_dataset_builder().with_data(&connectivity).create("Connectivity").unwrap();
    root.new_dataset_builder().with_data(&offsets).create("Offsets").unwrap();
    root.new_dataset_builder().with_data(&types).create("Types").unwrap();
    root.create_group("CellData").unwrap().new_dataset_builder().with_data(&groups).create("PhysicalIds").unwrap();
    if ids {
        let data = root.create_group("PointData").unwrap();
        data.new_dataset_builder().with_data(&numbers).create("GlobalPointIds").unwrap();
    }
    path
}

/// Nodes, elements, and for each surface its faces, of all ranks; sums of the places of corners.
fn measure(comm: &dyn Comm, path: &Path, names: [&str; 2]) -> (u64, usize, usize, f64) {
    let msh = Msh::read(comm, path, LARGE).expect("the file is sound");
    let SolidMesh { portion, surfaces, counts, .. } =
        msh.body(comm, &names[..1], &names[1..], element::Kind::Tet4).expect("it is a body");
    let faces: usize = surfaces.iter().map(|surface| surface.faces.len()).sum();
    let corners = portion.elements.of::<4>().iter().flatten();
    let place = corners.map(|&node| portion.points[node as usize].iter().sum::<f64>()).sum();
    (counts.nodes, portion.len(), faces, place)
}

#[test]
fn files_in_pieces_give_the_bodies_of_gmsh_on_any_ranks() {
    let directory = tempfile::tempdir().unwrap();
    let gmsh = Msh::parse(TEXT, TEXT.len() as u64).unwrap();
    let tag = |name: &str| gmsh.names.iter().find(|known| known.name == name).unwrap().tag.to_string();
    let [block, top] = ["block", "top"].map(tag);
    let original = directory.path().join("original.msh");
    std::fs::write(&original, TEXT).unwrap();
    let expected = measure(&Solo, &original, ["block", "top"]);
    for pieces in [1, 3, 8] {
        let path = write(&directory, &gmsh, pieces, true);
        for ranks in [1, 2, 5] {
            let found = threads::run(ranks, |comm| measure(comm, &path, [&block, &top]));
            assert!(found.iter().all(|of_rank| of_rank.0 == expected.0), "{pieces} pieces, {ranks} ranks");
            let sums = found.iter().fold((0, 0, 0.0), |sum, of| (sum.0 + of.1, sum.1 + of.2, sum.2 + of.3));
            assert_eq!((sums.0, sums.1), (expected.1, expected.2));
            assert!((sums.2 - expected.3).abs() < 1e-9 * expected.3.abs());
        }
    }
    // In one piece nothing has to be joined.
    let alone = write(&directory, &gmsh, 1, false);
    assert_eq!(
        measure(&Solo, &alone, [&block, &top]),
        measure(&Solo, &write(&directory, &gmsh, 1, true), [&block, &top])
    );
    // Pieces that have nothing in common are no body with closed surfaces.
    let apart = Msh::read(&Solo, &write(&directory, &gmsh, 3, false), LARGE).unwrap();
    assert!(apart.body(&Solo, &[&block[..]], &[&top[..]], element::Kind::Tet4).is_err());
}

#[test]
fn what_is_wrong_with_a_file_is_told_on_every_rank() {
    let directory = tempfile::tempdir().unwrap();
    let gmsh = Msh::parse(TEXT, TEXT.len() as u64).unwrap();
    let damaged = |damage: &dyn Fn(&Group)| {
        let path = write(&directory, &gmsh, 2, true);
        let file = File::open_rw(&path).unwrap();
        damage(&file.group("VTKHDF").unwrap());
        drop(file);
        let said = threads::run(3, |comm| Msh::read(comm, &path, LARGE).unwrap_err().to_string());
        assert!(said.iter().all(|text| *text == said[0]), "{said:?}");
        said[0].clone()
    };
    let set = |root: &Group, name: &str, value: i64| {
        let mut values = root.dataset(name).unwrap().read_raw::<i64>().unwrap();
        values[3] = value;
        root.dataset(name).unwrap().write_raw(&values).unwrap();
    };
    for (damage, wanted) in [
        (&(|root: &Group| set(root, "Connectivity", 100_000)) as &dyn Fn(&Group), "has point 100000 of a piece"),
        (&|root: &Group| set(root, "Offsets", 1), "do not ascend"),
        (&|root: &Group| root.unlink("Types").unwrap(), "Types"),
        (&|root: &Group| drop(root.create_group("Steps").unwrap()), "it has time steps"),
    ] {
        let said = damaged(damage);
        assert!(said.contains(wanted), "{said}");
    }
    let other = directory.path().join("other.h5");
    drop(File::create(&other).unwrap());
    let said = Msh::read(&Solo, &other, LARGE).unwrap_err().to_string();
    assert!(said.contains("it has no group VTKHDF"), "{said}");
}
