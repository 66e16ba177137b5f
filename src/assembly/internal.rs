//! `F(u) = D Psi(u)`: internal forces and energy of a subdomain, and energies in the elastic norm.
//!
//! Histories are those of the integration points, element by element.

use super::{committed, displacements, integrated};
use crate::decomposition::Subdomain;
use crate::element::{Nodal, Point, by_kind};
use crate::material::{History, Material};
use crate::tensor::von_mises;

/// What one pass over the elements finds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Internal {
    /// `Psi(u)` (energy).
    pub energy: f64,
    /// Elements that yield at one point at least.
    pub plastic: usize,
    /// What could cancel.
    pub terms: Terms,
}

/// Size of the terms that add up to strains and internal forces. A body that moves as a whole has large terms that
/// cancel to round-off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Sum over the points of `w (lambda + 2 mu) (sum_a |g_a| |u_a|)^2` (energy).
    pub energy: f64,
    /// Sum over the elements and their nodes, of `P` times the sum over their `P` points of `(w (lambda + 2 mu) |g_a|
    /// sum_b |g_b| |u_b|)^2` (force squared).
    pub force_squares: f64,
}

impl Terms {
    fn add<const N: usize, const P: usize>(&mut self, points: &[Point<N>; P], modulus: f64, u: &Nodal<N>) {
        for point in points {
            let steepness = point.gradients.map(|g| g.iter().map(|x| x * x).sum::<f64>());
            let lengths = steepness.iter().zip(u).map(|(s, u)| (s * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])).sqrt());
            let strain: f64 = lengths.sum();
            let stress = point.weight * modulus * strain;
            self.energy += stress * strain;
            self.force_squares += P as f64 * (stress * stress * steepness.iter().sum::<f64>());
        }
    }
}

/// What an element answers: means over its integration points by volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Von Mises stress.
    pub von_mises: f64,
    /// Accumulated plastic strain at the end of the step.
    pub kappa: f64,
    /// Whether it yields at one point at least.
    pub plastic: bool,
}

/// Adds the internal forces at `u`, one step from the committed `history`, to `forces`.
pub fn add_forces(
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
    forces: &mut [f64],
) -> Internal {
    by_kind!(subdomain.elements.kind(), add_forces_of(subdomain, material, history, u, forces))
}

fn add_forces_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
    forces: &mut [f64],
) -> Internal {
    let modulus = material.lambda() + 2.0 * material.shear_modulus();
    let mut sum = Internal::default();
    for (index, (nodes, points)) in integrated(points, &subdomain.elements, &subdomain.points).enumerate() {
        let u = displacements(u, nodes);
        sum.terms.add(&points, modulus, &u);
        let mut plastic = false;
        let mut local = [[0.0; 3]; N];
        for (k, point) in points.iter().enumerate() {
            let response = material.respond(&point.strain(&u), committed(history, P * index + k));
            sum.energy += point.weight * response.energy;
            plastic |= response.plastic;
            point.add_internal(&response.stress, &mut local);
        }
        sum.plastic += usize::from(plastic);
        for (&node, force) in nodes.iter().zip(&local) {
            (0..3).for_each(|i| forces[3 * node as usize + i] += force[i]);
        }
    }
    sum
}

/// What the elements answer to `u`, one step from the committed `history`.
pub fn answers(subdomain: &Subdomain, material: &Material, history: &[History], u: &[f64]) -> Vec<Answer> {
    by_kind!(subdomain.elements.kind(), answers_of(subdomain, material, history, u))
}

fn answers_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
) -> Vec<Answer> {
    let elements = integrated(points, &subdomain.elements, &subdomain.points).enumerate();
    elements
        .map(|(index, (nodes, points))| {
            let u = displacements(u, nodes);
            let volume: f64 = points.iter().map(|point| point.weight).sum();
            let mut answer = Answer::default();
            for (k, point) in points.iter().enumerate() {
                let response = material.respond(&point.strain(&u), committed(history, P * index + k));
                let share = point.weight / volume;
                answer.von_mises += share * von_mises(&response.stress);
                answer.kappa += share * response.kappa;
                answer.plastic |= response.plastic;
            }
            answer
        })
        .collect()
}

/// `Psi(u + change) - Psi(u) - F(u)'change >= 0` (energy), without cancellation.
pub fn divergence(subdomain: &Subdomain, material: &Material, history: &[History], u: &[f64], change: &[f64]) -> f64 {
    by_kind!(subdomain.elements.kind(), divergence_of(subdomain, material, history, u, change))
}

fn divergence_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
    change: &[f64],
) -> f64 {
    let mut sum = 0.0;
    for (index, (nodes, points)) in integrated(points, &subdomain.elements, &subdomain.points).enumerate() {
        let (u, change) = (displacements(u, nodes), displacements(change, nodes));
        for (k, point) in points.iter().enumerate() {
            let history = committed(history, P * index + k);
            sum += point.weight * material.divergence(&point.strain(&u), &point.strain(&change), history);
        }
    }
    sum
}

/// Commits the step that ends at `u`.
pub fn commit(subdomain: &Subdomain, material: &Material, u: &[f64], history: &mut Vec<History>) {
    by_kind!(subdomain.elements.kind(), commit_of(subdomain, material, u, history))
}

fn commit_of<const N: usize, const P: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    u: &[f64],
    history: &mut Vec<History>,
) {
    history.resize(P * subdomain.elements.len(), History::default());
    let elements = integrated(points, &subdomain.elements, &subdomain.points);
    for ((nodes, points), history) in elements.zip(history.as_chunks_mut::<P>().0) {
        let u = displacements(u, nodes);
        for (point, history) in points.iter().zip(history) {
            *history = material.commit(&point.strain(&u), history);
        }
    }
}

/// The elements that yield at `u`, one step from the committed `history`, by their nodes.
pub fn yielding<'a>(
    subdomain: &'a Subdomain,
    material: &Material,
    history: &[History],
    u: &[f64],
) -> impl Iterator<Item = &'a [u32]> + use<'a> {
    let answers = answers(subdomain, material, history, u);
    subdomain.elements.iter().zip(answers).filter(|(_, answer)| answer.plastic).map(|(nodes, _)| nodes)
}

/// `v'K_e v` of each vector (energy).
pub fn elastic_squares<const M: usize>(subdomain: &Subdomain, material: &Material, vectors: [&[f64]; M]) -> [f64; M] {
    by_kind!(subdomain.elements.kind(), elastic_squares_of(subdomain, material, vectors))
}

fn elastic_squares_of<const N: usize, const P: usize, const M: usize>(
    points: impl Fn(&Nodal<N>) -> Option<[Point<N>; P]>,
    subdomain: &Subdomain,
    material: &Material,
    vectors: [&[f64]; M],
) -> [f64; M] {
    let mut squares = [0.0; M];
    for (nodes, points) in integrated(points, &subdomain.elements, &subdomain.points) {
        for (square, v) in squares.iter_mut().zip(vectors) {
            let v = displacements(v, nodes);
            for point in &points {
                *square += point.weight * material.elastic_square(&point.strain(&v));
            }
        }
    }
    squares
}
