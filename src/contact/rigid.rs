//! Rigid obstacles by gap functions, linearised at the undeformed position of each slave node.
//!
//! An obstacle is where its gap function `g(x)` is negative. With `n = -grad g / |grad g|` the condition on a node at `x` is
//! `n . u <= g(x) / |grad g|`: the node stays on its side of a plane that touches the obstacle. For plane, sphere and
//! cylinder `g` is the signed distance and that plane touches at the nearest point; for a height field `g = z - h(x, y)`, so
//! it touches at the foot of the vertical (to first order in the distance the same).
//!
//! A node whose surface looks away from the obstacle (`n` against its outward normal) cannot touch it from its own side and
//! carries no condition, nor does a node beside a height field. Where the surface has an edge, both sides of it may face the
//! obstacle: a node there has one condition, on the area of both.

use std::collections::BTreeSet;

use super::surface::{GatheredSurface, Layer, unit};
use super::{Conditions, ContactError, ContactPair, quadratic};
use crate::comm::{Comm, sums};
use crate::scene::Obstacle;
use crate::vector::{difference, dot};

/// Cosine between the direction to the obstacle and the outward normal from which a surface faces the obstacle.
pub(super) const FACING: f64 = 1e-6;

/// Share of the radius within which a point is at the centre: every direction leads out.
const CENTRE: f64 = 1e-9;

/// Share of a cell of a height field that a point may be beside the field.
const BESIDE: f64 = 1e-9;

/// Conditions of contact number `contact`. Collective.
///
/// # Errors
/// If no node faces the obstacle.
pub fn pair(
    comm: &dyn Comm,
    contact: usize,
    name: &str,
    surface: &GatheredSurface,
    obstacle: &Obstacle,
) -> Result<Conditions, ContactError> {
    let nodes = surface.nodes.iter().zip(&surface.points).zip(surface.normals_and_areas_with(share(obstacle)));
    let own = nodes.zip(&surface.parts).enumerate().filter(|(index, _)| surface.layer(*index) == Layer::Own);
    let pairs = own.filter_map(|(_, (((&slave, &point), (outward, area)), &part))| {
        let (normal, gap) = approach(obstacle, point, outward)?;
        let (slaves, masters, vectors) = (vec![(slave, 1.0)], Vec::new(), Vec::new());
        let (limit_area, covered) = (area, true);
        let pair =
            ContactPair { contact, slave, part, slaves, masters, vectors, normal, gap, area, limit_area, covered };
        (dot(normal, outward) > FACING).then_some(pair)
    });
    let mut pairs = quadratic::conditions(surface, share(obstacle), pairs.collect());
    // What is left of several parts of a node is one condition if it says the same.
    pairs.dedup_by(|next, first| {
        let same = (next.slave, next.normal) == (first.slave, first.normal)
            && (&next.slaves, &next.vectors) == (&first.slaves, &first.vectors);
        if same {
            (first.area, first.limit_area) = (first.area + next.area, first.limit_area + next.limit_area);
        }
        same
    });
    let tells = |pair: &&ContactPair| surface.index(pair.slave, pair.part).is_some_and(|index| surface.tells(index));
    let told = (0..surface.nodes.len()).filter(|&index| surface.tells(index)).map(|index| surface.nodes[index]);
    let slaves = told.collect::<BTreeSet<u64>>().len();
    let [count, slaves] = sums(comm, [pairs.iter().filter(tells).count() as u64, slaves as u64]).map(|n| n as usize);
    if count == 0 {
        return Err(ContactError::LooksAway { name: name.to_owned(), slaves });
    }
    Ok(Conditions { pairs, count, ..Conditions::default() })
}

/// What corners of quadratic faces get of the functions of middles.
pub fn share(obstacle: &Obstacle) -> f64 {
    if matches!(obstacle, Obstacle::Plane { .. }) { quadratic::SHARE } else { quadratic::SHARE_WHERE_BENT }
}

/// The unit direction from a point straight into the obstacle, and the distance (negative inside). Where all directions
/// are alike it is the surface's outward normal.
pub(super) fn approach(obstacle: &Obstacle, x: [f64; 3], outward: [f64; 3]) -> Option<([f64; 3], f64)> {
    match obstacle {
        Obstacle::Plane { point, normal } => {
            let free = unit(*normal)?;
            Some((free.map(|n| -n), dot(difference(x, *point), free)))
        }
        Obstacle::Sphere { centre, radius, inside } => round(difference(x, *centre), *radius, *inside, outward),
        Obstacle::Cylinder { point, axis, radius, inside } => {
            let axis = unit(*axis)?;
            let across = |v: [f64; 3]| {
                let along = dot(v, axis);
                std::array::from_fn(|a| v[a] - along * axis[a])
            };
            round(across(difference(x, *point)), *radius, *inside, across(outward))
        }
        Obstacle::Heightfield { origin, spacing, heights, above } => {
            let (height, slopes) = bilinear([0, 1].map(|a| (x[a] - origin[a]) / spacing[a]), heights)?;
            let [dx, dy] = [0, 1].map(|a| slopes[a] / spacing[a]);
            let sign = if *above { -1.0 } else { 1.0 };
            let steep = (1.0 + dx * dx + dy * dy).sqrt();
            Some(([dx, dy, -1.0].map(|c| sign * c / steep), sign * (x[2] - height) / steep))
        }
    }
}

/// Around a centre or an axis, from which `arm` leads to the point.
fn round(arm: [f64; 3], radius: f64, inside: bool, outward: [f64; 3]) -> Option<([f64; 3], f64)> {
    let distance = dot(arm, arm).sqrt();
    let sign = if inside { 1.0 } else { -1.0 };
    let normal = if distance > CENTRE * radius { arm.map(|a| sign * a / distance) } else { unit(outward)? };
    Some((normal, sign * (radius - distance)))
}

/// Height and its derivatives at a point, in cells from the first height; `None` beside the field.
fn bilinear(at: [f64; 2], heights: &[Vec<f64>]) -> Option<(f64, [f64; 2])> {
    let cells = [heights.len() - 1, heights[0].len() - 1];
    if (0..2).any(|a| at[a] < -BESIDE || at[a] > cells[a] as f64 + BESIDE) {
        return None;
    }
    let [i, j] = [0, 1].map(|a| (at[a].max(0.0) as usize).min(cells[a] - 1));
    let [s, t] = [at[0] - i as f64, at[1] - j as f64];
    let [low, high] = [&heights[i], &heights[i + 1]];
    let along = [high[j] - low[j], high[j + 1] - low[j + 1]];
    let [first, last] = [low[j] + s * along[0], low[j + 1] + s * along[1]];
    Some((first + t * (last - first), [along[0] + t * (along[1] - along[0]), last - first]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::random::Random;

    const UP: [f64; 3] = [0.0, 0.0, 1.0];

    /// Height fields that are linear in x and y, and not.
    fn field(bend: f64, above: bool) -> Obstacle {
        let height = |i: usize, j: usize| 0.3 * i as f64 - 0.2 * j as f64 + bend * (i * j) as f64;
        let heights = (0..4).map(|i| (0..3).map(|j| height(i, j)).collect()).collect();
        Obstacle::Heightfield { origin: [-5.0, -5.0], spacing: [4.0, 5.0], heights, above }
    }

    fn round_ones(inside: bool) -> [Obstacle; 2] {
        let (centre, radius) = ([0.2, -0.1, 0.4], 0.8);
        let axis = [1.0, 2.0, -0.5];
        [Obstacle::Sphere { centre, radius, inside }, Obstacle::Cylinder { point: centre, axis, radius, inside }]
    }

    fn points(count: usize) -> impl Iterator<Item = [f64; 3]> {
        let mut random = Random::new(1);
        (0..count).map(move |_| [random.number(), random.number(), random.number()])
    }

    /// The gap as a function of the place.
    fn gap(obstacle: &Obstacle, x: [f64; 3]) -> f64 {
        approach(obstacle, x, UP).expect("the point is not beside").1
    }

    #[test]
    fn distances_to_exact_obstacles_vanish_on_them_and_have_the_normal_as_slope() {
        let plane = Obstacle::Plane { point: [0.1, 0.2, 0.3], normal: [3e200, 0.0, 4e200] };
        let [sphere, cylinder] = round_ones(false);
        let [cavity, bore] = round_ones(true);
        for obstacle in [plane, sphere, cylinder, cavity, bore, field(0.0, false), field(0.0, true)] {
            for x in points(50) {
                let (normal, distance) = approach(&obstacle, x, UP).expect("the point is not beside");
                assert!((dot(normal, normal) - 1.0).abs() < 1e-14);
                // A step of that length along the normal ends on the obstacle.
                let there = std::array::from_fn(|a| x[a] + distance * normal[a]);
                assert!(gap(&obstacle, there).abs() < 1e-13, "{obstacle:?} {x:?}");
                for axis in 0..3 {
                    let step = |h: f64| gap(&obstacle, std::array::from_fn(|a| x[a] + if a == axis { h } else { 0.0 }));
                    let slope = (step(1e-5) - step(-1e-5)) / 2e-5;
                    assert!((slope + normal[axis]).abs() < 1e-7, "{obstacle:?} {x:?}: {slope} {normal:?}");
                }
            }
        }
    }

    #[test]
    fn known_distances() {
        let plane = Obstacle::Plane { point: [0.0, 0.0, 1.0], normal: [0.0, 0.0, -5.0] };
        assert_eq!(approach(&plane, [7.0, 8.0, 0.25], UP), Some((UP, 0.75)));
        let sphere = |inside| Obstacle::Sphere { centre: [0.0, 0.0, 2.0], radius: 0.5, inside };
        assert_eq!(approach(&sphere(false), [0.0, 0.0, 1.0], UP), Some((UP, 0.5)));
        assert_eq!(approach(&sphere(true), [0.0, 0.0, 2.25], UP), Some((UP, 0.25)));
        assert_eq!(approach(&sphere(false), [0.0, 0.0, 2.0], UP), Some((UP, -0.5)), "at the centre");
        let bore = Obstacle::Cylinder { point: [1.0, 0.0, 0.0], axis: [0.0, 3.0, 0.0], radius: 2.0, inside: true };
        assert_eq!(approach(&bore, [0.0, 9.0, 0.0], UP), Some(([-1.0, 0.0, 0.0], 1.0)));
        assert_eq!(approach(&bore, [1.0, 9.0, 0.0], [0.0, 1.0, 0.0]), None, "on the axis, looking along it");
    }

    #[test]
    fn a_height_field_is_bilinear_and_ends() {
        let field = field(0.5, false);
        // h = 0.3 i - 0.2 j + 0.5 i j at i = 2.5, j = 0.5.
        let at = |i: f64, j: f64, z: f64| approach(&field, [4.0 * i - 5.0, 5.0 * j - 5.0, z], [0.0, 0.0, -1.0]);
        let (normal, gap) = at(2.5, 0.5, 2.0).expect("on the field");
        let slopes: [f64; 2] = [(0.3 + 0.5 * 0.5) / 4.0, (-0.2 + 0.5 * 2.5) / 5.0];
        let steep = (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]).sqrt();
        assert!((gap - (2.0 - (0.75 - 0.1 + 0.625)) / steep).abs() < 1e-14);
        for (found, expected) in normal.into_iter().zip([slopes[0], slopes[1], -1.0]) {
            assert!((found - expected / steep).abs() < 1e-14);
        }
        assert!(at(3.0, 2.0, 0.0).is_some() && at(0.0, 0.0, 0.0).is_some());
        assert!(at(3.1, 1.0, 0.0).is_none() && at(1.0, -0.1, 0.0).is_none());
    }

    #[test]
    fn only_nodes_that_face_the_obstacle_are_paired() {
        // A roof: one slope looks to +x, one to -x.
        let points = [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 0.0]];
        let roof = GatheredSurface::new(&[vec![4, 5, 6], vec![7, 6, 5]], &(4..).zip(points).collect());
        let wall = |x: f64, normal: f64| Obstacle::Plane { point: [x, 0.0, 0.0], normal: [normal, 0.0, 0.0] };
        let right = pair(&Solo, 2, "wall", &roof, &wall(3.0, -1.0)).expect("one slope faces it").pairs;
        let found = right.iter().map(|p| (p.contact, p.slave, p.gap)).collect::<Vec<_>>();
        assert_eq!(found, [(2, 5, 3.0), (2, 6, 3.0), (2, 7, 2.0)]);
        assert!(right.iter().all(|p| (p.area - 2.0_f64.sqrt() / 6.0).abs() < 1e-15), "{right:?}");
        // From above both slopes face it: nodes of the ridge have one condition, on both.
        let lid = Obstacle::Plane { point: [0.0, 0.0, 3.0], normal: [0.0, 0.0, -1.0] };
        let above = pair(&Solo, 2, "lid", &roof, &lid).expect("both slopes face it").pairs;
        let found = above.iter().map(|p| (p.slave, p.gap)).collect::<Vec<_>>();
        assert_eq!(found, [(4, 3.0), (5, 2.0), (6, 2.0), (7, 3.0)]);
        assert!((above[1].area - 2.0_f64.sqrt() / 3.0).abs() < 1e-15, "{above:?}");
        let floor = Obstacle::Plane { point: [0.0; 3], normal: UP };
        let error = pair(&Solo, 2, "floor", &roof, &floor).unwrap_err();
        assert_eq!(error, ContactError::LooksAway { name: "floor".into(), slaves: 4 });
    }

    /// Two quadratic faces that meet at a ridge: all nodes of both have conditions, those of the ridge one each.
    #[test]
    fn quadratic_faces_on_both_sides_of_an_edge_are_paired() {
        let points = [
            [-1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [1.0, 0.0, 0.0],
            [-0.5, 0.0, 0.5],
            [0.0, 0.5, 1.0],
            [-0.5, 0.5, 0.5],
            [0.5, 0.5, 0.5],
            [0.5, 0.0, 0.5],
        ];
        let faces = [vec![0, 1, 2, 4, 5, 6], vec![3, 2, 1, 7, 5, 8]];
        let roof = GatheredSurface::new(&faces, &(0..).zip(points).collect());
        assert_eq!(roof.nodes.len(), 12, "three nodes of the ridge have two parts");
        let lid = Obstacle::Plane { point: [0.0, 0.0, 3.0], normal: [0.0, 0.0, -1.0] };
        let pairs = pair(&Solo, 0, "lid", &roof, &lid).expect("both slopes face it").pairs;
        assert_eq!(pairs.iter().map(|p| p.slave).collect::<Vec<_>>(), (0..9).collect::<Vec<_>>());
        let area: f64 = pairs.iter().map(|p| p.area).sum();
        assert!((area - 2.0_f64.sqrt()).abs() < 1e-14, "{area}");
        assert!(pairs.iter().all(|p| (p.gap - (3.0 - points[p.slave as usize][2])).abs() < 1e-14), "{pairs:?}");
    }
}
