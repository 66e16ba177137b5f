//! How deep an obstacle is in a face of the slave between its nodes.
//!
//! Conditions hold nodes out of an obstacle. A ball that presses less deep than faces are wide is in a face between them, and may
//! touch no node at all. The distance is that of [`super::rigid`], linearised at each place of the face as it is there at nodes:
//! `d(x) = g(x) - n(x) . (u(x) - w)`, with `w` what the obstacle is moved by.
//!
//! Places are the middles of the face and of its edges; on quadratic faces those of its four parts.

use super::opposite::functions;
use super::rigid::{FACING, approach};
use crate::mesh::surface::area_vector;
use crate::scene::Obstacle;
use crate::vector::{difference, dot, length};

/// Where an obstacle is deepest in a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// How deep it is (length).
    pub depth: f64,
    /// Longest way between nodes beside each other (length).
    pub width: f64,
    /// Where that is before the displacement.
    pub place: [f64; 3],
}

/// Looks for the deepest place of a face, whose nodes have these places and motions relative to the obstacle; the `gap` is added to all
/// distances. `None` where it is nowhere inside.
pub fn deepest(obstacle: &Obstacle, places: &[[f64; 3]], motions: &[[f64; 3]], gap: f64) -> Option<Entry> {
    let corners = if places.len() == 4 { 4 } else { 3 };
    let outward = area_vector(&[places[0], places[1], places[corners - 1]]);
    let mean = |weights: &[f64], of: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|a| weights.iter().zip(of).map(|(weight, x)| weight * x[a]).sum())
    };
    let at = |weights: Vec<f64>| {
        let place = mean(&weights, places);
        let (normal, distance) = approach(obstacle, place, outward)?;
        let depth = dot(normal, mean(&weights, motions)) - distance - gap;
        (dot(normal, outward) > FACING * length(outward) && depth > 0.0).then_some((depth, place))
    };
    let (depth, place) = between(places.len()).into_iter().filter_map(at).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let edges = (0..corners).map(|k| length(difference(places[k], places[(k + 1) % corners])));
    let width = edges.fold(0.0, f64::max) / if places.len() == 6 { 2.0 } else { 1.0 };
    Some(Entry { depth, width, place })
}

/// The values of the functions of a face with so many nodes at places between these.
fn between(nodes: usize) -> Vec<Vec<f64>> {
    let half = |n: usize, k: usize| (0..n).map(|i| if i == k || i == (k + 1) % n { 0.5 } else { 0.0 }).collect();
    if nodes != 6 {
        return [vec![1.0 / nodes as f64; nodes]].into_iter().chain((0..nodes).map(|k| half(nodes, k))).collect();
    }
    let around = |at: [f64; 3]| (0..3).map(move |k| [0, 1, 2].map(|a| at[(a + k) % 3]));
    let middles = around([2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0]).chain([[1.0 / 3.0; 3]]);
    let of_edges = around([0.75, 0.25, 0.0]).chain(around([0.25, 0.75, 0.0]));
    let values = |at| functions(&[0, 1, 2, 3, 4, 5], at).into_iter().map(|(_, value)| value).collect();
    middles.chain(of_edges).map(values).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Obstacle = Obstacle::Sphere { centre: [0.3, 0.3, 2.0], radius: 2.0, inside: false };

    /// A flat quadratic face with straight edges.
    fn quadratic([a, b, c]: [[f64; 3]; 3]) -> [[f64; 3]; 6] {
        let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
        [a, b, c, middle(a, b), middle(b, c), middle(c, a)]
    }

    /// The ball touches the face at a place between its nodes, and these are pushed towards it, or bent to its shape.
    #[test]
    fn a_ball_between_nodes_is_as_deep_as_they_are_pushed() {
        let square = [[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.6, 0.6, 0.0], [0.0, 0.6, 0.0]];
        let triangle = [square[0], [0.9, 0.0, 0.0], [0.0, 0.9, 0.0]];
        let quadratic = quadratic(triangle);
        for (face, width) in
            [(&square[..], 0.6), (&triangle, 0.9 * 2.0_f64.sqrt()), (&quadratic, 0.45 * 2.0_f64.sqrt())]
        {
            let pushed = |by: f64| deepest(&BALL, face, &vec![[0.0, 0.0, by]; face.len()], 0.0);
            assert_eq!(pushed(-1e-3), None);
            let found = pushed(0.01).expect("the ball is inside");
            assert!((found.depth - 0.01).abs() < 1e-12 && (found.width - width).abs() < 1e-12, "{found:?}");
            assert!(length(difference(found.place, [0.3, 0.3, 0.0])) < 1e-12, "{found:?}");
            assert_eq!(deepest(&BALL, face, &vec![[0.0, 0.0, 0.01]; face.len()], 0.02), None);
            // From behind nothing is in the way.
            let behind: Vec<_> = face.iter().rev().copied().collect();
            assert!(face.len() == 6 || deepest(&BALL, &behind, &vec![[0.0, 0.0, 0.01]; face.len()], 0.0).is_none());
        }
    }

    #[test]
    fn quadratic_faces_bend_around_a_ball() {
        let face = quadratic([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0]]);
        let onto = |[x, y, _]: [f64; 3]| [0.0, 0.0, ((x - 0.3_f64).powi(2) + (y - 0.3_f64).powi(2)) / 4.0];
        // Nodes are on a paraboloid, nearly on the ball.
        let moved = face.map(onto);
        let linear = deepest(&BALL, &face[..3], &moved[..3], 0.0).expect("the ball is inside");
        assert!((linear.depth - 0.18 / 4.0).abs() < 1e-3, "{linear:?}");
        assert!(deepest(&BALL, &face, &moved, 0.0).is_none_or(|entry| entry.depth < 1e-3));
    }
}
