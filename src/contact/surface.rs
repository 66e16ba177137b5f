//! Triangles and nodes of a named surface, whole or as far as a rank needs it ([`super::patch`]).
//!
//! A node where the surface bends is there once for each smooth part around it ([`smooth`]), with the normal of that part.

use std::collections::BTreeMap;

use super::smooth;
use crate::mesh::surface::area_vector;
use crate::vector::dot;

/// Triangles and nodes of a surface.
#[derive(Clone)]
pub struct GatheredSurface {
    /// Global node numbers, ascending; those with several parts several times.
    pub nodes: Vec<u64>,
    /// Number of the smooth part around each.
    pub parts: Vec<u32>,
    /// Their coordinates.
    pub points: Vec<[f64; 3]>,
    /// Corners as indices into `nodes`, counter-clockwise from outside. Quadrilaterals are cut in both ways, and integrals
    /// are means of both: that keeps the integrals of bilinear functions, so constant pressures.
    pub triangles: Vec<[usize; 3]>,
    /// How much a triangle counts: a half where quadrilaterals are cut in both ways, else one.
    pub share: f64,
    /// Faces with quadratic shape functions: corners, then the middles of the edges between them. Each is four triangles.
    pub quadratic: Vec<[usize; 6]>,
    /// What it is a part of; nothing if all of the surface is here.
    pub of: Option<PartOf>,
}

/// What is known of a surface of which a part is here, and of that part.
#[derive(Clone, Debug)]
pub struct PartOf {
    /// [`GatheredSurface::spacing`] of the whole.
    pub spacing: f64,
    /// [`GatheredSurface::diameter`] of the whole.
    pub diameter: f64,
    /// How far each node is from the rank's own faces: on one, on a face beside one, or further.
    pub layers: Vec<Layer>,
    /// Nodes that no lower rank has on a face of its own: what all ranks say of these is said once.
    pub told: Vec<bool>,
    /// Which triangles are of the rank's own faces.
    pub own: Vec<bool>,
}

/// How much of the surface around a node is here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Layer {
    /// On an own face; all faces around it, and all faces around these are here.
    Own,
    /// All faces around it are here.
    Beside,
    /// Some faces may be missing.
    Rim,
}

impl GatheredSurface {
    /// All of surface number `surface`, on every rank: what parts of it are compared with. Collective.
    #[cfg(test)]
    pub fn gather(
        comm: &dyn crate::comm::Comm,
        subdomains: &[crate::decomposition::Subdomain],
        surface: usize,
    ) -> Self {
        let mut mine = Vec::new();
        for subdomain in subdomains {
            for facet in subdomain.facets.iter().filter(|f| f.surface == surface) {
                mine.push(facet.nodes.len() as u64);
                for node in facet.nodes.iter().map(|&n| n as usize) {
                    mine.push(subdomain.nodes[node]);
                    mine.extend(subdomain.points[node].map(f64::to_bits));
                }
            }
        }
        let (mut places, mut faces) = (BTreeMap::new(), Vec::new());
        let mut all = crate::comm::all_gather_u64(comm, &mine).into_iter();
        while let Some(count) = all.next() {
            let mut corner = || {
                let [node, x, y, z] = [(); 4].map(|()| all.next().expect("faces are whole"));
                places.insert(node, [x, y, z].map(f64::from_bits));
                node
            };
            faces.push((0..count).map(|_| corner()).collect());
        }
        Self::new(&faces, &places)
    }

    /// Of faces by their nodes, which have these places.
    pub fn new(faces: &[Vec<u64>], places: &BTreeMap<u64, [f64; 3]>) -> Self {
        Self::of_parts(faces, &smooth::parts(faces, |node| places[&node]), places)
    }

    /// As [`Self::new`], with the numbers of the smooth parts around the nodes of each face.
    pub fn of_parts(faces: &[Vec<u64>], parts: &[Vec<u32>], places: &BTreeMap<u64, [f64; 3]>) -> Self {
        let slots = faces.iter().zip(parts).map(|(face, parts)| face.iter().copied().zip(parts.iter().copied()));
        let mut listed: Vec<(u64, u32)> = slots.clone().flatten().collect();
        listed.sort_unstable();
        listed.dedup();
        let (mut triangles, mut quadratic, mut share) = (Vec::new(), Vec::new(), 1.0);
        for slots in slots {
            let index = |slot| listed.binary_search(&slot).expect("every corner is listed");
            // All faces of a surface are of one kind.
            match slots.map(index).collect::<Vec<usize>>()[..] {
                [a, b, c, d] => {
                    triangles.extend([[a, b, c], [a, c, d], [a, b, d], [b, c, d]]);
                    share = 0.5;
                }
                [a, b, c, ab, bc, ca] => {
                    triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                    quadratic.push([a, b, c, ab, bc, ca]);
                }
                ref face => triangles.push([face[0], face[1], face[2]]),
            }
        }
        let (nodes, parts): (Vec<u64>, Vec<u32>) = listed.into_iter().unzip();
        let points = nodes.iter().map(|node| places[node]).collect();
        Self { nodes, parts, points, triangles, share, quadratic, of: None }
    }

    /// Index of a node on one of the smooth parts around it.
    pub fn index(&self, node: u64, part: u32) -> Option<usize> {
        let first = self.nodes.partition_point(|known| *known < node);
        (first..self.nodes.len()).take_while(|&k| self.nodes[k] == node).find(|&k| self.parts[k] == part)
    }

    /// Corners of the triangles.
    pub fn corners(&self) -> impl Iterator<Item = [[f64; 3]; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|corner| self.points[corner]))
    }

    /// Area vectors of the triangles.
    pub(super) fn area_vectors(&self) -> impl Iterator<Item = [f64; 3]> {
        self.corners().map(|corners| area_vector(&corners))
    }

    /// How much of the surface around a node is here.
    pub fn layer(&self, index: usize) -> Layer {
        self.of.as_ref().map_or(Layer::Own, |of| of.layers[index])
    }

    /// Whether what is said of a node counts here, and not on another rank.
    pub fn tells(&self, index: usize) -> bool {
        self.of.as_ref().is_none_or(|of| of.told[index])
    }

    /// Whether a triangle is of this rank's own faces.
    pub fn owns(&self, triangle: usize) -> bool {
        self.of.as_ref().is_none_or(|of| of.own[triangle])
    }

    /// Diagonal of the bounding box of the whole surface.
    pub fn diameter(&self) -> f64 {
        if let Some(of) = &self.of {
            return of.diameter;
        }
        let along = |a: usize| {
            let (low, high) = self
                .points
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point[a]), high.max(point[a])));
            high - low
        };
        let diagonal = [0, 1, 2].map(along);
        dot(diagonal, diagonal).sqrt()
    }

    /// Typical edge length of the whole surface: root of twice the mean triangle area.
    pub fn spacing(&self) -> f64 {
        if let Some(of) = &self.of {
            return of.spacing;
        }
        let total: f64 = self.area_vectors().map(|v| dot(v, v).sqrt()).sum();
        (2.0 * total / self.triangles.len().max(1) as f64).sqrt()
    }
}

/// Cosine between the normals, one of them turned around, from which two surfaces face each other.
pub const FACING: f64 = 0.1;

/// The vector over its length, whatever that is.
pub fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let largest = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest < f64::EPSILON {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = dot(v, v).sqrt();
    Some(v.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decomposition::Patch;
    use crate::fixture::{RANKS, on_ranks, two_bricks, two_bricks_by_metis};

    #[test]
    fn a_face_is_gathered_whole_on_every_rank_with_its_normal_and_area() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(24)] {
            for ranks in RANKS {
                on_ranks(&scene, ranks, |setup| {
                    let (bodies, surfaces) = (&setup.discrete.bodies, &setup.discrete.surfaces);
                    for (index, surface) in surfaces.iter().enumerate() {
                        let body = &bodies[surface.body];
                        let (brick, Patch::Face(face)) = (body.brick().unwrap(), &surface.patch) else { panic!() };
                        let found = GatheredSurface::gather(setup.comm, setup.subdomains(), index);
                        let on = |node: &u64| brick.is_on(*face, brick.node_position(*node));
                        let nodes: Vec<u64> = (0..brick.node_count()).filter(on).collect();
                        let points: Vec<_> = nodes.iter().map(|&n| brick.coordinates(brick.node_position(n))).collect();
                        assert_eq!(found.nodes, nodes.iter().map(|n| body.first_node + n).collect::<Vec<_>>());
                        assert_eq!(found.points, points);
                        assert_eq!(found.triangles.len() as u64, brick.triangle_count(*face));

                        let of_nodes = found.normals_and_areas();
                        assert!(of_nodes.iter().all(|(normal, _)| *normal == face.normal()));
                        let axis = face.axis();
                        let area: f64 = (0..3).filter(|&a| a != axis).map(|a| brick.size[a]).product();
                        let sum: f64 = of_nodes.iter().map(|(_, area)| area).sum();
                        assert!((sum - area).abs() < 1e-14 * area);
                    }
                });
            }
        }
    }

    #[test]
    fn quadrilaterals_share_their_area_equally_on_a_lattice() {
        on_ranks(&two_bricks(&["body.lower.element=hex8"]), 2, |setup| {
            let top =
                |s: &crate::decomposition::Surface| s.body == 0 && s.patch == Patch::Face(crate::mesh::Face::ZMax);
            let index = setup.discrete.surfaces.iter().position(top).expect("it is in contact");
            let surface = GatheredSurface::gather(setup.comm, setup.subdomains(), index);
            for (point, (normal, area)) in surface.points.iter().zip(surface.normals_and_areas()) {
                let halves =
                    [(0, 4.0), (1, 2.2)].iter().filter(|(a, end)| point[*a] == 0.0 || point[*a] == *end).count();
                assert!((area - 1.0 * 1.1 * 0.5_f64.powi(halves as i32)).abs() < 1e-14);
                assert_eq!(normal, [0.0, 0.0, 1.0]);
            }
        });
    }

    #[test]
    fn where_it_bends_a_little_the_normal_is_the_mean_weighted_by_area_and_at_an_edge_there_are_two() {
        let bent = |drop: f64| {
            let points = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [-1.0, 0.0, -drop]];
            let places = (0..).zip(points).collect();
            GatheredSurface::new(&[vec![0, 2, 1], vec![0, 1, 3]], &places)
        };
        let little = bent(0.5);
        let [(ridge, area), _, (slope, third), _] = little.normals_and_areas()[..] else { panic!("four nodes") };
        // Triangles of area vectors (0, 0, 1) and (-1/4, 0, 1/2).
        let length = (1.5_f64.powi(2) + 0.25 * 0.25).sqrt();
        let expected = [-0.25 / length, 0.0, 1.5 / length];
        assert!((0..3).all(|a| (ridge[a] - expected[a]).abs() < 1e-15), "{ridge:?}");
        assert!((area - length / 3.0).abs() < 1e-15 && (third - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(slope, [0.0, 0.0, 1.0]);
        let edge = bent(3.0);
        assert_eq!(edge.nodes, [0, 0, 1, 1, 2, 3]);
        assert_eq!(edge.parts, [0, 1, 0, 1, 0, 0]);
        let steep = [-3.0 / 10.0_f64.sqrt(), 0.0, 1.0 / 10.0_f64.sqrt()];
        let expected = [[0.0, 0.0, 1.0], steep, [0.0, 0.0, 1.0], steep, [0.0, 0.0, 1.0], steep];
        for ((normal, _), expected) in edge.normals_and_areas().iter().zip(expected) {
            assert!((0..3).all(|a| (normal[a] - expected[a]).abs() < 1e-15), "{normal:?} {expected:?}");
        }
    }
}
