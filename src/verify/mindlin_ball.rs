//! A ball pressed on an equal half space with friction and pushed along it: [`crate::analytic::mindlin::Ball`].
//!
//! Both are blocks, half of them by symmetry, and the ball's shape is a gap between them, as in the closed form. Equal materials do not
//! move each other's surfaces along. Their size makes them come a few per cent less near along the normal, which is no part of this, and
//! little along the push. Stresses across the push, which the closed form leaves out, make a percent of the radius.

use super::mindlin::{BOTH, FRICTION, RADIUS, STEEL, mirrored, planes};
use super::run::Run;
use super::{Case, Demand, Error, material_line};
use crate::analytic::hertz::Hertz;
use crate::analytic::mindlin;
use crate::element::Kind;

/// Makes a circle of contact of radius 0.7, and friction of about half of what would make all of it slip.
const APPROACH: f64 = 0.0095;
const PUSHED: f64 = 0.00127;
/// Width of cells where it touches; half of it at level 2, a third at level 3.
const CELL: f64 = 0.4;

/// The ball on its block.
pub struct Ball;

impl Case for Ball {
    fn title(&self) -> [&'static str; 2] {
        ["friction-ball", "a ball on an equal half space that sticks in the middle (Cattaneo and Mindlin)"]
    }

    fn scene(&self) -> String {
        let (aside, up) = (planes(3, CELL, 3.0), planes(2, CELL, 3.0));
        let (x, z) = ([mirrored(&aside), aside.clone()].concat(), [mirrored(&up), vec![0.0]].concat());
        let steel = material_line("steel", &STEEL);
        format!(
            r#"
            step = [{{ support.push = 0.0, friction.roll = 0.0 }}, {{}}]
            {steel}
            decomposition.subdomains = 12
            contact.roll = {{ slave = "block.zmax", master = "ball.zmin", friction = {FRICTION:?} }}
            [support]
            base = {{ surface = "block.zmin", fix = ["x", "y", "z"] }}
            press = {{ surface = "ball.zmax", fix = ["z"], displacement = [0.0, 0.0, -{APPROACH:?}] }}
            push = {{ surface = "ball.zmax", fix = ["x", "y"], displacement = [{PUSHED:?}, 0.0, 0.0] }}
            side = {{ surface = "block.ymin", fix = ["y"] }}
            other = {{ surface = "ball.ymin", fix = ["y"] }}
            [body.block]
            material = "steel"
            element = "tet4"
            grid = {{ x = {x:?}, y = {aside:?}, z = {z:?} }}
            [body.ball]
            material = "steel"
            element = "tet4"
            grid = {{ x = {x:?}, y = {aside:?}, z = {up:?} }}"#
        )
    }

    fn gap(&self) -> Option<fn([f64; 3]) -> f64> {
        Some(|[x, y, _]| (x * x + y * y) / (2.0 * RADIUS))
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        // Quadratic ones have about eight times as many nodes.
        if element.degree() == 1 { vec![1, 2, 3] } else { Vec::new() }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let [x, _, z] = run.summary().state.contact_force.unwrap_or_default();
        let forces = [z, x].map(|force| 2.0 * force.abs());
        let hertz = Hertz::new(&BOTH, RADIUS, forces[0]);
        let exact = mindlin::Ball::new(&BOTH, hertz.radius, FRICTION, forces);
        let touches = run.contacts();
        let sum = |of: &dyn Fn([f64; 3], f64, f64) -> f64| -> f64 {
            touches.iter().map(|t| t.area * of(t.place, t.pressure, t.friction[0].abs())).sum()
        };
        let (pressed, pushed) = (sum(&|_, p, _| p), sum(&|_, _, q| q));
        let middle = sum(&|[x, ..], p, _| p * x) / pressed;
        let square = |[x, y, _]: [f64; 3]| (x - middle).powi(2) + y * y;
        // The mean square of the distance under Hertz' pressure is 2/5 a^2.
        let radius = (2.5 * sum(&|x, p, _| p * square(x)) / pressed).sqrt();
        let sticking = mindlin::Ball::sticking_of(radius, sum(&|x, _, q| q * square(x)) / pushed);
        vec![
            Error::new("contact radius", radius / hertz.radius - 1.0, Demand::Finest(0.03)),
            Error::new("sticking radius", sticking / exact.sticking - 1.0, Demand::Finest(0.03)),
            Error::new("way along", PUSHED / exact.moved - 1.0, Demand::Finest(0.03)),
            Error::new("approach", APPROACH / hertz.approach - 1.0, Demand::Shown),
        ]
    }
}
