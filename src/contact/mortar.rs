//! Contact of surfaces whose nodes do not match: dual mortar conditions, integrated over the common refinement.
//!
//! Every slave triangle is cut by the master triangles projected onto its plane along its normal. On each piece the linear
//! functions of both sides are linear (quadrilaterals are cut in both ways, and count half each), so three points integrate their products exactly. With the dual functions `psi_j` of
//! the slave nodes ([`super::dual`]), `D_jk = integral of psi_j phi_k` and `M_jl = integral of psi_j phi_l` over the master,
//! the condition on slave node `j` with its unit normal `n_j` is
//!
//! `n_j . (x_j + sum of D_jk / D_jj x_k - sum of M_jl / D_jj x_l) <= 0`
//!
//! at positions `x` after the displacement (Wohlmuth 2011; Popp, Gitterle, Gee, Wall 2010). The sums run over slave nodes `k`
//! without a condition and master nodes `l`. A constant pressure acts with the same resultant on both sides and on every
//! node as it should: flat surfaces pass the patch test whatever their meshes. Normals stay those of the start.
//!
//! Slave nodes whose normal direction supports hold carry no condition: rows stay independent. Nor do nodes without a
//! master triangle opposite.
//!
//! Quadratic faces carry conditions at their corners only, with the dual functions of the linear functions there and the
//! integrals of products with all quadratic ones on either side (Popp, Wohlmuth, Gee and Wall 2012, "quadratic-linear"): the
//! multipliers still add up to one, so a constant pressure acts on corners and middles as it should. Such a face is four
//! triangles through its middles, which are the geometry; its functions are those of its own coordinates.

use std::collections::BTreeMap;

use super::clip::{Point, barycentric, intersection, turn};
use super::dual;
use super::surface::{GatheredSurface, difference, dot};
use super::tree::BallTree;
use super::{ContactError, ContactPair};
use crate::mesh::surface;

/// Cosine between the normals, one of them turned around, from which triangles face each other.
const FACING: f64 = 0.1;

/// Share of a slave triangle below which a piece is round-off.
const SLIVER: f64 = 1e-12;

/// Share of its surface that a slave node must have opposite a master.
const COVERED: f64 = 1e-6;

/// The same share with quadratic functions, of which those of corners are negative in places.
const COVERED_QUADRATIC: f64 = 0.01;

/// Overlap, in diameters of the smaller surface's bounding box, from which triangles are taken for two far sides.
const DEEPEST: f64 = 0.125;

/// What faces one slave face: points of integration.
type Points = Vec<IntegrationPoint>;

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

/// The sums of one slave node's condition.
#[derive(Default)]
struct Sums {
    own: f64,
    /// As `own`, each triangle's part seen along the node's normal.
    area: f64,
    slaves: BTreeMap<usize, f64>,
    masters: BTreeMap<usize, f64>,
}

/// Conditions of contact number `contact`, ascending by slave node. `held` tells for each slave node the directions that
/// supports fix.
///
/// # Errors
/// If the surfaces do not face each other, or supports hold all slave nodes that do.
pub fn pair(
    contact: usize,
    name: &str,
    slave: &GatheredSurface,
    master: &GatheredSurface,
    held: &[[bool; 3]],
) -> Result<Vec<ContactPair>, ContactError> {
    let normals = slave.normals_and_areas();
    let mut active: Vec<bool> = normals.iter().zip(held).map(|((normal, _), held)| !is_held(*normal, *held)).collect();
    let opposite = Opposite::new(slave, master);
    let corners: Vec<_> = slave.corners().collect();
    let points = |Face { triangles, .. }: &Face| -> Points {
        triangles.clone().flat_map(|k| opposite.points(slave, k, &corners[k])).collect()
    };
    let seen = faces(slave).map(|face| (face.nodes, points(&face))).filter(|(_, points)| !points.is_empty());
    let seen: Vec<(&[usize], Points)> = seen.collect();
    if seen.is_empty() {
        return Err(ContactError::Apart { name: name.to_owned() });
    }
    let sums = loop {
        let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
        for (face, points) in &seen {
            let corners = [0, 1, 2].map(|k| face[k]);
            let Some(along) = surface::normal(&corners.map(|node| slave.points[node])) else { continue };
            let cosines = corners.map(|node| dot(normals[node].0, along));
            add(&mut sums, face, corners.map(|node| active[node]), cosines, points);
        }
        let least = if slave.quadratic.is_empty() { COVERED } else { COVERED_QUADRATIC };
        let before = sums.len();
        sums.retain(|&node, sums| {
            active[node] = sums.own > least * normals[node].1;
            active[node]
        });
        // What the others get of such nodes keeps constant pressures; of linear ones it is round-off.
        if slave.quadratic.is_empty() || sums.len() == before || sums.is_empty() {
            break sums;
        }
    };
    if sums.is_empty() {
        return Err(ContactError::AllHeld { name: name.to_owned() });
    }
    let condition = |(node, sums): (usize, Sums)| {
        let normal = normals[node].0;
        let weights = |of: &BTreeMap<usize, f64>, surface: &GatheredSurface| {
            of.iter().map(|(&node, sum)| (surface.nodes[node], sum / sums.own)).collect::<Vec<_>>()
        };
        // From the node: far from the origin, positions themselves would cost digits.
        let height = |place: [f64; 3]| dot(normal, difference(place, slave.points[node]));
        let of_slaves: f64 = sums.slaves.iter().map(|(&k, sum)| sum / sums.own * height(slave.points[k])).sum();
        let of_masters: f64 = sums.masters.iter().map(|(&l, sum)| sum / sums.own * height(master.points[l])).sum();
        ContactPair {
            contact,
            slave: slave.nodes[node],
            others: weights(&sums.slaves, slave),
            masters: weights(&sums.masters, master),
            normal,
            gap: of_masters - of_slaves,
            area: sums.area,
        }
    };
    Ok(sums.into_iter().map(condition).collect())
}

/// Whether supports fix all of a direction, but for round-off.
fn is_held(normal: [f64; 3], held: [bool; 3]) -> bool {
    let left: f64 = (0..3).filter(|&a| !held[a]).map(|a| normal[a] * normal[a]).sum();
    left < 1e-16
}

/// Adds what one face gives to the sums of its active corners; `cosines` are those between its normal and theirs.
fn add(sums: &mut BTreeMap<usize, Sums>, face: &[usize], active: [bool; 3], cosines: [f64; 3], points: &Points) {
    if points.is_empty() || !active.contains(&true) {
        return;
    }
    let mut mass = [[0.0; 3]; 3];
    for IntegrationPoint { area, at, .. } in points {
        for k in 0..3 {
            (0..3).for_each(|l| mass[k][l] += area * at[k] * at[l]);
        }
    }
    let found = dual::functions(&mass, active);
    for j in (0..3).filter(|&j| active[j]) {
        let of_node = sums.entry(face[j]).or_default();
        let mut slaves = match face {
            [_, _, _] => (0..3).map(|k| (face[k], found.slave[j][k])).filter(|(_, sum)| *sum != 0.0).collect(),
            _ => BTreeMap::new(),
        };
        for IntegrationPoint { area, at, masters } in points {
            let psi = area * dot(found.functions[j], *at);
            for (node, value) in masters {
                *of_node.masters.entry(*node).or_default() += psi * value;
            }
            if face.len() > 3 {
                functions(face, *at).into_iter().for_each(|(k, value)| *slaves.entry(k).or_default() += psi * value);
            }
        }
        let own = slaves.remove(&face[j]).unwrap_or_default();
        slaves.into_iter().for_each(|(k, sum)| *of_node.slaves.entry(k).or_default() += sum);
        of_node.own += own;
        of_node.area += cosines[j] * own;
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

    /// Points of integration on the part of triangle number `own` of the slave that faces the master surface.
    fn points(&self, surface: &GatheredSurface, own: usize, slave: &[[f64; 3]; 3]) -> Points {
        let Some(normal) = surface::normal(slave) else { return Vec::new() };
        let plane = Plane::new(slave, normal);
        let flat = slave.map(|corner| plane.project(corner));
        let whole = turn(flat[0], flat[1], flat[2]);
        let middle = std::array::from_fn(|a| slave.iter().map(|corner| corner[a]).sum::<f64>() / 3.0);
        let arms = slave.map(|corner| difference(corner, middle));
        let reach = arms.iter().map(|arm| dot(*arm, *arm)).fold(0.0, f64::max).sqrt();
        let mut points = Vec::new();
        for index in self.tree.along(middle, normal, reach) {
            if !self.normals[index].is_some_and(|other| dot(normal, other) < -FACING) {
                continue;
            }
            // Seen from the slave it turns clockwise.
            let [a, b, c] = self.corners[index].map(|corner| plane.project(corner));
            let polygon = intersection(&flat, &[a, c, b]);
            let heights = self.corners[index].map(|corner| dot(difference(corner, middle), normal));
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
                    points.extend(places.into_iter().map(|(area, of_slave, of_master)| IntegrationPoint {
                        area,
                        at: in_face(surface, own, of_slave),
                        masters: functions(self.nodes_of(index), in_face(self.master, index, of_master)),
                    }));
                }
            }
        }
        points
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
