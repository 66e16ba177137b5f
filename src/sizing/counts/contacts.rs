//! Rows of contact by closed forms: between opposite faces of two bricks whose nodes meet, and of a face at a rigid plane.
//!
//! Where the cells of two faces are of one size and in line, every slave node above the master has a partner, along each axis
//! those from the later beginning to the earlier end. A row is left out where supports fix both nodes along the normal,
//! which depends on the ends of the faces that they are on only: of a run of nodes the first, the last and all between are
//! looked at. All else (other meshes, curved surfaces and obstacles) is not counted here.

use crate::scene::{Axis, Body, Brick, Contact, Face, Obstacle, Scene, Sides, SurfaceName};

/// A contact whose conditions are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conditions {
    /// Conditions on slave nodes.
    pub all: u64,
    /// Those that have a row.
    pub rows: u64,
    /// How they are paired, as the summary says it.
    pub rule: &'static str,
}

/// How far nodes may be beside each other, in cells: less than pairing allows.
const BESIDE: f64 = 5e-7;
/// A component of a normal below this is none.
const NOTHING: f64 = 1e-8;

/// Some neighbouring nodes along an axis: how many, and whether they are at the lower or the upper end of the slave and of
/// the master.
type Run = (u64, [[bool; 2]; 2]);

/// Of a contact of a scene, if there is a closed form.
pub fn count(scene: &Scene, contact: &Contact) -> Option<Conditions> {
    match &contact.sides {
        Sides::Rigid { slave, obstacle: Obstacle::Plane { normal, .. }, .. } => plane(scene, slave, *normal),
        Sides::Rigid { .. } => None,
        Sides::Named { slave, master } => opposite(scene, slave, master),
        Sides::Either([one, other]) => opposite(scene, one, other),
    }
}

/// Whether no other contact has one of the surfaces: nodes in several contacts may have fewer rows.
pub fn is_alone(scene: &Scene, contact: &Contact) -> bool {
    let is_shared = |other: &&Contact| contact.surfaces().any(|surface| other.surfaces().any(|s| s == surface));
    scene.contact.values().filter(is_shared).count() == 1
}

fn opposite(scene: &Scene, slave: &SurfaceName, master: &SurfaceName) -> Option<Conditions> {
    let [one, other] = [slave, master].map(|surface| &scene.body[&surface.body]);
    let (face, beyond) = (slave.face()?, master.face()?);
    let faces_it = face.axis() == beyond.axis() && face.is_max() != beyond.is_max();
    if !faces_it || one.element != other.element {
        return None;
    }
    let degree = degree(one);
    let normal = face.axis();
    let mut runs = Vec::new();
    for axis in Axis::ALL {
        runs.push(if axis == normal {
            vec![(1, [face, beyond].map(|face| [!face.is_max(), face.is_max()]))]
        } else {
            common(one.brick()?, other.brick()?, axis.index(), degree)?
        });
    }
    let is_held = |ends: [[[bool; 2]; 2]; 3]| {
        [slave, master].iter().enumerate().all(|(side, s)| fixed(scene, &s.body, ends.map(|e| e[side]), normal))
    };
    Some(sum(&runs, is_held, "node to node"))
}

fn plane(scene: &Scene, slave: &SurfaceName, normal: [f64; 3]) -> Option<Conditions> {
    let (body, face) = (&scene.body[&slave.body], slave.face()?);
    let (brick, degree) = (body.brick()?, degree(body));
    let largest = normal.iter().fold(0.0_f64, |m, n| m.max(n.abs()));
    let outward = if face.is_max() { 1.0 } else { -1.0 };
    if -outward * normal[face.axis().index()] <= 1e-5 * largest {
        return None;
    }
    let run = |axis: Axis| {
        let nodes = degree * brick.cells[axis.index()] as u64 + 1;
        match axis == face.axis() {
            true => vec![(1, [[!face.is_max(), face.is_max()]; 2])],
            false => vec![(1, [[true, false]; 2]), (nodes - 2, [[false; 2]; 2]), (1, [[false, true]; 2])],
        }
    };
    let along = |axis: &Axis| normal[axis.index()].abs() > NOTHING * largest;
    let is_held = |ends: [[[bool; 2]; 2]; 3]| {
        let fixed = |axis| fixed(scene, &slave.body, ends.map(|e| e[0]), axis);
        Axis::ALL.into_iter().filter(along).all(fixed)
    };
    Some(sum(&Axis::ALL.map(run), is_held, "rigid"))
}

fn degree(body: &Body) -> u64 {
    body.element.degree() as u64
}

/// The nodes that two bricks have in common along an axis, from the lowest; `None` if they have not, or no two.
fn common(slave: &Brick, master: &Brick, axis: usize, degree: u64) -> Option<Vec<Run>> {
    let cell = |brick: &Brick| brick.size[axis] / brick.cells[axis] as f64;
    let [n, m] = [slave, master].map(|brick| brick.cells[axis] as i64);
    let shift = (master.origin[axis] - slave.origin[axis]) / cell(slave);
    let (begin, end) = (shift.round().max(0.0) as i64, n.min((shift.round() as i64).saturating_add(m)));
    // At both ends of what they have in common.
    let beside = |at: i64| {
        let other = master.origin[axis] + (at as f64 - shift.round()) * cell(master);
        ((slave.origin[axis] + at as f64 * cell(slave) - other) / cell(slave)).abs()
    };
    let in_line = (cell(master) / cell(slave) - 1.0).abs() < 0.1 && beside(begin) <= BESIDE && beside(end) <= BESIDE;
    if end <= begin || !in_line {
        return None;
    }
    let first = shift.round() as i64;
    let ends = |at: i64| [[at == 0, at == n], [at == first, at == first + m]];
    let between = degree * (end - begin) as u64 - 1;
    Some(vec![(1, ends(begin)), (between, [[false; 2]; 2]), (1, ends(end))])
}

/// Whether supports of a body fix a component at nodes at these ends along each axis.
fn fixed(scene: &Scene, body: &str, ends: [[bool; 2]; 3], component: Axis) -> bool {
    let is_at = |face: Face| ends[face.axis().index()][usize::from(face.is_max())];
    let mut supports = scene.support.values().filter(|s| s.surface.body == body && s.fix.contains(&component));
    supports.any(|s| s.surface.face().is_some_and(is_at))
}

/// Conditions at all nodes of the runs along the three axes; none has a row where it is held.
fn sum(runs: &[Vec<Run>], is_held: impl Fn([[[bool; 2]; 2]; 3]) -> bool, rule: &'static str) -> Conditions {
    let (mut all, mut rows) = (0, 0);
    for &(i, x) in &runs[0] {
        for &(j, y) in &runs[1] {
            for &(k, z) in &runs[2] {
                all += i * j * k;
                rows += if is_held([x, y, z]) { 0 } else { i * j * k };
            }
        }
    }
    Conditions { all, rows, rule }
}
