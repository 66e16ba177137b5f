//! Limit loads against closed forms: on any ranks, beside loads that stay, with contact, where there is none, and refined.

use crate::checkpoint::{assert_same_result, newton, resume_with, stopped_after, summary};
use crate::common::{assert_scene_refused, number, run_briefly, scene_file, solve, solve_with};
use serde_json::Value;

const SPHERE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/limit/sphere.toml");
const CYLINDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/limit/cylinder.toml");
const STRIP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/limit/strip.toml");
/// Less ground in larger cells, for what does not need the closed form.
const SMALL: [&str; 3] = [
    "body.ground.grid.x=[0, 12, 24, 34, 42, 47, 49, 50, 51, 53, 58, 66, 78, 95, 118, 150, 190, 250]",
    "body.ground.grid.z=[-150, -115, -88, -68, -53, -41, -31, -23, -16, -10, -6, -3, -1, 0]",
    "body.stamp.grid.x=[0, 12, 24, 34, 42, 47, 49, 50]",
];

/// The strip on little ground.
fn small(ranks: usize, sets: &[&str]) -> Value {
    solve(ranks, STRIP, &[&SMALL, sets].concat()).converged().summary()
}

/// Lower bound, upper bound and the factor of the last equilibrium, which is below the upper one but for the power that its residual takes
/// from the flow: as much of the loads' as is missing of their energy. The bounds are as near as was wanted.
fn bounds(summary: &Value, tolerance: f64) -> [f64; 3] {
    let limit = &summary["limit_load"];
    let [lower, upper, factor] = ["lower", "upper", "factor"].map(|key| number(limit, key));
    let [external, stored, plastic, friction, closing] =
        ["external", "stored", "plastic", "friction", "closing"].map(|key| number(&summary["energies"], key));
    let missing = (external - stored - plastic - friction - closing).abs() / external;
    assert!(factor <= upper * (1.0 + missing), "{limit}, of their energy {missing} is missing");
    assert!(lower <= upper && upper - lower <= tolerance * upper.abs(), "{limit}");
    [lower, upper, factor]
}

/// Both bounds are within a hundredth of the closed form. The strip takes a tenth of the multiplications that approaching it by
/// displacements took, on little ground in large cells less.
#[test]
fn closed_forms_are_between_bounds_or_near_them() {
    for (scene, multiplications) in [(SPHERE, 120.0), (CYLINDER, 40.0), (STRIP, 256.0)] {
        let summary = solve(2, scene, &[]).converged().summary();
        let [lower, upper, _] = bounds(&summary, 0.01);
        assert!((lower - 1.0).abs() < 0.0102 && (upper - 1.0).abs() < 0.0102, "{scene}: {lower} to {upper}");
        assert!(number(&summary, "hessian_multiplications") <= multiplications, "{scene}");
    }
    assert!(number(&small(2, &[]), "hessian_multiplications") <= 256.0);
}

/// Loads of the scene are of any size: the same strip bears as much. Only the first step, which is solved relative to
/// its loads, is less exact where these are too large, and is solved twice where they are far too large.
#[test]
fn loads_of_any_size_take_about_as_many_applications_of_the_dual_operator() {
    let [plain, others @ ..] = [2519.0, 2519e-6, 2519e3, 2519e9].map(|pressure| {
        let summary = solve(2, STRIP, &[&format!("load.stamp.pressure={pressure:?}")]).converged().summary();
        (number(&summary["limit_load"], "factor") * pressure, number(&summary, "hessian_multiplications"))
    });
    for other in others {
        assert!((other.0 / plain.0 - 1.0).abs() < 1e-3, "{other:?} {plain:?}");
        assert!(other.1 <= 1.5 * plain.1, "{other:?} {plain:?}");
    }
}

/// Bounds that are far apart have those between them, but for the residual, that are near each other.
#[test]
fn wide_bounds_contain_narrow_ones() {
    const WIDE: f64 = 0.03;
    let more = ["decomposition.subdomains=5", "material.stamp.young=1e6"];
    let other = [&SMALL[..], &more].concat();
    for (scene, sets) in [(SPHERE, &[][..]), (CYLINDER, &[]), (STRIP, &SMALL), (STRIP, &other)] {
        let found = |tolerance: f64| {
            let tolerance_key = format!("limit.tolerance={tolerance}");
            bounds(&solve(2, scene, &[sets, &[&tolerance_key]].concat()).converged().summary(), tolerance)
        };
        let ([lower, upper, _], [narrow_lower, narrow_upper, _]) = (found(WIDE), found(0.002));
        assert!(lower <= narrow_upper * (1.0 + 0.1 * WIDE), "{scene}: {lower} above {narrow_upper}");
        assert!(upper >= narrow_lower, "{scene}: {upper} below {narrow_lower}");
    }
}

#[test]
fn bounds_are_the_same_bits_on_any_ranks() {
    let sets = ["decomposition.subdomains=6"];
    let alone = small(1, &sets);
    for ranks in [2, 3] {
        let found = small(ranks, &sets);
        for key in ["limit_load", "energy", "hessian_multiplications", "steps"] {
            assert_eq!(found[key], alone[key], "{key} on {ranks} ranks");
        }
    }
}

#[test]
fn it_goes_on_from_a_checkpoint_between_any_two_steps() {
    const CELLS: [&str; 2] = ["body.lower.brick.cells=[12, 4, 4]", "body.upper.brick.cells=[12, 4, 4]"];
    const SOFT: [&str; 2] = ["material.lower.hardening=0", "material.upper.hardening=0"];
    const REST: [&str; 4] =
        ["body.lower.element=hex8", "body.upper.element=hex8", "decomposition.subdomains=4", "limit.tolerance=0.001"];
    let sets = [&CELLS[..], &SOFT, &REST].concat();
    let directory = tempfile::tempdir().unwrap();
    let (whole, out) = (directory.path().join("whole"), directory.path().join("stopped"));
    let end = run_briefly(1, &crate::checkpoint::solve(&whole, &sets, &[]));
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    let equilibria = newton(&whole);
    let of_first = equilibria.iter().take_while(|equilibrium| **equilibrium == 1).count();
    assert!(of_first < equilibria.len());
    // In the first equilibrium, between it and the second one, and after the first step of that.
    for (steps, ranks) in [(1, 2), (of_first, 3), (of_first + 1, 3)] {
        let end = resume_with(ranks, &stopped_after(steps, &out, &sets), &[]);
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert_same_result(&out, &whole, "two-blocks");
    }
}

/// What a sphere bears inside grows by what presses outside, in all.
#[test]
fn loads_that_stay_shift_the_limit_as_they_must() {
    let alone = bounds(&solve(1, SPHERE, &["body.wall.sphere.cells=[3, 3]"]).converged().summary(), 0.01)[2];
    let pressure = 2.0 * 240.0 * 2f64.ln();
    for share in [-0.5, 0.4, 1.5] {
        let outside = format!("load.outside={{surface=\"wall.outer\",pressure={:?}}}", share * pressure);
        let sets = ["body.wall.sphere.cells=[3, 3]", &outside, "limit.loads=[\"bore\"]"];
        let found = bounds(&solve(1, SPHERE, &sets).converged().summary(), 0.01)[2];
        assert!((found - alone - share).abs() < 2e-3, "{share}: {found}");
    }
}

/// The limit does not depend on elastic moduli, on units, on gaps and overlaps, or on how bodies are cut.
#[test]
fn the_limit_is_that_of_strength_alone() {
    let near = |sets: &[&str], wanted: f64| {
        let found = bounds(&small(2, sets), 0.01)[2];
        assert!((found / wanted - 1.0).abs() < 3e-3, "{sets:?}: {found} for {wanted}");
    };
    let alone = bounds(&small(2, &["limit.tolerance=1e-4"]), 1e-4)[2];
    near(&["material.ground.poisson=0.3"], alone);
    near(&["material.ground.poisson=0.499"], alone);
    near(&["material.ground.young=1e6", "material.stamp.young=1e12"], alone);
    near(&["load.stamp.pressure=1e-3"], alone * 2519.355 * 1e3);
    near(&["contact.foot.gap=0.02"], alone);
    near(&["contact.foot.gap=-0.02"], alone);
    near(&["decomposition.subdomains=7"], alone);
    let rested = "load.weight={body=\"ground\",body_force=[0.0,0.0,-30.0]}";
    near(&[rested, "limit.loads=[\"stamp\"]"], alone);
}

/// A tube of two rings bears what one of both sizes does: overlaps, even those that let both flow and turn the work of the pressure round,
/// and gaps, which close on the way, do not matter.
#[test]
fn two_rings_bear_as_much_as_one_whatever_their_fit() {
    let set = |ring: &str, inner: f64, outer: f64| {
        format!("body.{ring}.cylinder={{inner={inner:?},outer={outer:?},height=50.0,cells=[8, 4, 1]}}")
    };
    let more = [
        set("wall", 100.0, 140.0),
        "body.ring.material=\"steel\"".to_owned(),
        "body.ring.element=\"hex8\"".to_owned(),
        set("ring", 140.0, 200.0),
        "support.ring-x0={surface=\"ring.x0\",fix=[\"x\"]}".to_owned(),
        "support.ring-y0={surface=\"ring.y0\",fix=[\"y\"]}".to_owned(),
        "support.ring-bottom={surface=\"ring.bottom\",fix=[\"z\"]}".to_owned(),
        "support.ring-top={surface=\"ring.top\",fix=[\"z\"]}".to_owned(),
    ];
    for gap in [-2.0, -0.3, 0.0, 2.0] {
        let fit = format!("contact.fit={{slave=\"wall.outer\",master=\"ring.inner\",gap={gap:?}}}");
        let sets: Vec<&str> = more.iter().chain([&fit]).map(String::as_str).collect();
        let summary = solve(2, CYLINDER, &sets).converged().summary();
        let [lower, upper, _] = bounds(&summary, 0.01);
        assert!((lower - 1.0).abs() < 0.01 && (upper - 1.0).abs() < 0.01, "{gap}: {lower} to {upper}");
        let [rest, work] = ["rest", "work"].map(|key| number(&summary["limit_load"], key));
        assert_eq!(rest < -1e-3 * work.abs(), gap < 0.0, "{gap}: {rest} beside {work}");
    }
}

/// Tangents are stiffer than what flows, and tell of steps that are too short. With these it took 56 of them.
#[test]
fn steps_along_a_mechanism_are_made_longer() {
    let summary = small(2, &["material.stamp.young=1e5"]);
    let lengths = summary["newton"].as_array().unwrap().iter().map(|row| number(row, "damping"));
    assert!(lengths.reduce(f64::max).unwrap() > 1.0);
    assert!(number(&summary, "newton_iterations") <= 48.0, "{}", summary["newton_iterations"]);
}

/// The weaker of two parts decides: a stamp that is squeezed between plane walls bears 2/sqrt(3) of its yield stress.
#[test]
fn the_weakest_part_decides() {
    let summary = small(1, &["material.stamp.yield_stress=1000", "material.ground.yield_stress=1e9"]);
    assert!(number(&summary, "residual_energies") < 1e-3, "{}", summary["energies"]);
    let [lower, upper, _] = bounds(&summary, 0.01);
    let wanted = 2.0 / 3f64.sqrt() * 1000.0 / 2519.3551;
    assert!((lower / wanted - 1.0).abs() < 1e-2 && (upper / wanted - 1.0).abs() < 1e-2, "{lower} to {upper}");
}

/// A soft cantilever and an elastic one of the same size, one on the other, with a pressure of 1 on the upper one.
fn cantilevers(upper: &str, lower: &str) -> String {
    let mut text = format!(
        "material.soft = {{ young = 1e5, poisson = 0.3, yield_stress = 240.0 }}\n\
         material.hard = {{ young = 1e5, poisson = 0.3 }}\n\
         load.top = {{ surface = \"{upper}.zmax\", pressure = 1.0 }}\nlimit = {{}}\n\
         contact.joint = {{ slave = \"{upper}.zmin\", master = \"{lower}.zmax\" }}\n",
    );
    for (body, z) in [(upper, 1.0), (lower, 0.0)] {
        text += &format!(
            "[body.{body}]\nmaterial = \"{body}\"\nelement = \"hex8\"\n\
             brick = {{ origin = [0.0, 0.0, {z:?}], size = [6.0, 1.0, 1.0], cells = [6, 1, 1] }}\n\
             [support.{body}]\nsurface = \"{body}.xmin\"\nfix = [\"x\", \"y\", \"z\"]\n"
        );
    }
    text
}

/// The elastic cantilever above bears everything, whatever the soft one below does: no limit is told.
#[test]
fn elastic_parts_know_no_limit() {
    let directory = tempfile::tempdir().unwrap();
    let run = solve(1, &scene_file(directory.path(), &cantilevers("hard", "soft")), &[]);
    assert_eq!(run.code, 1);
    let summary = run.summary();
    assert!(summary["converged"] == false && summary["error"].as_str().unwrap().contains("the last bounds are"));
    let limit = &summary["limit_load"];
    assert!(number(limit, "upper") > 1.5 * number(limit, "lower"), "{limit}");
}

/// The soft cantilever above is squeezed on the elastic one. Uniaxial compression up to the yield stress is a lower bound; the support
/// at the end of a beam of six times its height adds little.
#[test]
fn soft_parts_are_squeezed_on_elastic_ones() {
    let directory = tempfile::tempdir().unwrap();
    let run = solve(1, &scene_file(directory.path(), &cantilevers("soft", "hard")), &[]);
    let [lower, upper, _] = bounds(&run.converged().summary(), 0.01);
    assert!(lower > 240.0 && upper < 1.02 * 240.0, "{lower} to {upper}");
}

/// A block that only contact holds on a cantilever: where the first stresses are far beyond the limit, the work is done with loads that
/// have turned round, and would pull the block off.
#[test]
fn loads_do_not_turn_round_on_the_way() {
    let directory = tempfile::tempdir().unwrap();
    let text = r#"
        material.soft = { young = 2e5, poisson = 0.3, yield_stress = 100.0 }
        material.hard = { young = 2e4, poisson = 0.3, yield_stress = 1e9 }
        [body.lower]
        material = "soft"
        element = "tet10"
        brick = { origin = [0.0, 0.0, 0.0], size = [4.3, 1.36, 0.61], cells = [6, 2, 2] }
        [body.upper]
        material = "hard"
        element = "tet10"
        brick = { origin = [0.67, 0.0, 0.61], size = [3.14, 1.36, 0.61], cells = [3, 2, 2] }
        [support]
        end = { surface = "lower.xmin", fix = ["x", "y", "z"] }
        along-x = { surface = "upper.xmin", fix = ["x"] }
        along-y = { surface = "upper.ymin", fix = ["y"] }
        [load.top]
        surface = "upper.zmax"
        pressure = 10.0
        [contact.joint]
        slave = "upper.zmin"
        master = "lower.zmax"
        [limit]
        tolerance = 0.03
        "#;
    let scene = scene_file(directory.path(), text);
    let [few, many] = [2, 5].map(|subdomains| {
        let summary = solve(2, &scene, &[&format!("decomposition.subdomains={subdomains}")]).converged().summary();
        assert!(number(&summary, "hessian_multiplications") <= 1000.0, "{}", summary["hessian_multiplications"]);
        bounds(&summary, 0.03)
    });
    assert!(few[0] <= many[1] && many[0] <= few[1], "{few:?} {many:?}");
}

/// Of a mesh of 18 tetrahedra that is refined, the limit comes near the closed form from above, as it must.
#[test]
fn meshes_are_refined_to_a_limit() {
    for (scene, cells) in [(SPHERE, "body.wall.sphere.cells=[1, 1]"), (CYLINDER, "body.wall.cylinder.cells=[2, 1, 1]")]
    {
        let summary = solve_with(2, scene, 1, &[cells], &["--error", "0.5%"]).converged().summary();
        let rows = summary["refinements"].as_array().unwrap();
        let factors: Vec<f64> = rows.iter().map(|row| number(&row["limit_load"], "factor")).collect();
        assert!(rows.len() > 2 && factors.iter().all(|factor| *factor > 0.9999), "{factors:?}");
        let [lower, upper, factor] = bounds(&summary, 0.01);
        // What is told belongs to the equilibrium whose factor stands beside it, not to later ones that do more work.
        let over = number(&rows[rows.len() - 1], "error") / (factors[factors.len() - 1] - 1.0);
        assert!((1.0..6.0).contains(&over), "{over} of the true error is told");
        assert!(factor < 1.005 && lower > 0.999 && upper < 1.012, "{lower} to {upper}");
    }
}

/// Blocks that are refined to a limit: only the last mesh is solved on to near bounds, from where it stood. A run that is stopped on the way
/// there, in that, or on a mesh before goes on with the same bits.
#[test]
fn meshes_between_the_first_and_the_last_have_wide_bounds() {
    let sets = [
        "body.lower.brick.cells=[6, 2, 2]",
        "body.upper.brick.cells=[6, 2, 2]",
        "material.lower.hardening=0",
        "material.upper.hardening=0",
        "decomposition.subdomains=4",
        "solver.error=0.1",
        "limit.tolerance=0.001",
    ];
    let directory = tempfile::tempdir().unwrap();
    let (whole, out) = (directory.path().join("whole"), directory.path().join("stopped"));
    let end = run_briefly(1, &crate::checkpoint::solve(&whole, &sets, &[]));
    assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
    let summary = summary(&whole, "two-blocks");
    bounds(&summary, 0.001);
    let rows = summary["refinements"].as_array().unwrap();
    let steps = |row: &Value| number(row, "newton_iterations") as usize;
    let [before, all] = [rows.len() - 1, rows.len()].map(|meshes| rows[..meshes].iter().map(steps).sum::<usize>());
    let again = newton(&whole).len();
    assert!(rows.len() > 2 && again + 2 < all - before, "{again} of {before} to {all}");
    let wide = rows[1..].iter().map(|row| {
        let [lower, upper] = ["lower", "upper"].map(|key| number(&row["limit_load"], key));
        (upper - lower) / upper
    });
    assert!(wide.clone().any(|width| width > 0.001), "{:?}", wide.collect::<Vec<_>>());
    // After every step, and on other ranks from the last mesh before it is solved on, and from where that is nearly done.
    for (steps, ranks) in [(before + 2, 3), (all - 1, 2)] {
        let end = resume_with(ranks, &stopped_after(steps, &out, &sets), &[]);
        assert_eq!(end.code, 0, "{}{}", end.stdout, end.stderr);
        assert_same_result(&out, &whole, "two-blocks");
    }
}

#[test]
fn the_command_line_asks_for_a_limit_too() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/precision/limit-sphere.toml");
    let sets = ["step=[]", "body.wall.sphere.cells=[2, 2]"];
    let run = solve_with(1, scene, 1, &sets, &["--limit=5%"]);
    let summary = run.converged().summary();
    bounds(&summary, 0.05);
    assert!(summary["steps"].as_array().unwrap().iter().all(|row| !row["limit_load"].is_null()));
}

#[test]
fn what_has_no_limit_is_refused() {
    for (sets, key) in [
        (&["limit.tolerance=0"][..], "limit.tolerance"),
        (&["limit.tolerance=1"], "limit.tolerance"),
        (&["limit.loads=[]"], "limit.loads"),
        (&["limit.loads=[\"bore\",\"bore\"]"], "limit.loads"),
        (&["limit.loads=[\"weight\"]"], "no such load: known are bore"),
        (&["load.bore.pressure=0"], "no load that could grow"),
        (&["material.steel.hardening=100"], "no limit load"),
        (&["step=[{}]"], "does not depend on a history"),
        (&["initial.result=\"before.vtkhdf\""], "does not depend on an earlier state"),
        (&["limit.load=1"], "load"),
    ] {
        assert_scene_refused(SPHERE, sets, 65, &[key]);
    }
}
