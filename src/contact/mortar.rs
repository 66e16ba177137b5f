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

/// Overlap, in diameters of the smaller surface's bounding box, from which triangles are taken for two far sides.
const DEEPEST: f64 = 0.125;

/// What faces one slave triangle: points of integration with their share of the area, the slave's functions there, and the
/// master's nodes with theirs.
type Points = Vec<(f64, [f64; 3], [usize; 3], [f64; 3])>;

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
    let active: Vec<bool> = normals.iter().zip(held).map(|((normal, _), held)| !is_held(*normal, *held)).collect();
    let opposite = Opposite::new(slave, master);
    let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
    let mut faces = false;
    for (triangle, corners) in slave.triangles.iter().zip(slave.corners()) {
        let points = opposite.points(&corners);
        faces |= !points.is_empty();
        let Some(along) = surface::normal(&corners) else { continue };
        let cosines = triangle.map(|node| dot(normals[node].0, along));
        add(&mut sums, triangle, triangle.map(|node| active[node]), cosines, &points);
    }
    sums.retain(|&node, sums| sums.own > COVERED * normals[node].1);
    if sums.is_empty() {
        let name = name.to_owned();
        return Err(if faces { ContactError::AllHeld { name } } else { ContactError::Apart { name } });
    }
    let condition = |(node, sums): (usize, Sums)| {
        let normal = normals[node].0;
        let weights = |of: &BTreeMap<usize, f64>, surface: &GatheredSurface| {
            of.iter().map(|(&node, sum)| (surface.nodes[node], sum / sums.own)).collect::<Vec<_>>()
        };
        let mut gap = -dot(normal, slave.points[node]);
        sums.slaves.iter().for_each(|(&k, sum)| gap -= sum / sums.own * dot(normal, slave.points[k]));
        sums.masters.iter().for_each(|(&l, sum)| gap += sum / sums.own * dot(normal, master.points[l]));
        ContactPair {
            contact,
            slave: slave.nodes[node],
            others: weights(&sums.slaves, slave),
            masters: weights(&sums.masters, master),
            normal,
            gap,
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

/// Adds what one triangle gives to the sums of its active corners; `cosines` are those between its normal and the nodes'.
fn add(sums: &mut BTreeMap<usize, Sums>, triangle: &[usize; 3], active: [bool; 3], cosines: [f64; 3], points: &Points) {
    if points.is_empty() || !active.contains(&true) {
        return;
    }
    let mut mass = [[0.0; 3]; 3];
    for (area, phi, _, _) in points {
        for k in 0..3 {
            (0..3).for_each(|l| mass[k][l] += area * phi[k] * phi[l]);
        }
    }
    let found = dual::functions(&mass, active);
    for j in (0..3).filter(|&j| active[j]) {
        let of_node = sums.entry(triangle[j]).or_default();
        of_node.own += found.slave[j][j];
        of_node.area += cosines[j] * found.slave[j][j];
        for k in (0..3).filter(|&k| !active[k]) {
            *of_node.slaves.entry(triangle[k]).or_default() += found.slave[j][k];
        }
        for (area, phi, nodes, of_master) in points {
            let psi = dot(found.functions[j], *phi);
            for (node, value) in nodes.iter().zip(of_master) {
                *of_node.masters.entry(*node).or_default() += area * psi * value;
            }
        }
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
}

impl<'a> Opposite<'a> {
    fn new(slave: &GatheredSurface, master: &'a GatheredSurface) -> Self {
        let corners: Vec<_> = master.corners().collect();
        let normals = corners.iter().map(surface::normal).collect();
        let deepest = DEEPEST * slave.diameter().min(master.diameter());
        let share = slave.share * master.share;
        Self { tree: BallTree::new(&corners), master, corners, normals, deepest, share }
    }

    /// Points of integration on the part of a slave triangle that faces the master surface.
    fn points(&self, slave: &[[f64; 3]; 3]) -> Points {
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
                let at = |i: usize| {
                    let p = [0, 1].map(|x| 0.5 * (part[i][x] + part[(i + 1) % 3][x]));
                    (
                        self.share * area / 6.0,
                        barycentric(&flat, p),
                        self.master.triangles[index],
                        barycentric(&[a, b, c], p),
                    )
                };
                let piece = [0, 1, 2].map(at);
                if piece.iter().all(|(_, _, _, values)| dot(*values, heights) >= -self.deepest) {
                    points.extend(piece);
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
