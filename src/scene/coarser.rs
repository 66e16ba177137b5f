//! The same scene with larger cells.

use super::body::Shape;
use super::mapped::Grid;
use super::{Groups, Method, Scene};

impl Scene {
    /// With cells `factor` times as large along each edge, as far as that leaves one; each body is cut into no more parts than
    /// it has materials. Meshes from files stay.
    pub fn coarser(&self, factor: usize) -> Scene {
        let mut scene = self.clone();
        let fewer = |n: &mut usize| *n = n.div_ceil(factor);
        for body in scene.body.values_mut() {
            match &mut body.shape {
                Shape::Brick(brick) => brick.cells.iter_mut().for_each(fewer),
                Shape::Sphere(sphere) => sphere.cells.iter_mut().for_each(fewer),
                Shape::Cylinder(cylinder) => cylinder.cells.iter_mut().for_each(fewer),
                Shape::Grid(Grid { x, y, z }) => [x, y, z].into_iter().for_each(|planes| thin_out(planes, factor)),
                Shape::Gmsh(_) => {}
            }
        }
        let regions = scene.body.values().map(|body| body.material.names().len()).sum();
        scene.decomposition.method = Method::Metis { subdomains: Some(regions) };
        scene.decomposition.cluster = Some(Groups::Equal(1));
        scene
    }

    /// What divides the cells of all bodies along every edge; 1 with meshes from files.
    pub fn common_divisor(&self) -> usize {
        let cells = self.body.values().flat_map(|body| match &body.shape {
            Shape::Brick(brick) => brick.cells.to_vec(),
            Shape::Sphere(sphere) => sphere.cells.to_vec(),
            Shape::Cylinder(cylinder) => cylinder.cells.to_vec(),
            Shape::Grid(Grid { x, y, z }) => [x, y, z].map(|planes| planes.len() - 1).to_vec(),
            Shape::Gmsh(_) => vec![1],
        });
        cells.fold(0, |mut a, mut b| {
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        })
    }
}

/// Keeps one plane of `factor`, and the last.
fn thin_out(planes: &mut Vec<f64>, factor: usize) {
    let last = planes.len() - 1;
    let mut place = 0..;
    planes.retain(|_| place.next().is_some_and(|k| k % factor == 0 || k == last));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_grow_as_far_as_there_are_any() {
        let sets = ["body.lower.brick.cells=[60, 7, 1]".to_owned(), "body.upper.brick.cells=[24, 6, 12]".to_owned()];
        let scene = Scene::load("two-blocks", 1, &[&sets[..], &["decomposition.cells=[6, 1, 1]".to_owned()]].concat());
        let scene = scene.unwrap();
        let cells = |scene: &Scene| scene.body.values().map(|b| b.brick().unwrap().cells).collect::<Vec<_>>();
        assert_eq!(cells(&scene.coarser(4)), [[15, 2, 1], [6, 2, 3]]);
        assert_eq!(cells(&scene.coarser(usize::MAX)), [[1; 3]; 2]);
        assert_eq!(scene.common_divisor(), 1);
        assert_eq!(Scene::load("two-blocks", 7, &[]).unwrap().common_divisor(), 70);
        let mut planes: Vec<f64> = (0..9).map(f64::from).collect();
        thin_out(&mut planes, 3);
        assert_eq!(planes, [0.0, 3.0, 6.0, 8.0]);
        thin_out(&mut planes, 100);
        assert_eq!(planes, [0.0, 8.0]);
    }
}
