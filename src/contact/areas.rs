//! Normals of the nodes of a surface, and the areas that belong to them.

use super::surface::GatheredSurface;
use super::{quadratic, smooth};
use crate::mesh::surface::quadratic_normal;
use crate::vector::dot;

impl GatheredSurface {
    /// Unit normal of each node, and its share of the area: the integral of its shape function, seen along the normal; with
    /// quadratic ones that of [`quadratic`]. A pressure times that area along that normal is what the pressure on the faces
    /// does to the node. Normals are means of those of the faces around it, weighted by area: of quadratic faces of those at the node,
    /// so that they are as exact at the end of a curved surface as inside.
    pub fn normals_and_areas(&self) -> Vec<([f64; 3], f64)> {
        self.normals_and_areas_with(quadratic::SHARE)
    }

    /// As [`Self::normals_and_areas`], where corners of quadratic faces get that share of the functions of middles.
    pub fn normals_and_areas_with(&self, share: f64) -> Vec<([f64; 3], f64)> {
        let mut sums = vec![[0.0; 3]; self.nodes.len()];
        let mut add = |node: usize, factor: f64, vector: [f64; 3]| {
            sums[node].iter_mut().zip(vector).for_each(|(sum, x)| *sum += factor * x);
        };
        for face in &self.quadratic {
            let places = face.map(|node| self.points[node]);
            face.iter().zip(smooth::NODES).for_each(|(&node, at)| add(node, 1.0, quadratic_normal(&places, at)));
        }
        if self.quadratic.is_empty() {
            for (triangle, vector) in self.triangles.iter().zip(self.area_vectors()) {
                triangle.iter().for_each(|&corner| add(corner, self.share / 3.0, vector));
            }
        }
        let parts = |sum: [f64; 3]| {
            let area = dot(sum, sum).sqrt();
            (sum.map(|s| s / area), area)
        };
        let mut all: Vec<_> = sums.into_iter().map(parts).collect();
        if !self.quadratic.is_empty() {
            let areas = quadratic::areas(self, share, |_| true);
            all.iter_mut().zip(areas).for_each(|((_, sum), area)| *sum = area);
        }
        all
    }

    /// As [`Self::normals_and_areas`], but of the faces alone whose nodes are all `covered`.
    pub fn covered_areas(&self, normals: &[[f64; 3]], covered: impl Fn(usize) -> bool) -> Vec<f64> {
        if !self.quadratic.is_empty() {
            return quadratic::areas(self, quadratic::SHARE, |face| face.iter().all(|&node| covered(node)));
        }
        let mut areas = vec![0.0; self.nodes.len()];
        for (triangle, vector) in self.triangles.iter().zip(self.area_vectors()) {
            if triangle.iter().all(|&node| covered(node)) {
                triangle.iter().for_each(|&node| areas[node] += self.share * dot(vector, normals[node]) / 3.0);
            }
        }
        areas
    }
}
