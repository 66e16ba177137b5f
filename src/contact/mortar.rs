//! Contact of surfaces whose nodes do not match: dual mortar conditions, integrated over the common refinement.
//!
//! Every slave triangle is cut by the master triangles projected onto its plane along its normal. On each piece the linear
//! functions of both sides are linear (quadrilaterals are cut in both ways, and count half each), so three points integrate their products exactly. With the dual functions `psi_j` of
//! the slave nodes ([`super::dual`]), `D_jk = integral of psi_j phi_k`, `M_jl = integral of psi_j phi_l` over the master and
//! `W_j = integral of psi_j`, the condition on slave node `j` with its unit normal `n_j` is
//!
//! `n_j . (sum of D_jk / W_j x_k - sum of M_jl / W_j x_l) <= 0`
//!
//! at positions `x` after the displacement (Wohlmuth 2011; Popp, Gitterle, Gee, Wall 2010). The sums run over slave nodes `k`,
//! usually `j` alone, and master nodes `l`. A constant pressure acts with the same resultant on both sides and on every
//! node as it should: flat surfaces pass the patch test whatever their meshes. Normals stay those of the start.
//!
//! All integrals are over what has the master opposite. On faces that it covers in part, multipliers move to its edge
//! ([`super::edge`]): none pushes beyond it. Nodes of which less than [`REACH`] of the way is covered carry no condition, nor do
//! those whose normal direction supports hold, so rows stay independent; the pressure on their part of a face goes to its other
//! corners.
//!
//! Quadratic faces carry conditions at their corners only, with the dual functions of the linear functions there and the
//! integrals of products with all quadratic ones on either side (Popp, Wohlmuth, Gee and Wall 2012, "quadratic-linear"): the
//! multipliers still add up to one, so a constant pressure acts on corners and middles as it should. Such a face is four
//! triangles through its middles, which are the geometry; its functions are those of its own coordinates.

use std::collections::BTreeMap;

use super::clip::{Point, barycentric, intersection, turn};
use super::dual::{self, DualFunctions};
use super::surface::{FACING, GatheredSurface, difference, dot};
use super::tree::BallTree;
use super::{Conditions, ContactError, ContactPair, MasterNode, edge};
use crate::mesh::surface;

/// Share of a slave triangle below which a piece is round-off.
const SLIVER: f64 = 1e-12;

/// Share of its surface that a slave node must have opposite a master.
const COVERED: f64 = 1e-6;

/// Share of the way to a slave node that must be covered for it to carry a condition: with less, it would say almost the same as
/// those of its neighbours, and the dual problem would be nearly singular.
const REACH: f64 = 0.25;

/// Slack, in a triangle's linear functions, of what lies in it.
const INSIDE: f64 = 1e-9;

/// Overlap, in diameters of the smaller surface's bounding box, from which triangles are taken for two far sides.
const DEEPEST: f64 = 0.125;

/// What faces one slave face.
#[derive(Default)]
struct Seen {
    /// Points of integration.
    points: Vec<IntegrationPoint>,
    /// Corners of the covered pieces, between the corners of the face.
    corners: Vec<[f64; 3]>,
    /// Nodes of the master with their distance from the face's plane, and their places between its corners.
    masters: Vec<(usize, f64, [f64; 3])>,
}

/// A point where both sides are compared.
struct IntegrationPoint {
    /// Its share of the slave's area.
    area: f64,
    /// Where it is between the corners of the slave's face.
    at: [f64; 3],
    /// The master's nodes with their functions there.
    masters: Vec<(usize, f64)>,
}

/// Middles of the edges of a triangle: exact for squares.
const MIDDLES: [[f64; 3]; 3] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];

/// Corners of the triangles that a quadratic face is cut into, between the corners of the face.
const PARTS: [[[f64; 3]; 3]; 4] = [
    [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5]],
    [[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.5]],
    [[0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]],
    [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]],
];

/// A face of a surface: its nodes, corners first, and its triangles.
struct Face<'a> {
    nodes: &'a [usize],
    triangles: std::ops::Range<usize>,
}

/// Faces of a surface, all linear or all quadratic.
fn faces(surface: &GatheredSurface) -> impl Iterator<Item = Face<'_>> {
    let linear = if surface.quadratic.is_empty() { &surface.triangles[..] } else { &[] };
    let linear = linear.iter().enumerate().map(|(k, nodes)| Face { nodes, triangles: k..k + 1 });
    let quadratic = surface.quadratic.iter().enumerate();
    linear.chain(quadratic.map(|(k, nodes)| Face { nodes, triangles: 4 * k..4 * k + 4 }))
}

/// A place in a triangle as one in the face that it is part of.
fn in_face(surface: &GatheredSurface, triangle: usize, at: [f64; 3]) -> [f64; 3] {
    if surface.quadratic.is_empty() {
        return at;
    }
    let corners = &PARTS[triangle % 4];
    std::array::from_fn(|a| (0..3).map(|k| at[k] * corners[k][a]).sum())
}

/// Nodes and functions of a face at a place in it.
fn functions(nodes: &[usize], at: [f64; 3]) -> Vec<(usize, f64)> {
    let [p, q, r] = at;
    if nodes.len() == 3 {
        return nodes.iter().copied().zip(at).collect();
    }
    let corners = at.map(|x| x * (2.0 * x - 1.0));
    let middles = [4.0 * p * q, 4.0 * q * r, 4.0 * r * p];
    nodes.iter().copied().zip(corners.into_iter().chain(middles)).collect()
}

/// The covered part of a slave face.
struct Part<'a> {
    /// Its nodes, corners first.
    face: &'a [usize],
    seen: Seen,
    /// Functions of the corners at the places of their multipliers; `None` where these are the corners.
    places: Option<[[f64; 3]; 3]>,
    /// Cosines between its normal and those of its corners.
    cosines: [f64; 3],
}

/// The sums of one slave node's condition.
#[derive(Default)]
struct Sums {
    /// `W_j`.
    whole: f64,
    /// As `whole`, each triangle's part seen along the node's normal.
    area: f64,
    slaves: BTreeMap<usize, f64>,
    masters: BTreeMap<u64, f64>,
}

/// Conditions of contact number `contact`. `held` tells for each slave node the directions that supports fix.
///
/// # Errors
/// If the surfaces do not face each other, or supports hold all slave nodes that do.
pub fn pair(
    contact: usize,
    name: &str,
    slave: &GatheredSurface,
    master: &GatheredSurface,
    held: &[[bool; 3]],
) -> Result<Conditions, ContactError> {
    let normals = slave.normals_and_areas();
    let parts = parts(slave, master, &normals);
    if parts.is_empty() {
        return Err(ContactError::Apart { name: name.to_owned() });
    }
    let reach = reach(&parts, slave.nodes.len());
    let is_held = |node: usize| is_held(normals[node].0, held[node]);
    let mut active: Vec<bool> = (0..reach.len()).map(|node| reach[node] >= REACH && !is_held(node)).collect();
    let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
    parts.iter().for_each(|part| add(&mut sums, part, &active, master));
    sums.retain(|&node, sums| {
        active[node] = sums.whole > COVERED * normals[node].1;
        active[node]
    });
    if sums.is_empty() {
        return Err(ContactError::AllHeld { name: name.to_owned() });
    }
    let of_node: BTreeMap<usize, usize> = sums.keys().copied().zip(0..).collect();
    let condition = |(node, sums): (usize, Sums)| {
        let (normal, origin) = (normals[node].0, slave.points[node]);
        let along = |point: [f64; 3]| dot(normal, difference(point, origin));
        let place = |node: u64| master.points[master.nodes.binary_search(&node).expect("it is on the surface")];
        let Sums { whole, area, slaves, masters } = sums;
        ContactPair {
            contact,
            slave: slave.nodes[node],
            part: slave.parts[node],
            gap: masters.iter().map(|(&l, sum)| sum / whole * along(place(l))).sum::<f64>()
                - slaves.iter().map(|(&k, sum)| sum / whole * along(slave.points[k])).sum::<f64>(),
            slaves: merged(slaves.into_iter().map(|(k, sum)| (slave.nodes[k], sum / whole))),
            masters: masters.into_iter().map(|(l, sum)| (l, sum / whole)).collect(),
            normal,
            area,
            covered: reach[node] >= 1.0,
        }
    };
    Ok(Conditions {
        pairs: sums.into_iter().map(condition).collect(),
        masters: master_nodes(&parts, master, &of_node),
        held: (0..reach.len()).filter(|&node| reach[node] >= REACH && is_held(node)).count(),
    })
}

/// Weights of nodes, each once.
fn merged(weights: impl Iterator<Item = (u64, f64)>) -> Vec<(u64, f64)> {
    let mut sums: BTreeMap<u64, f64> = BTreeMap::new();
    weights.for_each(|(node, weight)| *sums.entry(node).or_default() += weight);
    sums.into_iter().collect()
}

/// The covered parts of all slave faces that have any.
fn parts<'a>(slave: &'a GatheredSurface, master: &GatheredSurface, normals: &[([f64; 3], f64)]) -> Vec<Part<'a>> {
    let opposite = Opposite::new(slave, master);
    let corners: Vec<_> = slave.corners().collect();
    let part = |Face { nodes, triangles }: Face<'a>| {
        let mut seen = Seen::default();
        triangles.for_each(|k| opposite.add(slave, k, &corners[k], &mut seen));
        let ends = [0, 1, 2].map(|k| nodes[k]);
        let along = surface::normal(&ends.map(|node| slave.points[node])).filter(|_| !seen.points.is_empty())?;
        let area: f64 = seen.points.iter().map(|point| point.area).sum();
        let mean = |k: usize| seen.points.iter().map(|point| point.area * point.at[k]).sum::<f64>() / area;
        let places = edge::places(&seen.corners, [0, 1, 2].map(mean));
        Some(Part { face: nodes, seen, places, cosines: ends.map(|node| dot(normals[node].0, along)) })
    };
    faces(slave).filter_map(part).collect()
}

/// How much of the way to each slave node is covered, at most, in the faces around it.
fn reach(parts: &[Part], nodes: usize) -> Vec<f64> {
    let mut reach = vec![0.0_f64; nodes];
    for Part { face, places, .. } in parts {
        (0..3).for_each(|k| reach[face[k]] = reach[face[k]].max(places.map_or(1.0, |places| places[k][k])));
    }
    reach
}

/// What the pressure is at the master's nodes, from the conditions on the slave's: where several faces are opposite, the nearest
/// counts.
fn master_nodes(parts: &[Part], master: &GatheredSurface, of_node: &BTreeMap<usize, usize>) -> Vec<MasterNode> {
    let mut nearest: BTreeMap<u64, (f64, Vec<(usize, f64)>)> = BTreeMap::new();
    for Part { face, seen, .. } in parts {
        for &(node, distance, at) in &seen.masters {
            let weights = (0..3).filter_map(|k| Some((*of_node.get(&face[k])?, at[k].max(0.0))));
            let weights: Vec<_> = weights.filter(|(_, weight)| *weight > INSIDE).collect();
            let whole: f64 = weights.iter().map(|(_, weight)| weight).sum();
            let number = master.nodes[node];
            if whole > 0.0 && nearest.get(&number).is_none_or(|(known, _)| distance.abs() < known.abs()) {
                nearest.insert(number, (distance, weights.into_iter().map(|(k, w)| (k, w / whole)).collect()));
            }
        }
    }
    nearest.into_iter().map(|(node, (_, pairs))| MasterNode { node, pairs }).collect()
}

/// Whether supports fix all of a direction, but for round-off.
fn is_held(normal: [f64; 3], held: [bool; 3]) -> bool {
    let left: f64 = (0..3).filter(|&a| !held[a]).map(|a| normal[a] * normal[a]).sum();
    left < 1e-16
}

/// Adds what one face gives to the sums of its active corners.
fn add(sums: &mut BTreeMap<usize, Sums>, part: &Part, active: &[bool], master: &GatheredSurface) {
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
                *of_node.slaves.entry(face[k]).or_default() += integrals[j][k];
            }
        }
        for IntegrationPoint { area, at, masters } in &seen.points {
            let psi = area * dot(psi[j], *at);
            for (node, value) in masters {
                *of_node.masters.entry(master.nodes[*node]).or_default() += psi * value;
            }
            if face.len() > 3 {
                functions(face, *at)
                    .into_iter()
                    .for_each(|(k, value)| *of_node.slaves.entry(k).or_default() += psi * value);
            }
        }
        let whole: f64 = integrals[j].iter().sum();
        of_node.whole += whole;
        of_node.area += cosines[j] * whole;
    }
}

/// The multipliers' functions on a part, and their integrals with the linear functions of the face.
fn dual_functions(Part { seen, places, .. }: &Part, active: [bool; 3]) -> DualFunctions {
    let mut mass = [[0.0; 3]; 3];
    for IntegrationPoint { area, at, .. } in &seen.points {
        for k in 0..3 {
            (0..3).for_each(|l| mass[k][l] += area * at[k] * at[l]);
        }
    }
    let Some(places) = places else {
        return dual::functions(&mass, active).unwrap_or_else(|| dual::positive(&mass, active));
    };
    // `phi* = S phi` with `S = T^-T`, so `phi = T^T phi*`.
    let inverse = dual::invert(places);
    let moved = dual::multiply(&dual::multiply(&dual::transpose(&inverse), &mass), &inverse);
    match dual::functions(&moved, active) {
        Some(DualFunctions { functions, slave }) => DualFunctions {
            functions: dual::multiply(&functions, &dual::transpose(&inverse)),
            slave: dual::multiply(&slave, places),
        },
        None => dual::positive(&mass, active),
    }
}

/// The master surface as it is seen from slave triangles.
struct Opposite<'a> {
    master: &'a GatheredSurface,
    corners: Vec<[[f64; 3]; 3]>,
    normals: Vec<Option<[f64; 3]>>,
    tree: BallTree,
    deepest: f64,
    /// How much a piece of a slave and a master triangle counts.
    share: f64,
    /// Where pieces are integrated, with shares of their area.
    rule: Vec<(f64, [f64; 3])>,
}

impl<'a> Opposite<'a> {
    fn new(slave: &GatheredSurface, master: &'a GatheredSurface) -> Self {
        let corners: Vec<_> = master.corners().collect();
        let normals = corners.iter().map(surface::normal).collect();
        let deepest = DEEPEST * slave.diameter().min(master.diameter());
        let share = slave.share * master.share;
        let rule = if slave.quadratic.is_empty() && master.quadratic.is_empty() {
            MIDDLES.map(|at| (1.0 / 3.0, at)).to_vec()
        } else {
            surface::quartic().collect()
        };
        Self { tree: BallTree::new(&corners), master, corners, normals, deepest, share, rule }
    }

    /// Nodes of the face that a master triangle is part of.
    fn nodes_of(&self, triangle: usize) -> &[usize] {
        match self.master.quadratic.get(triangle / 4) {
            Some(face) => face,
            None => &self.master.triangles[triangle],
        }
    }

    /// Adds the part of triangle number `own` of the slave that faces the master surface.
    fn add(&self, surface: &GatheredSurface, own: usize, slave: &[[f64; 3]; 3], seen: &mut Seen) {
        let Some(normal) = surface::normal(slave) else { return };
        let plane = Plane::new(slave, normal);
        let flat = slave.map(|corner| plane.project(corner));
        let whole = turn(flat[0], flat[1], flat[2]);
        let middle = std::array::from_fn(|a| slave.iter().map(|corner| corner[a]).sum::<f64>() / 3.0);
        let arms = slave.map(|corner| difference(corner, middle));
        let reach = arms.iter().map(|arm| dot(*arm, *arm)).fold(0.0, f64::max).sqrt();
        for index in self.tree.along(middle, normal, reach) {
            if !self.normals[index].is_some_and(|other| dot(normal, other) < -FACING) {
                continue;
            }
            // Seen from the slave it turns clockwise.
            let [a, b, c] = self.corners[index].map(|corner| plane.project(corner));
            let polygon = intersection(&flat, &[a, c, b]);
            let heights = self.corners[index].map(|corner| dot(difference(corner, middle), normal));
            let mut is_opposite = false;
            for k in 2..polygon.len() {
                let part = [polygon[0], polygon[k - 1], polygon[k]];
                let area = turn(part[0], part[1], part[2]);
                if area <= SLIVER * whole {
                    continue;
                }
                let places = self.rule.iter().map(|(share, at)| {
                    let p = [0, 1].map(|x| (0..3).map(|k| at[k] * part[k][x]).sum());
                    (0.5 * self.share * area * share, barycentric(&flat, p), barycentric(&[a, b, c], p))
                });
                let places: Vec<_> = places.collect();
                if places.iter().all(|(_, _, of_master)| dot(*of_master, heights) >= -self.deepest) {
                    is_opposite = true;
                    seen.corners.extend(part.map(|p| in_face(surface, own, barycentric(&flat, p))));
                    seen.points.extend(places.into_iter().map(|(area, of_slave, of_master)| IntegrationPoint {
                        area,
                        at: in_face(surface, own, of_slave),
                        masters: functions(self.nodes_of(index), in_face(self.master, index, of_master)),
                    }));
                }
            }
            if is_opposite {
                let nodes = self.master.triangles[index].into_iter().zip([a, b, c].map(|p| barycentric(&flat, p)));
                let inside = nodes.zip(heights).filter(|((_, at), _)| at.iter().all(|at| *at > -INSIDE));
                seen.masters.extend(inside.map(|((node, at), height)| (node, height, in_face(surface, own, at))));
            }
        }
    }
}

/// A plane through a triangle, with coordinates in it.
struct Plane {
    origin: [f64; 3],
    axes: [[f64; 3]; 2],
}

impl Plane {
    fn new(triangle: &[[f64; 3]; 3], normal: [f64; 3]) -> Self {
        let edge = difference(triangle[1], triangle[0]);
        let length = dot(edge, edge).sqrt();
        let first = edge.map(|e| e / length);
        let second = std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            normal[b] * first[c] - normal[c] * first[b]
        });
        Self { origin: triangle[0], axes: [first, second] }
    }

    fn project(&self, point: [f64; 3]) -> Point {
        let arm = difference(point, self.origin);
        self.axes.map(|axis| dot(arm, axis))
    }
}

#[cfg(test)]
pub(super) mod tests;
