//! What the kernels cost, as JSON lines: the machine's limits, one subdomain of several sizes, the coarse problem.
//!
//! `scripts/bench run kernels` keeps the lines of `cargo bench --bench kernels` in `bench-results/raw/kernels`, beside
//! CHOLMOD's; `scripts/bench write kernels` makes a page of them. Times are the best of several, in seconds.

use std::time::Instant;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use fetiplast::comm::solo::Solo;
use fetiplast::kernels::{
    Analysis, Coarse, CoarseFace, Factors, Interconnection, Lower, Precision, Region, Schur, Subdomain, Workspace,
    analyse, stiffness,
};
use fetiplast::model::{self, Discrete};
use fetiplast::scene::Scene;
use serde_json::json;

/// Subdomains a problem: as many as are solved together.
const COUNT: usize = 8;

fn main() {
    machine();
    for cells in [4, 6, 8, 10, 12] {
        subdomain(cells);
    }
    for side in [5, 10, 15, 22] {
        coarse(side);
    }
}

fn best(times: usize, mut body: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        body();
        start.elapsed().as_secs_f64()
    };
    (0..times).map(once).fold(f64::INFINITY, f64::min)
}

/// Rate of multiplying matrices, and of reading memory.
fn machine() {
    let n = 512;
    let (a, mut c) = (Mat::<f32>::from_fn(n, n, |i, j| (i + j) as f32), Mat::<f32>::zeros(n, n));
    let single = best(20, || matmul(&mut c, Accum::Replace, &a, &a, 1.0, Par::Seq));
    let (a, mut c) = (Mat::<f64>::from_fn(n, n, |i, j| (i + j) as f64), Mat::<f64>::zeros(n, n));
    let double = best(20, || matmul(&mut c, Accum::Replace, &a, &a, 1.0, Par::Seq));
    let numbers = vec![1_u64; 1 << 25];
    let mut sum = 0;
    let read = best(10, || sum += std::hint::black_box(&numbers).iter().sum::<u64>());
    assert!(sum > 0);
    let flops = 2.0 * (n * n * n) as f64;
    println!(
        "{}",
        json!({
            "kind": "machine", "gemm_single_gflops": flops / single / 1e9, "gemm_double_gflops": flops / double / 1e9,
            "read_gb_per_s": 8.0 * numbers.len() as f64 / read / 1e9,
        })
    );
}

/// Everything that a cube of `cells`^3 elastic cells costs, alone and as one of twins.
fn subdomain(cells: usize) {
    let sets = [
        format!("body.block.brick.cells=[{0}, {0}, {0}]", 2 * cells),
        format!("decomposition.cells=[{cells}, {cells}, {cells}]"),
    ];
    let scene = Scene::load("shear", 1, &sets).expect("the scene is sound");
    let Discrete { decomposition, materials, .. } =
        model::discretise(&scene, &Solo).expect("it has a discrete problem");
    let subdomains = &decomposition.subdomains;
    assert_eq!(subdomains.len(), COUNT);
    let symbolic = analyse(subdomains);
    let pattern = &symbolic[0].pattern;
    let mut values = vec![0.0; pattern.rows.len()];
    let rest = vec![0.0; pattern.dofs()];
    let region = Region::virgin(&subdomains[0], &materials[0]);
    let assembly = best(200, || {
        stiffness::assemble(&region, (&rest, &[]), pattern, &mut values);
    });
    for precision in [Precision::Single, Precision::Double] {
        let mut factors = Factors::new(symbolic.clone(), precision, None);
        let mut schur = Schur::new(
            &symbolic,
            subdomains.iter().map(surface).collect(),
            &vec![COUNT; subdomains.len()],
            Some(precision),
        );
        let (mut factor, mut interior) = (f64::INFINITY, f64::INFINITY);
        for (own, subdomain) in subdomains.iter().enumerate() {
            let whole = || factors.factorise(own, subdomain, &values, false).expect("it is definite");
            factor = factor.min(best(5, whole));
            interior = interior.min(best(5, || schur.update(own, own, &values, false).expect("it is definite")));
        }
        let mut x: Vec<Vec<f64>> = subdomains.iter().map(|s| vec![1.0; s.dofs()]).collect();
        let t: Vec<Vec<f64>> = (0..COUNT).map(|own| vec![1.0; schur.boundary(own).len()]).collect();
        let mut forces = t.clone();
        let each = |seconds: f64| seconds / COUNT as f64;
        let alone = [best(20, || factors.solve(&mut x)), best(20, || schur.apply(&t, &mut forces))].map(each);
        factors.factorise(0, &subdomains[0], &values, true).expect("it is definite");
        schur.update(0, 0, &values, true).expect("it is definite");
        for own in 1..COUNT {
            factors.share(own, 0);
            schur.share(own, 0);
        }
        let twins = [best(20, || factors.solve(&mut x)), best(20, || schur.apply(&t, &mut forces))].map(each);
        let whole = symbolic[0].analysis();
        let first = interior_first(&subdomains[0], &symbolic[0].order, Lower::from(pattern), &values, precision);
        println!(
            "{}",
            json!({
                "kind": "subdomain", "cells": cells, "dofs": pattern.dofs(), "boundary": t[0].len(),
                "precision": format!("{precision:?}").to_lowercase(), "assembly": assembly,
                "factor": {"length": whole.factor_length(), "flops": whole.flops(), "seconds": factor},
                "interior_factor": interior,
                "interior_first": {"length": first.0, "flops": first.1, "seconds": first.2},
                "solve": alone[0], "solve_twins": twins[0], "schur": alone[1], "schur_twins": twins[1],
            })
        );
    }
}

/// Local unknowns of the nodes on the boundary.
fn surface(subdomain: &Subdomain) -> Vec<u32> {
    subdomain.boundary.iter().flat_map(|&node| (0..3).map(move |a| 3 * node + a)).collect()
}

/// Length, flops and time of the one factor that eliminates the interior first: it holds the interior factor and that of
/// the dense Schur complement.
fn interior_first(
    subdomain: &Subdomain,
    order: &[u32],
    lower: Lower,
    values: &[f64],
    precision: Precision,
) -> (usize, f64, f64) {
    let boundary = surface(subdomain);
    let inside = order.iter().filter(|dof| boundary.binary_search(dof).is_err());
    let order: Vec<u32> = inside.chain(&boundary).copied().collect();
    let analysis = Analysis::ordered(lower, &order);
    let mut workspace = Workspace::new([&analysis]);
    let mut factor = analysis.factor(precision);
    // The last six pivots are round-off; a shift keeps them positive.
    let mut shifted = values.to_vec();
    for column in 0..lower.column_begin.len() - 1 {
        shifted[lower.column_begin[column] as usize] *= 1.01;
    }
    let seconds = best(5, || workspace.factorise(&analysis, lower, &shifted, &mut factor).expect("it is definite"));
    (analysis.factor_length(), analysis.flops(), seconds)
}

/// The coarse problem of two bodies of `side`^3 subdomains of one cell each.
fn coarse(side: usize) {
    let size = |origin: f64| {
        format!("{{ origin = [0.0, 0.0, {origin}], size = [1.0, 1.0, 1.0], cells = [{side}, {side}, {side}] }}")
    };
    let sets = [
        format!("body.lower.brick={}", size(0.0)),
        format!("body.upper.brick={}", size(1.0)),
        "decomposition.cells=[1, 1, 1]".to_owned(),
        "decomposition.cluster=1".to_owned(),
    ];
    let scene = Scene::load("two-blocks", 1, &sets).expect("the scene is sound");
    let Discrete { decomposition, constraints, .. } =
        &model::discretise(&scene, &Solo).expect("it has a discrete problem");
    let subdomains = &decomposition.subdomains;
    let connection = Interconnection::new(&Solo, decomposition, constraints);
    let start = Instant::now();
    let mut coarse = Coarse::new(&Solo, decomposition, constraints, &connection);
    coarse.factorise().expect("supports hold both bodies");
    let setup = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let again = CoarseFace::new(&coarse, vec![true; constraints.rows.len()]);
    let restricted = start.elapsed().as_secs_f64();
    let mut a = vec![1.0; 6 * subdomains.len()];
    let solve = best(10, || coarse.solve(&mut a));
    let mut rows = vec![1.0; constraints.rows.len()];
    let project = best(10, || again.project(&coarse, &mut rows));
    println!(
        "{}",
        json!({
            "kind": "coarse", "subdomains": subdomains.len(), "rows": rows.len(), "length": coarse.factor_length(),
            "setup": setup, "restricted": restricted, "solve": solve, "projection": project,
        })
    );
}
