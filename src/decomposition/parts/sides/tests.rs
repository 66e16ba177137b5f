use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::decomposition::parts::of_brick;
use crate::decomposition::{BodyMesh, Shape, number_bodies};
use crate::element::Kind;
use crate::mesh::Brick;

const CELLS: [usize; 3] = [6, 5, 3];

/// A brick whose cells are so high.
fn body(kind: Kind, height: f64) -> BodyMesh {
    let size = [6.0, 5.0, 3.0 * height];
    let brick = Brick { origin: [0.0; 3], size, cells: CELLS };
    number_bodies([(kind, Shape::Brick(brick), vec![0])]).swap_remove(0)
}

/// What becomes of two parts, the second having these cells.
fn flattened(body: &BodyMesh, comm: &dyn Comm, is_second: impl Fn([usize; 3]) -> bool) -> Vec<u32> {
    let portion = of_brick(body, comm);
    let place = |&number: &u32| {
        let cell = (u64::from(number) / body.kind.cell().per_hexahedron()) as usize;
        u32::from(is_second([cell % CELLS[0], cell / CELLS[0] % CELLS[1], cell / (CELLS[0] * CELLS[1])]))
    };
    let mut part: Vec<u32> = portion.numbers.iter().map(place).collect();
    Sides::new(comm, &portion).flatten(&mut part, &Wholes::new(vec![body.counts().elements], vec![2]));
    part
}

#[test]
fn a_cell_goes_to_the_part_around_it_and_plane_faces_stay() {
    let body = body(Kind::Hex8, 1.0);
    let plane = |[x, _, _]: [usize; 3]| x >= 3;
    let with_a_tooth = |cell: [usize; 3]| plane(cell) || cell == [2, 2, 1];
    let expected = flattened(&body, &Solo, plane);
    assert_eq!(expected.iter().sum::<u32>(), 45, "half of the cells");
    assert_eq!(flattened(&body, &Solo, with_a_tooth), expected);
}

#[test]
fn ranks_do_not_matter() {
    for kind in [Kind::Tet4, Kind::Hex8] {
        let body = body(kind, 0.5);
        let scattered = |[x, y, z]: [usize; 3]| (x * x + 2 * y + 3 * z) % 5 < 2;
        let alone = flattened(&body, &Solo, scattered);
        for ranks in [2, 5] {
            let found = threads::run(ranks, |comm| flattened(&body, comm, scattered)).concat();
            assert_eq!(found, alone, "{kind:?}, {ranks} ranks");
        }
    }
}
