//! What elements can do beyond homogeneous states: bending of nearly incompressible bodies, the benchmark.

use crate::common::{COARSEST, assert_close, assert_residuals, number, scene_file, solve, solve_with};

/// Deflection of a cantilever in plane strain under a shear traction at its end, over that of beam theory. Its height is 1.
fn deflection(element: &str, cells: [usize; 2], poisson: f64) -> f64 {
    const YOUNG: f64 = 1000.0;
    const LENGTH: f64 = 10.0;
    const TRACTION: f64 = 1e-3;
    let [along, high] = cells;
    let text = format!(
        r#"
        material.rubber = {{ young = {YOUNG}, poisson = {poisson} }}
        [body.beam]
        material = "rubber"
        element = "{element}"
        brick = {{ origin = [0.0, 0.0, 0.0], size = [{LENGTH}, 1.0, 0.1], cells = [{along}, {high}, 1] }}
        [support]
        wall = {{ surface = "beam.xmin", fix = ["x", "y"] }}
        front = {{ surface = "beam.zmin", fix = ["z"] }}
        back = {{ surface = "beam.zmax", fix = ["z"] }}
        [load.end]
        surface = "beam.xmax"
        traction = [0.0, {TRACTION}, 0.0]
        [decomposition]
        subdomains = 3"#
    );
    let directory = tempfile::tempdir().unwrap();
    let summary = solve(2, &scene_file(directory.path(), &text), &[]).converged().summary();
    assert_residuals(&summary, 1e-6);
    // Timoshenko's beam: P L^3 / 3 E'I and 6/5 P L / G A, with the modulus of plane strain.
    let plane = YOUNG / (1.0 - poisson * poisson);
    let shear = YOUNG / (2.0 * (1.0 + poisson));
    let theory = TRACTION * (4.0 * LENGTH.powi(3) / plane + 1.2 * LENGTH / shear);
    // The largest displacement is that of the upper edge of the end, which also moves along the beam by what the end
    // turns: P L^2 / 2 E'I times half the height.
    let turned = TRACTION * 3.0 * LENGTH * LENGTH / plane;
    number(&summary, "max_displacement") / theory.hypot(turned)
}

#[test]
fn mean_dilatation_keeps_nearly_incompressible_bodies_from_locking() {
    let bends = |element, poisson| deflection(element, [80, 8], poisson);
    for poisson in [0.3, 0.499, 0.4999] {
        let ratio = bends("hex8", poisson);
        assert!((ratio - 1.0).abs() < 0.02, "nu = {poisson}: {ratio}");
    }
    // What it cures: the tetrahedra of the same cells are hardly moved.
    let locked = bends("tet4", 0.4999);
    assert!(locked < 0.5, "{locked}");
}

#[test]
fn the_benchmark_converges_from_rest_and_from_a_coarser_level_alike() {
    for element in ["hex8"] {
        let elements = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
        let sets: Vec<&str> = COARSEST.into_iter().chain(elements.iter().map(String::as_str)).collect();
        let [cold, warm] =
            ["off", "on"].map(|way| solve_with(2, "two-blocks", 2, &sets, &["--cascade", way]).converged().summary());
        for key in ["energy", "internal_energy", "external_work", "max_displacement"] {
            assert_close(key, number(&warm, key), number(&cold, key), 1e-6);
        }
        assert_residuals(&warm, 1e-6);
        assert!(number(&warm, "hessian_multiplications") < 0.9 * number(&cold, "hessian_multiplications"));
        let alone = solve_with(1, "two-blocks", 2, &sets, &["--cascade", "on"]).converged().summary();
        for key in ["energy", "max_von_mises", "hessian_multiplications", "plastic_elements"] {
            assert_eq!(alone[key], warm[key], "{key} on one rank and on two");
        }
    }
}

#[test]
fn quadratic_elements_solve_the_benchmark_with_less_energy_on_the_same_cells() {
    let solved = |ranks, element: &str| {
        let elements = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
        let sets: Vec<&str> = COARSEST.into_iter().chain(elements.iter().map(String::as_str)).collect();
        solve(ranks, "two-blocks", &sets).converged().summary()
    };
    let [alone, quadratic] = [1, 2].map(|ranks| solved(ranks, "tet10"));
    assert_residuals(&quadratic, 1e-6);
    for key in ["energy", "max_von_mises", "hessian_multiplications", "plastic_elements", "active_contacts"] {
        assert_eq!(alone[key], quadratic[key], "{key} on one rank and on two");
    }
    assert!(number(&quadratic, "energy") < number(&solved(2, "tet4"), "energy"));
}
