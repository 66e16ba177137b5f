//! `F(u) = D Psi(u)`: internal forces and energy of a subdomain, and energies in the elastic norm.

use super::Region;
use super::visit::{LAW, Visited, Visitor, for_each_element, for_each_point, strain_flops};
use crate::element::{Nodal, Point};
use crate::material::{History, Law};
use crate::tensor::von_mises;
use crate::work;

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
    pub equivalent_plastic_strain: f64,
    /// Whether it yields at one point at least.
    pub plastic: bool,
}

/// Adds the internal forces at `u`, one step from the committed history, to `forces`.
pub fn add_forces(region: &Region, u: &[f64], forces: &mut [f64]) -> Internal {
    let modulus = region.material.hooke().lambda() + 2.0 * region.material.hooke().shear_modulus();
    let mut pass = Forces { region, u, forces, modulus, sum: Internal::default() };
    let elements = &region.subdomain.elements;
    let (nodes, points) = (elements.kind().nodes(), elements.kind().points());
    // Strain, stress, forces and the size of the terms at each point; displacements are read, forces written.
    let flops = points * (2 * strain_flops(nodes) + LAW + 14 * nodes);
    work::each(elements.len(), flops, 2 * nodes * size_of::<[f64; 3]>());
    for_each_element(&region.subdomain.elements, &region.subdomain.points, &mut pass);
    pass.sum
}

struct Forces<'a> {
    region: &'a Region<'a>,
    u: &'a [f64],
    forces: &'a mut [f64],
    /// `lambda + 2 mu`.
    modulus: f64,
    sum: Internal,
}

impl Visitor for Forces<'_> {
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let u = element.nodal(self.u);
        self.sum.terms.add(element.points, self.modulus, &u);
        let mut plastic = false;
        let mut local = [[0.0; 3]; N];
        for (index, point) in element.points() {
            let response = self.region.material.respond(&point.strain(&u), self.region.committed(index));
            self.sum.energy += point.weight * response.energy;
            plastic |= response.plastic;
            point.add_internal(&response.stress, &mut local);
        }
        self.sum.plastic += usize::from(plastic);
        for (&node, force) in element.nodes.iter().zip(&local) {
            (0..3).for_each(|i| self.forces[3 * node as usize + i] += force[i]);
        }
    }
}

/// What the elements answer to `u`, one step from the committed history.
pub fn answers(region: &Region, u: &[f64]) -> Vec<Answer> {
    let mut answers = vec![Answer::default(); region.subdomain.elements.len()];
    for_each_point(&region.subdomain.elements, &region.subdomain.points, [u], |at| {
        let response = region.material.respond(&at.strains[0], region.committed(at.index));
        let (share, answer) = (at.weight / at.volume, &mut answers[at.element]);
        answer.von_mises += share * von_mises(&response.stress);
        answer.equivalent_plastic_strain += share * response.equivalent_plastic_strain;
        answer.plastic |= response.plastic;
    });
    answers
}

/// `Psi(u + change) - Psi(u) - F(u)'change >= 0` (energy), without cancellation.
pub fn divergence(region: &Region, u: &[f64], change: &[f64]) -> f64 {
    let mut sum = 0.0;
    for_each_point(&region.subdomain.elements, &region.subdomain.points, [u, change], |at| {
        let [strain, change] = &at.strains;
        sum += at.weight * region.material.divergence(strain, change, region.committed(at.index));
    });
    sum
}

/// The histories after the step that ends at `u`.
pub fn commit(region: &Region, u: &[f64]) -> Vec<History> {
    let elements = &region.subdomain.elements;
    let mut histories = Vec::with_capacity(elements.kind().points() * elements.len());
    for_each_point(elements, &region.subdomain.points, [u], |at| {
        histories.push(region.material.commit(&at.strains[0], region.committed(at.index)));
    });
    histories
}

/// The elements that yield at `u`, one step from the committed history, by their nodes.
pub fn yielding<'a>(region: &Region<'a>, u: &[f64]) -> impl Iterator<Item = &'a [u32]> + use<'a> {
    let answers = answers(region, u);
    region.subdomain.elements.iter().zip(answers).filter(|(_, answer)| answer.plastic).map(|(nodes, _)| nodes)
}

/// What is stored elastically from the first displacement to the second, one step from the committed history, and the plastic work
/// by the mean of the stresses (energies).
pub fn work(region: &Region, ends: [&[f64]; 2]) -> [f64; 2] {
    let (hooke, mut sums) = (region.material.hooke(), [0.0; 2]);
    for_each_point(&region.subdomain.elements, &region.subdomain.points, ends, |at| {
        let committed = region.committed(at.index);
        let [before, after] = at.strains.map(|strain| region.material.respond(&strain, committed).stress);
        let total: f64 = (0..6).map(|i| 0.5 * (before[i] + after[i]) * (at.strains[1][i] - at.strains[0][i])).sum();
        let stored = 0.5 * (hooke.complementary_square(&after) - hooke.complementary_square(&before));
        sums[0] += at.weight * stored;
        sums[1] += at.weight * (total - stored);
    });
    sums
}

/// `v'K_e v` of each vector (energy).
pub fn elastic_squares<const M: usize>(region: &Region, vectors: [&[f64]; M]) -> [f64; M] {
    let mut squares = [0.0; M];
    for_each_point(&region.subdomain.elements, &region.subdomain.points, vectors, |at| {
        for (square, strain) in squares.iter_mut().zip(&at.strains) {
            *square += at.weight * region.material.hooke().square(strain);
        }
    });
    squares
}
