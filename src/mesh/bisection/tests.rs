use super::tagged::LEAST_COPY;
use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::element::sample::samples;
use crate::mesh::Mapped;
use crate::mesh::faces::Neighbours;
use crate::mesh::form::Form;
use crate::mesh::quality::Quality;
use crate::mesh::surface::areas;
use crate::random::Random;
use crate::vector::{cross, difference, dot, length};

/// Volume and the area of each surface.
fn sizes(mesh: &SolidMesh) -> (f64, Vec<f64>) {
    let portion = &mesh.portion;
    let volume =
        |at: usize| samples(portion.elements.kind(), &portion.places(at)).iter().map(|s| s.weight).sum::<f64>();
    let place = |&node: &u32| portion.points[portion.nodes.binary_search(&node).expect("an own node")];
    let area = |face: &Vec<u32>| areas(&face.iter().map(place).collect::<Vec<_>>()).iter().sum::<f64>();
    let of_surface = |surface: &NamedSurface| surface.faces.iter().map(area).sum();
    ((0..portion.len()).map(volume).sum(), mesh.surfaces.iter().map(of_surface).collect())
}

/// Radius of the inscribed sphere over the longest edge.
fn shape(corners: &[[f64; 3]]) -> f64 {
    let at = |a: usize, b: usize| difference(corners[b], corners[a]);
    let volume = dot(cross(at(0, 1), at(0, 2)), at(0, 3)) / 6.0;
    let area = |a, b, c| 0.5 * length(cross(at(a, b), at(a, c)));
    let surface = area(0, 1, 2) + area(0, 1, 3) + area(0, 2, 3) + area(1, 2, 3);
    let longest = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(a, b)| length(at(a, b)));
    3.0 * volume / surface / longest.into_iter().fold(0.0, f64::max)
}

fn worst(mesh: &SolidMesh) -> f64 {
    (0..mesh.portion.len()).map(|at| shape(&mesh.portion.places(at)[..4])).fold(f64::INFINITY, f64::min)
}

/// A box with some inner nodes, cut into tetrahedra, with its corners moved at random.
fn random_mesh(random: &mut Random, kind: Kind) -> SolidMesh {
    let planes = [(); 3].map(|()| {
        let count = 1 + (1.0 + random.number()) as usize;
        let steps = (0..count).map(|_| 1.0 + 0.8 * random.number());
        std::iter::once(0.0)
            .chain(steps.scan(0.0, |end, step| {
                *end += step;
                Some(*end)
            }))
            .collect::<Vec<f64>>()
    });
    let mut mesh = Mapped::Grid { planes }.mesh(&Solo, kind);
    // An affine map leaves planes plane.
    let rows: [[f64; 3]; 3] = std::array::from_fn(|a| {
        let mut row = random.vector(0.3);
        row[a] += 1.0;
        row
    });
    mesh.portion.points.iter_mut().for_each(|x| *x = rows.map(|row| dot(row, *x)));
    mesh
}

/// Some elements of a mesh, and how often each is to be bisected.
fn some(random: &mut Random, mesh: &SolidMesh, share: f64, times: usize) -> Vec<(Vec<u32>, usize)> {
    let mut key = |at: usize| {
        let mut corners: Vec<u32> =
            mesh.portion.elements.get(at)[..4].iter().map(|&n| mesh.portion.nodes[n as usize]).collect();
        corners.sort_unstable();
        (random.number() < 2.0 * share - 1.0).then_some((corners, times))
    };
    (0..mesh.portion.len()).filter_map(&mut key).collect()
}

fn assert_sound(mesh: &SolidMesh, volume: f64, areas: &[f64]) {
    let quality = Quality::of(&Solo, &mesh.portion);
    assert!(quality.is_sound(), "{quality:?}");
    let neighbours = Neighbours::new(mesh.portion.points.len(), &mesh.portion.elements);
    assert!(neighbours.overlapping.is_empty());
    // Conforming: what is outside is on a named surface.
    let named: usize = mesh.surfaces.iter().map(|s| s.faces.len()).sum();
    assert_eq!(neighbours.outer(&mesh.portion.elements).count(), named);
    let (found, found_areas) = sizes(mesh);
    assert!((found / volume - 1.0).abs() < 1e-12, "{found} {volume}");
    assert!(found_areas.iter().zip(areas).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{found_areas:?} {areas:?}");
    let counts = Counts {
        nodes: mesh.portion.nodes.len() as u64,
        cells: mesh.portion.len() as u64,
        elements: mesh.portion.len() as u64,
    };
    assert_eq!(mesh.counts, counts);
    assert!(mesh.portion.numbers.iter().zip(0..).all(|(&number, at)| number == at));
    assert!(mesh.portion.nodes.iter().zip(0..).all(|(&number, at)| number == at));
}

#[test]
fn random_refinements_of_random_meshes_are_sound_and_keep_their_shape() {
    let mut random = Random::new(11);
    for round in 0..250 {
        let kind = [Kind::Tet4, Kind::Tet10][round % 2];
        let start = random_mesh(&mut random, kind);
        let (volume, areas) = sizes(&start);
        let first = worst(&start);
        let mut mesh = Refinable::new(&Solo, &start, Forms::default(), kind);
        for _ in 0..4 {
            let (share, times) = (0.05 + 0.1 * (1.0 + random.number()), 1 + (1.0 + random.number()) as usize);
            let wanted = some(&mut random, &mesh.mesh(), share, times);
            let before = mesh.counts().elements;
            mesh.refine(&Solo, &wanted);
            assert!(mesh.counts().elements >= before + wanted.len() as u64);
            let refined = mesh.mesh();
            assert_sound(&refined, volume, &areas);
            assert!(worst(&refined) >= LEAST_COPY * first, "{} of {first}", worst(&refined));
        }
    }
}

#[test]
fn a_refined_mesh_is_the_same_on_any_ranks() {
    for kind in [Kind::Tet4, Kind::Tet10] {
        let body = Mapped::Sphere { radii: [1.0, 2.0], cells: [2, 2] };
        let refined = |comm: &dyn Comm| {
            let mut random = Random::new(2);
            let start = body.mesh(comm, kind);
            let mut mesh = Refinable::new(comm, &start, body.forms(comm, &start), kind);
            for times in [1, 3, 2] {
                // Any rank may name an element: here rank 0 names those near a corner, or all.
                let wanted = some(&mut random, &mesh.mesh(), 1.0, times).into_iter();
                let near =
                    |(corners, _): &(Vec<u32>, usize)| times == 1 || corners.iter().all(|&n| mesh.at(n)[0][0] < 0.4);
                let wanted: Vec<_> = wanted.filter(near).collect();
                mesh.displace(|node| [f64::from(node), 1.0, 2.0]);
                mesh.refine(comm, &wanted);
            }
            let found = mesh.mesh();
            let at: Vec<(u32, AtNode)> = found.portion.nodes.iter().map(|&node| (node, *mesh.at(node))).collect();
            (found, at)
        };
        let (alone, at_alone) = refined(&Solo);
        for ranks in [2, 3, 5] {
            let parts = threads::run(ranks, refined);
            let mut elements: Vec<(u32, Vec<u32>)> = Vec::new();
            let mut nodes: Vec<(u32, AtNode)> = Vec::new();
            let mut faces: Vec<Vec<Vec<u32>>> = vec![Vec::new(); alone.surfaces.len()];
            for (mesh, at) in parts {
                assert_eq!(mesh.counts, alone.counts);
                let global = |nodes: &[u32]| nodes.iter().map(|&n| mesh.portion.nodes[n as usize]).collect();
                elements.extend(mesh.portion.numbers.iter().copied().zip(mesh.portion.elements.iter().map(global)));
                nodes.extend(at);
                faces.iter_mut().zip(mesh.surfaces).for_each(|(all, surface)| all.extend(surface.faces));
            }
            elements.sort();
            nodes.sort_by_key(|(node, _)| *node);
            nodes.dedup();
            let expected: Vec<(u32, Vec<u32>)> =
                (0..).zip(alone.portion.elements.iter().map(<[u32]>::to_vec)).collect();
            assert!(elements == expected && nodes == at_alone, "{kind:?} {ranks}");
            for (mut found, surface) in faces.into_iter().zip(&alone.surfaces) {
                let mut expected = surface.faces.clone();
                found.sort();
                expected.sort();
                assert_eq!(found, expected);
            }
        }
    }
}

/// A quadratic function of the place is what it was at every node, also at those in the middle of edges.
#[test]
fn displacements_are_passed_on_exactly() {
    let mut random = Random::new(4);
    for kind in [Kind::Tet4, Kind::Tet10] {
        let start = random_mesh(&mut random, kind);
        let quadratic = if kind == Kind::Tet10 { 1.0 } else { 0.0 };
        let of = |x: [f64; 3]| {
            [x[0] - 2.0 * x[2], quadratic * x[0] * x[1] + x[1], quadratic * (x[2] * x[2] - x[0] * x[2]) + 3.0]
        };
        let mut mesh = Refinable::new(&Solo, &start, Forms::default(), kind);
        let places: HashMap<u32, [f64; 3]> =
            start.portion.nodes.iter().copied().zip(start.portion.points.clone()).collect();
        mesh.displace(|node| of(places[&node]));
        for _ in 0..3 {
            let wanted = some(&mut random, &mesh.mesh(), 0.3, 2);
            mesh.refine(&Solo, &wanted);
        }
        assert!(mesh.counts().elements > 3 * start.counts.elements);
        for node in mesh.nodes() {
            let [place, found] = *mesh.at(node);
            let error = length(difference(found, of(place)));
            assert!(error < 1e-12, "{kind:?} {error}");
        }
    }
}

/// Halves of a curved element of second order are the same patch: its volume stays. On a sphere that is known the volume tends to
/// the sphere's.
#[test]
fn curved_elements_are_refined_on_their_surface() {
    let body = Mapped::Sphere { radii: [1.0, 2.0], cells: [1, 1] };
    let exact = 7.0 * std::f64::consts::PI / 6.0;
    for kind in [Kind::Tet4, Kind::Tet10] {
        let start = body.mesh(&Solo, kind);
        let volume = sizes(&start).0;
        let all = |mesh: &SolidMesh| some(&mut Random::new(1), mesh, 1.0, 3);
        let mut blind = Refinable::new(&Solo, &start, Forms::default(), kind);
        blind.refine(&Solo, &all(&start));
        assert!((sizes(&blind.mesh()).0 / volume - 1.0).abs() < 1e-12);
        let mut mesh = Refinable::new(&Solo, &start, body.forms(&Solo, &start), kind);
        let mut errors = vec![(volume - exact).abs()];
        for _ in 0..2 {
            let wanted = all(&mesh.mesh());
            mesh.refine(&Solo, &wanted);
            let refined = mesh.mesh();
            assert!(Quality::of(&Solo, &refined.portion).is_sound());
            let on = |name: &str, radius: f64| {
                let nodes = refined.surface(name).iter().flatten();
                nodes.for_each(|&node| assert!((length(mesh.at(node)[0]) - radius).abs() < 1e-14, "{name}"));
            };
            on("inner", 1.0);
            on("outer", 2.0);
            errors.push((sizes(&refined).0 - exact).abs());
        }
        // Halved cells: second order for facets, fourth for patches; the first mesh is one cell across.
        let least = if kind == Kind::Tet10 { 12.0 } else { 3.4 };
        assert!(errors.windows(2).all(|e| e[0] / e[1] > least), "{kind:?} {errors:?}");
    }
}

/// A linear mesh that becomes quadratic is the one with straight edges, on any ranks, and on a sphere that is known the curved one.
#[test]
fn linear_meshes_become_quadratic() {
    let planes = [vec![0.0, 1.0, 3.0], vec![0.0, 2.0], vec![0.0, 1.0]];
    for (body, is_straight) in
        [(Mapped::Grid { planes }, true), (Mapped::Sphere { radii: [1.0, 2.0], cells: [2, 1] }, false)]
    {
        let places = |comm: &dyn Comm| {
            let start = body.mesh(comm, Kind::Tet4);
            let raised = Refinable::new(comm, &start, body.forms(comm, &start), Kind::Tet10);
            let mesh = raised.mesh();
            assert!(Quality::of(comm, &mesh.portion).is_sound());
            (mesh.counts, mesh.portion.nodes.iter().map(|&node| (node, *raised.at(node))).collect::<Vec<_>>())
        };
        let (counts, alone) = places(&Solo);
        let quadratic = body.mesh(&Solo, Kind::Tet10);
        assert_eq!((counts.nodes, counts.elements), (quadratic.counts.nodes, quadratic.counts.elements));
        if is_straight {
            let sorted = |points: Vec<[f64; 3]>| {
                let mut bits: Vec<[u64; 3]> = points.into_iter().map(|x| x.map(f64::to_bits)).collect();
                bits.sort_unstable();
                bits
            };
            assert_eq!(sorted(alone.iter().map(|(_, at)| at[0]).collect()), sorted(quadratic.portion.points));
        }
        let mut parts: Vec<(u32, AtNode)> = threads::run(3, |comm| places(comm).1).concat();
        parts.sort_by_key(|(node, _)| *node);
        parts.dedup();
        assert_eq!(parts, alone);
    }
}

/// Quadratic elements of linear ones, a sphere through some of their faces.
fn raised(body: &[[u32; 4]], places: &[[f64; 3]], faces: &[[u32; 3]]) -> Refinable {
    let portion = Portion::new(Kind::Tet4, 0, body.as_flattened(), |node| places[node as usize]);
    let [nodes, elements] = [places.len(), body.len()].map(|count| count as u64);
    let forms = Forms::new(
        &Solo,
        &portion.nodes,
        vec![Form::Sphere { centre: [0.0; 3], radius: 1.0 }],
        faces.iter().map(|face| (key(face), 0)).collect(),
    );
    let mesh = SolidMesh {
        pieces: vec![0; body.len()],
        portion,
        surfaces: Vec::new(),
        piece_count: 1,
        counts: Counts { nodes, cells: elements, elements },
    };
    Refinable::new(&Solo, &mesh, forms, Kind::Tet10)
}

fn middles(mesh: &Refinable) -> HashMap<Edge, [f64; 3]> {
    let of_cell =
        |cell: &Cell| cell.middles(Kind::Tet10).map(|(edge, node)| (edge, mesh.at(node)[0])).collect::<Vec<_>>();
    mesh.cells.iter().flat_map(of_cell).collect()
}

/// The edge between two faces of one element on a sphere would be smooth: there the element would have no volume. Its edges stay
/// straight, the others do not.
#[test]
fn an_element_with_two_faces_on_a_sphere_keeps_its_edges() {
    let on = |x: f64, y: f64| [x, y, (1.0 - x * x - y * y).sqrt()];
    let places = [on(0.0, 0.2), on(0.0, -0.2), on(0.6, 0.0), on(-0.6, 0.0), [0.0; 3], on(0.5, 0.5)];
    let elements = [[1, 0, 2, 3], [0, 2, 3, 4], [1, 3, 2, 4], [4, 0, 2, 5]];
    let mut mesh = raised(&elements, &places, &[[0, 1, 2], [0, 1, 3], [0, 2, 5]]);
    assert_eq!((mesh.round().count(), mesh.round().spoilt), (1, 1));
    let distance = |mesh: &Refinable, edge: Edge| length(middles(mesh)[&edge]);
    for (edge, is_straight) in [([0, 1], true), ([0, 2], true), ([1, 3], true), ([0, 5], false), ([2, 5], false)] {
        assert_eq!(distance(&mesh, edge) < 1.0 - 1e-3, is_straight, "{edge:?}");
    }
    // Elements get far smaller than straight edges are off the sphere.
    for _ in 0..2 {
        assert!(Quality::of(&Solo, &mesh.mesh().portion).is_sound());
        let wanted = some(&mut Random::new(1), &mesh.mesh(), 1.0, 6);
        mesh.refine(&Solo, &wanted);
    }
    // The face beside a straight edge is between that and two edges on the sphere, each of which is in 16 parts now.
    let on_sphere = middles(&mesh).values().filter(|x| (length(**x) - 1.0).abs() < 1e-14).count();
    assert_eq!(on_sphere, 2 * 16);
}

/// A shell that is thinner than its faces are curved keeps them.
#[test]
fn edges_that_would_turn_elements_inside_out_stay_straight() {
    for (outer, is_round) in [(1.02, false), (1.5, true)] {
        let body = Mapped::Sphere { radii: [1.0, outer], cells: [2, 1] };
        let found = |comm: &dyn Comm| {
            let start = body.mesh(comm, Kind::Tet4);
            let mesh = Refinable::new(comm, &start, body.forms(comm, &start), Kind::Tet10);
            assert!(Quality::of(comm, &mesh.mesh().portion).is_sound());
            let mut placed: Vec<(Edge, [f64; 3])> = middles(&mesh).into_iter().collect();
            placed.sort_by_key(|(edge, _)| *edge);
            (mesh.round().spoilt, placed)
        };
        let (spoilt, alone) = found(&Solo);
        assert_eq!(spoilt == 0, is_round, "{outer}: {spoilt}");
        let parts = threads::run(3, found);
        assert!(parts.iter().all(|(found, _)| *found == spoilt));
        let mut placed: Vec<(Edge, [f64; 3])> = parts.into_iter().flat_map(|(_, placed)| placed).collect();
        placed.sort_by_key(|(edge, _)| *edge);
        placed.dedup();
        assert_eq!(placed, alone);
    }
}
