//! What the master surface is opposite a slave face: points of integration over the common refinement.
//!
//! Every slave triangle is cut by the master triangles projected onto its plane along its normal (Puso and Laursen 2004). On each
//! piece the linear functions of both sides are linear, so three points integrate their products exactly; six where faces are
//! quadratic. Pieces that look away from the slave, or overlap so deep that they are the far side of a body, are not opposite.

use super::clip::{Point, barycentric, intersection, turn};
use super::patch::Line;
use super::surface::{FACING, GatheredSurface};
use super::tree::BallTree;
use crate::mesh::surface;
use crate::vector::{difference, dot};

/// Share of a slave triangle below which a piece is round-off.
const SLIVER: f64 = 1e-12;

/// Slack, in a triangle's linear functions, of what lies in it.
pub(super) const INSIDE: f64 = 1e-9;

/// Overlap, in diameters of the smaller surface's bounding box, from which triangles are taken for two far sides.
const DEEPEST: f64 = 0.125;

/// What faces one slave face.
#[derive(Default)]
pub(super) struct Seen {
    /// Points of integration.
    pub points: Vec<IntegrationPoint>,
    /// Corners of the covered pieces, between the corners of the face.
    pub corners: Vec<[f64; 3]>,
    /// Nodes of the master with their distance from the face's plane, and their places between its corners.
    pub masters: Vec<(usize, f64, [f64; 3])>,
}

/// A point where both sides are compared.
pub(super) struct IntegrationPoint {
    /// Its share of the slave's area.
    pub area: f64,
    /// Where it is between the corners of the slave's face.
    pub at: [f64; 3],
    /// The master's nodes with their functions there.
    pub masters: Vec<(usize, f64)>,
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
pub(super) struct Face<'a> {
    pub nodes: &'a [usize],
    pub triangles: std::ops::Range<usize>,
}

/// Faces of a surface, all linear or all quadratic.
pub(super) fn faces(surface: &GatheredSurface) -> impl Iterator<Item = Face<'_>> {
    let linear = if surface.quadratic.is_empty() { &surface.triangles[..] } else { &[] };
    let linear = linear.iter().enumerate().map(|(k, nodes)| Face { nodes, triangles: k..k + 1 });
    let quadratic = surface.quadratic.iter().enumerate();
    linear.chain(quadratic.map(|(k, nodes)| Face { nodes, triangles: 4 * k..4 * k + 4 }))
}

/// A place in a triangle as one in the face that it is part of.
pub(super) fn in_face(surface: &GatheredSurface, triangle: usize, at: [f64; 3]) -> [f64; 3] {
    if surface.quadratic.is_empty() {
        return at;
    }
    let corners = &PARTS[triangle % 4];
    std::array::from_fn(|a| (0..3).map(|k| at[k] * corners[k][a]).sum())
}

/// Nodes and functions of a face at a place in it.
pub(super) fn functions(nodes: &[usize], at: [f64; 3]) -> Vec<(usize, f64)> {
    let [p, q, r] = at;
    if nodes.len() == 3 {
        return nodes.iter().copied().zip(at).collect();
    }
    let corners = at.map(|x| x * (2.0 * x - 1.0));
    let middles = [4.0 * p * q, 4.0 * q * r, 4.0 * r * p];
    nodes.iter().copied().zip(corners.into_iter().chain(middles)).collect()
}

/// The master surface as it is seen from slave triangles.
pub(super) struct Opposite<'a> {
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
    pub fn new(slave: &GatheredSurface, master: &'a GatheredSurface) -> Self {
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
    pub fn add(&self, surface: &GatheredSurface, own: usize, slave: &[[f64; 3]; 3], seen: &mut Seen) {
        let Some(normal) = surface::normal(slave) else { return };
        let plane = Plane::new(slave, normal);
        let flat = slave.map(|corner| plane.project(corner));
        let whole = turn(flat[0], flat[1], flat[2]);
        let Line { point: middle, distance: reach, .. } = line(slave, normal);
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

/// The line through the middle of a triangle along its normal, and how far from it corners are.
pub(super) fn line(triangle: &[[f64; 3]; 3], normal: [f64; 3]) -> Line {
    let middle = std::array::from_fn(|a| triangle.iter().map(|corner| corner[a]).sum::<f64>() / 3.0);
    let arms = triangle.map(|corner| difference(corner, middle));
    let reach = arms.iter().map(|arm| dot(*arm, *arm)).fold(0.0, f64::max).sqrt();
    Line { point: middle, direction: normal, distance: reach }
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
