//! The quadratic tetrahedron: corners 0..4 as those of the linear one, then the middles of the edges 01, 12, 20, 03, 13, 23
//! (the order of VTK). Four Gauss points of degree two: exact for straight edges, and no motion but the rigid ones is
//! free, as 4 x 6 strains and 6 motions make 30 unknowns. Edges may be curved; the map is that of the displacement.

use super::cell::{EDGES, FAR, NEAR, barycentric, four_points};
use super::{Cell, Element, Gmsh, Nodal, Point, Sample, map};

/// The element.
pub struct Tet10;

impl Element<10, 4> for Tet10 {
    const CELL: Cell = Cell::Tetrahedron;
    const DEGREE: usize = 2;
    const FACES: &'static [&'static [usize]] =
        &[&[0, 2, 1, 6, 5, 4], &[0, 1, 3, 4, 8, 7], &[1, 2, 3, 5, 9, 8], &[0, 3, 2, 7, 9, 6]];
    const MIDDLES: &'static [(usize, usize)] = &EDGES;
    const TETRAHEDRA: u64 = 8;
    const BEST_AT_CENTRE: bool = false;
    const VTK: u8 = 24;
    const GMSH: Gmsh = Gmsh {
        cell: 11,
        face: 9,
        // Gmsh has the last two middles the other way round.
        order: &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
        needs: Some(
            "tetrahedra of second order alone: mesh with `Mesh.ElementOrder = 2;` or `SetOrder 2;` and without `Recombine`, \
             or take another element",
        ),
    };

    #[inline]
    fn points(nodes: &Nodal<10>) -> [Point<10>; 4] {
        four_points().map(|place| {
            let point = map::point(nodes, &derivatives(&place));
            Point { weight: point.weight / 24.0, ..point }
        })
    }

    fn values_at_points() -> [[f64; 10]; 4] {
        four_points().map(|at| Self::values(&at))
    }

    /// Least determinant of the map from the reference tetrahedron at nodes and Gauss points, over the cube of the longest
    /// distance of corners, times the root of two: 1 for the regular tetrahedron, negative if it is turned inside out somewhere.
    fn shape(nodes: &Nodal<10>) -> f64 {
        let mut longest = 0.0_f64;
        for (a, b) in EDGES {
            longest = longest.max((0..3).map(|i| (nodes[a][i] - nodes[b][i]).powi(2)).sum());
        }
        let corner = |a: usize| std::array::from_fn(|b| f64::from(a == b));
        let middle = |(a, b): (usize, usize)| std::array::from_fn(|c| if c == a || c == b { 0.5 } else { 0.0 });
        let places = (0..4).map(corner).chain(EDGES.map(middle)).chain(four_points());
        let least = places.map(|at| map::determinant(nodes, &derivatives(&at))).fold(f64::INFINITY, f64::min);
        std::f64::consts::SQRT_2 * least / (longest * longest.sqrt())
    }

    fn values(at: &[f64]) -> [f64; 10] {
        let at = barycentric(at);
        let mut values = [0.0; 10];
        (0..4).for_each(|a| values[a] = at[a] * (2.0 * at[a] - 1.0));
        EDGES.iter().zip(&mut values[4..]).for_each(|(&(a, b), value)| *value = 4.0 * at[a] * at[b]);
        values
    }

    fn extrapolation(at: &[f64]) -> [f64; 4] {
        barycentric(at).map(|a| (a - FAR) / (NEAR - FAR))
    }

    fn sample(nodes: &Nodal<10>, at: &[f64], weight: f64) -> Sample {
        let point = map::point(nodes, &derivatives(&barycentric(at)));
        let values = Self::values(at).to_vec();
        Sample { weight: weight * point.weight, values, gradients: point.gradients.to_vec() }
    }
}

/// Derivatives of the shape functions by the barycentric coordinates of corners 1, 2, 3.
#[inline]
fn derivatives(at: &[f64; 4]) -> Nodal<10> {
    // Of each coordinate by those three.
    const SLOPES: [[f64; 3]; 4] = [[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut derivatives = [[0.0; 3]; 10];
    for k in 0..3 {
        (0..4).for_each(|a| derivatives[a][k] = (4.0 * at[a] - 1.0) * SLOPES[a][k]);
        for (&(a, b), derivative) in EDGES.iter().zip(&mut derivatives[4..]) {
            derivative[k] = 4.0 * (at[a] * SLOPES[b][k] + at[b] * SLOPES[a][k]);
        }
    }
    derivatives
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::DEGENERATE;
    use crate::element::tet4::Tet4;

    fn straight(corners: &Nodal<4>) -> Nodal<10> {
        let middle = |(a, b): (usize, usize)| std::array::from_fn(|i| 0.5 * (corners[a][i] + corners[b][i]));
        let middles = EDGES.map(middle);
        std::array::from_fn(|a| if a < 4 { corners[a] } else { middles[a - 4] })
    }

    const CORNERS: Nodal<4> = [[0.1, 0.0, 0.2], [2.0, 0.3, 0.0], [0.4, 1.5, 0.1], [0.2, 0.5, 1.0]];

    #[test]
    fn with_straight_edges_it_has_volume_and_shape_of_the_linear_one() {
        let nodes = straight(&CORNERS);
        let [linear] = Tet4::points(&CORNERS);
        let points = Tet10::points(&nodes);
        assert!(points.iter().all(|p| (p.weight - linear.weight / 4.0).abs() < 1e-15));
        assert!((Tet10::shape(&nodes) - Tet4::shape(&CORNERS)).abs() < 1e-14);
    }

    /// The gradient of a quadratic function at each Gauss point.
    #[test]
    fn gradients_of_quadratic_functions_are_exact() {
        let nodes = straight(&CORNERS);
        let function = |[x, y, z]: [f64; 3]| x * x - 2.0 * x * y + 0.5 * z * z + y * z - x;
        let gradient = |[x, y, z]: [f64; 3]| [2.0 * x - 2.0 * y - 1.0, z - 2.0 * x, z + y];
        for (near, point) in Tet10::points(&nodes).iter().enumerate() {
            let values = Tet10::values(&four_points()[near]);
            let place = std::array::from_fn(|i| (0..10).map(|a| values[a] * nodes[a][i]).sum());
            let expected = gradient(place);
            for i in 0..3 {
                let found: f64 = (0..10).map(|a| point.gradients[a][i] * function(nodes[a])).sum();
                assert!((found - expected[i]).abs() < 1e-13, "{found} {expected:?}");
            }
        }
    }

    #[test]
    fn a_middle_too_far_off_or_inverted_corners_are_refused() {
        let mut bent = straight(&CORNERS);
        bent[4] = std::array::from_fn(|i| 0.9 * CORNERS[1][i] + 0.1 * CORNERS[0][i]);
        let [a, b, c, d] = CORNERS;
        for nodes in [bent, straight(&[a, c, b, d]), straight(&[a, b, c, a])] {
            assert!(Tet10::shape(&nodes) <= DEGENERATE);
        }
    }
}
