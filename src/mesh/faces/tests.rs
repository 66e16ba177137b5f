use super::*;
use crate::element::Kind;
use crate::mesh::{Brick, Face, brick};

fn tets(nodes: &[[u32; 4]]) -> Elements {
    Elements::new(Kind::Tet4, nodes.concat())
}

#[test]
fn the_outside_of_a_brick_are_its_faces_and_neighbours_share_three_nodes() {
    let brick = Brick { origin: [0.0; 3], size: [1.0; 3], cells: [3, 2, 2] };
    let nodes = brick::indices(&brick.all_cells()).flat_map(|cell| brick.tets(cell)).flatten();
    let elements = Elements::new(Kind::Tet4, nodes.map(|n| n as u32).collect());
    let neighbours = Neighbours::new(brick.node_count() as usize, &elements);
    assert!(neighbours.overlapping.is_empty());
    let turned = |t: [u32; 3]| (0..3).map(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]).min();
    let mut outer: Vec<_> = neighbours.outer(&elements).map(|face| turned(face.try_into().unwrap())).collect();
    let of_brick = Face::ALL.into_iter().flat_map(|face| brick.triangles_on(face).collect::<Vec<_>>());
    let mut expected: Vec<_> = of_brick.map(|t| turned(t.map(|n| n as u32))).collect();
    outer.sort();
    expected.sort();
    assert_eq!(outer, expected, "sense of rotation included");
    let tets = elements.of::<4>();
    for (tet, nodes) in tets.iter().enumerate() {
        for other in neighbours.of(tet).map(|o| o as usize) {
            assert_eq!(nodes.iter().filter(|n| tets[other].contains(n)).count(), 3);
            assert!(neighbours.behind(other).contains(&(tet as u32)));
        }
    }
}

#[test]
fn hexahedra_of_a_brick_share_faces_of_four_nodes_and_leave_its_outside() {
    let brick = Brick { origin: [0.0; 3], size: [1.0; 3], cells: [3, 2, 2] };
    let nodes = (0..brick.cell_count()).flat_map(|cell| brick.hexahedron(cell));
    let elements = Elements::new(Kind::Hex8, nodes.map(|n| n as u32).collect());
    let neighbours = Neighbours::new(brick.node_count() as usize, &elements);
    assert!(neighbours.overlapping.is_empty());
    assert_eq!(neighbours.outer(&elements).count(), 2 * (3 * 2 + 3 * 2 + 2 * 2));
    assert_eq!(neighbours.inner(&elements).count(), 2 * 4 + 3 * 2 + 3 * 2);
    // From outside: the area vectors of each side look outwards.
    let place = |n: &u32| brick.coordinates(brick.node_position(u64::from(*n)));
    for face in neighbours.outer(&elements) {
        let corners: Vec<_> = face.iter().map(place).collect();
        let side = Face::ALL
            .into_iter()
            .find(|side| face.iter().all(|&n| brick.is_on(*side, brick.node_position(u64::from(n)))));
        let normal = side.expect("it is on a side").normal();
        let vector = crate::mesh::surface::shares(&corners)[0];
        assert!((0..3).map(|a| normal[a] * vector[a]).sum::<f64>() > 0.0);
    }
    for cell in 0..elements.len() {
        for other in neighbours.of(cell).map(|o| o as usize) {
            assert_eq!(elements.get(cell).iter().filter(|n| elements.get(other).contains(n)).count(), 4);
        }
    }
}

#[test]
fn an_edge_is_no_face_and_faces_with_two_elements_on_a_side_overlap() {
    let count = |nodes: &[[u32; 4]]| {
        let neighbours = Neighbours::new(6, &tets(nodes));
        (neighbours.overlapping.len(), (0..nodes.len()).flat_map(|tet| neighbours.of(tet)).count())
    };
    assert_eq!(count(&[[0, 1, 2, 3], [0, 1, 4, 5]]), (0, 0));
    assert_eq!(count(&[[0, 1, 2, 3], [0, 2, 1, 4]]), (0, 2));
    assert_eq!(count(&[[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]]), (1, 0));
    assert_eq!(count(&[[0, 1, 2, 3], [0, 1, 2, 4]]), (1, 0));
    assert_eq!(count(&[[0, 1, 2, 3], [1, 2, 0, 3]]), (4, 0));
}
