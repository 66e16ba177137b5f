//! Planes, spheres, cones, cylinders and tori that faces of a body are on.
//!
//! A mesh of a round body knows places on its surface, but not what is between them. Where all nodes of a part of the surface are
//! on such a form, that is what was meant: `find` looks for these parts, `fit` for the form through given nodes, [`forms`]
//! brings what was found to the ranks. A new node on an edge belongs where the forms of both faces meet:
//!
//! ```text
//! x <- x - J'(J J')^-1 d(x),   d: signed distances from the forms, J: their gradients.
//! ```
//!
//! Free forms are not looked for. No mesh is changed here.

mod find;
mod fit;
pub mod forms;
#[cfg(test)]
mod tests;

pub use forms::Forms;

use crate::vector::{Point, difference, dot, length};

/// A surface with a closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Through a point, across a unit normal.
    Plane {
        /// A point on it.
        point: Point,
        /// Unit normal.
        normal: Point,
    },
    /// All that is so far from a centre.
    Sphere {
        /// Its centre.
        centre: Point,
        /// Its radius.
        radius: f64,
    },
    /// A line turned about an axis: a cone, or a cylinder.
    Cone {
        /// A point of the axis.
        point: Point,
        /// Unit vector along the axis.
        axis: Point,
        /// Distance from the axis at the point.
        radius: f64,
        /// Angle between line and axis (radians): 0 for a cylinder, positive if it gets wider along the axis.
        opening: f64,
    },
    /// A circle turned about an axis in its plane.
    Torus {
        /// Its centre.
        centre: Point,
        /// Unit vector along the axis.
        axis: Point,
        /// Radius of the circle of centres, and of the circle that is turned.
        radii: [f64; 2],
    },
}

/// Forms whose normals enclose a smaller angle (its squared sine) touch along a curve rather than cross there.
const TOUCH: f64 = 1e-4;
/// Steps of Newton's method at most.
const STEPS: usize = 30;
/// A step is as good as none, relative to the coordinates.
const NOTHING: f64 = 1e-14;

impl Form {
    /// Whether it is no plane.
    pub fn is_curved(&self) -> bool {
        !matches!(self, Self::Plane { .. })
    }

    /// Signed distance of a place, and its gradient.
    pub fn distance(&self, x: Point) -> (f64, Point) {
        match *self {
            Self::Plane { point, normal } => (dot(difference(x, point), normal), normal),
            Self::Sphere { centre, radius } => {
                let outwards = difference(x, centre);
                let distance = length(outwards);
                (distance - radius, outwards.map(|c| c / distance))
            }
            Self::Cone { point, axis, radius, opening } => {
                let (along, from_axis, outwards) = about(x, point, axis);
                let (sin, cos) = opening.sin_cos();
                let normal = std::array::from_fn(|a| cos * outwards[a] - sin * axis[a]);
                (cos * (from_axis - radius) - sin * along, normal)
            }
            Self::Torus { centre, axis, radii: [outer, inner] } => {
                let (along, from_axis, outwards) = about(x, centre, axis);
                let distance = length([from_axis - outer, along]);
                let [p, q] = [from_axis - outer, along].map(|part| part / distance);
                (distance - inner, std::array::from_fn(|a| p * outwards[a] + q * axis[a]))
            }
        }
    }
}

/// How far a place is along an axis and from it, and the unit vector from the axis to the place.
fn about(x: Point, point: Point, axis: Point) -> (f64, f64, Point) {
    let from = difference(x, point);
    let along = dot(from, axis);
    let across: Point = std::array::from_fn(|a| from[a] - along * axis[a]);
    let distance = length(across);
    (along, distance, across.map(|c| c / distance))
}

/// The place on both forms, which may be the same one, within a distance of a place near them; none if it is not found there.
pub fn project(forms: [&Form; 2], place: Point, within: f64) -> Option<Point> {
    let mut x = place;
    for _ in 0..STEPS {
        let [(d, g), (e, h)] = forms.map(|form| form.distance(x));
        let cosine = dot(g, h);
        let determinant = 1.0 - cosine * cosine;
        let [along_g, along_h] = if determinant < TOUCH {
            [0.5 * d, 0.5 * e]
        } else {
            [(d - cosine * e) / determinant, (e - cosine * d) / determinant]
        };
        let step: Point = std::array::from_fn(|a| along_g * g[a] + along_h * h[a]);
        x = difference(x, step);
        if length(step) <= NOTHING * length(x) {
            return (length(difference(x, place)) <= within).then_some(x);
        }
    }
    None
}
