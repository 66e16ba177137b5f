//! Integrals over elements of what is known at nodes and at integration points.
//!
//! Between the integration points of an element stresses are interpolated and extrapolated: constant in the linear
//! tetrahedron, linear in the quadratic one, trilinear in the hexahedron. Volumes likewise.

use crate::element::cell::{EDGES, four_points};
use crate::element::sample::GAUSS;
use crate::element::{Cell, Kind};

/// A point of a rule.
pub struct Place {
    /// Weights of the volumes of the integration points in the volume of this one.
    pub volume: Vec<f64>,
    /// Weights of values at the integration points in the value here.
    pub samples: Vec<f64>,
    /// Weights of values at the nodes in the value here: the values of the shape functions.
    pub nodes: Vec<f64>,
}

/// Exact for squares of what shape functions interpolate, as long as edges are straight.
pub fn squares(kind: Kind) -> Vec<Place> {
    match (kind.cell(), kind.degree()) {
        (Cell::Tetrahedron, 1) => four_points().map(|at| tetrahedron(kind, at, 0.25)).into(),
        (Cell::Tetrahedron, _) => of_degree_five(kind),
        (Cell::Hexahedron, 1) => gauss(kind, &[(-1.0 / 3_f64.sqrt(), 1.0), (1.0 / 3_f64.sqrt(), 1.0)]),
        (Cell::Hexahedron, _) => gauss(kind, &GAUSS),
    }
}

/// For functions that elements do not know: of degree five.
pub fn fine(kind: Kind) -> Vec<Place> {
    match kind.cell() {
        Cell::Hexahedron => gauss(kind, &GAUSS),
        Cell::Tetrahedron => of_degree_five(kind),
    }
}

/// Products of a rule along a line; volumes between the integration points are interpolated.
fn gauss(kind: Kind, line: &[(f64, f64)]) -> Vec<Place> {
    let mut places = Vec::new();
    for (z, c) in line {
        for (y, b) in line {
            for (x, a) in line {
                let at = [*x, *y, *z];
                let samples = kind.extrapolation(&at);
                let volume = samples.iter().map(|s| a * b * c * s).collect();
                places.push(Place { volume, samples, nodes: kind.values(&at) });
            }
        }
    }
    places
}

/// A place that stands for this share of the volume.
fn tetrahedron(kind: Kind, at: [f64; 4], share: f64) -> Place {
    Place { volume: vec![share; kind.points()], samples: kind.extrapolation(&at), nodes: kind.values(&at) }
}

/// 14 points (Walkington, "Quadrature on simplices of arbitrary dimension", 2000).
fn of_degree_five(kind: Kind) -> Vec<Place> {
    let mut places = Vec::new();
    for (share, near) in
        [(0.112_687_925_718_015_85, 0.310_885_919_263_300_6), (0.073_493_043_116_361_95, 0.092_735_250_310_891_23)]
    {
        for corner in 0..4 {
            let at = std::array::from_fn(|a| if a == corner { 1.0 - 3.0 * near } else { near });
            places.push(tetrahedron(kind, at, share));
        }
    }
    let near = 0.045_503_704_125_649_65;
    for (a, b) in EDGES {
        let at = std::array::from_fn(|c| if c == a || c == b { 0.5 - near } else { near });
        places.push(tetrahedron(kind, at, 0.042_546_020_777_081_466));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of barycentric monomials over a tetrahedron of volume 1: 3! a! b! c! d! / (3 + a + b + c + d)!.
    #[test]
    fn fourteen_points_are_of_degree_five() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for powers in [
            [0, 0, 0, 0],
            [2, 0, 0, 0],
            [2, 2, 0, 0],
            [1, 1, 1, 1],
            [4, 0, 0, 0],
            [5, 0, 0, 0],
            [2, 1, 1, 1],
            [3, 2, 0, 0],
        ] {
            let exact =
                6.0 * powers.iter().map(|&p| factorial(p)).product::<f64>() / factorial(3 + powers.iter().sum::<i32>());
            let sum: f64 = of_degree_five(Kind::Tet4)
                .iter()
                .map(|place| place.volume[0] * (0..4).map(|a| place.nodes[a].powi(powers[a])).product::<f64>())
                .sum();
            assert!((sum - exact).abs() < 1e-15, "{powers:?}: {sum} {exact}");
        }
    }

    #[test]
    fn all_rules_have_the_volume_and_give_constants_back() {
        for kind in [Kind::Tet4, Kind::Tet10, Kind::Hex8] {
            for rule in [squares(kind), fine(kind)] {
                let points = rule[0].volume.len() as f64;
                // Every integration point stands for the same volume.
                let volume: f64 = rule.iter().map(|place| place.volume.iter().sum::<f64>() / points).sum();
                assert!((volume - 1.0).abs() < 1e-14, "{kind:?}: {volume}");
                for place in rule {
                    assert!((place.samples.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                    assert!((place.nodes.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn linear_fields_pass_through_the_points_of_a_quadratic_tetrahedron() {
        let field = |at: [f64; 4]| 2.0 * at[0] - at[1] + 0.5 * at[3];
        let samples = four_points().map(field);
        for place in squares(Kind::Tet10) {
            // Corner values of a linear field are its nodal values; middles are means.
            let mut nodal = [0.0; 10];
            (0..4).for_each(|a| nodal[a] = field(std::array::from_fn(|b| f64::from(a == b))));
            EDGES.iter().enumerate().for_each(|(k, &(a, b))| nodal[4 + k] = 0.5 * (nodal[a] + nodal[b]));
            let expected: f64 = place.nodes.iter().zip(nodal).map(|(v, n)| v * n).sum();
            let found: f64 = place.samples.iter().zip(samples).map(|(c, s)| c * s).sum();
            assert!((found - expected).abs() < 1e-14);
        }
    }
}
