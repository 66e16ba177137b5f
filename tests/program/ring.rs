//! Two nested hollow spheres from a mesh file, with interfaces that do not match: against the closed form on two meshes, and
//! the same on every cut. That they are the same on any number of ranks is in `ranks.rs`.

use crate::common::fields::Fields;
use crate::common::{Run, assert_close, assert_near, number, solve, vector};
use fetiplast::analytic::hollow_sphere::HollowSphere;
use fetiplast::analytic::nested_spheres::NestedSpheres;
use fetiplast::material::VonMises;

const RADIUS: f64 = 200.0;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/ring.toml");

/// A mesh half as fine.
const COARSE: [&str; 2] =
    ["body.inner.gmsh.file='../tests/meshes/ring-8-6.msh'", "body.outer.gmsh.file='../tests/meshes/ring-8-6.msh'"];

/// Errors relative to the closed form: of the contact force, and root mean squares of those of the contact pressure and of
/// the displacement of the outer sphere at the interface.
fn errors(run: &Run) -> [f64; 3] {
    let elastic = VonMises::elastic(210_000.0, 0.29);
    let material = VonMises { yield_stress: Some(450.0), hardening: 10_000.0, ..elastic };
    let inner = HollowSphere { inner: 100.0, outer: RADIUS, material };
    let spheres = NestedSpheres { inner, outer_radius: 300.0, outer_material: elastic, gap: 0.05 };
    let exact = spheres.loaded(600.0).expect("no wall yields through");

    let fields = Fields::read(&run.result());
    let (pressure, status) = (fields.of_points("contact_pressure"), fields.integers_of_points("contact_status"));
    let (bodies, displacement) = (fields.body_of_points(), fields.of_points("displacement"));
    let root = |squares: Vec<f64>| (squares.iter().map(|e| e * e).sum::<f64>() / squares.len() as f64).sqrt();
    let slaves = (0..status.len()).filter(|&node| status[node] >= 0);
    let of_pressure = slaves.map(|node| pressure[node] / exact.contact_pressure - 1.0).collect();
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at =
        (0..status.len()).filter(|&node| bodies[node] == 1 && (length(&fields.points[node]) - RADIUS).abs() < 1e-6);
    let outward = exact.outer.displacement(RADIUS);
    let of_displacement = at.map(|node| length(&displacement[3 * node..3 * node + 3]) / outward - 1.0).collect();

    // On an octant the resultant has three equal components, of the pressure on a quarter disc each.
    let quarter = 0.25 * std::f64::consts::PI * RADIUS * RADIUS * exact.contact_pressure;
    let force = vector(&run.summary()["contact_force"]);
    let of_force = force.iter().map(|f| f.abs() / quarter - 1.0).sum::<f64>() / 3.0;
    [of_force.abs(), root(of_pressure), root(of_displacement)]
}

#[test]
fn on_interfaces_that_do_not_match_errors_fall_at_least_with_the_width_of_the_elements() {
    let [coarse, fine] = [&COARSE[..], &[]].map(|mesh| {
        let run = solve(2, SCENE, mesh).converged();
        let summary = run.summary();
        assert_eq!(summary["contacts"][0]["slave"], "inner.interface", "the finer one");
        assert_eq!(summary["contacts"][0]["rule"], "mortar");
        // All nodes touch; on the coarse mesh the pressure's error leaves one of 45 open.
        let touching = number(&summary, "active_contacts") / number(&summary, "contact_rows");
        assert!(touching == 1.0 || (!mesh.is_empty() && touching > 0.95), "{touching} of the nodes touch");
        errors(&run)
    });
    for (coarse, fine) in coarse.iter().zip(fine) {
        assert!(fine < 0.5 * coarse, "{coarse} on the coarse mesh, {fine} on one twice as fine");
    }
    assert!(fine[0] < 0.1 && fine[1] < 0.2 && fine[2] < 0.15, "{fine:?}");
}

const TIGHT: [&str; 3] =
    ["solver.newton_tolerance=1e-8", "solver.residual_tolerance=1e-10", "solver.qp_tolerance=1e-11"];

#[test]
fn every_cut_gives_the_same_energies() {
    let run = |subdomains: usize| {
        let parts = format!("decomposition.subdomains={subdomains}");
        solve(2, SCENE, &[&COARSE[..], &TIGHT, &[&parts]].concat()).converged().summary()
    };
    // One a body, and many.
    let whole = run(2);
    assert_eq!(whole["gluing_rows"], 0);
    for subdomains in [7, 24, 60] {
        let torn = run(subdomains);
        assert!(number(&torn, "subdomains") >= subdomains as f64);
        for key in ["energy", "internal_energy", "external_work", "max_displacement", "max_von_mises"] {
            assert_close(key, number(&torn, key), number(&whole, key), 1e-8);
        }
        assert_near("contact force", vector(&torn["contact_force"]), vector(&whole["contact_force"]), 1e-8);
        for key in ["plastic_elements", "active_contacts", "contacts"] {
            assert_eq!(torn[key], whole[key], "{key}");
        }
    }
}
