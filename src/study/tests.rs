//! Bodies of several materials against closed forms, two bodies in contact, and each other.

use crate::comm::threads;
use crate::fixture::{RANKS, clustered, quarters, two_bricks};
use crate::monitor::metered::Metered;
use crate::monitor::table::PhaseTable;
use crate::monitor::timing::Timer;
use crate::record::counts::Counted;
use crate::record::summary::Summary;
use crate::scene::Scene;

const STIFF: f64 = 200.0;
const SOFT: f64 = 50.0;
/// Poisson's ratio over Young's modulus, of both.
const CONTRACTION: f64 = 0.002;

const SERIES: &str = r#"{ left-low = "stiff", left-high = "stiff", right-low = "soft", right-high = "soft" }"#;
const PARALLEL: &str = r#"{ left-low = "stiff", left-high = "soft", right-low = "stiff", right-high = "soft" }"#;
const CHECKERED: &str = r#"{ left-low = "stiff", left-high = "soft", right-low = "soft", right-high = "stiff" }"#;

const TIGHT: [&str; 3] =
    ["solver.newton_tolerance=1e-9", "solver.residual_tolerance=1e-10", "solver.qp_tolerance=1e-11"];
const PULLED: &str = "load.end={surface='bar.x3', traction=[0.2, 0, 0]}";
const BENT: &str = "load.end={surface='bar.x3', traction=[0.2, 0.1, 0.3]}";
const HARDENING: [&str; 2] = ["material.soft.yield_stress=0.15", "material.soft.hardening=5"];

struct Outcome {
    summary: Summary,
    /// Place and displacement of each copy of a node, in the order of the subdomains.
    nodes: Vec<([f64; 3], [f64; 3])>,
}

fn solve(scene: &Scene, ranks: usize) -> Outcome {
    let parts = threads::run(ranks, |comm| {
        let discrete = crate::model::discrete::discretise(scene, comm).expect("the scene has a discrete problem");
        let solved =
            super::solve(scene, &discrete, comm, super::Begin::Rest, &Timer::start(), &mut ()).expect("it is held");
        let of = |(s, u): (&crate::decomposition::Subdomain, &Vec<f64>)| {
            s.points.iter().copied().zip(u.as_chunks().0.iter().copied()).collect::<Vec<_>>()
        };
        let nodes = discrete.decomposition.subdomains.iter().zip(&solved.u).flat_map(of).collect();
        Outcome { summary: solved.summary, nodes }
    });
    let nodes = parts.iter().flat_map(|part| part.nodes.clone()).collect();
    let summary = parts.into_iter().next().expect("rank 0").summary;
    assert_eq!(summary.converged, Some(true), "{:?}", summary.error);
    Outcome { summary, nodes }
}

fn bar(materials: &str, sets: &[&str]) -> Outcome {
    solve(&quarters(materials, &[&TIGHT, sets].concat()), 1)
}

/// Compares with a displacement; `u` is that of the end. Stresses without an error are recovered without one.
#[track_caller]
fn assert_exact(found: &Outcome, end: f64, exact: impl Fn([f64; 3]) -> [f64; 3]) {
    for (x, u) in &found.nodes {
        let expected = exact(*x);
        assert!((0..3).all(|a| (u[a] - expected[a]).abs() < 1e-8 * end), "at {x:?}: {u:?}, not {expected:?}");
    }
    let error = found.summary.state.errors.discretisation.unwrap();
    assert!(error < 1e-7, "the estimate is {error:e}");
}

#[track_caller]
fn assert_same_energy(found: &Outcome, expected: &Outcome) {
    let [found, expected] = [found, expected].map(|outcome| outcome.summary.state.energy.unwrap());
    assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
}

/// Both parts bear the same stress.
#[test]
fn materials_in_series_give_the_closed_form() {
    let stress = 0.2;
    let exact = |[x, y, z]: [f64; 3]| {
        let along = x.min(1.0) / STIFF + (x - 1.0).max(0.0) / SOFT;
        [along, -CONTRACTION * y, -CONTRACTION * z].map(|u| stress * u)
    };
    for element in ["tet4", "hex8"] {
        let found = bar(SERIES, &[PULLED, &format!("body.bar.element={element}")]);
        let end = stress * (1.0 / STIFF + 2.0 / SOFT);
        assert_exact(&found, end, exact);
        let energy = found.summary.state.internal_energy.unwrap();
        assert!((energy / (0.5 * stress * end) - 1.0).abs() < 1e-8);
    }
}

/// Both parts have the same strain; stresses jump where they meet.
#[test]
fn materials_in_parallel_give_the_closed_form() {
    let (strain, poisson) = (0.01, 0.3);
    let pull = "support.end={surface='bar.x3', fix=['x'], displacement=[0.03, 0, 0]}";
    for element in ["tet4", "hex8"] {
        let alike = ["material.stiff.poisson=0.3", "material.soft.poisson=0.3", &format!("body.bar.element={element}")];
        let found = bar(PARALLEL, &[&alike[..], &[pull]].concat());
        let exact = |[x, y, z]: [f64; 3]| [x, -poisson * y, -poisson * z].map(|u| strain * u);
        assert_exact(&found, 3.0 * strain, exact);
        let force = found.summary.state.reactions["end"][0];
        assert!((force / (strain * (0.25 * STIFF + 0.75 * SOFT)) - 1.0).abs() < 1e-8, "{force}");
    }
}

/// The same parts as bodies of their own, pressed against each other: contact without friction holds them as well, as both
/// contract alike.
#[test]
fn two_materials_pressed_together_are_two_bodies_in_contact() {
    let press = "load.end={surface='bar.x3', traction=[-0.2, 0, 0]}";
    let one = bar(SERIES, &[press]);
    let scene = quarters(SERIES, &[&TIGHT[..], &[press]].concat());
    let text = scene.to_toml();
    let (head, tail) = text.split_once("[body.bar]").unwrap();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/meshes/quarters.msh");
    let body = |name: &str, material: &str| {
        format!(
            "[body.{name}]\nmaterial = \"{material}\"\nelement = \"tet4\"\ngmsh = {{ file = \"{file}\", volume = \
             [\"{name}-low\", \"{name}-high\"] }}\n"
        )
    };
    let (_, rest) = tail.split_once("[support.x]").unwrap();
    let more =
        ["y", "z"].map(|axis| format!("[support.right-{axis}]\nsurface = \"right.{axis}0\"\nfix = [\"{axis}\"]\n"));
    let contact = "[contact.joint]\nslave = \"right.joint\"\nmaster = \"left.joint\"\n";
    let rest = rest.replace("bar.x3", "right.x3").replace("bar.", "left.");
    let text = [head, &body("left", "stiff"), &body("right", "soft"), &more.concat(), contact, "[support.x]", &rest];
    let two = solve(&Scene::from_text(&text.concat(), "two bodies", 1, &[]).unwrap(), 1);
    assert!(two.summary.state.active_contacts > Some(0));
    assert_same_energy(&two, &one);
    let sorted = |outcome: &Outcome| {
        let mut nodes = outcome.nodes.clone();
        nodes.sort_by(|a, b| a.0.iter().zip(&b.0).fold(std::cmp::Ordering::Equal, |o, (a, b)| o.then(a.total_cmp(b))));
        nodes.dedup_by(|a, b| a.0 == b.0);
        nodes
    };
    for (one, two) in sorted(&one).iter().zip(sorted(&two)) {
        assert!((0..3).all(|a| (one.1[a] - two.1[a]).abs() < 1e-8), "{one:?} {two:?}");
    }
}

#[test]
fn subdomains_change_no_energy_and_ranks_no_bit() {
    for materials in [SERIES, PARALLEL, CHECKERED] {
        let scene = |parts: usize| {
            let parts = format!("decomposition.subdomains={parts}");
            quarters(materials, &[&TIGHT[..], &HARDENING, &[BENT, &parts]].concat())
        };
        let [few, some, many] = [2, 5, 8].map(|parts| solve(&scene(parts), 1));
        assert!(few.summary.state.plastic_elements > Some(10));
        assert!(few.summary.sizes.subdomains < some.summary.sizes.subdomains.min(many.summary.sizes.subdomains));
        [&some, &many].into_iter().for_each(|found| assert_same_energy(found, &few));
        for ranks in &RANKS[1..] {
            let found = solve(&scene(8), *ranks);
            assert_eq!(found.nodes, many.nodes, "{ranks} ranks");
            assert_eq!(found.summary.state, many.summary.state);
        }
    }
}

/// Materials that differ a million times take about as many applications of F as one material does.
#[test]
fn jumps_of_stiffness_inside_a_body_cost_few_iterations() {
    let count = |materials: &str, more: &[&str]| {
        let sets = [&[BENT, "decomposition.subdomains=12"], more].concat();
        let summary = solve(&quarters(materials, &sets), 1).summary;
        summary.counters.hessian_multiplications.unwrap()
    };
    for materials in [SERIES, PARALLEL, CHECKERED] {
        let alike = count(materials, &["material.soft.young=200", "material.soft.poisson=0.4"]);
        for young in ["2e-4", "2e8"] {
            let jump = count(materials, &[&format!("material.soft.young={young}")]);
            assert!(jump <= 3 * alike, "{materials}: {jump} applications of F at {young}, {alike} without a jump");
        }
    }
}

#[test]
fn one_material_named_for_each_volume_is_one_material() {
    const EACH: &str = r#"{ left-low = "soft", left-high = "soft", right-low = "soft", right-high = "soft" }"#;
    const PAIRS: &str = r#"{ left-low = "soft", left-high = "same", right-low = "same", right-high = "soft" }"#;
    let common = [&HARDENING[..], &[BENT, "decomposition.subdomains=3"]].concat();
    let whole = bar(r#""soft""#, &common);
    let each = bar(EACH, &common);
    assert_eq!(each.nodes, whole.nodes);
    assert_eq!(each.summary.state, whole.summary.state);
    let same = "material.same={young=50.0, poisson=0.1, yield_stress=0.15, hardening=5}";
    let pairs = bar(PAIRS, &[&common[..], &[same]].concat());
    assert!(pairs.summary.sizes.subdomains > whole.summary.sizes.subdomains);
    assert_same_energy(&pairs, &whole);
}

/// Phases that are local to subdomains, or whose sums are: as much work on any ranks.
const LOCAL: [&str; 9] = [
    "assembly",
    "factorisation",
    "factorisation of the interior",
    "dual operator",
    "inner products",
    "internal forces",
    "residuals",
    "certificate",
    "error estimate",
];

/// What ranks did in a solve.
fn count(scene: &Scene, ranks: usize) -> Counted {
    let tables = threads::run(ranks, |comm| {
        let timer = Timer::start();
        let comm = &Metered::new(comm, &timer);
        let discrete = crate::model::discrete::discretise(scene, comm).expect("the scene has a discrete problem");
        super::solve(scene, &discrete, comm, super::Begin::Rest, &timer, &mut ()).expect("it is held");
        PhaseTable::gather(comm, &timer)
    });
    tables.into_iter().next().expect("rank 0").counted
}

#[test]
fn counts_have_no_noise_and_local_work_does_not_depend_on_the_ranks() {
    // No two parts are congruent, so that no rank can share factors.
    let scene = two_bricks(&["decomposition.subdomains=9", "load.top.traction=[0.0, 0.0, -0.35]"]);
    let alone = count(&scene, 1);
    assert_eq!(alone.counts_total.map(|of| (of.messages.busiest, of.bytes_sent.busiest)), Some((0.0, 0.0)));
    for ranks in RANKS {
        let [once, again] = [(); 2].map(|()| count(&scene, ranks));
        assert_eq!(once, again, "{ranks} ranks");
        let sum = |of: &Counted, phase: &str| ranks as f64 * of.counts[phase].flops.mean;
        for phase in LOCAL {
            let (found, expected) = (sum(&once, phase), alone.counts[phase].flops.mean);
            assert!(expected > 0.0, "{phase} has no count");
            // A mean is rounded.
            assert!((found / expected - 1.0).abs() < 1e-14, "{phase} on {ranks} ranks: {found} {expected}");
        }
        if ranks > 1 {
            assert!(once.counts_total.is_some_and(|total| total.messages.busiest > 0.0));
        }
    }
}

/// Every phase that takes time and computes has a count.
#[test]
fn all_phases_of_a_solve_are_counted() {
    let Counted { counts, .. } = count(&clustered(), 2);
    let idle: Vec<&str> = counts.iter().filter(|(_, of)| of.flops.busiest == 0.0).map(|(name, _)| &name[..]).collect();
    // Searches and orderings.
    assert_eq!(idle, ["interfaces", "symbolic analysis"]);
    let reads = |name: &str| counts[name].bytes.busiest > 0.0;
    assert!(counts.keys().filter(|name| !idle.contains(&&name[..])).all(|name| reads(name)));
}
