//! Normals of the nodes of a surface, and the areas that belong to them.

use super::quadratic;
use super::surface::GatheredSurface;
use crate::vector::dot;

impl GatheredSurface {
    /// Unit normal of each node, and its share of the area: the integral of its shape function, seen along the normal; with
    /// quadratic ones that of [`quadratic`]. A pressure times that area along that normal is what the pressure on the faces
    /// does to the node.
    pub fn normals_and_areas(&self) -> Vec<([f64; 3], f64)> {
        let mut sums = vec![[0.0; 3]; self.nodes.len()];
        for (triangle, vector) in self.triangles.iter().zip(self.area_vectors()) {
            for &corner in triangle {
                (0..3).for_each(|a| sums[corner][a] += self.share * vector[a] / 3.0);
            }
        }
        let parts = |sum: [f64; 3]| {
            let area = dot(sum, sum).sqrt();
            (sum.map(|s| s / area), area)
        };
        let mut all: Vec<_> = sums.into_iter().map(parts).collect();
        if !self.quadratic.is_empty() {
            all.iter_mut().zip(quadratic::areas(self, |_| true)).for_each(|((_, sum), area)| *sum = area);
        }
        all
    }

    /// As [`Self::normals_and_areas`], but of the faces alone whose nodes are all `covered`.
    pub fn covered_areas(&self, normals: &[[f64; 3]], covered: impl Fn(usize) -> bool) -> Vec<f64> {
        if !self.quadratic.is_empty() {
            return quadratic::areas(self, |face| face.iter().all(|&node| covered(node)));
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
