//! How near points, segments and triangles in space are to each other (Ericson, "Real-Time Collision Detection", 2005,
//! chapter 5). Squares of distances, so that nothing is rooted in vain.

use super::surface::{area, area_vector};
use crate::vector::{Point, difference, dot};

/// Square of the distance of two points.
pub fn of_points(a: Point, b: Point) -> f64 {
    let way = difference(a, b);
    dot(way, way)
}

/// Six times the volume of a tetrahedron; positive if `abc` turns counter-clockwise seen from `d`.
pub fn volume(a: Point, b: Point, c: Point, d: Point) -> f64 {
    2.0 * dot(area_vector(&[a, b, c]), difference(d, a))
}

/// Square of the distance of a point from a triangle.
pub fn to_triangle(p: Point, &[a, b, c]: &[Point; 3]) -> f64 {
    let normal = area_vector(&[a, b, c]);
    let inside = |from: Point, to: Point| dot(area_vector(&[from, to, p]), normal) >= 0.0;
    let square = dot(normal, normal);
    if square > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return dot(difference(p, a), normal).powi(2) / square;
    }
    [[a, b], [b, c], [c, a]].iter().map(|side| to_segment(p, side)).fold(f64::INFINITY, f64::min)
}

/// Square of the distance of a point from a segment.
fn to_segment(p: Point, &[a, b]: &[Point; 2]) -> f64 {
    let (along, arm) = (difference(b, a), difference(p, a));
    let share = ratio(dot(arm, along), dot(along, along)).clamp(0.0, 1.0);
    of_points(arm, along.map(|x| share * x))
}

/// Square of the distance of two segments.
pub fn of_segments(first: &[Point; 2], second: &[Point; 2]) -> f64 {
    let ends = first.iter().map(|&p| to_segment(p, second)).chain(second.iter().map(|&p| to_segment(p, first)));
    let least = ends.fold(f64::INFINITY, f64::min);
    // Where both lines are nearest to each other, if that is within both.
    let (u, v, w) = (difference(first[1], first[0]), difference(second[1], second[0]), difference(first[0], second[0]));
    let (a, b, c, d, e) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let determinant = a * c - b * b;
    let [s, t] = [b * e - c * d, a * e - b * d].map(|x| ratio(x, determinant));
    if determinant > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        let way: Point = std::array::from_fn(|i| w[i] + s * u[i] - t * v[i]);
        return least.min(dot(way, way));
    }
    least
}

/// Whether a segment goes through the inside of a triangle, with ends farther than `near` from its plane.
pub fn pierces(&[p, q]: &[Point; 2], &[a, b, c]: &[Point; 3], near: f64) -> bool {
    let sides = [[a, b], [b, c], [c, a]].map(|[from, to]| volume(p, q, from, to));
    let through = sides.iter().all(|v| *v > 0.0) || sides.iter().all(|v| *v < 0.0);
    let [low, high] = [p, q].map(|x| volume(a, b, c, x));
    through && low * high < 0.0 && low.abs().min(high.abs()) > 2.0 * near * area(&[a, b, c])
}

fn ratio(x: f64, y: f64) -> f64 {
    if y > 0.0 { x / y } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Least over a fine grid of points of both, which is never less and not much more.
    #[test]
    fn distances_are_the_least_over_all_points() {
        const FINE: usize = 60;
        let on = |[a, b]: [Point; 2], t: f64| -> Point { std::array::from_fn(|i| a[i] + t * (b[i] - a[i])) };
        let shares = || (0..=FINE).map(|k| k as f64 / FINE as f64);
        let mut random = Random::new(5);
        for _ in 0..50 {
            let [a, b, c, p, q]: [Point; 5] = std::array::from_fn(|_| random.vector(1.0));
            let grid = shares().flat_map(|s| shares().map(move |t| (s, t * (1.0 - s))));
            let on_triangle =
                |(s, t): (f64, f64)| std::array::from_fn(|i| a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]));
            let least = grid.map(|at| of_points(on_triangle(at), p)).fold(f64::INFINITY, f64::min).sqrt();
            let found = to_triangle(p, &[a, b, c]).sqrt();
            assert!((-1e-12..3.0 / FINE as f64).contains(&(least - found)), "{found} {least}");
            let pairs = shares().flat_map(|s| shares().map(move |t| (s, t)));
            let least = pairs.map(|(s, t)| of_points(on([a, b], s), on([p, q], t))).fold(f64::INFINITY, f64::min);
            let (least, found) = (least.sqrt(), of_segments(&[a, b], &[p, q]).sqrt());
            assert!((-1e-12..3.0 / FINE as f64).contains(&(least - found)), "{found} {least}");
        }
    }

    #[test]
    fn segments_pierce_where_their_points_reach_the_triangle() {
        let triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let through = |x: f64, y: f64, low: f64, high: f64| {
            let [p, q] = [[x, y, low], [x, y, high]];
            assert_eq!(pierces(&[p, q], &triangle, 0.05), pierces(&[q, p], &triangle, 0.05));
            pierces(&[p, q], &triangle, 0.05)
        };
        assert!(through(0.2, 0.3, -1.0, 0.1) && !through(0.2, 0.3, -1.0, 0.04));
        assert!(!through(0.2, 0.3, 0.1, 1.0) && !through(0.6, 0.6, -1.0, 1.0) && !through(-0.1, 0.2, -1.0, 1.0));
        // Of no length, parallel.
        assert_eq!(of_segments(&[[0.0; 3]; 2], &[[0.0, 2.0, 0.0]; 2]), 4.0);
        assert_eq!(of_segments(&[[0.0; 3], [3.0, 0.0, 0.0]], &[[1.0, 2.0, 0.0], [2.0, 2.0, 0.0]]), 4.0);
        assert_eq!(to_triangle([2.0, 0.0, 0.0], &[[0.0; 3]; 3]), 4.0);
    }
}
