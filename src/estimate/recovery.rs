//! Recovered stresses or strains at the nodes.

use std::ops::Range;

use super::polynomial;
use crate::assembly::stress::Sample;
use crate::decomposition::Subdomain;
use crate::decomposition::sums::NodeSums;
use crate::tensor::Voigt;
use crate::vector::{cross, difference};
use crate::work;

/// How far polynomials reach from inside to the boundary: to vertices on faces, and from these to edges and corners that
/// have no neighbour inside.
const ROUNDS: usize = 2;
/// Outward areas around a vertex inside add up to nothing, up to this share of their sizes.
const CLOSED: f64 = 1e-6;
/// Numbers that tell whether they do: the sum, and that of the sizes.
const CLOSURE: usize = 4;

/// The recovered value at each node of each own subdomain, from the samples in each. Collective.
pub fn recover(sums: &NodeSums, subdomains: &[&Subdomain], samples: impl Fn(usize) -> Vec<Sample>) -> Vec<Vec<Voigt>> {
    let mut patches: Vec<Patches> = subdomains.iter().map(|subdomain| Patches::new(subdomain)).collect();
    let mut values: Vec<Vec<f64>> = patches.iter().enumerate().map(|(own, patch)| patch.sums(&samples(own))).collect();
    sums.add(|own, node| patches[own].range(patches[own].vertex[node], patches[own].sums_width()), &mut values);
    patches.iter_mut().zip(values).for_each(|(patch, values)| patch.fit(&values));
    for _ in 0..ROUNDS {
        let mut offers: Vec<Vec<f64>> = patches.iter().map(Patches::offers).collect();
        let open =
            |own: usize, node: usize| patches[own].vertex[node].and_then(|vertex| patches[own].open[vertex as usize]);
        sums.add(|own, node| patches[own].range(open(own, node), patches[own].offer_width()), &mut offers);
        patches.iter_mut().zip(offers).for_each(|(patch, offers)| patch.accept(&offers));
    }
    patches.iter().map(Patches::nodal).collect()
}

/// The polynomials around the vertices of a subdomain.
struct Patches<'a> {
    subdomain: &'a Subdomain,
    /// Monomials of a polynomial.
    n: usize,
    /// Vertex of each local node; none for the middles of edges.
    vertex: Vec<Option<u32>>,
    /// Local node of each vertex.
    nodes: Vec<u32>,
    /// Coefficients, vertex by vertex.
    coefficients: Vec<f64>,
    /// Number of each vertex among those whose polynomial does not come from inside yet.
    open: Vec<Option<u32>>,
}

impl<'a> Patches<'a> {
    fn new(subdomain: &'a Subdomain) -> Self {
        let kind = subdomain.elements.kind();
        let mut vertex = vec![None; subdomain.nodes.len()];
        let of_elements = subdomain.elements.iter().flat_map(|nodes| &nodes[..kind.cell().corners()]);
        of_elements.for_each(|&node| vertex[node as usize] = Some(0));
        let nodes: Vec<u32> = (0..vertex.len() as u32).filter(|&node| vertex[node as usize].is_some()).collect();
        nodes.iter().zip(0..).for_each(|(&node, number)| vertex[node as usize] = Some(number));
        let n = polynomial::monomials(kind.degree());
        Self { subdomain, n, vertex, nodes, coefficients: Vec::new(), open: Vec::new() }
    }

    fn point(&self, node: u32) -> [f64; 3] {
        self.subdomain.points[node as usize]
    }

    /// Vertices of each element.
    fn elements(&self) -> impl Iterator<Item = &[u32]> {
        let corners = self.subdomain.elements.kind().cell().corners();
        self.subdomain.elements.iter().map(move |nodes| &nodes[..corners])
    }

    fn number(&self, node: u32) -> usize {
        self.vertex[node as usize].expect("it is a vertex") as usize
    }

    /// Where so many numbers of something are.
    fn range(&self, number: Option<u32>, width: usize) -> Range<usize> {
        number.map_or(0..0, |number| width * number as usize..width * (number as usize + 1))
    }

    fn sums_width(&self) -> usize {
        CLOSURE + polynomial::width(self.n)
    }

    /// Sums over the own elements around each vertex.
    fn sums(&self, samples: &[Sample]) -> Vec<f64> {
        let kind = self.subdomain.elements.kind();
        let width = self.sums_width();
        let mut sums = vec![0.0; width * self.nodes.len()];
        // Areas of faces, and each sample at each corner: its moments and products.
        let of_corner = if kind.best_at_centre() { 1 } else { kind.points() } * 2 * width;
        work::each(
            self.subdomain.elements.len(),
            kind.cell().corners() * of_corner + 15 * kind.faces().len(),
            size_of_val(samples) / self.subdomain.elements.len().max(1),
        );
        for (nodes, samples) in self.elements().zip(samples.chunks_exact(kind.points())) {
            for face in kind.faces() {
                let face = &face[..kind.cell().corners_of_face()];
                let area = area(face.iter().map(|&local| self.point(nodes[local])));
                for &local in face {
                    let sums = &mut sums[width * self.number(nodes[local])..][..CLOSURE];
                    (0..3).for_each(|i| sums[i] += area[i]);
                    sums[3] += area.iter().map(|a| a.abs()).sum::<f64>();
                }
            }
            let centre = [centre(samples)];
            let samples = if kind.best_at_centre() { &centre } else { samples };
            for &node in nodes {
                let sums = &mut sums[width * self.number(node)..][CLOSURE..width];
                for sample in samples {
                    polynomial::add(self.n, difference(sample.place, self.point(node)), &sample.value, sums);
                }
            }
        }
        sums
    }

    /// Own polynomials for all vertices, to stay where they are inside, or quadratic and told by the samples: patches of linear
    /// elements see a boundary from too near for a slope.
    fn fit(&mut self, sums: &[f64]) {
        self.coefficients = vec![0.0; 6 * self.n * self.nodes.len()];
        // A factor, and six solves with it.
        work::each(self.nodes.len(), self.n.pow(3) / 3 + 12 * self.n.pow(2), size_of::<f64>() * self.sums_width());
        let of_vertices = sums.chunks_exact(self.sums_width());
        let quadratic = self.subdomain.elements.kind().degree() == 2;
        let mut opened = 0..;
        for (sums, coefficients) in of_vertices.zip(self.coefficients.chunks_exact_mut(6 * self.n)) {
            let told = polynomial::fit(self.n, &sums[CLOSURE..], coefficients);
            let outward = sums[..3].iter().map(|a| a.abs()).sum::<f64>();
            let inside = outward <= CLOSED * sums[3] || (quadratic && told);
            self.open.push(if inside { None } else { opened.next() });
        }
    }

    /// Coefficients and how many polynomials they are the sum of.
    fn offer_width(&self) -> usize {
        6 * self.n + 1
    }

    fn polynomial(&self, vertex: usize) -> &[f64] {
        &self.coefficients[6 * self.n * vertex..][..6 * self.n]
    }

    /// What each open vertex is offered by the others of its elements.
    fn offers(&self) -> Vec<f64> {
        let width = self.offer_width();
        let mut offers = vec![0.0; width * self.open.iter().flatten().count()];
        for nodes in self.elements() {
            let givers = || nodes.iter().filter(|&&node| self.open[self.number(node)].is_none());
            for &node in nodes {
                let Some(open) = self.open[self.number(node)] else { continue };
                let offer = &mut offers[width * open as usize..][..width];
                for &giver in givers() {
                    work::add(4 * width, size_of::<f64>() * width);
                    let way = difference(self.point(node), self.point(giver));
                    polynomial::add_moved(self.polynomial(self.number(giver)), way, offer);
                    offer[width - 1] += 1.0;
                }
            }
        }
        offers
    }

    /// Closes vertices that have offers, with their mean.
    fn accept(&mut self, offers: &[f64]) {
        let width = self.offer_width();
        let mut left = 0..;
        for (open, coefficients) in self.open.iter_mut().zip(self.coefficients.chunks_exact_mut(6 * self.n)) {
            let Some(number) = *open else { continue };
            let (offer, count) = offers[width * number as usize..][..width].split_at(width - 1);
            if count[0] > 0.0 {
                coefficients.iter_mut().zip(offer).for_each(|(c, offer)| *c = offer / count[0]);
                *open = None;
            } else {
                *open = left.next();
            }
        }
    }

    /// The recovered value at every node.
    fn nodal(&self) -> Vec<Voigt> {
        let mut nodal = vec![[0.0; 6]; self.vertex.len()];
        for (vertex, &node) in self.nodes.iter().enumerate() {
            nodal[node as usize] = polynomial::value(self.polynomial(vertex), [0.0; 3]);
        }
        let kind = self.subdomain.elements.kind();
        for nodes in &self.subdomain.elements {
            for (&middle, &(a, b)) in nodes[kind.cell().corners()..].iter().zip(kind.middles()) {
                let from = |end: usize| {
                    let way = difference(self.point(middle), self.point(nodes[end]));
                    polynomial::value(self.polynomial(self.number(nodes[end])), way)
                };
                // In an order that all elements around the edge agree on.
                let (a, b) = if nodes[a] < nodes[b] { (from(a), from(b)) } else { (from(b), from(a)) };
                nodal[middle as usize] = std::array::from_fn(|s| 0.5 * (a[s] + b[s]));
            }
        }
        nodal
    }
}

/// Area vector of a face by its corners.
fn area(corners: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 3] {
    let mut area = [0.0; 3];
    let Some(first) = corners.clone().next() else { return area };
    for (b, c) in corners.clone().skip(1).zip(corners.skip(2)) {
        let twice = cross(difference(b, first), difference(c, first));
        area.iter_mut().zip(twice).for_each(|(area, twice)| *area += 0.5 * twice);
    }
    area
}

/// Mean of the samples by volume.
fn centre(samples: &[Sample]) -> Sample {
    let weight: f64 = samples.iter().map(|sample| sample.weight).sum();
    let mut mean = Sample { place: [0.0; 3], weight, value: [0.0; 6] };
    for sample in samples {
        let share = sample.weight / weight;
        mean.place.iter_mut().zip(sample.place).for_each(|(mean, x)| *mean += share * x);
        mean.value.iter_mut().zip(sample.value).for_each(|(mean, s)| *mean += share * s);
    }
    mean
}
