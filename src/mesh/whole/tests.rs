use super::*;
use crate::mesh::{Elements, Mapped};
use crate::random::Random;

const KINDS: [Kind; 3] = [Kind::Tet4, Kind::Tet10, Kind::Hex8];

fn planes(from: f64, to: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|k| from + (to - from) * k as f64 / cells as f64).collect()
}

/// A box of cells.
fn block(kind: Kind, low: [f64; 3], high: [f64; 3], cells: [usize; 3]) -> SolidMesh {
    Mapped::Grid { planes: std::array::from_fn(|a| planes(low[a], high[a], cells[a])) }.mesh(kind)
}

/// One mesh of several, each a region. Nodes at one place are one where `glued`.
fn join(parts: &[SolidMesh], glued: impl Fn([f64; 3]) -> bool) -> SolidMesh {
    let (mut points, mut nodes, mut regions, mut known) = (Vec::new(), Vec::new(), Vec::new(), BTreeMap::new());
    for (region, part) in (0..).zip(parts) {
        let new = |&x: &[f64; 3]| {
            let next = points.len() as u32;
            let place = x.map(|x| (x * 1e9).round() as i64);
            let node = if glued(x) { *known.entry(place).or_insert(next) } else { next };
            if node == next {
                points.push(x);
            }
            node
        };
        let number: Vec<u32> = part.points.iter().map(new).collect();
        nodes.extend(part.elements.nodes().iter().map(|&n| number[n as usize]));
        regions.extend(part.elements.iter().map(|_| region));
    }
    let elements = Elements::new(parts[0].elements.kind(), nodes);
    SolidMesh { points, elements, cells: 0, surfaces: Vec::new(), regions, pieces: Vec::new() }
}

fn pieces_of(mesh: &SolidMesh) -> Result<usize, Found> {
    let neighbours = Neighbours::new(mesh.points.len(), &mesh.elements);
    assert_eq!(neighbours.overlapping, 0);
    pieces(mesh, &neighbours).map(|pieces| pieces.into_iter().max().map_or(1, |last| last as usize + 1))
}

#[track_caller]
fn flaw(mesh: &SolidMesh) -> Found {
    pieces_of(mesh).expect_err("it only looks whole")
}

/// The same mesh turned, scaled and moved.
fn moved(mesh: &SolidMesh, scale: f64) -> SolidMesh {
    let [c, s] = [0.8, 0.6];
    let turned = |[x, y, z]: [f64; 3]| {
        let [x, y] = [c * x - s * y, s * x + c * y];
        [x, c * y - s * z, s * y + c * z].map(|x| scale * (x + 10.0))
    };
    SolidMesh { points: mesh.points.iter().map(|&x| turned(x)).collect(), ..mesh.clone() }
}

#[test]
fn sound_meshes_raise_no_alarm() {
    let mut random = Random::new(11);
    for kind in KINDS {
        let mut mesh = block(kind, [0.0; 3], [1.0; 3], [4, 3, 5]);
        assert_eq!(pieces_of(&mesh), Ok(1));
        if kind != Kind::Tet10 {
            mesh.points.iter_mut().for_each(|x| *x = std::array::from_fn(|a| x[a] + 0.03 * random.number()));
            assert_eq!(pieces_of(&mesh), Ok(1));
        }
        // Layers a millionth as thick as wide, outside and within.
        let thin = vec![0.0, 1e-6, 0.5, 0.500_001, 1.0];
        let layers = Mapped::Grid { planes: [planes(0.0, 1.0, 3), thin.clone(), thin] }.mesh(kind);
        assert_eq!(pieces_of(&layers), Ok(1));
        // Nodes of both sides glued; a ring that closes; bodies that share an edge but are joined elsewhere.
        let beside = |x: f64, y: f64| block(kind, [x, y, 0.0], [x + 1.0, y + 1.0, 1.0], [2; 3]);
        assert_eq!(pieces_of(&join(&[beside(0.0, 0.0), beside(1.0, 0.0)], |_| true)), Ok(1));
        let around = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 2.0), (2.0, 2.0), (0.0, 1.0)];
        assert_eq!(pieces_of(&join(&around.map(|(x, y)| beside(x, y)), |_| true)), Ok(1));
    }
    for kind in KINDS {
        let cylinder = Mapped::Cylinder { radii: [0.7, 1.0], height: 0.5, cells: [2, 9, 2] }.mesh(kind);
        assert_eq!(pieces_of(&cylinder), Ok(1));
    }
}

#[test]
fn slits_wider_than_the_tolerance_are_slits() {
    for kind in KINDS {
        let low = block(kind, [0.0; 3], [1.0; 3], [3; 3]);
        let high = |gap: f64| block(kind, [0.1, 0.0, 1.0 + gap], [1.1, 1.0, 2.0 + gap], [4, 5, 3]);
        for scale in [1.0, 1e-4, 1e5] {
            let at = |gap: f64| pieces_of(&moved(&join(&[low.clone(), high(gap)], |_| false), scale));
            assert_eq!(at(1e-3), Ok(2));
            assert!(matches!(at(1e-6), Err(Found { flaw: Flaw::Torn { hanging: 1.., .. }, .. })));
            assert!(matches!(at(-1e-2), Err(Found { flaw: Flaw::Torn { crossing: 1.., .. }, .. })));
        }
    }
}

#[test]
fn half_glued_interfaces_are_found_with_their_nodes_and_place() {
    for kind in KINDS {
        let parts = [0.0, 1.0].map(|z| block(kind, [0.0, 0.0, z], [1.0, 1.0, z + 1.0], [4, 2, 2]));
        let mesh = join(&parts, |x| x[0] < 0.6);
        // Columns at x = 0.75 and 1, for quadratic elements also those between them and at 0.625; on both sides.
        let columns = if kind == Kind::Tet10 { 4 * 5 } else { 2 * 3 };
        for (scale, offset) in [(1.0, 0.0), (1e3, 0.0), (1e-3, 1e-6)] {
            let mut mesh = mesh.clone();
            let first_above = parts[0].points.len();
            mesh.points[first_above..].iter_mut().for_each(|x| x[0] += offset);
            let mesh = moved(&mesh, scale);
            let Found { flaw, near, regions } = flaw(&mesh);
            assert_eq!(flaw, Flaw::Torn { coincident: 2 * columns, hanging: 0, crossing: 0 }, "{kind:?}");
            assert!(regions == [0, 1] && mesh.points.contains(&near));
        }
    }
    // A slit within one part, along the plane between two cells.
    let mut slit = block(Kind::Hex8, [0.0; 3], [1.0; 3], [4, 4, 4]);
    let on = |x: &[f64; 3]| x[2] == 0.5 && x[0] < 0.3;
    let cut: Vec<u32> = (0..).zip(&slit.points).filter(|(_, x)| on(x)).map(|(n, _)| n).collect();
    let first = slit.points.len() as u32;
    cut.iter().for_each(|&n| slit.points.push(slit.points[n as usize]));
    let upper = |nodes: &[u32]| nodes.iter().all(|&n| slit.points[n as usize][2] >= 0.5);
    let new = |n: u32| cut.iter().position(|&c| c == n).map_or(n, |k| first + k as u32);
    let nodes: Vec<u32> = slit
        .elements
        .iter()
        .flat_map(|e| e.iter().map(|&n| if upper(e) { new(n) } else { n }).collect::<Vec<_>>())
        .collect();
    slit.elements = Elements::new(Kind::Hex8, nodes);
    assert_eq!(flaw(&slit).flaw, Flaw::Torn { coincident: 20, hanging: 0, crossing: 0 });
}

#[test]
fn hanging_nodes_are_counted() {
    for (kind, expected) in [(Kind::Tet4, 5), (Kind::Hex8, 5), (Kind::Tet10, 16)] {
        let coarse = block(kind, [0.0; 3], [1.0; 3], [1; 3]);
        let fine = block(kind, [0.0, 0.0, 1.0], [1.0, 1.0, 2.0], [2; 3]);
        let Found { flaw, near, .. } = flaw(&moved(&join(&[coarse, fine], |_| true), 1e2));
        assert_eq!(flaw, Flaw::Torn { coincident: 0, hanging: expected, crossing: 0 }, "{kind:?}");
        assert!(near.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn parts_that_cross_without_nodes_near_each_other_are_found() {
    for kind in KINDS {
        // Sticks, one lying across the other, and one through the other.
        for z in [1.0, 0.5] {
            let sticks = [
                block(kind, [-3.0, 0.0, 0.0], [3.0, 1.0, 1.0], [1; 3]),
                block(kind, [0.0, -3.0, z], [1.0, 3.1, z + 1.0], [1; 3]),
            ];
            let found = flaw(&join(&sticks, |_| false));
            assert!(matches!(found.flaw, Flaw::Torn { coincident: 0, crossing: 2.., .. }), "{found:?}");
            assert_eq!(found.regions, [0, 1]);
        }
    }
}

/// Cells of the upper block are cut along the other diagonals.
#[test]
fn quadrilaterals_cut_along_both_diagonals_leave_holes() {
    let lower = block(Kind::Tet4, [0.0; 3], [1.0; 3], [3, 2, 1]);
    let mut upper = block(Kind::Tet4, [0.0, 0.0, 1.0], [1.0, 1.0, 2.0], [3, 2, 1]);
    assert_eq!(pieces_of(&join(&[lower.clone(), upper.clone()], |_| true)), Ok(1));
    upper.points.iter_mut().for_each(|x| x[0] = 1.0 - x[0]);
    let nodes = upper.elements.of::<4>().iter().flat_map(|&[a, b, c, d]| [b, a, c, d]).collect();
    upper.elements = Elements::new(Kind::Tet4, nodes);
    let mut mesh = join(&[lower, upper], |_| true);
    assert_eq!(flaw(&mesh).flaw, Flaw::Holes(6));
    // Also where they are warped.
    let warp = |x: [f64; 3]| [x[0], x[1], x[2] + 0.3 * x[0] * x[1]];
    mesh.points.iter_mut().for_each(|x| *x = warp(*x));
    assert_eq!(flaw(&mesh).flaw, Flaw::Holes(6));
}

#[test]
fn pieces_joined_by_an_edge_or_a_corner_are_hinges() {
    for (kind, on_edge) in [(Kind::Tet4, 3), (Kind::Tet10, 5), (Kind::Hex8, 3)] {
        let at = |x: [f64; 3]| block(kind, x, x.map(|x| x + 1.0), [2; 3]);
        let edge = join(&[at([0.0; 3]), at([1.0, 1.0, 0.0])], |_| true);
        assert_eq!(flaw(&edge).flaw, Flaw::Hinge(on_edge));
        let corner = flaw(&join(&[at([0.0; 3]), at([1.0; 3])], |_| true));
        assert_eq!(corner, Found { flaw: Flaw::Hinge(1), near: [1.0; 3], regions: [0, 1] });
    }
}

#[test]
fn middles_that_are_not_shared_are_found() {
    let mut mesh = block(Kind::Tet10, [0.0; 3], [1.0; 3], [2; 3]);
    let centre = mesh.points.iter().position(|x| *x == [0.5; 3]).expect("the cells meet there") as u32;
    // The middle of an edge at the centre, given to one element alone.
    let mut nodes = mesh.elements.nodes().to_vec();
    let place = nodes.chunks(10).position(|n| n[0] == centre).expect("it is a corner");
    let copy = mesh.points[nodes[10 * place + 4] as usize];
    nodes[10 * place + 4] = mesh.points.len() as u32;
    mesh.points.push(copy);
    mesh.elements = Elements::new(Kind::Tet10, nodes);
    let found = flaw(&mesh);
    assert_eq!((found.flaw, found.near), (Flaw::Middles(2), copy));
}

#[test]
fn pieces_inside_of_others_are_told_from_pieces_in_their_cavities() {
    for kind in KINDS {
        let large = block(kind, [0.0; 3], [3.0; 3], [3; 3]);
        let small = block(kind, [1.2; 3], [1.8; 3], [2; 3]);
        let found = flaw(&join(&[large, small.clone()], |_| false));
        assert_eq!((found.flaw, found.regions), (Flaw::Inside(1), [1, 0]));
        let cells = (0..27).filter(|cell| *cell != 13).map(|cell| [cell % 3, cell / 3 % 3, cell / 9]);
        let cell = |at: [usize; 3]| block(kind, at.map(|k| k as f64), at.map(|k| k as f64 + 1.0), [1; 3]);
        let shell = cells.map(cell).collect::<Vec<_>>();
        assert_eq!(pieces_of(&join(&[shell, vec![small]].concat(), |_| true)), Ok(2));
    }
}
