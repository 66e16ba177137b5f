//! What every element must do, on distorted shapes.

use std::array::from_fn;

use super::hex8::{self, Hex8};
use super::point::block;
use super::tet4::Tet4;
use super::tet10::Tet10;
use super::{Element, Nodal, Point, cell};
use crate::material::samples::STEEL;
use crate::material::von_mises::{PlasticState, VonMises};
use crate::material::{Law, Variables};
use crate::random::Random;
use crate::tensor::{Tangent, apply};

const TET4: Nodal<4> = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Runs a check on distorted elements of every kind, of edge about 10 and far from the origin.
macro_rules! on_all {
    ($check:ident) => {
        shapes(TET4).for_each(|nodes| $check(nodes, Tet4::points(&nodes)));
        shapes(TET4).map(|corners| bent(&corners)).for_each(|nodes| $check(nodes, Tet10::points(&nodes)));
        let cube = hex8::CORNERS.map(|x| x.map(|x| 0.5 * x));
        shapes(cube).for_each(|nodes| $check(nodes, Hex8::points(&nodes)));
    };
}

fn shapes<const N: usize>(reference: Nodal<N>) -> impl Iterator<Item = Nodal<N>> {
    let mut random = Random::new(5);
    (0..50).map(move |_| {
        reference.map(|x| {
            let shift: [f64; 3] = random.vector(0.15);
            std::array::from_fn(|i| 10.0 * (x[i] + shift[i]) + 100.0)
        })
    })
}

/// The quadratic element on these corners, its edges slightly curved.
fn bent(corners: &Nodal<4>) -> Nodal<10> {
    let mut random = Random::new(4);
    let mut middle = |(a, b): (usize, usize)| {
        let shift: [f64; 3] = random.vector(0.5);
        std::array::from_fn(|i| 0.5 * (corners[a][i] + corners[b][i]) + shift[i])
    };
    let middles = cell::EDGES.map(&mut middle);
    std::array::from_fn(|a| if a < 4 { corners[a] } else { middles[a - 4] })
}

/// `[a][i][b][j]` is row (node a, component i), column (node b, component j).
type Matrix<const N: usize> = [[Nodal<N>; 3]; N];

fn random_field<const N: usize>(random: &mut Random, size: f64) -> Nodal<N> {
    std::array::from_fn(|_| random.vector(size))
}

fn stiffness<const N: usize, const P: usize>(
    points: &[Point<N>; P],
    tangent: impl Fn(&Point<N>) -> Tangent,
) -> Matrix<N> {
    let mut k = [[[[0.0; N]; 3]; 3]; N];
    points.iter().for_each(|point| point.add_stiffness(&tangent(point), &mut k));
    let entry = |a: usize, i: usize, b: usize, j: usize| -> f64 { block(&k, a, b)[i][j] };
    from_fn(|a| from_fn(|i| from_fn(|b| from_fn(|j| entry(a, i, b, j)))))
}

fn times<const N: usize>(k: &Matrix<N>, u: &Nodal<N>) -> Nodal<N> {
    k.map(|rows| rows.map(|row| contract(&row, u)))
}

fn contract<const N: usize>(f: &Nodal<N>, u: &Nodal<N>) -> f64 {
    f.as_flattened().iter().zip(u.as_flattened()).map(|(f, u)| f * u).sum()
}

fn size<const N: usize>(f: &Nodal<N>) -> f64 {
    f.as_flattened().iter().fold(0.0, |size, f| size.max(f.abs()))
}

fn gives_the_strain_of_linear_displacements<const N: usize, const P: usize>(nodes: Nodal<N>, points: [Point<N>; P]) {
    let mut random = Random::new(6);
    let h: [[f64; 3]; 3] = std::array::from_fn(|_| random.vector(1e-2));
    let u = nodes.map(|x| h.map(|row| (0..3).map(|a| row[a] * x[a]).sum()));
    for point in points {
        let strain = point.strain(&u);
        for (c, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
            let expected = if i == j { h[i][i] } else { h[i][j] + h[j][i] };
            assert!((strain[c] - expected).abs() < 1e-14, "{strain:?}");
        }
    }
}

#[test]
fn linear_displacements_give_their_strain_exactly() {
    on_all!(gives_the_strain_of_linear_displacements);
}

fn has_six_free_motions<const N: usize, const P: usize>(nodes: Nodal<N>, points: [Point<N>; P]) {
    let k = stiffness(&points, |_| STEEL.hooke().tangent());
    let scale = k[0][0][0][0];
    for axis in 0..3 {
        let along = [std::array::from_fn(|i| f64::from(i == axis)); N];
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let around = nodes.map(|x| {
            let mut turned = [0.0; 3];
            (turned[b], turned[c]) = (100.0 - x[c], x[b] - 100.0);
            turned
        });
        assert!(size(&times(&k, &along)) < 1e-12 * scale);
        assert!(size(&times(&k, &around)) < 1e-11 * scale);
    }
    // No other motion is free: exactly six eigenvalues are round-off.
    let matrix = faer::Mat::from_fn(3 * N, 3 * N, |p, q| k[p / 3][p % 3][q / 3][q % 3]);
    let values = matrix.self_adjoint_eigenvalues(faer::Side::Lower).expect("a small matrix has eigenvalues");
    let largest = values[3 * N - 1];
    assert!(values[5].abs() < 1e-12 * largest && values[6] > 1e-4 * largest, "{values:?}");
}

#[test]
fn stiffness_is_symmetric_and_blind_to_rigid_motion_only() {
    on_all!(has_six_free_motions);
}

fn answers_elastic_motions_by_its_stiffness<const N: usize, const P: usize>(_: Nodal<N>, points: [Point<N>; P]) {
    let c = STEEL.hooke().tangent();
    let u = random_field(&mut Random::new(9), 1.0);
    let mut internal = [[0.0; 3]; N];
    points.iter().for_each(|point| point.add_internal(&apply(&c, &point.strain(&u)), &mut internal));
    let k = stiffness(&points, |_| c);
    for (a, b) in internal.as_flattened().iter().zip(times(&k, &u).as_flattened()) {
        assert!((a - b).abs() < 1e-12 * k[0][0][0][0]);
    }
}

#[test]
fn elastic_internal_forces_are_stiffness_times_displacement() {
    on_all!(answers_elastic_motions_by_its_stiffness);
}

/// Plastic included: forces are the derivative of the energy, the stiffness that of the forces.
fn has_right_derivatives<const N: usize, const P: usize>(_: Nodal<N>, points: [Point<N>; P]) {
    let mut random = Random::new(10);
    let material = VonMises { hardening: 2e4, ..STEEL };
    let virgin = PlasticState::VIRGIN;
    let (u, direction): (Nodal<N>, Nodal<N>) = (random_field(&mut random, 0.2), random_field(&mut random, 1.0));
    let at = |by: f64| {
        let moved: Nodal<N> = std::array::from_fn(|a| std::array::from_fn(|i| u[a][i] + by * direction[a][i]));
        let (mut energy, mut forces) = (0.0, [[0.0; 3]; N]);
        for point in &points {
            let response = material.respond(&point.strain(&moved), &virgin);
            energy += point.weight * response.energy;
            point.add_internal(&response.stress, &mut forces);
        }
        (energy, forces)
    };
    let h = 1e-6;
    let (back, here, ahead) = (at(-h), at(0.0), at(h));
    let sum: f64 = here.1.as_flattened().iter().map(|f| f.abs()).sum();
    assert!(((ahead.0 - back.0) / (2.0 * h) - contract(&here.1, &direction)).abs() < 1e-6 * sum);
    let k = stiffness(&points, |point| material.stiffness(&point.strain(&u), &virgin, None));
    let slopes = ahead.1.as_flattened().iter().zip(back.1.as_flattened()).map(|(a, b)| (a - b) / (2.0 * h));
    for (slope, force) in slopes.zip(times(&k, &direction).as_flattened()) {
        assert!((slope - force).abs() < 1e-6 * k[0][0][0][0]);
    }
}

#[test]
fn finite_differences() {
    on_all!(has_right_derivatives);
}
