//! The loop over the elements of a subdomain, and over their integration points.
//!
//! The kind of the elements is looked up once. What is done with an element is compiled for each kind.

use crate::element::{Element, Nodal, Point, by_kind};
use crate::mesh::Elements;
use crate::tensor::Voigt;
use crate::work;

/// An element of `N` nodes and `P` integration points.
pub struct Visited<'a, const N: usize, const P: usize> {
    /// Its number in the subdomain.
    pub index: usize,
    /// Its nodes.
    pub nodes: &'a [u32; N],
    /// Its integration points.
    pub points: &'a [Point<N>; P],
    /// Values of the shape functions at its points.
    pub values: &'a [[f64; N]; P],
}

impl<const N: usize, const P: usize> Visited<'_, N, P> {
    /// Values at its nodes of a nodal vector of the subdomain.
    #[inline]
    pub fn nodal(&self, u: &[f64]) -> Nodal<N> {
        self.nodes.map(|n| std::array::from_fn(|i| u[3 * n as usize + i]))
    }

    /// Each point with its number in the subdomain.
    #[inline]
    pub fn points(&self) -> impl Iterator<Item = (usize, &Point<N>)> {
        (P * self.index..).zip(self.points)
    }
}

/// What is done with an element of any kind. Whoever does it books its own work; that of the geometry is booked already.
pub trait Visitor {
    /// Sees the next element.
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>);
}

/// Shows a visitor all elements; nodes are at `places`.
///
/// # Panics
/// If an element has no volume. Meshes and cuts are checked before.
pub fn for_each_element(elements: &Elements, places: &[[f64; 3]], visitor: &mut impl Visitor) {
    by_kind!(elements.kind(), E => show::<E, _, _>(elements, places, visitor));
}

fn show<E: Element<N, P>, const N: usize, const P: usize>(
    elements: &Elements,
    places: &[[f64; 3]],
    visitor: &mut impl Visitor,
) {
    let values = &E::values_at_points();
    // Per point the derivatives of the place, their inverse, and the gradients of the nodes; nodes with their places are read.
    work::each(elements.len(), P * (2 * 18 * N + 40), N * (size_of::<u32>() + size_of::<[f64; 3]>()));
    for (index, nodes) in elements.of::<N>().iter().enumerate() {
        let points = E::points(&nodes.map(|n| places[n as usize]));
        assert!(points.iter().all(|point| point.weight > 0.0), "elements of a checked mesh have volume");
        visitor.see(&Visited { index, nodes, points: &points, values });
    }
}

/// Operations of a strain from the displacements of so many nodes ([`Point::strain`]), and of as many nodal forces from a stress.
pub fn strain_flops(nodes: usize) -> usize {
    18 * nodes
}

/// Operations of a material law at a point, more or less: the trial stress, its deviator, and the way back.
pub const LAW: usize = 60;

/// An integration point, with the strains there of `M` displacements.
pub struct AtPoint<const M: usize> {
    /// Number of its element in the subdomain.
    pub element: usize,
    /// Its own number in the subdomain.
    pub index: usize,
    /// Volume that it stands for.
    pub weight: f64,
    /// Volume of its element.
    pub volume: f64,
    /// Strain of each displacement (engineering shears).
    pub strains: [Voigt; M],
}

/// Shows all integration points, element by element, with the strains of some displacements; nodes are at `places`.
///
/// # Panics
/// If an element has no volume. Meshes and cuts are checked before.
pub fn for_each_point<const M: usize>(
    elements: &Elements,
    places: &[[f64; 3]],
    displacements: [&[f64]; M],
    see: impl FnMut(AtPoint<M>),
) {
    let points = elements.len() * elements.kind().points();
    work::each(points, M * strain_flops(elements.kind().nodes()) + LAW, size_of::<[f64; 3]>() * M);
    for_each_element(elements, places, &mut Points { displacements, see });
}

struct Points<'a, const M: usize, F> {
    displacements: [&'a [f64]; M],
    see: F,
}

impl<const M: usize, F: FnMut(AtPoint<M>)> Visitor for Points<'_, M, F> {
    #[inline]
    fn see<const N: usize, const P: usize>(&mut self, element: &Visited<N, P>) {
        let displacements = self.displacements.map(|u| element.nodal(u));
        let volume = element.points.iter().map(|point| point.weight).sum();
        for (index, point) in element.points() {
            let strains = displacements.each_ref().map(|u| point.strain(u));
            (self.see)(AtPoint { element: element.index, index, weight: point.weight, volume, strains });
        }
    }
}
