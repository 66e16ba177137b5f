//! Intersection of triangles in the plane.

/// A point of the plane.
pub type Point = [f64; 2];

/// Twice the signed area of a triangle: positive if its corners turn counter-clockwise.
pub fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Corners of the intersection of two triangles, all counter-clockwise; fewer than three if there is none. Clips by one
/// edge after the other (Sutherland and Hodgman 1974).
pub fn intersection(one: &[Point; 3], other: &[Point; 3]) -> Vec<Point> {
    let mut polygon = one.to_vec();
    for k in 0..3 {
        let (a, b) = (other[k], other[(k + 1) % 3]);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (here, there) = (turn(a, b, p), turn(a, b, q));
            if here >= 0.0 {
                kept.push(p);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                let t = here / (here - there);
                kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        polygon = kept;
    }
    polygon
}

/// Linear functions of a triangle's corners at a point: they add up to one.
pub fn barycentric(triangle: &[Point; 3], p: Point) -> [f64; 3] {
    let [a, b, c] = *triangle;
    let parts = [turn(p, b, c), turn(a, p, c), turn(a, b, p)];
    let whole = turn(a, b, c);
    parts.map(|part| part / whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn area(polygon: &[Point]) -> f64 {
        (2..polygon.len()).map(|k| 0.5 * turn(polygon[0], polygon[k - 1], polygon[k])).sum()
    }

    #[test]
    fn triangles_that_share_all_part_or_nothing() {
        let t = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
        assert_eq!(area(&intersection(&t, &t)), 2.0);
        let shifted = t.map(|[x, y]| [x + 1.0, y]);
        assert_eq!(area(&intersection(&t, &shifted)), 0.5);
        let turned = [[1.5, 1.5], [-0.5, 1.5], [1.5, -0.5]];
        // A hexagon: the square of edge 1.5 less two opposite corners.
        assert_eq!(area(&intersection(&t, &turned)), 2.25 - 0.5 - 0.5);
        let beside = t.map(|[x, y]| [x + 2.0, y]);
        assert_eq!(area(&intersection(&t, &beside)), 0.0);
        assert!(intersection(&t, &t.map(|[x, y]| [x + 3.0, y])).is_empty());
    }

    /// The area of the intersection is the share of random points that both contain.
    #[test]
    fn areas_agree_with_counted_points_and_corners_lie_in_both() {
        let mut random = Random::new(5);
        let mut triangle = || {
            let [a, b, c]: [Point; 3] = std::array::from_fn(|_| std::array::from_fn(|_| random.number()));
            if turn(a, b, c) > 0.0 { [a, b, c] } else { [a, c, b] }
        };
        let pairs: Vec<_> = (0..20).map(|_| (triangle(), triangle())).collect();
        for (one, other) in &pairs {
            let polygon = intersection(one, other);
            let within = |p: Point, slack: f64| {
                [one, other].iter().all(|t| barycentric(t, p).iter().all(|weight| *weight >= -slack))
            };
            assert!(polygon.iter().all(|&p| within(p, 1e-9)));
            let n = 400;
            let grid = (0..n * n).map(|k| [k % n, k / n].map(|i| -1.0 + (2 * i + 1) as f64 / n as f64));
            let counted = grid.filter(|&p| within(p, 0.0)).count() as f64 * 4.0 / (n * n) as f64;
            assert!((area(&polygon) - counted).abs() < 0.01, "{} {counted}", area(&polygon));
        }
    }
}
