//! Where multipliers of a slave face are that the master surface covers in part only.
//!
//! A pressure ends where the master ends. The multiplier of a corner beyond that edge cannot stay at its node: with functions of
//! the whole face it would push there, where nothing is, and pull further in. So on such a face the linear functions are those of
//! another triangle, within the covered part: from the centre of the part towards each corner as far as it is covered.
//! With the place `x*_l = centre + t_l (x_l - centre)` of corner `l` they are `phi* = T^-T phi` where `T_lk = phi_k(x*_l)`, and
//! the multiplier of `l` pushes at `x*_l`. So every sum of pushes lies within the overlap, and reaches to its edge.
//!
//! Where a master surface has notches or holes, the convex hull of the covered part stands for it, within one slave face.

use super::clip::{Point, turn};

/// Shares of the way to a corner from which the corner is covered.
const WHOLE: f64 = 1.0 - 1e-9;

/// Linear functions of the corners at each of the three places, `T_lk`, of the part of a triangle that spans these points and has
/// this centre; `None` if all corners are covered. All are given by the triangle's linear functions.
pub fn places(covered: &[[f64; 3]], centre: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let hull = hull(covered.iter().map(|p| [p[0], p[1]]).collect());
    let from = [centre[0], centre[1]];
    let way = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]].map(|corner| share_inside(&hull, from, corner));
    if way.iter().all(|way| *way >= WHOLE) {
        return None;
    }
    let corner = |l: usize| std::array::from_fn(|k| f64::from(k == l));
    Some(std::array::from_fn(|l| match corner(l) {
        corner if way[l] >= WHOLE => corner,
        corner => std::array::from_fn(|k| centre[k] + way[l] * (corner[k] - centre[k])),
    }))
}

/// Twice the area, in shares of the triangle's, that a side of the covered part makes with a point on the wrong side of it, from
/// which that counts. Where pieces meet, sides as long as rounding point anywhere.
const ROUNDING: f64 = 1e-12;

/// How much of the way from a point inside to another one is in a convex polygon, whose corners turn counter-clockwise.
fn share_inside(polygon: &[Point], from: Point, to: Point) -> f64 {
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    sides.fold(1.0, |shortest: f64, (&a, &b)| {
        let (here, there) = (turn(a, b, from), turn(a, b, to));
        if there < -ROUNDING { shortest.min(here.max(0.0) / (here.max(0.0) - there)) } else { shortest }
    })
}

/// The convex hull of some points, counter-clockwise (Andrew 1979).
fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut points.iter().copied());
    [lower, half(&mut points.iter().rev().copied())].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn a_hull_has_all_points_inside_and_no_needless_corner() {
        let mut random = Random::new(3);
        for _ in 0..50 {
            let points: Vec<Point> = (0..12).map(|_| [random.number(), random.number()]).collect();
            let found = hull(points.clone());
            let n = found.len();
            for k in 0..n {
                let (a, b, c) = (found[k], found[(k + 1) % n], found[(k + 2) % n]);
                assert!(turn(a, b, c) > 0.0 && points.contains(&a));
                assert!(points.iter().all(|p| turn(a, b, *p) >= -1e-15));
            }
        }
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [1.0, 1.0]];
        assert_eq!(hull(square.to_vec()), square[..4]);
    }

    #[test]
    fn a_triangle_that_is_covered_to_its_corners_is_left_alone() {
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(places(&corners, [1.0 / 3.0; 3]), None);
        assert_eq!(places(&[corners[0], corners[1], corners[2], [0.2, 0.3, 0.5]], [0.3, 0.4, 0.3]), None);
    }

    #[test]
    fn sides_as_long_as_rounding_do_not_count() {
        let near = |x: f64, y: f64| [x, y, 1.0 - x - y];
        let corners = [near(1.0, 0.0), near(0.0, 1.0), near(0.0, 0.0)];
        let doubled = [near(1.0 - 1e-16, 1e-17), near(1e-17, 1.0 - 1e-16), near(1e-17, -1e-17), near(0.5, -1e-17)];
        assert_eq!(places(&[&corners[..], &doubled].concat(), [1.0 / 3.0; 3]), None);
        let mut random = Random::new(2);
        for _ in 0..200 {
            let mut shaken = || corners.map(|corner| corner.map(|x| x + 1e-16 * random.number()));
            let all = [corners, shaken(), shaken(), shaken()].concat();
            assert_eq!(places(&all, [0.2, 0.3, 0.5]), None);
        }
    }

    /// Covered where the third function is at most `reach`: the place of that corner is at the edge, whatever the reach.
    #[test]
    fn places_of_corners_beyond_a_straight_edge_are_on_it() {
        for reach in [0.9, 0.5, 0.1, 1e-3] {
            // A trapezoid, and its centre from that of two triangles.
            let rest = 1.0 - reach;
            let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, rest, reach], [rest, 0.0, reach]];
            let third = (1.0 / 3.0) * reach * (3.0 - 2.0 * reach) / (2.0 - reach);
            let centre = [0.5 * (1.0 - third), 0.5 * (1.0 - third), third];
            let [first, second, beyond] = places(&corners, centre).expect("a corner is not covered");
            assert_eq!((first, second), (corners[0], corners[1]));
            assert!((beyond[2] - reach).abs() < 1e-14 && (beyond[0] - beyond[1]).abs() < 1e-14, "{beyond:?}");
            assert!((beyond.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn all_places_are_in_the_covered_part() {
        let mut random = Random::new(8);
        for _ in 0..100 {
            let part: [[f64; 3]; 3] = std::array::from_fn(|_| {
                let [a, b] = [random.number().abs(), random.number().abs()];
                let scale = 1.0 / (a + b + 0.1);
                [a * scale, b * scale, 0.1 * scale]
            });
            let centre = std::array::from_fn(|k| part.iter().map(|p| p[k]).sum::<f64>() / 3.0);
            let inside = hull(part.iter().map(|p| [p[0], p[1]]).collect());
            for place in places(&part, centre).expect("no corner is covered") {
                let at = [place[0], place[1]];
                assert!(inside.iter().zip(inside.iter().cycle().skip(1)).all(|(a, b)| turn(*a, *b, at) > -1e-12));
            }
        }
    }
}
