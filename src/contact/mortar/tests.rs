use std::f64::consts::PI;

use super::*;

/// A surface over a grid: corners of `n` x `m` cells, each two triangles; `at` maps the unit square. Counter-clockwise in
/// the square, seen from outside, unless `turned`.
pub fn grid([n, m]: [usize; 2], first: u64, turned: bool, at: impl Fn(f64, f64) -> [f64; 3]) -> GatheredSurface {
    let node = |i: usize, j: usize| i + (n + 1) * j;
    let mut triangles = Vec::new();
    for (i, j) in (0..n * m).map(|k| (k % n, k / n)) {
        let quad = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        let split = if (i + j) % 2 == 0 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] };
        for [a, b, c] in split.map(|t| t.map(|k| quad[k])) {
            triangles.push(if turned { [a, c, b] } else { [a, b, c] });
        }
    }
    let count = (n + 1) * (m + 1);
    let points = (0..count).map(|k| at((k % (n + 1)) as f64 / n as f64, (k / (n + 1)) as f64 / m as f64)).collect();
    GatheredSurface {
        nodes: (0..count as u64).map(|k| first + k).collect(),
        parts: vec![0; count],
        points,
        triangles,
        share: 1.0,
        quadratic: Vec::new(),
        of: None,
    }
}

/// Conditions of two surfaces that face each other.
fn paired(slave: &GatheredSurface, master: &GatheredSurface, held: &[[bool; 3]]) -> Vec<ContactPair> {
    pair(3, "joint", slave, master, held).expect("they face each other").pairs
}

const FREE: [bool; 3] = [false; 3];

/// The slave's face of a body above, at height `z`, and a larger master below; the meshes have nothing in common.
fn flat(z: f64) -> (GatheredSurface, GatheredSurface) {
    let slave = grid([4, 3], 100, true, |x, y| [0.13 + x + 0.2 * y * x, 0.21 + y, z]);
    let master = grid([7, 6], 500, false, |x, y| [-0.3 + 2.0 * x, 2.0 * y + 0.1 * x, 0.0]);
    (slave, master)
}

fn sum(weights: &[(u64, f64)]) -> f64 {
    weights.iter().map(|(_, weight)| weight).sum()
}

/// A linear function of the place, interpolated.
fn mean(weights: &[(u64, f64)], surface: &GatheredSurface, of: impl Fn([f64; 3]) -> f64) -> f64 {
    weights.iter().map(|(node, weight)| weight * of(surface.points[(node - surface.nodes[0]) as usize])).sum()
}

/// Nodal forces of a unit pressure on a surface, by node.
fn unit_forces(surface: &GatheredSurface) -> Vec<f64> {
    surface.normals_and_areas().into_iter().map(|(_, area)| area).collect()
}

#[test]
fn flat_surfaces_have_the_exact_gap_and_reproduce_linear_functions() {
    for gap in [0.0, 0.4, -0.05] {
        let (slave, master) = flat(gap);
        let pairs = paired(&slave, &master, &vec![FREE; slave.nodes.len()]);
        assert_eq!(pairs.iter().map(|p| p.slave).collect::<Vec<_>>(), slave.nodes);
        let linear = |[x, y, _]: [f64; 3]| 1.0 + 2.0 * x - 3.0 * y;
        for p in &pairs {
            assert!((p.gap - gap).abs() < 1e-13 && (sum(&p.masters) - 1.0).abs() < 1e-13);
            assert_eq!(p.slaves, [(p.slave, 1.0)]);
            assert_eq!((p.contact, p.normal), (3, [0.0, 0.0, -1.0]));
            let here = linear(slave.points[(p.slave - 100) as usize]);
            assert!((mean(&p.masters, &master, linear) - here).abs() < 1e-12);
        }
    }
}

/// What a unit pressure on all conditions does to the nodes of both sides.
fn forces(pairs: &[ContactPair], slave: &GatheredSurface, master: &GatheredSurface) -> (Vec<f64>, Vec<f64>) {
    let mut on_slave = vec![0.0; slave.nodes.len()];
    let mut on_master = vec![0.0; master.nodes.len()];
    for p in pairs {
        p.slaves.iter().for_each(|(k, weight)| on_slave[(k - slave.nodes[0]) as usize] += weight * p.area);
        p.masters.iter().for_each(|(l, weight)| on_master[(l - master.nodes[0]) as usize] += weight * p.area);
        let force = p.force(p.area);
        assert!((force[2] - sum(&p.masters) * p.area).abs() < 1e-14);
    }
    (on_slave, on_master)
}

/// Fails unless a constant pressure on some slave nodes acts on all nodes as on the covered part of either surface.
fn assert_patch(slave: &GatheredSurface, master: &GatheredSurface, held: &[[bool; 3]], whole: bool) {
    let pairs = paired(slave, master, held);
    let (on_slave, on_master) = forces(&pairs, slave, master);
    if whole {
        for (found, expected) in on_slave.iter().zip(unit_forces(slave)) {
            assert!((found - expected).abs() < 1e-13, "{found} {expected}");
        }
    }
    // Equal resultants and moments.
    for of in [|_: [f64; 3]| 1.0, |p: [f64; 3]| p[0], |p: [f64; 3]| p[1]] {
        let resultant = |forces: &[f64], surface: &GatheredSurface| {
            forces.iter().zip(&surface.points).map(|(f, p)| f * of(*p)).sum::<f64>()
        };
        assert!((resultant(&on_slave, slave) - resultant(&on_master, master)).abs() < 1e-13);
    }
}

#[test]
fn a_constant_pressure_acts_on_both_sides_as_it_should() {
    let (slave, master) = flat(0.1);
    assert_patch(&slave, &master, &vec![FREE; slave.nodes.len()], true);
    // The larger surface as the slave: its nodes beyond the edge of the master carry nothing.
    let mut turned = (slave, master);
    for surface in [&mut turned.0, &mut turned.1] {
        surface.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    let (master, slave) = turned;
    let free = vec![FREE; slave.nodes.len()];
    assert_patch(&slave, &master, &free, false);
    let pairs = paired(&slave, &master, &free);
    assert!(pairs.len() < slave.nodes.len());
    // All of the master is covered.
    let (_, on_master) = forces(&pairs, &slave, &master);
    for (found, expected) in on_master.iter().zip(unit_forces(&master)) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

/// The same surface with quadratic faces: their middles halfway between the corners.
pub fn quadratic(surface: GatheredSurface) -> GatheredSurface {
    let GatheredSurface { mut nodes, mut points, triangles, .. } = surface;
    let mut middles = BTreeMap::new();
    let first = nodes[0];
    let mut middle = |a: usize, b: usize| {
        *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            points.push(std::array::from_fn(|x| 0.5 * (points[a][x] + points[b][x])));
            nodes.push(first + nodes.len() as u64);
            nodes.len() - 1
        })
    };
    let face = |[a, b, c]: [usize; 3]| [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
    let quadratic: Vec<[usize; 6]> = triangles.into_iter().map(face).collect();
    let cut = |&[a, b, c, ab, bc, ca]: &[usize; 6]| [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    let triangles = quadratic.iter().flat_map(cut).collect();
    GatheredSurface { parts: vec![0; nodes.len()], nodes, points, triangles, share: 1.0, quadratic, of: None }
}

/// Nodal forces of a unit pressure, by the faces' own functions.
fn consistent_forces(surface: &GatheredSurface) -> Vec<f64> {
    let mut forces = vec![0.0; surface.nodes.len()];
    for face in faces(surface) {
        let places: Vec<[f64; 3]> = face.nodes.iter().map(|&node| surface.points[node]).collect();
        face.nodes.iter().zip(surface::areas(&places)).for_each(|(&node, area)| forces[node] += area);
    }
    forces
}

#[test]
fn a_constant_pressure_acts_on_quadratic_faces_as_it_should() {
    for (slave, master) in [(true, true), (true, false), (false, true)].map(|which| {
        let (slave, master) = flat(0.1);
        let of = |turn: bool, surface| if turn { quadratic(surface) } else { surface };
        (of(which.0, slave), of(which.1, master))
    }) {
        // Free, and with an edge that is held: its corners and middles.
        let edge = |k: &[f64; 3]| (k[0] - 0.13).abs() < 1e-9;
        let held = |some: bool| slave.points.iter().map(|p| if some && edge(p) { [true; 3] } else { FREE }).collect();
        for held in [held(false), held(true)] {
            let held: Vec<[bool; 3]> = held;
            let pairs = paired(&slave, &master, &held);
            let corners = if held[0] == FREE { 20 } else { 16 };
            assert_eq!(pairs.len(), corners);
            for p in &pairs {
                assert!(p.area > 0.0 && (p.gap - 0.1).abs() < 1e-12);
                assert!((sum(&p.masters) - 1.0).abs() < 1e-12 && (sum(&p.slaves) - 1.0).abs() < 1e-12);
                // Linear functions of the place have no jump.
                let linear = |[x, y, _]: [f64; 3]| 1.0 + 2.0 * x - 3.0 * y;
                let here = mean(&p.slaves, &slave, linear);
                assert!((mean(&p.masters, &master, linear) - here).abs() < 1e-12);
            }
            let (on_slave, on_master) = forces(&pairs, &slave, &master);
            for (found, expected) in on_slave.iter().zip(consistent_forces(&slave)) {
                assert!((found - expected).abs() < 1e-13, "{found} {expected}");
            }
            assert!((on_master.iter().sum::<f64>() - on_slave.iter().sum::<f64>()).abs() < 1e-13);
        }
    }
    // The larger one as the slave: the master gets what a pressure on it gives.
    let (mut master, mut slave) = flat(0.1);
    for surface in [&mut master, &mut slave] {
        surface.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    let (master, slave) = (quadratic(master), quadratic(slave));
    let (_, on_master) = forces(&paired(&slave, &master, &vec![FREE; slave.nodes.len()]), &slave, &master);
    for (found, expected) in on_master.iter().zip(consistent_forces(&master)) {
        assert!((found - expected).abs() < 1e-13, "{found} {expected}");
    }
}

#[test]
fn held_nodes_carry_no_condition_but_their_share_of_the_pressure() {
    let (slave, master) = flat(0.0);
    // An edge held along the normal, and one held across it, which does not matter.
    let held: Vec<[bool; 3]> =
        (0..slave.nodes.len()).map(|k| if k % 5 == 0 { [true; 3] } else { [k % 5 == 4, true, false] }).collect();
    assert_patch(&slave, &master, &held, true);
    let pairs = paired(&slave, &master, &held);
    assert_eq!(pairs.len(), 16);
    assert!(pairs.iter().all(|p| (p.slave - 100) % 5 > 0));
    for p in &pairs {
        assert!((sum(&p.slaves) - sum(&p.masters)).abs() < 1e-13 && p.gap.abs() < 1e-13);
    }
    let all = pair(0, "joint", &slave, &master, &vec![[true; 3]; slave.nodes.len()]);
    assert_eq!(all, Err(ContactError::AllHeld { name: "joint".into() }));
}

#[test]
fn surfaces_apart_or_turned_away_are_no_contact() {
    let (slave, mut master) = flat(0.0);
    let free = vec![FREE; slave.nodes.len()];
    let apart = Err(ContactError::Apart { name: "joint".into() });
    master.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert_eq!(pair(0, "joint", &slave, &master, &free), apart);
    let (_, mut master) = flat(0.0);
    master.points.iter_mut().for_each(|p| p[0] += 10.0);
    assert_eq!(pair(0, "joint", &slave, &master, &free), apart);
    // The far side of a thick body is no overlap.
    let (slave, master) = flat(-1.0);
    assert_eq!(pair(0, "joint", &slave, &master, &free), apart);
}

/// Concentric quarter cylinders: the gap is the difference of the radii but for the facets, whose error falls with the
/// square of their width.
#[test]
fn on_curved_surfaces_the_gap_converges_with_the_square_of_the_facets() {
    let worst = |n: usize| {
        let arc = |radius: f64| move |x: f64, y: f64| [radius * (0.5 * PI * x).sin(), radius * (0.5 * PI * x).cos(), y];
        // Outward is away from the axis on the inner body, towards it on the outer.
        let slave = grid([2 * n, n], 0, true, arc(1.0));
        let master = grid([3 * n, n + 1], 1000, false, arc(1.1));
        let pairs = paired(&slave, &master, &vec![FREE; slave.nodes.len()]);
        assert_eq!(pairs.len(), slave.nodes.len());
        let area: f64 = pairs.iter().map(|p| p.area).sum();
        assert!((area - 0.5 * PI).abs() < 0.5 / (n * n) as f64, "{area}");
        pairs.iter().map(|p| (p.gap - 0.1).abs()).fold(0.0, f64::max)
    };
    let errors = [2, 4, 8].map(worst);
    assert!(errors[2] < 2e-3 && errors.windows(2).all(|e| e[1] < 0.3 * e[0]), "{errors:?}");
}

/// A bowl of curvature 1 that touches a flat slave at the node in the middle: the nodes around are apart as they are, on quadratic
/// faces; with dual functions all of them would be nearer by a tenth to a fifth of the square of an edge.
#[test]
fn a_bowl_touches_quadratic_faces_where_it_does() {
    let slave = quadratic(grid([6, 6], 100, true, |x, y| [2.0 * x - 1.0, 2.0 * y - 1.0, 0.0]));
    let height = |x: f64, y: f64| -0.5 * (x * x + y * y);
    let master = grid([80, 80], 5000, false, |x, y| [3.0 * x - 1.5, 3.0 * y - 1.5, 0.0]);
    let raised = |p: &[f64; 3]| [p[0], p[1], height(p[0], p[1])];
    let master = GatheredSurface { points: master.points.iter().map(raised).collect(), ..master };
    for pair in paired(&slave, &master, &vec![FREE; slave.nodes.len()]) {
        let [x, y, _] = slave.points[(pair.slave - 100) as usize];
        let is_inner = x.abs() < 0.9 && y.abs() < 0.9;
        assert!(!is_inner || (pair.gap + height(x, y)).abs() < 5e-4, "{} {}", pair.gap, height(x, y));
    }
}

/// A slave that overhangs on two sides, by shares of its cells that leave nodes beyond the edge with much, half and hardly any
/// cover: every condition pushes within the overlap on both sides, and some of them at its corners.
#[test]
fn no_condition_pushes_beyond_the_edge_of_the_master() {
    for reach in [0.02, 0.3, 0.5, 0.97] {
        for bent in [false, true] {
            let slave = grid([5, 5], 100, true, |x, y| [5.0 * x, 5.0 * y, 0.1]);
            let slave = if bent { quadratic(slave) } else { slave };
            let edge = 3.0 + reach;
            let master = grid([7, 6], 500, false, |x, y| [edge * x, edge * y, 0.0]);
            let pairs = paired(&slave, &master, &vec![FREE; slave.nodes.len()]);
            let mut furthest = 0.0_f64;
            for p in &pairs {
                for a in 0..2 {
                    let [push, met] = [mean(&p.slaves, &slave, |x| x[a]), mean(&p.masters, &master, |x| x[a])];
                    assert!((push - met).abs() < 1e-12 && push > -1e-12 && push < edge + 1e-12, "{push} {met}");
                    furthest = furthest.max(push);
                }
                let beyond = slave.points[(p.slave - 100) as usize][..2].iter().any(|x| *x > edge);
                assert_eq!(p.covered, !beyond);
            }
            let kept = if reach < REACH { 3.0 } else { edge };
            assert!((furthest - kept).abs() < if reach < REACH { reach } else { 1e-12 }, "{furthest} {kept}");
            let area: f64 = pairs.iter().map(|p| p.area).sum();
            assert!((area - edge * edge).abs() < 1e-11, "{area}");
        }
    }
}

/// The pressure of the slave at the master's nodes: linear functions of the place pass as they are.
#[test]
fn master_nodes_read_the_pressure_of_the_slave() {
    let (slave, master) = flat(0.2);
    let found = pair(0, "joint", &slave, &master, &vec![FREE; slave.nodes.len()]).expect("they face each other");
    let pressure = |[x, y, _]: [f64; 3]| 3.0 + x - 2.0 * y;
    let inside = |[x, y, _]: [f64; 3]| {
        // The slave's face as in `flat`, which is wider to the right.
        let v = y - 0.21;
        (0.0..=1.0).contains(&v) && (0.0..=1.0).contains(&((x - 0.13) / (1.0 + 0.2 * v)))
    };
    for point in master.points.iter().zip(&master.nodes) {
        let node = found.masters.iter().find(|node| node.node == *point.1);
        assert_eq!(node.is_some(), inside(*point.0), "{point:?}");
        let Some(node) = node else { continue };
        let of = |pair: usize| pressure(slave.points[(found.pairs[pair].slave - 100) as usize]);
        let mean: f64 = node.pairs.iter().map(|(pair, weight)| weight * of(*pair)).sum();
        assert!((mean - pressure(*point.0)).abs() < 1e-12);
    }
}
