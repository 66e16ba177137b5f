//! Solutions that go on on other subdomains, from before any of their Newton steps.

use std::collections::BTreeMap;
use std::path::Path;

use super::{contact, pack, unpack};
use crate::comm::solo::Solo;
use crate::fixture::{Stopper, two_bricks};
use crate::model;
use crate::model::discrete::Discrete;
use crate::monitor::timing::Timer;
use crate::record::summary::Summary;
use crate::restart::Standing;
use crate::results::checkpoint::{self, Checkpoint};
use crate::results::piece::{Piece, Values};
use crate::scene::Scene;
use crate::study;
use crate::study::Begin;

const EXACT: f64 = 1e-8;

/// Loaded until much of the lower brick yields, and drawn back until contact opens.
fn scene(sets: &[&str]) -> Scene {
    let common = [
        "load.top.traction=[0.0, 0.0, -0.35]",
        "support.right.displacement=[0.0, 0.0, 0.0]",
        "step=[{increments=2}, {amplitude=-0.5, increments=2}]",
        "solver.qp_tolerance=1e-12",
        "solver.residual_tolerance=1e-11",
        "solver.newton_tolerance=1e-10",
    ];
    two_bricks(&[&common, sets].concat())
}

/// Which contacts held, and with what force in the last increment, by what tells them apart; nothing where that is not known.
type Contacts = BTreeMap<[i64; 4], (bool, f64)>;

fn contacts(discrete: &Discrete, standing: &Standing) -> Contacts {
    let newton = &standing.newton;
    let Some(kept) = newton.kept.as_ref().or(newton.solver.programs.kept.as_ref()) else { return Contacts::new() };
    let force = |row: usize| newton.reached.as_ref().map_or(0.0, |reached| reached.lambda[row]);
    let rows = discrete.constraints.rows.iter().enumerate();
    rows.filter_map(|(k, row)| Some((contact(discrete, k)?, (kept[k], row.scale * force(k))))).collect()
}

/// The end of a solution, or its contacts where it was stopped, before step `stop`, and left a checkpoint.
fn solve(
    scene: &Scene,
    begin: impl FnOnce(&Discrete) -> Begin,
    (stop, file): (usize, &Path),
) -> Result<(Summary, Piece), Contacts> {
    let discrete = model::discretise(scene, &Solo).expect("the scene has a discrete problem");
    let (begin, mut stopper) = (begin(&discrete), Stopper::new(stop));
    let solved = study::solve(scene, &discrete, &Solo, begin, &Timer::start(), &mut stopper);
    solved.map(|solved| (solved.summary, solved.piece)).map_err(|_| {
        let stood = stopper.stood.expect("it was stopped");
        let touching = contacts(&discrete, &stood);
        let (texts, arrays) = pack(&Solo, &discrete, stood);
        checkpoint::write(&Solo, file, &texts, &arrays).expect("there is room");
        touching
    })
}

/// From a checkpoint, to the end or another checkpoint: on other subdomains if contacts there are given, which are those here
/// then.
fn go_on(
    scene: &Scene,
    from: &Path,
    there: Option<&Contacts>,
    stop: (usize, &Path),
) -> Result<(Summary, Piece), Contacts> {
    let at = |discrete: &Discrete| {
        let file = Checkpoint::open(&Solo, from).expect("it is whole");
        let (standing, is_recut) = unpack(&Solo, discrete, &file).expect("it fits");
        file.close().expect("it is open");
        assert_eq!(is_recut, there.is_some());
        if let Some(there) = there {
            let here = contacts(discrete, &standing);
            assert!(here.keys().eq(there.keys()));
            for ((held, force), (held_there, force_there)) in here.values().zip(there.values()) {
                assert!(held == held_there && (force - force_there).abs() <= 1e-14 * force.abs());
            }
        }
        Begin::At(Box::new(standing))
    };
    solve(scene, at, stop)
}

/// All recorded numbers, by name, time, and node or nodes of the element.
fn numbers(piece: &Piece) -> BTreeMap<(String, usize, Vec<i64>), f64> {
    let Some(Values::Integer(nodes)) = piece.point_data[0].states.first() else { panic!("nodes have numbers") };
    let points = nodes.iter().map(|&node| vec![node]).collect();
    let ends = piece.offsets.windows(2);
    let nodes_of = |cell: &[u64]| cell.iter().map(|&point| nodes[point as usize]).collect();
    let cells = ends.map(|ends| nodes_of(&piece.connectivity[ends[0] as usize..ends[1] as usize])).collect();
    let mut found = BTreeMap::new();
    for (fields, keys) in [(&piece.point_data[1..], points), (&piece.cell_data[4..], cells)] {
        let keys: Vec<Vec<i64>> = keys;
        for field in fields {
            assert_eq!(field.states.len(), piece.times.len());
            for (time, state) in field.states.iter().enumerate() {
                let values: Vec<f64> = match state {
                    Values::Real(values) => values.clone(),
                    Values::Integer(values) => values.iter().map(|&value| value as f64).collect(),
                };
                for (key, row) in keys.iter().zip(values.chunks_exact(field.components)) {
                    for (component, value) in row.iter().enumerate() {
                        found.insert((format!("{} {component}", field.name), time, key.clone()), *value);
                    }
                }
            }
        }
    }
    found
}

/// Fails unless both have come to the same, in every increment, but for rounding and the tolerances.
#[track_caller]
fn assert_alike(found: &(Summary, Piece), expected: &(Summary, Piece), what: &str) {
    let close = |what: &str, a: f64, b: f64, size: f64| {
        let alike = (a - b).abs() <= EXACT * size || (a.is_nan() && b.is_nan());
        assert!(alike, "{what}: {a} instead of {b}, of {size}");
    };
    assert_eq!(found.0.steps.len(), expected.0.steps.len(), "{what}");
    for (a, b) in found.0.steps.iter().zip(&expected.0.steps) {
        let (a, b) = (&a.state, &b.state);
        assert_eq!((a.plastic_elements, a.active_contacts), (b.plastic_elements, b.active_contacts), "{what}");
        for (a, b) in [(a.energy, b.energy), (a.internal_energy, b.internal_energy)] {
            close(what, a.unwrap(), b.unwrap(), b.unwrap().abs());
        }
        let (a, b) = (a.contact_force.unwrap(), b.contact_force.unwrap());
        (0..3).for_each(|axis| close(what, a[axis], b[axis], 1.0));
    }
    let (a, b) = (numbers(&found.1), numbers(&expected.1));
    assert!(a.keys().eq(b.keys()) && a.len() > 1000, "{what}");
    let mut sizes: BTreeMap<&str, f64> = BTreeMap::new();
    for ((name, ..), value) in &b {
        let size = sizes.entry(name).or_default();
        *size = value.abs().max(*size);
    }
    for ((key, a), b) in a.iter().zip(b.values()) {
        // What is told of the errors belongs to the last iterate.
        let size = if key.0.starts_with("error_estimate") { f64::INFINITY } else { sizes[&key.0[..]] };
        close(&format!("{what}, {key:?}"), *a, *b, size);
    }
}

/// Boxes from boxes, parts from boxes, one body a box, and clusters of the same boxes.
const CUTS: [&str; 4] = [
    "decomposition.cells=[1, 1, 1]",
    "decomposition.subdomains=5",
    "decomposition.cells=[4, 2, 2]",
    "decomposition.cluster=2",
];

#[track_caller]
fn cut_otherwise_it_arrives_at_the_same(sets: &[&str], every: usize) {
    let directory = tempfile::tempdir().unwrap();
    let [file, again] = ["one.h5", "other.h5"].map(|name| directory.path().join(name));
    let never = (usize::MAX, &*again);
    let whole = solve(&scene(sets), |_| Begin::Rest, never).expect("nobody stops it");
    assert_eq!(whole.0.converged, Some(true), "{:?}", whole.0.error);
    let steps = whole.0.newton.len();
    assert!(whole.0.steps.iter().any(|row| row.state.plastic_elements > Some(3)));
    let touching = |index: usize| whole.0.steps[index].state.active_contacts;
    assert!(touching(1) > Some(1) && touching(3) < touching(1));
    for cut in CUTS {
        let scene = scene(&[sets, &[cut]].concat());
        let own = solve(&scene, |_| Begin::Rest, never).expect("nobody stops it");
        let most = steps.max(own.0.newton.len()) + 2;
        let mut known = 0;
        for stop in (1..=steps).step_by(every) {
            let there = solve(&self::scene(sets), |_| Begin::Rest, (stop, &file)).expect_err("it is stopped");
            known += there.values().filter(|(held, force)| *held && *force > 0.0).count();
            let what = format!("{cut} before step {stop} of {steps}");
            let found = go_on(&scene, &file, Some(&there), never).expect("nobody stops it");
            assert_alike(&found, &whole, &what);
            assert!(found.0.newton.len() <= most, "{what}: {} steps, not {most}", found.0.newton.len());
        }
        assert!(known > 0, "no contact was ever closed");
    }
}

#[test]
fn a_history_goes_on_on_other_subdomains() {
    cut_otherwise_it_arrives_at_the_same(&["solver.qp=active-set"], 1);
    cut_otherwise_it_arrives_at_the_same(&["solver.qp=smalse-m"], 4);
}

#[test]
fn a_history_of_hexahedra_goes_on_on_other_subdomains_without_a_preconditioner() {
    let sets = ["body.lower.element=hex8", "body.upper.element=hex8", "solver.preconditioner=none"];
    cut_otherwise_it_arrives_at_the_same(&sets, 3);
}

/// Quadratic faces have fields on edges that not every subdomain has a face at.
#[test]
fn a_history_of_quadratic_tetrahedra_goes_on_on_other_subdomains() {
    cut_otherwise_it_arrives_at_the_same(&["body.lower.element=tet10", "body.upper.element=tet10"], 5);
}

#[test]
fn what_goes_on_on_other_subdomains_leaves_checkpoints_of_them() {
    let directory = tempfile::tempdir().unwrap();
    let [file, again] = ["one.h5", "other.h5"].map(|name| directory.path().join(name));
    let there = solve(&scene(&[]), |_| Begin::Rest, (7, &file)).expect_err("it is stopped");
    let parts = scene(&[CUTS[1]]);
    let whole = go_on(&parts, &file, Some(&there), (usize::MAX, &again)).expect("nobody stops it");
    assert!(go_on(&parts, &file, Some(&there), (4, &again)).is_err());
    let mut found = go_on(&parts, &again, None, (usize::MAX, &file)).expect("nobody stops it");
    for (found, whole) in found.0.newton.iter_mut().zip(&whole.0.newton) {
        found.seconds = whole.seconds;
    }
    assert!(format!("{found:?}") == format!("{whole:?}"));
}
