//! The consistency error of contact on a mesh: what pressures do on the distances that its conditions leave.
//!
//! Conditions hold surfaces apart at nodes or in the mean, not everywhere. With the exact displacement `u`, its pressure `p` and the
//! distance `g(u_h)` of the surfaces after `u_h`, negative where one is inside the other,
//!
//! ```text
//! J(u_h) - J(u) = D(u_h, u) + integral of p g(u_h)
//! ```
//!
//! where `D` is the Bregman distance: `J'(u)` does no work but that of `p`, and `p g(u) = 0`. Here the pressure of the mesh is in the place
//! of `p`, linear between its nodes. Where pressures pass from one node to the next this is too large, for the exact one ends
//! somewhere between.
//!
//! Mortar conditions hold the mean with their own functions `psi` ([`super::dual`]) at zero where there is pressure. So what is left is the
//! difference of two means, that with positive functions and that with `psi`, and distances that are given in place of those of the
//! meshes drop out. Where nodes meet nodes or an obstacle, the distances of nodes are interpolated. What an obstacle does between the
//! nodes of linear faces is not seen.

use super::dual::{self, DualFunctions};
use super::mortar::{self, Part};
use super::opposite::{self, Face, faces, in_face};
use super::surface::GatheredSurface;
use crate::mesh::surface;
use crate::vector::dot;

/// What is known of a condition.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Pressure (stress).
    pub pressure: f64,
    /// Distance (length).
    pub gap: f64,
}

/// Integral of `p g` over each face (energy), zero over those that are not own ones, where conditions are on the nodes: `state` knows
/// them by the index of the node, `share` is that of middles ([`super::quadratic`]).
pub fn of_nodes(slave: &GatheredSurface, share: f64, state: impl Fn(usize) -> Option<State>) -> Vec<f64> {
    let corners: Vec<_> = slave.corners().collect();
    let of = |Face { nodes, triangles }: Face| {
        let Some(states) = nodes.iter().map(|&node| state(node)).collect::<Option<Vec<State>>>() else { return 0.0 };
        let mut gaps: Vec<f64> = states.iter().map(|state| state.gap).collect();
        for k in 3..nodes.len() {
            gaps[k] = (1.0 - 2.0 * share) * gaps[k] + share * (gaps[k - 3] + gaps[(k - 2) % 3]);
        }
        let pressure = |node: usize| states[nodes.iter().position(|&n| n == node).expect("it is of the face")].pressure;
        let of_triangle = |triangle: usize| {
            let pressures = slave.triangles[triangle].map(pressure);
            let work = |(part, at): (f64, [f64; 3])| {
                let values = opposite::functions(nodes, in_face(slave, triangle, at)).into_iter().zip(&gaps);
                part * dot(pressures, at) * values.map(|((_, value), gap)| value * gap).sum::<f64>()
            };
            slave.share * surface::area(&corners[triangle]) * surface::quartic().map(work).sum::<f64>()
        };
        triangles.map(of_triangle).sum()
    };
    faces(slave).map(|face| if slave.owns(face.triangles.start) { of(face) } else { 0.0 }).collect()
}

/// The same where conditions are means. `displacement` is that of a global node; places count for distances unless these `are_given`.
pub fn of_means(
    slave: &GatheredSurface,
    master: &GatheredSurface,
    pressure: impl Fn(usize) -> Option<f64>,
    displacement: impl Fn(u64) -> [f64; 3],
    are_given: bool,
) -> Vec<f64> {
    let normals = slave.normals_and_areas();
    let height = |of: &GatheredSurface, nodes: &[(usize, f64)], normal: [f64; 3]| {
        let of_node = |&(node, value): &(usize, f64)| {
            let place = if are_given { 0.0 } else { dot(normal, of.points[node]) };
            value * (place + dot(normal, displacement(of.nodes[node])))
        };
        nodes.iter().map(of_node).sum::<f64>()
    };
    let of = |part: &Part| {
        let pressures = [0, 1, 2].map(|k| pressure(part.face[k]));
        if !pressures.iter().flatten().any(|pressure| *pressure > 0.0) {
            return 0.0;
        }
        let active = pressures.map(|pressure| pressure.is_some());
        let functions = [dual::positive(&part.mass, active), mortar::dual_functions(part, active)];
        let mut integrals = [[0.0; 3]; 2];
        for point in &part.seen.points {
            let own = opposite::functions(part.face, point.at);
            let Some(normal) = mortar::mean(own.iter().map(|&(node, value)| (normals[node].0, value))) else {
                continue;
            };
            let distance = height(master, &point.masters, normal) - height(slave, &own, normal);
            for (integrals, DualFunctions { functions, .. }) in integrals.iter_mut().zip(&functions) {
                (0..3).for_each(|j| integrals[j] += point.area * dot(functions[j], point.at) * distance);
            }
        }
        let work = |j: usize| {
            let [phi, psi] = functions.map(|of| of.slave[j].iter().sum::<f64>());
            pressures[j].unwrap_or_default() * (psi / phi * integrals[0][j] - integrals[1][j])
        };
        (0..3).filter(|&j| active[j]).map(work).sum()
    };
    let mut works = vec![0.0; faces(slave).count()];
    mortar::parts(slave, master, &normals)
        .iter()
        .filter(|part| part.own)
        .for_each(|part| works[part.number] = of(part));
    works
}

#[cfg(test)]
mod tests {
    use super::super::mortar::tests::grid;
    use super::super::quadratic::SHARE_WHERE_BENT as SHARE;
    use super::*;

    fn square(n: usize, first: u64, turned: bool) -> GatheredSurface {
        grid([n, n], first, turned, |x, y| [x, y, 0.0])
    }

    fn assert_sum(found: &[f64], expected: f64) {
        let sum: f64 = found.iter().sum();
        assert!((sum - expected).abs() < 1e-12, "{sum} {expected}");
    }

    /// On the unit square the integral of `(1 + x) (2 + y)` is 15/4.
    #[test]
    fn at_nodes_it_is_the_integral_of_what_they_have() {
        let slave = square(3, 0, true);
        let state = |node: usize| {
            let [x, y, _] = slave.points[node];
            Some(State { pressure: 1.0 + x, gap: 2.0 + y })
        };
        let found = of_nodes(&slave, SHARE, state);
        assert_eq!(found.len(), 18);
        assert_sum(&found, 3.75);
        // A face of which a node has no condition tells nothing.
        let found = of_nodes(&slave, SHARE, |node| state(node).filter(|_| node != 0));
        assert_eq!(found.iter().filter(|work| **work == 0.0).count(), 2);
    }

    /// Distances of quadratic faces are quadratic, and those of their middles come from coefficients: the integral of
    /// `(1 + x) (x^2 + y)` over the unit square is 4/3.
    #[test]
    fn conditions_of_middles_are_coefficients() {
        let slave = mortar::tests::quadratic(square(2, 0, true));
        let gap = |node: usize| slave.points[node][0].powi(2) + slave.points[node][1];
        let mut ends = std::collections::HashMap::new();
        for face in &slave.quadratic {
            (0..3).for_each(|k| _ = ends.insert(face[3 + k], [face[k], face[(k + 1) % 3]]));
        }
        let state = |node: usize| {
            let coefficient = |[a, b]: &[usize; 2]| (gap(node) - SHARE * (gap(*a) + gap(*b))) / (1.0 - 2.0 * SHARE);
            let gap = ends.get(&node).map_or_else(|| gap(node), coefficient);
            Some(State { pressure: 1.0 + slave.points[node][0], gap })
        };
        assert_sum(&of_nodes(&slave, SHARE, state), 4.0 / 3.0);
    }

    /// Dual functions find the value at the node of a linear distance: what is left of each face is
    /// `A / 12 (sum of p) (sum of g) - A / 4 (sum of p g)`.
    #[test]
    fn of_means_it_is_what_dual_functions_do_not_see() {
        let (slave, master) =
            (square(3, 0, true), grid([4, 5], 500, false, |x, y| [2.0 * x - 0.5, 2.0 * y - 0.5, -0.25]));
        let pressure = |[x, y, _]: [f64; 3]| 1.0 + x * x + 0.5 * y;
        let gap = |[x, y, _]: [f64; 3]| 0.25 + 0.3 * x - 0.2 * y;
        let rise = |node: u64| if node < 500 { gap(slave.points[node as usize]) - 0.25 } else { 0.0 };
        let of_node = |node: usize| Some(pressure(slave.points[node]));
        let found = of_means(&slave, &master, of_node, |node| [0.0, 0.0, rise(node)], false);
        let given = of_means(&slave, &master, of_node, |node| [0.0, 0.0, rise(node)], true);
        for ((corners, found), given) in slave.corners().zip(found).zip(given) {
            let (p, g) = (corners.map(pressure), corners.map(gap));
            let sum = |of: [f64; 3]| of.iter().sum::<f64>();
            let expected = surface::area(&corners) * (sum(p) * sum(g) / 12.0 - dot(p, g) / 4.0);
            assert!((found - expected).abs() < 1e-13 && (given - expected).abs() < 1e-13, "{found} {given} {expected}");
        }
    }

    /// The multipliers' functions add up to one: a constant pressure does no more than its conditions say, whatever is opposite.
    #[test]
    fn a_constant_pressure_leaves_nothing() {
        for [slave, master] in [
            [square(3, 0, true), square(4, 500, false)],
            [mortar::tests::quadratic(square(2, 0, true)), mortar::tests::quadratic(square(3, 500, false))],
        ] {
            let wave = |node: u64| [0.0, 0.0, 0.01 * (node as f64).sin()];
            let found = of_means(&slave, &master, |_| Some(2.0), wave, false);
            assert!(found.iter().all(|work| work.abs() < 1e-15), "{found:?}");
            assert!(of_means(&slave, &master, |k| Some(k as f64), wave, false).iter().any(|work| work.abs() > 1e-6));
        }
    }
}
