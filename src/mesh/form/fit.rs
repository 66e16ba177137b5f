//! The form nearest to given places.
//!
//! ```text
//! plane:   through the mean of the places, across the direction in which they vary least,
//! sphere:  2 c.x + r^2 - c.c = x.x in the sense of least squares,
//! others:  Gauss-Newton on the distances.
//! ```
//!
//! That begins at an axis which the normals of faces tell: across a cylinder's axis they vary least, about a cone's they have one angle,
//! and all normals of what is turned about an axis meet it, `n.(a x (x - c)) = 0` (Pottmann and Wallner, "Computational line
//! geometry", 2001). In the half plane of the axis a line or a circle is fitted then, as above. Places are made relative to their mean
//! and their extent first. Whether they are on the form is for the caller to see.

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, Side};

use super::{Form, about};
use crate::vector::{Point, cross, difference, dot, length};

/// Steps of the Gauss-Newton method at most; on exact places it takes about five.
const STEPS: usize = 12;
/// It ends where a step leaves more than this share of the largest distance, but for the first steps.
const LEFT: f64 = 0.5;
const FIRST: usize = 3;
/// Radii are at most so many times the extent of the places: what is flatter is taken for flat.
const FLATTEST: f64 = 1e3;

/// The plane.
pub fn plane(places: &[Point]) -> Option<Form> {
    let (mean, _) = frame(places)?;
    let normal = least(places.iter().map(|&x| difference(x, mean)))?;
    Some(Form::Plane { point: mean, normal })
}

/// The sphere, from five places or more.
pub fn sphere(places: &[Point]) -> Option<Form> {
    let (mean, extent) = frame(places)?;
    let local = relative(places, mean, extent);
    let matrix = Mat::from_fn(local.len(), 4, |i, j| if j < 3 { 2.0 * local[i][j] } else { 1.0 });
    let centre = solved(&matrix, |i| dot(local[i], local[i]))?;
    let from_mean: Point = [centre[0], centre[1], centre[2]];
    let radius = (centre[3] + dot(from_mean, from_mean)).sqrt();
    scaled(Form::Sphere { centre: from_mean, radius }, mean, extent)
}

/// The cones (or cylinders) through seven places or more with the area vectors of the faces between them, from both axes that these
/// tell.
pub fn cones(places: &[Point], normals: &[Point]) -> Vec<Form> {
    let Some((mean, extent)) = frame(places) else { return Vec::new() };
    let local = relative(places, mean, extent);
    let sum: Point = std::array::from_fn(|a| normals.iter().map(|n| n[a]).sum());
    let area: f64 = normals.iter().map(length).sum();
    let from_mean = |n: &Point| {
        let size = length(n);
        std::array::from_fn(|a| n[a] - sum[a] / area * size)
    };
    let axes = [least(normals.iter().copied()), least(normals.iter().map(from_mean))];
    let through = |axis: Point| {
        let (point, radius) = circle(&local, axis)?;
        let profile = |x: &Point| about(*x, point, axis);
        let matrix = Mat::from_fn(local.len(), 2, |i, j| if j == 0 { 1.0 } else { profile(&local[i]).0 });
        let line = solved(&matrix, |i| profile(&local[i]).1).unwrap_or(vec![radius, 0.0]);
        let form = nearest(&local, Form::Cone { point, axis, radius: line[0], opening: line[1].atan() })?;
        scaled(form, mean, extent)
    };
    axes.into_iter().flatten().filter_map(through).collect()
}

/// The torus through eight places or more with the places and the area vectors of the faces between them.
pub fn torus(places: &[Point], faces: &[[Point; 2]]) -> Option<Form> {
    let (mean, extent) = frame(places)?;
    let local = relative(places, mean, extent);
    let mut gram = Mat::<f64>::zeros(6, 6);
    for [place, normal] in faces {
        let at = difference(*place, mean).map(|c| c / extent);
        let moment = cross(at, *normal);
        let row = [normal[0], normal[1], normal[2], moment[0], moment[1], moment[2]];
        (0..36).for_each(|k| gram[(k / 6, k % 6)] += row[k / 6] * row[k % 6]);
    }
    let eigen = gram.self_adjoint_eigen(Side::Lower).ok()?;
    let [moment, along]: [Point; 2] = [0, 3].map(|first| std::array::from_fn(|a| eigen.U()[(first + a, 0)]));
    let size = dot(along, along);
    let (axis, foot) = (along.map(|x| x / size.sqrt()), cross(along, moment).map(|x| x / size));
    let profile = |x: &Point| about(*x, foot, axis);
    let matrix = Mat::from_fn(local.len(), 3, |i, j| {
        let (along, from_axis, _) = profile(&local[i]);
        [2.0 * from_axis, 2.0 * along, 1.0][j]
    });
    let circle = solved(&matrix, |i| {
        let (along, from_axis, _) = profile(&local[i]);
        along * along + from_axis * from_axis
    })?;
    let inner = (circle[2] + circle[0] * circle[0] + circle[1] * circle[1]).sqrt();
    let centre = std::array::from_fn(|a| foot[a] + circle[1] * axis[a]);
    scaled(nearest(&local, Form::Torus { centre, axis, radii: [circle[0], inner] })?, mean, extent)
}

/// The form of least squares near one of the same kind.
fn nearest(places: &[Point], mut form: Form) -> Option<Form> {
    let mut before = f64::INFINITY;
    for step in 0..STEPS {
        let rows: Vec<(f64, [f64; 7])> = places.iter().map(|&x| linearised(&form, x)).collect();
        let size = rows.iter().fold(0.0_f64, |most, (distance, _)| most.max(distance.abs()));
        if step > FIRST && size >= LEFT * before {
            break;
        }
        before = size;
        let matrix = Mat::from_fn(places.len(), parameters(&form), |i, k| rows[i].1[k]);
        let step = solved(&matrix, |i| -rows[i].0)?;
        form = changed(&form, std::array::from_fn(|k| step.get(k).copied().unwrap_or(0.0)));
    }
    Some(form)
}

/// The distance of a place from a cone or a torus, and its derivatives by what [`changed`] changes.
fn linearised(form: &Form, x: Point) -> (f64, [f64; 7]) {
    let (distance, gradient) = form.distance(x);
    let (point, axis) = match *form {
        Form::Cone { point, axis, .. } => (point, axis),
        Form::Torus { centre, axis, .. } => (centre, axis),
        Form::Plane { .. } | Form::Sphere { .. } => return (distance, [0.0; 7]),
    };
    let (along, from_axis, outwards) = about(x, point, axis);
    // By the distance from the axis, by that along it, and by the last number.
    let (by_distance, by_height) = (dot(gradient, outwards), dot(gradient, axis));
    let by_last = match *form {
        Form::Cone { radius, .. } => by_height * (from_axis - radius) - by_distance * along,
        _ => -1.0,
    };
    let [one, other] = across(axis);
    let turn = |direction| dot(difference(x, point), direction) * (by_height - by_distance * along / from_axis);
    let shift = |direction| -dot(gradient, direction);
    (distance, [shift(one), shift(other), turn(one), turn(other), -by_distance, by_last, -by_height])
}

/// Numbers that tell a cone or a torus.
fn parameters(form: &Form) -> usize {
    if matches!(form, Form::Torus { .. }) { 7 } else { 6 }
}

/// A cone or a torus with its axis moved and turned across, other radii (or the opening), and, of a torus, moved along.
fn changed(form: &Form, by: [f64; 7]) -> Form {
    let moved = |axis: Point, from: Point, by: &[f64]| -> Point {
        let [one, other] = across(axis);
        std::array::from_fn(|a| from[a] + by[0] * one[a] + by[1] * other[a])
    };
    let unit = |x: Point| x.map(|c| c / length(x));
    match *form {
        Form::Cone { point, axis, radius, opening } => Form::Cone {
            point: moved(axis, point, &by[..2]),
            axis: unit(moved(axis, axis, &by[2..4])),
            radius: radius + by[4],
            opening: opening + by[5],
        },
        Form::Torus { centre, axis, radii } => Form::Torus {
            centre: std::array::from_fn(|a| moved(axis, centre, &by[..2])[a] + by[6] * axis[a]),
            axis: unit(moved(axis, axis, &by[2..4])),
            radii: [radii[0] + by[4], radii[1] + by[5]],
        },
        other => other,
    }
}

/// A form of places that were made relative, if it is not as good as flat.
fn scaled(form: Form, mean: Point, extent: f64) -> Option<Form> {
    let place = |x: Point| std::array::from_fn(|a| mean[a] + extent * x[a]);
    let is_round = |radius: f64| radius > 0.0 && radius < FLATTEST;
    match form {
        Form::Sphere { centre, radius } => {
            is_round(radius).then(|| Form::Sphere { centre: place(centre), radius: extent * radius })
        }
        Form::Cone { point, axis, radius, opening } => {
            is_round(radius).then(|| Form::Cone { point: place(point), axis, radius: extent * radius, opening })
        }
        Form::Torus { centre, axis, radii } => {
            let is_torus = radii.into_iter().all(is_round);
            is_torus.then(|| Form::Torus { centre: place(centre), axis, radii: radii.map(|radius| extent * radius) })
        }
        Form::Plane { .. } => None,
    }
}

/// The circle about an axis, and its centre.
fn circle(places: &[Point], axis: Point) -> Option<(Point, f64)> {
    let plane = across(axis);
    let flat = |x: &Point| plane.map(|direction| dot(direction, *x));
    let matrix = Mat::from_fn(places.len(), 3, |i, j| if j < 2 { 2.0 * flat(&places[i])[j] } else { 1.0 });
    let found = solved(&matrix, |i| dot(flat(&places[i]), flat(&places[i])))?;
    let centre: Point = std::array::from_fn(|a| found[0] * plane[0][a] + found[1] * plane[1][a]);
    Some((centre, (found[2] + dot(centre, centre)).sqrt()))
}

/// Two unit vectors across a unit vector and each other.
pub fn across(axis: Point) -> [Point; 2] {
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs())).expect("there are three");
    let one = cross(axis, std::array::from_fn(|a| if a == least { 1.0 } else { 0.0 }));
    let one = one.map(|x| x / length(one));
    [one, cross(axis, one)]
}

/// Mean of the places and how far they are from it.
fn frame(places: &[Point]) -> Option<(Point, f64)> {
    let mean: Point = std::array::from_fn(|a| places.iter().map(|x| x[a]).sum::<f64>() / places.len() as f64);
    let extent = places.iter().map(|&x| length(difference(x, mean))).fold(0.0, f64::max);
    (extent > 0.0).then_some((mean, extent))
}

fn relative(places: &[Point], mean: Point, extent: f64) -> Vec<Point> {
    places.iter().map(|&x| difference(x, mean).map(|c| c / extent)).collect()
}

/// The direction along which vectors have the least squares.
fn least(vectors: impl Iterator<Item = Point>) -> Option<Point> {
    let mut gram = Mat::<f64>::zeros(3, 3);
    for vector in vectors {
        (0..9).for_each(|k| gram[(k / 3, k % 3)] += vector[k / 3] * vector[k % 3]);
    }
    let eigen = gram.self_adjoint_eigen(Side::Lower).ok()?;
    Some(std::array::from_fn(|a| eigen.U()[(a, 0)]))
}

/// The least squares solution, if there is one.
fn solved(matrix: &Mat<f64>, right: impl Fn(usize) -> f64) -> Option<Vec<f64>> {
    if matrix.nrows() < matrix.ncols() {
        return None;
    }
    let solution = matrix.col_piv_qr().solve_lstsq(Mat::from_fn(matrix.nrows(), 1, |i, _| right(i)));
    let solution: Vec<f64> = (0..matrix.ncols()).map(|j| solution[(j, 0)]).collect();
    solution.iter().all(|x| x.is_finite()).then_some(solution)
}
