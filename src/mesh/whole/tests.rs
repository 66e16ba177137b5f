use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::comm::words::share;
use crate::element::Kind;
use crate::element::cell::EDGES;
use crate::mesh::{Mapped, split};
use crate::random::Random;

const KINDS: [Kind; 3] = [Kind::Tet4, Kind::Tet10, Kind::Hex8];

fn planes(from: f64, to: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|k| from + (to - from) * k as f64 / cells as f64).collect()
}

/// A box of hexahedra.
fn block(low: [f64; 3], high: [f64; 3], cells: [usize; 3]) -> Portion {
    Mapped::Grid { planes: std::array::from_fn(|a| planes(low[a], high[a], cells[a])) }.mesh(&Solo, Kind::Hex8).portion
}

/// One mesh of several, each a region. Nodes at one place are one where `glued`.
fn join(kind: Kind, parts: &[Portion], glued: impl Fn([f64; 3]) -> bool) -> Portion {
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
    cut(kind, mesh(Kind::Hex8, &points, &nodes, regions), |x, _| x)
}

/// Hexahedra as elements of a kind, quadrilaterals cut at the corner that comes first in an order of places, by region.
fn cut(kind: Kind, hexahedra: Portion, order: impl Fn([f64; 3], usize) -> [f64; 3]) -> Portion {
    if kind == Kind::Hex8 {
        return hexahedra;
    }
    let Portion { mut points, elements, wholes: regions, .. } = hexahedra;
    let (mut nodes, mut of_elements, mut middles) = (Vec::new(), Vec::new(), BTreeMap::new());
    for (cell, &region) in elements.iter().zip(&regions) {
        let keys: Vec<[f64; 3]> = cell.iter().map(|&n| order(points[n as usize], region as usize)).collect();
        let ranks: Vec<u32> = keys.iter().map(|a| keys.iter().filter(|b| *b < a).count() as u32).collect();
        split::tetrahedra(&ranks, |tet| {
            let tet = tet.map(|rank| cell[ranks.iter().position(|r| *r == rank).expect("ranks differ")]);
            nodes.extend(tet);
            for (a, b) in EDGES.into_iter().filter(|_| kind == Kind::Tet10).map(|(a, b)| (tet[a], tet[b])) {
                nodes.push(*middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push(std::array::from_fn(|i| 0.5 * (points[a as usize][i] + points[b as usize][i])));
                    points.len() as u32 - 1
                }));
            }
            of_elements.push(region);
        });
    }
    mesh(kind, &points, &nodes, of_elements)
}

/// All of a mesh.
fn mesh(kind: Kind, points: &[[f64; 3]], nodes: &[u32], regions: Vec<u32>) -> Portion {
    Portion { wholes: regions, ..Portion::new(kind, 0, nodes, |node| points[node as usize]) }
}

/// The number of pieces, or the flaw; the same on one rank, on three with shares of the elements, and on five of which the first
/// two have some in turn.
#[track_caller]
fn pieces_of(mesh: &Portion) -> Result<usize, Found> {
    let alone = pieces_on(&Solo, mesh, &|_| true).map(|(pieces, count)| {
        assert_eq!(pieces.iter().max().map(|&last| last as usize + 1), Some(count));
        count
    });
    let shared = threads::run(3, |comm| {
        let own = share(mesh.len() as u64, comm);
        pieces_on(comm, mesh, &|at| own.contains(&(at as u64))).map(|(_, count)| count)
    });
    let in_turn = threads::run(5, |comm| pieces_on(comm, mesh, &|at| comm.rank() == at % 2).map(|(_, count)| count));
    shared.iter().chain(&in_turn).for_each(|found| assert_eq!(found, &alone));
    alone
}

/// The pieces of the elements that a rank has.
fn pieces_on(comm: &dyn Comm, mesh: &Portion, has: &dyn Fn(usize) -> bool) -> Result<(Vec<u32>, usize), Found> {
    let places: Vec<usize> = (0..mesh.len()).filter(|&at| has(at)).collect();
    let nodes: Vec<u32> = places.iter().flat_map(|&at| mesh.elements.get(at)).copied().collect();
    let portion = Portion::new(mesh.elements.kind(), 0, &nodes, |node| mesh.points[node as usize]);
    let of_places = |values: &[u32]| places.iter().map(|&at| values[at]).collect();
    let portion = Portion { numbers: of_places(&mesh.numbers), wholes: of_places(&mesh.wholes), ..portion };
    let joints = Joints::new(comm, &portion);
    assert_eq!(joints.overlapping, None);
    pieces(comm, &portion, &joints)
}

#[track_caller]
fn flaw(mesh: &Portion) -> Found {
    pieces_of(mesh).expect_err("it only looks whole")
}

/// The same mesh turned, scaled and moved.
fn moved(mesh: &Portion, scale: f64) -> Portion {
    let [c, s] = [0.8, 0.6];
    let turned = |[x, y, z]: [f64; 3]| {
        let [x, y] = [c * x - s * y, s * x + c * y];
        [x, c * y - s * z, s * y + c * z].map(|x| scale * (x + 10.0))
    };
    Portion { points: mesh.points.iter().map(|&x| turned(x)).collect(), ..mesh.clone() }
}

#[test]
fn sound_meshes_raise_no_alarm() {
    let mut random = Random::new(11);
    for kind in KINDS {
        let mut distorted = block([0.0; 3], [1.0; 3], [4, 3, 5]);
        distorted.points.iter_mut().for_each(|x| *x = x.map(|x| x + 0.03 * random.number()));
        assert_eq!(pieces_of(&join(kind, &[distorted], |_| true)), Ok(1));
        // Layers a millionth as thick as wide, outside and within.
        let thin = vec![0.0, 1e-6, 0.5, 0.500_001, 1.0];
        let layers = Mapped::Grid { planes: [planes(0.0, 1.0, 3), thin.clone(), thin] }.mesh(&Solo, kind).portion;
        assert_eq!(pieces_of(&layers), Ok(1));
        let cylinder = Mapped::Cylinder { radii: [0.7, 1.0], height: 0.5, cells: [2, 9, 2] }.mesh(&Solo, kind).portion;
        assert_eq!(pieces_of(&cylinder), Ok(1));
        // Nodes of both sides glued; parts that share an edge, but are joined elsewhere.
        let beside = |(x, y): (f64, f64)| block([x, y, 0.0], [x + 1.0, y + 1.0, 1.0], [2; 3]);
        let around = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 2.0), (2.0, 2.0), (0.0, 1.0)];
        assert_eq!(pieces_of(&join(kind, &around.map(beside), |_| true)), Ok(1));
    }
}

#[test]
fn slits_wider_than_the_tolerance_are_slits() {
    for kind in KINDS {
        let low = block([0.0; 3], [1.0; 3], [3; 3]);
        let high = |gap: f64| block([0.1, 0.0, 1.0 + gap], [1.1, 1.0, 2.0 + gap], [4, 5, 3]);
        for scale in [1.0, 1e-4, 1e5] {
            let at = |gap: f64| pieces_of(&moved(&join(kind, &[low.clone(), high(gap)], |_| false), scale));
            assert_eq!(at(1e-3), Ok(2));
            assert!(matches!(at(1e-6), Err(Found { flaw: Flaw::Torn { hanging: 1.., .. }, .. })));
            assert!(matches!(at(-1e-2), Err(Found { flaw: Flaw::Torn { crossing: 1.., .. }, .. })));
        }
    }
}

#[test]
fn half_glued_interfaces_are_found_with_their_nodes_and_place() {
    for kind in KINDS {
        let parts = [0.0, 1.0].map(|z| block([0.0, 0.0, z], [1.0, 1.0, z + 1.0], [4, 2, 2]));
        let mesh = join(kind, &parts, |x| x[0] < 0.6);
        // Of columns at x = 0.75 and 1, for quadratic elements also those at 0.625 and 0.875; on both sides.
        let columns = if kind == Kind::Tet10 { 4 * 5 } else { 2 * 3 };
        for (scale, offset) in [(1.0, 0.0), (1e3, 0.0), (1e-3, 1e-6)] {
            let mut mesh = mesh.clone();
            mesh.points.iter_mut().filter(|x| x[2] > 1.2).for_each(|x| x[0] += offset);
            let mesh = moved(&mesh, scale);
            let Found { flaw, near, regions } = flaw(&mesh);
            assert_eq!(flaw, Flaw::Torn { coincident: 2 * columns, hanging: 0, crossing: 0 }, "{kind:?}");
            assert!(regions == [0, 1] && mesh.points.contains(&near));
        }
        // By a little, along the interface and away from it.
        let apart = parts.clone().map(|mut part| {
            part.points.iter_mut().filter(|x| x[2] == 1.0 && x[0] > 0.6).for_each(|x| *x = x.map(|x| x + 1e-6));
            part
        });
        let nearly = join(kind, &[parts[0].clone(), apart[1].clone()], |_| true);
        assert_eq!(flaw(&nearly).flaw, Flaw::Torn { coincident: 2 * columns, hanging: 0, crossing: 0 }, "{kind:?}");
    }
    // A slit without width within one part.
    let mut slit = block([0.0; 3], [1.0; 3], [4, 4, 4]);
    let on = |x: &[f64; 3]| x[2] == 0.5 && x[0] < 0.3;
    let both: Vec<u32> = (0..).zip(&slit.points).filter(|(_, x)| on(x)).map(|(n, _)| n).collect();
    let first = slit.points.len() as u32;
    both.iter().for_each(|&n| slit.points.push(slit.points[n as usize]));
    let other = |n: u32| both.iter().position(|&c| c == n).map_or(n, |k| first + k as u32);
    let is_upper = |nodes: &[u32]| nodes.iter().all(|&n| slit.points[n as usize][2] >= 0.5);
    let torn = |nodes: &[u32]| nodes.iter().map(|&n| if is_upper(nodes) { other(n) } else { n }).collect::<Vec<_>>();
    let nodes: Vec<u32> = slit.elements.iter().flat_map(torn).collect();
    assert_eq!(
        flaw(&mesh(Kind::Hex8, &slit.points, &nodes, slit.wholes)).flaw,
        Flaw::Torn { coincident: 20, hanging: 0, crossing: 0 }
    );
}

#[test]
fn hanging_nodes_are_counted() {
    for kind in KINDS {
        let parts = [block([0.0; 3], [1.0; 3], [1; 3]), block([0.0, 0.0, 1.0], [1.0, 1.0, 2.0], [2; 3])];
        let found = flaw(&moved(&join(kind, &parts, |_| true), 1e2)).flaw;
        // Of quadratic elements the coarse middles coincide with fine corners, and the fine middles hang.
        let expected = match kind {
            Kind::Tet4 | Kind::Hex8 => Flaw::Torn { coincident: 0, hanging: 5, crossing: 0 },
            Kind::Tet10 => Flaw::Torn { coincident: 10, hanging: 16, crossing: 0 },
        };
        assert_eq!(found, expected, "{kind:?}");
    }
}

#[test]
fn parts_that_cross_without_nodes_near_each_other_are_found() {
    for kind in KINDS {
        // Sticks, one lying across the other, and one through the other.
        for z in [1.0, 0.5] {
            let sticks =
                [block([-3.0, 0.0, 0.0], [3.0, 1.0, 1.0], [1; 3]), block([0.1, -3.0, z], [1.0, 3.1, z + 1.0], [1; 3])];
            let found = flaw(&join(kind, &sticks, |_| false));
            assert!(matches!(found.flaw, Flaw::Torn { coincident: 0, crossing: 2.., .. }), "{found:?}");
            assert_eq!(found.regions, [0, 1]);
        }
    }
}

#[test]
fn quadrilaterals_cut_along_both_diagonals_leave_holes() {
    let parts = [0.0, 1.0].map(|z| block([0.0, 0.0, z], [1.0, 1.0, z + 1.0], [3, 2, 1]));
    for warp in [0.0, 0.3] {
        let mut hexahedra = join(Kind::Hex8, &parts, |_| true);
        hexahedra.points.iter_mut().for_each(|x| x[2] += warp * x[0] * x[1]);
        assert_eq!(pieces_of(&cut(Kind::Tet4, hexahedra.clone(), |x, _| x)), Ok(1));
        let mirrored = cut(Kind::Tet4, hexahedra, |[x, y, z], region| if region == 0 { [x, y, z] } else { [-x, y, z] });
        assert_eq!(flaw(&mirrored).flaw, Flaw::Holes(6));
    }
}

#[test]
fn pieces_joined_by_an_edge_or_a_corner_are_hinges() {
    for (kind, on_edge) in [(Kind::Tet4, 3), (Kind::Tet10, 5), (Kind::Hex8, 3)] {
        let at = |x: [f64; 3]| block(x, x.map(|x| x + 1.0), [2; 3]);
        let edge = join(kind, &[at([0.0; 3]), at([1.0, 1.0, 0.0])], |_| true);
        assert_eq!(flaw(&edge).flaw, Flaw::Hinge(on_edge));
        let corner = flaw(&join(kind, &[at([0.0; 3]), at([1.0; 3])], |_| true));
        assert_eq!(corner, Found { flaw: Flaw::Hinge(1), near: [1.0; 3], regions: [0, 1] });
    }
}

#[test]
fn middles_that_are_not_shared_are_found() {
    let mut sound = join(Kind::Tet10, &[block([0.0; 3], [1.0; 3], [2; 3])], |_| true);
    // The middle of an edge inside, given a copy in one element alone.
    let inside = |x: &[f64; 3]| x.iter().all(|x| (0.1..0.9).contains(x));
    let mut nodes = sound.elements.nodes().to_vec();
    let place = (0..nodes.len()).find(|k| k % 10 > 3 && inside(&sound.points[nodes[*k] as usize]));
    let place = place.expect("there are edges inside");
    let copy = sound.points[nodes[place] as usize];
    nodes[place] = sound.points.len() as u32;
    sound.points.push(copy);
    // Between that element and the two beside it that have the edge.
    assert_eq!(
        flaw(&mesh(Kind::Tet10, &sound.points, &nodes, sound.wholes)),
        Found { flaw: Flaw::Middles(2), near: copy, regions: [0, 0] }
    );
}

#[test]
fn pieces_inside_of_others_are_told_from_pieces_in_their_cavities() {
    for kind in KINDS {
        let (large, small) = (block([0.0; 3], [3.0; 3], [3; 3]), block([1.2; 3], [1.8; 3], [2; 3]));
        let found = flaw(&join(kind, &[large, small.clone()], |_| false));
        assert_eq!((found.flaw, found.regions), (Flaw::Inside(1), [1, 0]));
        let cells = (0..27).filter(|cell| *cell != 13).map(|cell| [cell % 3, cell / 3 % 3, cell / 9]);
        let cell = |at: [usize; 3]| block(at.map(|k| k as f64), at.map(|k| k as f64 + 1.0), [1; 3]);
        let shell: Vec<Portion> = cells.map(cell).collect();
        assert_eq!(pieces_of(&join(kind, &[shell, vec![small]].concat(), |_| true)), Ok(2));
    }
}
