//! Contact of surfaces whose nodes do not match: dual mortar conditions, integrated over the common refinement.
//!
//! Integrals are over the common refinement of both surfaces ([`super::opposite`]; quadrilaterals are cut in both ways, and count
//! half each). With the dual functions `psi_j` of the slave nodes ([`super::dual`]), `D_jk = integral of psi_j phi_k`,
//! `M_jl = integral of psi_j phi_l` over the master and `W_j = integral of psi_j`, the condition on slave node `j` with its unit normal `n_j` is
//!
//! `n_j . (sum of D_jk / W_j x_k - sum of M_jl / W_j x_l) <= 0`
//!
//! at positions `x` after the displacement (Wohlmuth 2011; Popp, Gitterle, Gee, Wall 2010). The sums run over slave nodes `k`,
//! usually `j` alone, and master nodes `l`. On quadratic faces that are curved one normal does not do for all of a condition. With `n(x)`,
//! the normals of the slave nodes between these, it is
//!
//! `sum of d_jk . x_k - sum of m_jl . x_l <= 0`,   `d_jk = integral of psi_j phi_k n / A_j`,   `A_j = sum of integrals of psi_j phi_k n . n_k`,
//!
//! and `m_jl` likewise: a constant pressure acts along `n` everywhere, and a distance along the surface's normals opens all conditions by
//! that much. Either way a constant pressure acts with the same resultant on both sides and on every node as it should: flat surfaces pass
//! the patch test whatever their meshes. Normals stay those of the start.
//!
//! All integrals are over what has the master opposite. On faces that it covers in part, multipliers move to its edge
//! ([`super::edge`]): none pushes beyond it. Nodes of which less than `REACH` of the way is covered carry no condition, nor do
//! those whose normal direction supports hold, so rows stay independent; the pressure on their part of a face goes to its other
//! corners.
//!
//! Quadratic faces carry conditions at their corners only, with the dual functions of the linear functions there and the
//! integrals of products with all quadratic ones on either side (Popp, Wohlmuth, Gee and Wall 2012, "quadratic-linear"): the
//! multipliers still add up to one, so a constant pressure acts on corners and middles as it should. Such a face is four
//! triangles through its middles, which are the geometry; its functions are those of its own coordinates. Where the distance of the other
//! side is bent over a face, as between a pin and its bore, its functions are the [even](DualFunctions::even) ones: dual ones find the surfaces
//! into each other by a tenth to two fifths of what the distance grows by from a node to the next, where they only touch.

use std::collections::BTreeMap;

use super::dual::{self, DualFunctions};
use super::opposite::{Face, INSIDE, IntegrationPoint, Opposite, Seen, faces, functions, line};
use super::patch::Line;
use super::surface::{GatheredSurface, Layer, unit};
use super::{Conditions, ContactError, ContactPair, MasterNode, ROUNDING, edge};
use crate::mesh::surface;
use crate::vector::{difference, dot, length};

/// Share of its surface that a slave node must have opposite a master.
const COVERED: f64 = 1e-6;

/// The linear function of a slave node that must be reached within the covered part for the node to carry a condition: with less, it
/// would say almost the same as those of its neighbours, and the dual problem would be nearly singular. One corner of every face
/// reaches a third.
const REACH: f64 = 0.25;

/// A distance is bent if it differs from a linear one by this share of the width of its face: coordinates of flat surfaces may have been
/// rounded to single precision.
const BENT: f64 = 1e-6;

/// The same share from which a node counts as covered in results: coordinates of parts that meet differ by rounding.
const AT_THE_EDGE: f64 = 1.0 - 1e-3;

/// The covered part of a slave face.
pub(super) struct Part<'a> {
    /// Which of the surface's faces.
    pub number: usize,
    /// Its nodes, corners first.
    pub face: &'a [usize],
    /// Whether it is an own one.
    pub own: bool,
    pub seen: Seen,
    /// Integrals of products of linear functions.
    pub mass: [[f64; 3]; 3],
    /// Functions of the corners at the places of their multipliers; `None` where these are the corners.
    places: Option<[[f64; 3]; 3]>,
    /// Cosines between its normal and those of its corners.
    cosines: [f64; 3],
    /// Whether it is quadratic, and the distance of the other side is bent over it.
    is_bent: bool,
}

/// The sums of one slave node's condition.
#[derive(Default)]
struct Sums {
    /// `W_j`.
    whole: f64,
    /// As `whole`, each triangle's part seen along the node's normal.
    area: f64,
    slaves: BTreeMap<usize, Weight>,
    masters: BTreeMap<u64, Weight>,
}

/// Integrals of the functions of a node.
#[derive(Clone, Copy, Default)]
struct Weight {
    size: f64,
    /// With the normals of the surface.
    along: [f64; 3],
}

impl Weight {
    fn of(size: f64, normal: [f64; 3]) -> Self {
        Self { size, along: normal.map(|n| size * n) }
    }

    fn add(&mut self, other: &Self) {
        self.size += other.size;
        self.along.iter_mut().zip(other.along).for_each(|(along, x)| *along += x);
    }

    /// Whether normals differ from this one, but for round-off of a sum of this size.
    fn is_curved(&self, normal: [f64; 3], whole: f64) -> bool {
        length(difference(self.along, normal.map(|n| self.size * n))) > ROUNDING * whole
    }
}

/// The lines through the triangles of a surface along which those of the other are looked for.
pub fn lines(surface: &GatheredSurface) -> Vec<Line> {
    surface.corners().filter_map(|corners| surface::normal(&corners).map(|normal| line(&corners, normal))).collect()
}

/// Conditions of contact number `contact` on the nodes of own faces, and whether surfaces face each other anywhere: of the master
/// is here what is near [`lines`]. `held` tells for each slave node the directions that supports fix. The counts are this rank's.
pub fn conditions(
    contact: usize,
    slave: &GatheredSurface,
    master: &GatheredSurface,
    held: &[[bool; 3]],
) -> (Conditions, bool) {
    let normals = slave.normals_and_areas();
    let parts = parts(slave, master, &normals);
    let reach = reach(&parts, slave.nodes.len());
    let is_held = |node: usize| is_held(normals[node].0, held[node]);
    let active: Vec<bool> = (0..reach.len()).map(|node| reach[node] >= REACH && !is_held(node)).collect();
    let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
    parts.iter().for_each(|part| add(&mut sums, part, &active, &normals, master));
    sums.retain(|&node, sums| slave.layer(node) == Layer::Own && sums.whole > COVERED * normals[node].1);
    let of_node: BTreeMap<usize, usize> = sums.keys().copied().zip(0..).collect();
    let told = |node: &usize| slave.tells(*node);
    let count = of_node.keys().copied().filter(told).count();
    let held = (0..reach.len()).filter(told).filter(|&node| reach[node] >= REACH && is_held(node)).count();
    let condition = |(node, sums): (usize, Sums)| {
        let (normal, origin) = (normals[node].0, slave.points[node]);
        let place = |node: u64| master.points[master.nodes.binary_search(&node).expect("it is on the surface")];
        let Sums { whole, area, slaves, masters } = sums;
        let of_slaves = merged(slaves.iter().map(|(&k, weight)| (slave.nodes[k], *weight)));
        let weights = || of_slaves.values().chain(masters.values());
        let is_curved = weights().any(|weight| weight.is_curved(normal, whole));
        // `A_j`: how far slave nodes that all move by one along their normals close the condition.
        let closed: f64 = slaves.iter().map(|(&k, weight)| dot(weight.along, normals[k].0)).sum();
        let along = |weight: &Weight| match is_curved {
            true => weight.along.map(|x| x / closed),
            false => normal.map(|n| weight.size / whole * n),
        };
        let over = |weight: &Weight, vector: [f64; 3]| dot(along(weight), vector);
        let of_master = masters.iter().map(|(&l, weight)| over(weight, difference(place(l), origin)));
        let of_slave = slaves.iter().map(|(&k, weight)| over(weight, difference(slave.points[k], origin)));
        let area = if is_curved { closed } else { area };
        ContactPair {
            contact,
            slave: slave.nodes[node],
            part: slave.parts[node],
            gap: of_master.sum::<f64>() - of_slave.sum::<f64>(),
            vectors: if is_curved { weights().map(along).collect() } else { Vec::new() },
            slaves: of_slaves.iter().map(|(&node, weight)| (node, weight.size / whole)).collect(),
            masters: masters.iter().map(|(&node, weight)| (node, weight.size / whole)).collect(),
            normal,
            area,
            limit_area: area,
            covered: reach[node] >= AT_THE_EDGE,
        }
    };
    let masters = master_nodes(contact, &parts, master, &of_node);
    let pairs = sums.into_iter().map(condition).collect();
    (Conditions { pairs, masters, count, held }, !parts.is_empty())
}

/// What is wrong with the conditions of all ranks, if anything; `is_opposite` says whether surfaces face each other anywhere.
///
/// # Errors
/// If the surfaces do not face each other, or supports hold all slave nodes that do.
pub fn accept(name: &str, found: Conditions, is_opposite: bool) -> Result<Conditions, ContactError> {
    let name = name.to_owned();
    match found {
        found if found.count > 0 => Ok(found),
        found if is_opposite && found.held > 0 => Err(ContactError::AllHeld { name }),
        _ => Err(ContactError::Apart { name }),
    }
}

/// Conditions of surfaces that are here as a whole.
#[cfg(test)]
pub fn pair(
    contact: usize,
    name: &str,
    slave: &GatheredSurface,
    master: &GatheredSurface,
    held: &[[bool; 3]],
) -> Result<Conditions, ContactError> {
    let (found, is_opposite) = conditions(contact, slave, master, held);
    accept(name, found, is_opposite)
}

/// Weights of nodes, each once.
fn merged(weights: impl Iterator<Item = (u64, Weight)>) -> BTreeMap<u64, Weight> {
    let mut sums: BTreeMap<u64, Weight> = BTreeMap::new();
    weights.for_each(|(node, weight)| sums.entry(node).or_default().add(&weight));
    sums
}

/// The covered parts of all slave faces that have any.
pub(super) fn parts<'a>(
    slave: &'a GatheredSurface,
    master: &GatheredSurface,
    normals: &[([f64; 3], f64)],
) -> Vec<Part<'a>> {
    let opposite = Opposite::new(slave, master);
    let corners: Vec<_> = slave.corners().collect();
    let part = |(number, Face { nodes, triangles }): (usize, Face<'a>)| {
        let mut seen = Seen::default();
        let own = slave.owns(triangles.start);
        triangles.for_each(|k| opposite.add(slave, k, &corners[k], &mut seen));
        let ends = [0, 1, 2].map(|k| nodes[k]);
        let along = surface::normal(&ends.map(|node| slave.points[node])).filter(|_| !seen.points.is_empty())?;
        let area: f64 = seen.points.iter().map(|point| point.area).sum();
        let mean = |k: usize| seen.points.iter().map(|point| point.area * point.at[k]).sum::<f64>() / area;
        let places = edge::places(&seen.corners, [0, 1, 2].map(mean));
        let cosines = ends.map(|node| dot(normals[node].0, along));
        let mass = mass(&seen.points);
        let is_bent = nodes.len() > 3 && is_bent((nodes, &mass), &seen.points, along, [slave, master]);
        Some(Part { number, face: nodes, own, seen, mass, places, cosines, is_bent })
    };
    faces(slave).enumerate().filter_map(part).collect()
}

/// Whether the distance along a direction is no linear function on the covered part of a face.
fn is_bent(
    (face, mass): (&[usize], &[[f64; 3]; 3]),
    points: &[IntegrationPoint],
    along: [f64; 3],
    [slave, master]: [&GatheredSurface; 2],
) -> bool {
    let place = |of: &GatheredSurface, weights: &[(usize, f64)]| {
        weights.iter().map(|&(node, weight)| weight * dot(along, of.points[node])).sum::<f64>()
    };
    let distance = |point: &IntegrationPoint| place(master, &point.masters) - place(slave, &functions(face, point.at));
    let distances: Vec<f64> = points.iter().map(distance).collect();
    let of_corner = |k: usize| points.iter().zip(&distances).map(|(point, d)| point.area * point.at[k] * d).sum();
    let (inverse, integrals) = (dual::invert(mass), [0, 1, 2].map(of_corner));
    let linear = inverse.map(|row| dot(row, integrals));
    let off = |(point, d): (&IntegrationPoint, &f64)| point.area * (d - dot(linear, point.at)).powi(2);
    let area: f64 = points.iter().map(|point| point.area).sum();
    points.iter().zip(&distances).map(off).sum::<f64>() > (BENT * area).powi(2)
}

/// Integrals of products of linear functions.
fn mass(points: &[IntegrationPoint]) -> [[f64; 3]; 3] {
    let mut mass = [[0.0; 3]; 3];
    for IntegrationPoint { area, at, .. } in points {
        for k in 0..3 {
            (0..3).for_each(|l| mass[k][l] += area * at[k] * at[l]);
        }
    }
    mass
}

/// How much of the way to each slave node is covered, at most, in the faces around it.
fn reach(parts: &[Part], nodes: usize) -> Vec<f64> {
    let mut reach = vec![0.0_f64; nodes];
    for Part { face, places, .. } in parts {
        (0..3).for_each(|k| reach[face[k]] = reach[face[k]].max(places.map_or(1.0, |places| places[k][k])));
    }
    reach
}

/// What the pressure is at the master's nodes, on each smooth part around them, from the conditions on own faces of the slave: where
/// several faces are opposite, the nearest counts.
fn master_nodes(
    contact: usize,
    parts: &[Part],
    master: &GatheredSurface,
    of_node: &BTreeMap<usize, usize>,
) -> Vec<MasterNode> {
    let mut nearest: BTreeMap<usize, (f64, Vec<(usize, f64)>)> = BTreeMap::new();
    for Part { face, seen, .. } in parts.iter().filter(|part| part.own) {
        for &(node, distance, at) in &seen.masters {
            let weights = (0..3).filter_map(|k| Some((*of_node.get(&face[k])?, at[k].max(0.0))));
            let weights: Vec<_> = weights.filter(|(_, weight)| *weight > INSIDE).collect();
            let whole: f64 = weights.iter().map(|(_, weight)| weight).sum();
            if whole > 0.0 && nearest.get(&node).is_none_or(|(known, _)| distance.abs() < known.abs()) {
                nearest.insert(node, (distance, weights.into_iter().map(|(k, w)| (k, w / whole)).collect()));
            }
        }
    }
    let of = |(slot, (distance, pairs)): (usize, (f64, Vec<(usize, f64)>))| MasterNode {
        contact,
        node: master.nodes[slot],
        part: master.parts[slot],
        distance,
        matches: false,
        pairs,
    };
    nearest.into_iter().map(of).collect()
}

/// Whether supports fix all of a direction, but for round-off.
fn is_held(normal: [f64; 3], held: [bool; 3]) -> bool {
    let left: f64 = (0..3).filter(|&a| !held[a]).map(|a| normal[a] * normal[a]).sum();
    left < 1e-16
}

/// Adds what one face gives to the sums of its active corners.
fn add(
    sums: &mut BTreeMap<usize, Sums>,
    part: &Part,
    active: &[bool],
    normals: &[([f64; 3], f64)],
    master: &GatheredSurface,
) {
    let Part { face, seen, cosines, .. } = part;
    let active = [0, 1, 2].map(|k| active[face[k]]);
    if !active.contains(&true) {
        return;
    }
    let DualFunctions { functions: psi, slave: integrals } = dual_functions(part, active);
    for j in (0..3).filter(|&j| active[j]) {
        let of_node = sums.entry(face[j]).or_default();
        if face.len() == 3 {
            for k in (0..3).filter(|&k| integrals[j][k] != 0.0) {
                of_node.slaves.entry(face[k]).or_default().add(&Weight::of(integrals[j][k], normals[face[j]].0));
            }
        }
        for IntegrationPoint { area, at, masters } in &seen.points {
            let psi = area * dot(psi[j], *at);
            let mut normal = normals[face[j]].0;
            if face.len() > 3 {
                let own = functions(face, *at);
                normal = mean(own.iter().map(|&(k, value)| (normals[k].0, value))).unwrap_or(normal);
                for (k, value) in own {
                    of_node.slaves.entry(k).or_default().add(&Weight::of(psi * value, normal));
                }
            }
            for (node, value) in masters {
                of_node.masters.entry(master.nodes[*node]).or_default().add(&Weight::of(psi * value, normal));
            }
        }
        let whole: f64 = integrals[j].iter().sum();
        of_node.whole += whole;
        of_node.area += cosines[j] * whole;
    }
}

/// The direction of a sum of weighted vectors.
pub(super) fn mean(vectors: impl Iterator<Item = ([f64; 3], f64)>) -> Option<[f64; 3]> {
    let add = |sum: [f64; 3], (vector, weight): ([f64; 3], f64)| std::array::from_fn(|a| sum[a] + weight * vector[a]);
    unit(vectors.fold([0.0; 3], add))
}

/// The multipliers' functions on a part, and their integrals with the linear functions of the face.
pub(super) fn dual_functions(Part { mass, places, is_bent, .. }: &Part, active: [bool; 3]) -> DualFunctions {
    let functions = |mass: &[[f64; 3]; 3]| {
        let dual = dual::functions(mass, active)?;
        Some(if *is_bent { dual.even(dual::positive(mass, active)) } else { dual })
    };
    let Some(places) = places else {
        return functions(mass).unwrap_or_else(|| dual::positive(mass, active));
    };
    // `phi* = S phi` with `S = T^-T`, so `phi = T^T phi*`.
    let inverse = dual::invert(places);
    let moved = dual::multiply(&dual::multiply(&dual::transpose(&inverse), mass), &inverse);
    match functions(&moved) {
        Some(DualFunctions { functions, slave }) => DualFunctions {
            functions: dual::multiply(&functions, &dual::transpose(&inverse)),
            slave: dual::multiply(&slave, places),
        },
        None => dual::positive(mass, active),
    }
}

#[cfg(test)]
pub(super) mod tests;
