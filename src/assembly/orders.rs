//! Observed orders of all elements on a smooth elastic solution: `u = c sin(pi x) sin(pi y) sin(pi z)` on the unit cube, held
//! all around, under the body force that it takes. Errors are integrated by 27 points an element, which the elements do not
//! know.

use std::f64::consts::PI;

use super::{Region, stiffness};
use crate::decomposition::{Bodies, Shape, Subdomain, number_bodies};
use crate::element::Kind;
use crate::element::sample::{Sample, samples};
use crate::material::{Law, Material, VonMises};
use crate::mesh::Brick;
use crate::sparse::pattern::Pattern;
use crate::tensor::{Voigt, apply, contract};

pub const MATERIAL: Material = Material::VonMises(VonMises::elastic(1.0, 0.3));
const C: [f64; 3] = [1.0, -0.5, 0.7];

pub fn exact(x: [f64; 3]) -> [f64; 3] {
    C.map(|c| c * x.iter().map(|x| (PI * x).sin()).product::<f64>())
}

pub fn exact_strain(x: [f64; 3]) -> Voigt {
    let [s, c] = [x.map(|x| (PI * x).sin()), x.map(|x| PI * (PI * x).cos())];
    let g = [c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]];
    let shear = |i: usize, j: usize| C[i] * g[j] + C[j] * g[i];
    [C[0] * g[0], C[1] * g[1], C[2] * g[2], shear(0, 1), shear(1, 2), shear(2, 0)]
}

/// What the solution takes: `-(lambda + mu) grad div u - mu laplace u`.
pub fn body_force(x: [f64; 3]) -> [f64; 3] {
    let (lambda, mu) = (MATERIAL.hooke().lambda(), MATERIAL.hooke().shear_modulus());
    let [s, c] = [x.map(|x| (PI * x).sin()), x.map(|x| (PI * x).cos())];
    let product: f64 = s.iter().product();
    std::array::from_fn(|i| {
        let second = |j: usize| if i == j { -product } else { c[i] * c[j] * s[3 - i - j] };
        let grad_div: f64 = (0..3).map(|j| C[j] * second(j)).sum();
        PI * PI * (3.0 * mu * C[i] * product - (lambda + mu) * grad_div)
    })
}

/// The unit cube with so many cells along each edge.
pub fn cube(kind: Kind, cells: usize) -> Subdomain {
    let brick = Brick { origin: [0.0; 3], size: [1.0; 3], cells: [cells; 3] };
    let bodies = number_bodies([(kind, Shape::Brick(brick), vec![0])]);
    let torn = Bodies { bodies: &bodies, surfaces: &[] };
    let elements: Vec<u64> = (0..bodies[0].counts().elements).collect();
    Subdomain::of_brick(0, &torn, 0, &elements)
}

/// The displacement of the cube under the body force, with these values at the nodes of its boundary.
pub fn displacement(
    cube: &Subdomain,
    force: impl Fn([f64; 3]) -> [f64; 3],
    exact: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<f64> {
    let pattern = Pattern::new(cube.nodes.len(), &cube.elements, &[]);
    let mut k = vec![0.0; pattern.rows.len()];
    stiffness::assemble(&Region::virgin(cube, &MATERIAL), (&vec![0.0; cube.dofs()], &[]), &pattern, &mut k);
    let mut f = vec![0.0; cube.dofs()];
    for nodes in &cube.elements {
        let places: Vec<[f64; 3]> = nodes.iter().map(|&n| cube.points[n as usize]).collect();
        for Sample { weight, values, .. } in samples(cube.elements.kind(), &places) {
            let force = force(sum(&values, &places));
            for (&node, value) in nodes.iter().zip(values) {
                (0..3).for_each(|i| f[3 * node as usize + i] += weight * value * force[i]);
            }
        }
    }
    let (mut held, mut u) = (vec![false; cube.dofs()], vec![0.0; cube.dofs()]);
    for &node in &cube.boundary {
        held[3 * node as usize..][..3].fill(true);
        u[3 * node as usize..][..3].copy_from_slice(&exact(cube.points[node as usize]));
    }
    let mut ku = vec![0.0; u.len()];
    pattern.multiply_add(&k, &u, &mut ku);
    f.iter_mut().zip(&ku).for_each(|(f, ku)| *f -= ku);
    let inside = solve(&pattern, &k, &f, &held);
    u.iter_mut().zip(inside).for_each(|(u, v)| *u += v);
    u
}

fn sum(weights: &[f64], vectors: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|i| weights.iter().zip(vectors).map(|(w, v)| w * v[i]).sum())
}

/// Errors in the energy norm and in the mean square of the displacement, with `cells` along each edge.
fn errors(kind: Kind, cells: usize) -> [f64; 2] {
    let cube = cube(kind, cells);
    let u = displacement(&cube, body_force, exact);
    let of_elements: Vec<_> = cube
        .elements
        .iter()
        .map(|nodes| {
            let places: Vec<[f64; 3]> = nodes.iter().map(|&n| cube.points[n as usize]).collect();
            (nodes, samples(kind, &places), places)
        })
        .collect();
    let c = MATERIAL.hooke().tangent();
    let mut squares = [0.0; 2];
    for (nodes, samples, places) in &of_elements {
        let of_nodes: Vec<[f64; 3]> = nodes.iter().map(|&n| std::array::from_fn(|i| u[3 * n as usize + i])).collect();
        for Sample { weight, values, gradients } in samples {
            let x = sum(values, places);
            let (found, expected) = (sum(values, &of_nodes), exact(x));
            squares[1] += weight * (0..3).map(|i| (found[i] - expected[i]).powi(2)).sum::<f64>();
            let slope = |i: usize, j: usize| gradients.iter().zip(&of_nodes).map(|(g, u)| g[j] * u[i]).sum::<f64>();
            let shear = |i: usize, j: usize| slope(i, j) + slope(j, i);
            let strain = [slope(0, 0), slope(1, 1), slope(2, 2), shear(0, 1), shear(1, 2), shear(2, 0)];
            let exact = exact_strain(x);
            let error = std::array::from_fn(|k| strain[k] - exact[k]);
            squares[0] += weight * contract(&apply(&c, &error), &error);
        }
    }
    squares.map(f64::sqrt)
}

/// Conjugate gradients on the unknowns that are not held.
fn solve(pattern: &Pattern, k: &[f64], f: &[f64], held: &[bool]) -> Vec<f64> {
    let free = |v: &mut Vec<f64>| v.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(v, _)| *v = 0.0);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut u, mut r) = (vec![0.0; f.len()], f.to_vec());
    free(&mut r);
    let (mut p, mut square) = (r.clone(), dot(&r, &r));
    let start = square;
    while square > 1e-20 * start {
        let mut kp = vec![0.0; p.len()];
        pattern.multiply_add(k, &p, &mut kp);
        free(&mut kp);
        let step = square / dot(&p, &kp);
        u.iter_mut().zip(&p).for_each(|(u, p)| *u += step * p);
        r.iter_mut().zip(&kp).for_each(|(r, kp)| *r -= step * kp);
        let before = std::mem::replace(&mut square, dot(&r, &r));
        p.iter_mut().zip(&r).for_each(|(p, r)| *p = r + square / before * *p);
    }
    u
}

/// Fails unless halving the cells divides the errors by powers of two near these.
fn assert_orders(kind: Kind, coarse: usize, [energy, displacement]: [f64; 2]) {
    let (coarse, fine) = (errors(kind, coarse), errors(kind, 2 * coarse));
    let orders = [0, 1].map(|k| (coarse[k] / fine[k]).log2());
    assert!((orders[0] - energy).abs() < 0.15, "{kind:?} in energy: {coarse:?} {fine:?}, {orders:?}");
    assert!((orders[1] - displacement).abs() < 0.25, "{kind:?} in displacement: {coarse:?} {fine:?}, {orders:?}");
}

#[test]
fn linear_elements_are_of_first_order_in_energy_and_of_second_in_displacement() {
    assert_orders(Kind::Tet4, 8, [1.0, 2.0]);
    assert_orders(Kind::Hex8, 8, [1.0, 2.0]);
}

#[test]
fn quadratic_ones_gain_an_order() {
    assert_orders(Kind::Tet10, 4, [2.0, 3.0]);
}
