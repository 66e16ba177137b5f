use std::f64::consts::{FRAC_PI_2, PI};

use super::find::find;
use super::*;
use crate::comm::Comm;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::element::Kind;
use crate::mesh::faces::key;
use crate::mesh::{Mapped, SolidMesh};
use crate::random::Random;
use crate::vector::cross;

/// One of each form, in a frame of three unit vectors.
fn forms([x, y, z]: [Point; 3]) -> [Form; 5] {
    let at = |a: f64, b: f64, c: f64| std::array::from_fn(|i| a * x[i] + b * y[i] + c * z[i]);
    [
        Form::Plane { point: at(1.0, 0.0, 2.0), normal: z },
        Form::Sphere { centre: at(0.3, -1.0, 0.0), radius: 2.0 },
        Form::Cone { point: at(1.0, 0.0, 0.0), axis: z, radius: 1.5, opening: 0.0 },
        Form::Cone { point: at(0.0, 2.0, 0.0), axis: z, radius: 3.0, opening: -0.4 },
        Form::Torus { centre: at(0.0, 0.0, 1.0), axis: z, radii: [4.0, 0.7] },
    ]
}

fn random_frame(random: &mut Random) -> [Point; 3] {
    let unit = |x: Point| x.map(|c| c / length(x));
    let (one, other) = (unit(random.vector(1.0)), random.vector(1.0));
    let third = unit(cross(one, other));
    [one, cross(third, one), third]
}

#[test]
fn gradients_are_those_of_the_distances_and_unit_vectors() {
    let mut random = Random::new(1);
    for _ in 0..20 {
        for form in forms(random_frame(&mut random)) {
            let x = random.vector(5.0);
            let (_, gradient) = form.distance(x);
            assert!((length(gradient) - 1.0).abs() < 1e-12);
            for axis in 0..3 {
                let beside = |size: f64| {
                    let moved: Point = std::array::from_fn(|a| if a == axis { x[a] + size } else { x[a] });
                    form.distance(moved).0
                };
                let slope = (beside(1e-6) - beside(-1e-6)) / 2e-6;
                assert!((slope - gradient[axis]).abs() < 1e-6, "{form:?} {slope} {gradient:?}");
            }
            // From where it is, straight to the form.
            assert!(form.distance(project([&form, &form], x, 99.0).unwrap()).0.abs() < 1e-12, "{form:?}");
        }
    }
}

#[test]
fn a_place_on_two_forms_is_where_they_cross_or_touch() {
    let (axis, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let cylinder = Form::Cone { point: [0.0; 3], axis, radius: 2.0, opening: 0.0 };
    let slant = Form::Plane { point: [0.0; 3], normal: [0.6, 0.0, 0.8] };
    let other = Form::Cone { point: [0.0; 3], axis: x, radius: 1.0, opening: 0.0 };
    let [place, on_both] = [&slant, &other].map(|form| project([&cylinder, form], [1.7, 0.9, 0.4], 9.0).unwrap());
    assert!((place[0] * place[0] + place[1] * place[1] - 4.0).abs() < 1e-13);
    assert!((0.6 * place[0] + 0.8 * place[2]).abs() < 1e-14);
    assert!((on_both[1] * on_both[1] + on_both[2] * on_both[2] - 1.0).abs() < 1e-13);
    assert!((on_both[0] * on_both[0] + on_both[1] * on_both[1] - 4.0).abs() < 1e-13);
    // A cap on the cylinder: both give the same.
    let cap = Form::Sphere { centre: [0.0; 3], radius: 2.0 };
    let place = project([&cylinder, &cap], [1.2, 1.5, 0.0], 1.0).unwrap();
    let factor = 2.0 / 1.2_f64.hypot(1.5);
    assert!(length(difference(place, [1.2 * factor, 1.5 * factor, 0.0])) < 1e-13, "{place:?}");
    // Too far, nowhere, or in no direction.
    assert_eq!(project([&cylinder, &cap], [1.2, 1.5, 0.0], 1e-3), None);
    let beyond = Form::Plane { point: [3.0, 0.0, 0.0], normal: [1.0, 0.0, 0.0] };
    assert_eq!(project([&cylinder, &beyond], [1.9, 0.1, 0.0], 10.0), None);
    assert_eq!(project([&cap, &cap], [0.0; 3], 10.0), None);
}

/// Triangles between places of a lattice, at random within it, in a random frame; `turn` closes its first direction.
fn lattice(
    random: &mut Random,
    frame: [Point; 3],
    [m, n]: [usize; 2],
    jitter: f64,
    turn: bool,
    at: &dyn Fn(f64, f64) -> Point,
) -> (Vec<Vec<u32>>, Vec<Point>) {
    let columns = if turn { m } else { m + 1 };
    let number = |i: usize, j: usize| (j * columns + i % columns) as u32;
    let mut places = Vec::new();
    for j in 0..=n {
        for i in 0..columns {
            let [p, q] = [(i, m, turn), (j, n, false)].map(|(k, count, turn)| {
                let is_inner = turn || (k > 0 && k < count);
                (k as f64 + if is_inner { jitter * random.number() } else { 0.0 }) / count as f64
            });
            let local = at(p, q);
            places.push(std::array::from_fn(|a| (0..3).map(|k| local[k] * frame[k][a]).sum()));
        }
    }
    let mut faces = Vec::new();
    for j in 0..n {
        for i in 0..m {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| number(i, j));
            let halves = if random.number() < 0.0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            faces.extend(halves.map(|half| half.to_vec()));
        }
    }
    (faces, places)
}

type Shape<'a> = (&'a str, [usize; 2], bool, &'a dyn Fn(f64, f64) -> Point);

/// What is found is the form that the nodes were put on, with all faces, however the mesh lies on it.
#[test]
fn forms_are_found_from_their_nodes() {
    let angle = |p: f64, of: f64| (of * p).sin_cos();
    let around = |p: f64, of: f64, radius: f64, z: f64| {
        let (sin, cos) = angle(p, of);
        [radius * cos, radius * sin, z]
    };
    let bore = |p: f64, q: f64| around(p, 2.0 * PI, 1.5, 4.0 * q);
    let quarter = |p: f64, q: f64| around(p, FRAC_PI_2, 10.0, 3.0 * q);
    let countersink = |p: f64, q: f64| around(p, 2.0 * PI, 2.0 + q, q);
    let ball = |p: f64, q: f64| {
        let (sin, cos) = angle(0.2 + 0.8 * q, FRAC_PI_2);
        around(p, FRAC_PI_2, 3.0 * sin, 3.0 * cos)
    };
    let fillet = |p: f64, q: f64| {
        let (sin, cos) = angle(q, FRAC_PI_2);
        around(p, 2.0 * PI, 5.0 - cos, 1.0 - sin)
    };
    let shapes: [Shape; 7] = [
        ("cylinder", [24, 8], true, &bore),
        ("cylinder", [15, 1], true, &bore),
        ("cylinder", [5, 2], false, &quarter),
        ("cone", [24, 4], true, &countersink),
        ("cone", [16, 1], true, &countersink),
        ("sphere", [8, 8], false, &ball),
        ("torus", [48, 5], true, &fillet),
    ];
    let mut random = Random::new(7);
    for (name, size, turn, at) in shapes {
        for jitter in [0.0, 0.2] {
            let frame = random_frame(&mut random);
            let (faces, places) = lattice(&mut random, frame, size, jitter, turn, at);
            let found = find(&faces, |node| places[node as usize]);
            let [(form, part)] = &found[..] else { panic!("{name} {size:?} {jitter}: {found:?}") };
            assert_eq!(part.len(), faces.len(), "{name} {size:?} {jitter}: {form:?}");
            let expected = match *form {
                Form::Plane { .. } => "plane",
                Form::Sphere { centre, radius } => {
                    assert!((radius - 3.0).abs() < 1e-9 && length(centre) < 1e-9, "{form:?}");
                    "sphere"
                }
                Form::Cone { opening, .. } if opening.abs() < 1e-9 => "cylinder",
                Form::Cone { opening, .. } => {
                    assert!((opening.abs() - PI / 4.0).abs() < 1e-9, "{form:?}");
                    "cone"
                }
                Form::Torus { radii, .. } => {
                    assert!((radii[0] - 5.0).abs() < 1e-8 && (radii[1] - 1.0).abs() < 1e-8, "{form:?}");
                    "torus"
                }
            };
            assert_eq!(expected, name);
            assert!(places.iter().all(|&x| form.distance(x).0.abs() < 1e-8));
        }
    }
}

/// Free forms, noise, and parts that are on a form by chance stay as they are.
#[test]
fn what_is_no_form_is_not_found() {
    let around = |p: f64, x: f64, y: f64, z: f64| [x * (2.0 * PI * p).cos(), y * (2.0 * PI * p).sin(), z];
    let ellipse = |p: f64, q: f64| around(p, 2.0, 2.2, 3.0 * q);
    let bowl = |p: f64, q: f64| [p, q, 0.3 * (p * p + 1.5 * q * q + p * q * q)];
    let plate = |p: f64, q: f64| [4.0 * p, 3.0 * q, 0.0];
    // An edge with two chamfers: four lines, all of which are on a cylinder.
    let chamfer = |p: f64, q: f64| {
        let turned = |k: usize| (32.0 * k as f64).to_radians().sin_cos();
        let [x, z] = (0..(3.0 * p).round() as usize).fold([0.0; 2], |[x, z], k| [x + turned(k).1, z - turned(k).0]);
        [x, 5.0 * q, z]
    };
    let shapes: [Shape; 4] = [
        ("ellipse", [24, 6], true, &ellipse),
        ("bowl", [9, 9], false, &bowl),
        ("plate", [6, 6], false, &plate),
        ("chamfer", [3, 4], false, &chamfer),
    ];
    let mut random = Random::new(3);
    for (name, size, turn, at) in shapes {
        let frame = random_frame(&mut random);
        let (faces, places) = lattice(&mut random, frame, size, 0.0, turn, at);
        let found = find(&faces, |node| places[node as usize]);
        assert!(found.is_empty(), "{name}: {found:?}");
    }
    let bore = |p: f64, q: f64| around(p, 2.0, 2.0, 3.0 * q);
    let (faces, mut places) = lattice(&mut random, random_frame(&mut Random::new(1)), [24, 6], 0.2, true, &bore);
    assert_eq!(find(&faces, |node| places[node as usize]).len(), 1);
    places.iter_mut().for_each(|x| *x = std::array::from_fn(|a| x[a] + random.number() * 1e-3));
    assert!(find(&faces, |node| places[node as usize]).is_empty());
}

/// A quarter of a pipe of linear and of quadratic elements: both cylinders, and the planes beside them, on any ranks.
#[test]
fn bodies_are_known_by_their_mesh() {
    let body = Mapped::Cylinder { radii: [2.0, 3.0], height: 4.0, cells: [6, 2, 5] };
    for kind in [Kind::Tet4, Kind::Tet10] {
        let found = |comm: &dyn Comm| {
            let mesh = body.mesh(comm, kind);
            (Forms::found(comm, &mesh), mesh)
        };
        let (alone, mesh) = found(&Solo);
        let known = body.forms(&Solo, &mesh);
        let curved = |forms: &Forms| forms.all.iter().filter(|form| form.is_curved()).count();
        assert_eq!((curved(&alone), alone.all.len(), curved(&known)), (2, 6, 2));
        for (surface, radius) in [("inner", 2.0), ("outer", 3.0)] {
            for face in mesh.surface(surface) {
                let Form::Cone { axis, radius: found, opening, .. } = alone.all[alone.faces[&key(&face[..3])] as usize]
                else {
                    panic!("no cylinder")
                };
                assert!((found - radius).abs() + opening.abs() + length([axis[0], axis[1]]) < 1e-9);
            }
        }
        // Edges along the axis or around, of both; those of the known cylinders alone have no planes beside.
        let mut edges: Vec<_> = known.edges.keys().collect();
        edges.sort_unstable();
        let mut found_edges: Vec<_> = alone.edges.keys().collect();
        found_edges.sort_unstable();
        assert_eq!(edges, found_edges);
        let rims = alone.edges.values().filter(|[one, other]| one != other).count();
        assert_eq!(rims, 2 * 2 * (6 + 5));
        let has = |mesh: &SolidMesh, nodes: &[u32]| nodes.iter().all(|n| mesh.portion.nodes.binary_search(n).is_ok());
        for (forms, mesh) in threads::run(3, found) {
            assert_eq!(forms.all, alone.all);
            for (edge, of) in &forms.edges {
                assert_eq!(alone.edges.get(edge), Some(of));
            }
            let own = mesh.portion.elements.iter().flat_map(|nodes| {
                let corner = |k: usize| mesh.portion.nodes[nodes[k] as usize];
                [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
                    .map(|(a, b)| [corner(a).min(corner(b)), corner(a).max(corner(b))])
            });
            for edge in own {
                assert!(has(&mesh, &edge));
                assert_eq!(forms.edges.get(&edge), alone.edges.get(&edge), "{edge:?}");
            }
        }
    }
}

/// A cylinder that goes on in a fillet of three rows: too few, and its facets are no planes beside the cylinder.
#[test]
fn facets_are_no_planes() {
    let profile = |p: f64, q: f64| {
        let row = (6.0 * q).round();
        let (sin, cos) = (20.0 * (row - 3.0).max(0.0)).to_radians().sin_cos();
        let (radius, height) = (3.0 - cos, 0.7 * row.min(3.0) + sin);
        [radius * (2.0 * PI * p).cos(), radius * (2.0 * PI * p).sin(), height]
    };
    let mut random = Random::new(5);
    let frame = random_frame(&mut random);
    let (faces, places) = lattice(&mut random, frame, [20, 6], 0.0, true, &profile);
    let found = find(&faces, |node| places[node as usize]);
    let [(Form::Cone { radius, .. }, part)] = &found[..] else { panic!("{found:?}") };
    assert!((radius - 2.0).abs() < 1e-9 && part.len() == 2 * 3 * 20, "{radius} {}", part.len());
}

/// A form is told by however many nodes, in a time that grows with them.
#[test]
fn fine_meshes_of_forms_are_found_and_free_forms_do_not_take_long() {
    let mut random = Random::new(6);
    let frame = random_frame(&mut random);
    let bore = |p: f64, q: f64| [2.0 * (2.0 * PI * p).cos(), 2.0 * (2.0 * PI * p).sin(), 6.0 * q];
    let (faces, places) = lattice(&mut random, frame, [200, 100], 0.2, true, &bore);
    let found = find(&faces, |node| places[node as usize]);
    assert_eq!(found.iter().map(|(_, part)| part.len()).collect::<Vec<_>>(), [faces.len()]);
    let bowl = |p: f64, q: f64| [p, q, 0.3 * (p * p + 1.5 * q * q + p * q * q)];
    let (faces, places) = lattice(&mut random, frame, [60, 60], 0.2, false, &bowl);
    let began = std::time::Instant::now();
    assert!(find(&faces, |node| places[node as usize]).is_empty());
    assert!(began.elapsed().as_secs_f64() < 1e-3 * faces.len() as f64, "{:?}", began.elapsed());
}
