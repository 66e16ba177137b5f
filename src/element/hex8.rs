//! The trilinear hexahedron with mean dilatation: 2x2x2 Gauss points, the divergence at each replaced by its mean over the
//! element (B-bar: Hughes, "Generalization of selective integration procedures to anisotropic and nonlinear media", 1980;
//! Nagtegaal, Parks and Rice 1974). Volume changes are constrained once an element instead of at eight points, so it
//! does not lock in isochoric flow, while shears keep their full integration and no motion but the rigid ones is free.
//!
//! Corners in the order of VTK: 0, 1, 2, 3 around the bottom, counter-clockwise from above, 4, 5, 6, 7 above them.

use super::{Cell, Element, Gmsh, Nodal, Point, Sample, map};

/// Corners of the reference cube `[-1, 1]^3`.
pub const CORNERS: Nodal<8> = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Coordinates of the Gauss points in the reference cube, up to signs: one over the root of three.
const GAUSS: f64 = 0.577_350_269_189_625_8;

/// The element.
pub struct Hex8;

impl Element<8, 8> for Hex8 {
    const CELL: Cell = Cell::Hexahedron;
    const DEGREE: usize = 1;
    const FACES: &'static [&'static [usize]] =
        &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
    const MIDDLES: &'static [(usize, usize)] = &[];
    const TETRAHEDRA: u64 = 6;
    const BEST_AT_CENTRE: bool = true;
    const VTK: u8 = 12;
    const GMSH: Gmsh = Gmsh {
        cell: 5,
        face: 3,
        order: &[0, 1, 2, 3, 4, 5, 6, 7],
        needs: Some(
            "hexahedra alone: mesh with `Transfinite Volume` and `Recombine Surface`, or `Mesh.SubdivisionAlgorithm = 2;`, or \
             take element = \"tet4\"",
        ),
    };

    #[inline]
    fn points(nodes: &Nodal<8>) -> [Point<8>; 8] {
        let mut points = CORNERS.map(|corner| map::point(nodes, &derivatives(&corner.map(|x| GAUSS * x))));
        let volume: f64 = points.iter().map(|point| point.weight).sum();
        let mut mean = [[0.0; 3]; 8];
        for point in &points {
            for (mean, g) in mean.as_flattened_mut().iter_mut().zip(point.gradients.as_flattened()) {
                *mean += point.weight / volume * g;
            }
        }
        for point in &mut points {
            let gradients = &point.gradients;
            point.dilatation = Some(std::array::from_fn(|a| std::array::from_fn(|i| mean[a][i] - gradients[a][i])));
        }
        points
    }

    fn values_at_points() -> [[f64; 8]; 8] {
        CORNERS.map(|corner| values(corner.map(|x| GAUSS * x)))
    }

    /// Least volume that three edges span at a corner, over the cube of the longest edge: 1 for a cube, negative if a corner
    /// is turned inside out. The map from the reference cube has its least determinant at a corner, or nearly so.
    fn shape(nodes: &Nodal<8>) -> f64 {
        let mut longest = 0.0_f64;
        for (a, b) in EDGES {
            longest = longest.max((0..3).map(|i| (nodes[a][i] - nodes[b][i]).powi(2)).sum());
        }
        let least =
            CORNERS.iter().map(|corner| map::determinant(nodes, &derivatives(corner))).fold(f64::INFINITY, f64::min);
        // The reference cube has edges of two.
        8.0 * least / (longest * longest.sqrt())
    }

    fn values(at: &[f64]) -> [f64; 8] {
        values(place(at))
    }

    /// The integration points are the corners of a smaller cube.
    fn extrapolation(at: &[f64]) -> [f64; 8] {
        values(place(at).map(|x| 3_f64.sqrt() * x))
    }

    /// Without mean dilatation.
    fn sample(nodes: &Nodal<8>, at: &[f64], weight: f64) -> Sample {
        let point = map::point(nodes, &derivatives(&place(at)));
        Sample { weight: weight * point.weight, values: Self::values(at).to_vec(), gradients: point.gradients.to_vec() }
    }
}

/// A place in the reference cube.
fn place(at: &[f64]) -> [f64; 3] {
    at.try_into().expect("a place in a hexahedron has three coordinates")
}

/// Values of the shape functions at a point of the reference cube.
fn values(at: [f64; 3]) -> [f64; 8] {
    CORNERS.map(|corner| (0..3).map(|i| 0.5 * (1.0 + corner[i] * at[i])).product())
}

/// Derivatives of the shape functions by the coordinates of the reference cube.
#[inline]
fn derivatives(at: &[f64; 3]) -> Nodal<8> {
    CORNERS.map(|corner| {
        let [x, y, z] = [0, 1, 2].map(|i| 1.0 + corner[i] * at[i]);
        [0.125 * corner[0] * y * z, 0.125 * corner[1] * x * z, 0.125 * corner[2] * x * y]
    })
}

const EDGES: [(usize, usize); 12] =
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::DEGENERATE;
    use crate::material::{Law, VonMises};
    use crate::random::Random;
    use crate::tensor::{apply, contract, trace};

    fn distorted(random: &mut Random) -> Nodal<8> {
        CORNERS.map(|corner| {
            let shift: [f64; 3] = random.vector(0.3);
            std::array::from_fn(|i| corner[i] + shift[i])
        })
    }

    #[test]
    fn a_box_has_its_volume_and_its_shape() {
        let nodes = CORNERS.map(|[x, y, z]| [5.0 + x, 2.0 * y, 0.5 * z]);
        let points = Hex8::points(&nodes);
        assert!(points.iter().all(|p| (p.weight - 1.0).abs() < 1e-15));
        assert!((Hex8::shape(&nodes) - 8.0 / 64.0).abs() < 1e-15 && (Hex8::shape(&CORNERS) - 1.0).abs() < 1e-15);
    }

    /// By the divergence theorem over triangles, of faces that are not flat but by their mean.
    #[test]
    fn volumes_of_distorted_ones_are_exact() {
        let mut random = Random::new(2);
        for _ in 0..20 {
            let nodes = distorted(&mut random);
            let mut exact = 0.0;
            for face in crate::element::Kind::Hex8.faces() {
                // Both ways to cut a face, half each: the integral over the bilinear face.
                for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]] {
                    let [a, b, c] = [a, b, c].map(|k| nodes[face[k]]);
                    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                    exact += (0..3).map(|i| a[i] * cross[i]).sum::<f64>() / 12.0;
                }
            }
            let volume: f64 = Hex8::points(&nodes).iter().map(|p| p.weight).sum();
            assert!((volume - exact).abs() < 1e-13, "{volume} {exact}");
        }
    }

    #[test]
    fn the_dilatation_is_the_same_at_all_points_and_has_the_right_mean() {
        let mut random = Random::new(3);
        let nodes = distorted(&mut random);
        let points = Hex8::points(&nodes);
        let u: Nodal<8> = std::array::from_fn(|_| random.vector(1.0));
        let of_point = points.map(|point| trace(&point.strain(&u)));
        let plain = points.map(|point| trace(&Point { dilatation: None, ..point }.strain(&u)));
        let sum = |traces: &[f64; 8]| traces.iter().zip(&points).map(|(t, p)| t * p.weight).sum::<f64>();
        assert!(of_point.iter().all(|t| (t - of_point[0]).abs() < 1e-14));
        assert!((sum(&of_point) - sum(&plain)).abs() < 1e-14 && (plain[0] - plain[1]).abs() > 0.01);
    }

    /// Where the dilatation is constant anyway, full integration gives the same; where it is not, more energy.
    #[test]
    fn b_bar_is_full_integration_for_constant_dilatation_and_softer_otherwise() {
        let c = VonMises::elastic(1.0, 0.45).hooke().tangent();
        let nodes = CORNERS.map(|[x, y, z]| [1.3 * x, 0.7 * y, z]);
        let points = Hex8::points(&nodes);
        let energy = |u: &Nodal<8>, with: bool| -> f64 {
            let strains = points.map(|p| Point { dilatation: p.dilatation.filter(|_| with), ..p }.strain(u));
            strains.iter().zip(&points).map(|(e, p)| p.weight * contract(&apply(&c, e), e)).sum()
        };
        // Shear of hourglass shape: u_x = y z has no divergence. And all linear motions.
        let hourglass = nodes.map(|[_, y, z]| [y * z, 0.0, 0.0]);
        let linear = nodes.map(|[x, y, z]| [x + 2.0 * y, z - 0.3 * y, 0.1 * x + z]);
        for u in [hourglass, linear] {
            assert!((energy(&u, true) - energy(&u, false)).abs() < 1e-14 * energy(&u, false));
        }
        // Bending: u_x = x y has the divergence y.
        let bending = nodes.map(|[x, y, _]| [x * y, 0.0, 0.0]);
        assert!(energy(&bending, true) < 0.9 * energy(&bending, false));
    }

    #[test]
    fn inverted_flat_and_folded_ones_are_refused() {
        let mirrored = CORNERS.map(|[x, y, z]| [x, y, -z]);
        let flat = CORNERS.map(|[x, y, _]| [x, y, 0.0]);
        let mut folded = CORNERS;
        folded[6] = [-0.5, -0.5, 0.9];
        for nodes in [mirrored, flat, folded, [[1.0; 3]; 8]] {
            assert!(Hex8::shape(&nodes).is_nan() || Hex8::shape(&nodes) <= DEGENERATE);
        }
        assert!(Hex8::shape(&CORNERS.map(|x| x.map(|v| 1e-60 * v))) > DEGENERATE);
    }

    #[test]
    fn shape_functions_are_one_at_their_corner_and_zero_at_others() {
        for (a, corner) in CORNERS.into_iter().enumerate() {
            assert_eq!(values(corner), std::array::from_fn(|b| f64::from(a == b)));
        }
    }
}
