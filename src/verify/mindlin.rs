//! A cylinder pressed on an equal half space with friction and pushed along it, in plane strain: [`crate::analytic::mindlin`].
//!
//! Both are blocks, and the cylinder's shape is a gap between them, as in the closed form. Equal materials do not move each other's
//! surfaces along. Forces are those that are found, as in the case of Hertz' ball: how far bodies come nearer in plane strain depends on
//! all of the blocks.

use super::run::Run;
use super::{Case, Demand, Error, material_line};
use crate::analytic::mindlin::Line;
use crate::element::Kind;
use crate::material::VonMises;

pub(super) const STEEL: VonMises = VonMises::elastic(210_000.0, 0.3);
/// A half space that gives way as both bodies do together.
pub(super) const BOTH: VonMises = VonMises::elastic(0.5 * STEEL.young, STEEL.poisson);
pub(super) const RADIUS: f64 = 50.0;
pub(super) const FRICTION: f64 = 0.3;
/// Makes half a width of contact of about 0.8, and friction of about half of what would make all of it slip.
const APPROACH: f64 = 0.0215;
const PUSHED: f64 = 0.0065;
/// Width of cells where it touches, a fifth of the half width; half of it at level 2, a third at level 3.
const CELL: f64 = 0.16;
/// Thickness of the slice of the blocks. As thin as the cells it takes 2.5 times the applications of F.
const SLICE: f64 = 1.0;

/// Planes from zero: cells so wide where it touches, and from there on each so many times as wide as the one before.
pub(super) fn planes(fine: usize, cell: f64, growth: f64) -> Vec<f64> {
    let mut planes: Vec<f64> = (0..=fine).map(|k| k as f64 * cell).collect();
    let mut width = cell;
    let mut last = fine as f64 * cell;
    while last < 15.0 {
        width *= growth;
        last += width;
        planes.push(last);
    }
    planes
}

/// The same on the other side of zero.
pub(super) fn mirrored(planes: &[f64]) -> Vec<f64> {
    planes[1..].iter().rev().map(|x| -x).collect()
}

/// The cylinder on its block.
pub struct Cylinder;

impl Case for Cylinder {
    fn title(&self) -> [&'static str; 2] {
        ["friction-cylinder", "a cylinder on an equal half space that sticks in the middle (Cattaneo and Mindlin)"]
    }

    fn scene(&self) -> String {
        let (right, up) = (planes(6, CELL, 1.8), planes(3, CELL, 1.8));
        let (x, z) = ([mirrored(&right), right].concat(), [mirrored(&up), vec![0.0]].concat());
        let steel = material_line("steel", &STEEL);
        format!(
            r#"
            step = [{{ support.push = 0.0, friction.roll = 0.0 }}, {{}}]
            {steel}
            decomposition.subdomains = 16
            contact.roll = {{ slave = "block.zmax", master = "roll.zmin", friction = {FRICTION:?} }}
            [support]
            base = {{ surface = "block.zmin", fix = ["x", "z"] }}
            press = {{ surface = "roll.zmax", fix = ["z"], displacement = [0.0, 0.0, -{APPROACH:?}] }}
            push = {{ surface = "roll.zmax", fix = ["x"], displacement = [{PUSHED:?}, 0.0, 0.0] }}
            front = {{ surface = "block.ymin", fix = ["y"] }}
            back = {{ surface = "block.ymax", fix = ["y"] }}
            before = {{ surface = "roll.ymin", fix = ["y"] }}
            behind = {{ surface = "roll.ymax", fix = ["y"] }}
            [body.block]
            material = "steel"
            element = "tet4"
            grid = {{ x = {x:?}, y = [0.0, {SLICE:?}], z = {z:?} }}
            [body.roll]
            material = "steel"
            element = "tet4"
            grid = {{ x = {x:?}, y = [0.0, {SLICE:?}], z = {up:?} }}"#
        )
    }

    fn gap(&self) -> Option<fn([f64; 3]) -> f64> {
        Some(|[x, ..]| x * x / (2.0 * RADIUS))
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        // Quadratic ones have about eight times as many nodes.
        if element.degree() == 1 { vec![1, 2, 3] } else { Vec::new() }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let [x, _, z] = run.summary().state.contact_force.unwrap_or_default();
        let modulus = BOTH.young / (1.0 - BOTH.poisson * BOTH.poisson);
        let exact = Line::new(modulus, RADIUS, FRICTION, [z, x].map(|force| force.abs() / SLICE));
        let touches = run.contacts();
        // About the middle of what presses.
        let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
            touches.iter().map(|t| t.area * of(t.place[0], t.pressure, t.friction[0].abs())).sum()
        };
        let (pressed, pushed) = (sum(&|_, p, _| p), sum(&|_, _, q| q));
        let middle = sum(&|x, p, _| p * x) / pressed;
        let half = (4.0 * sum(&|x, p, _| p * (x - middle).powi(2)) / pressed).sqrt();
        let square = sum(&|x, _, q| q * (x - middle).powi(2)) / pushed;
        let is_in_the_middle = |x: f64| f64::from(x.abs() < 0.1 * CELL);
        let traction = sum(&|x, _, q| q * is_in_the_middle(x)) / sum(&|x, _, _| is_in_the_middle(x));
        let distance = sum(&|x, _, q| (q - exact.traction(x)).powi(2)) / sum(&|x, _, _| exact.traction(x).powi(2));
        vec![
            Error::new("contact width", half / exact.half - 1.0, Demand::Finest(0.03)),
            Error::new("sticking width", Line::sticking_of(half, square) / exact.sticking - 1.0, Demand::Finest(0.03)),
            Error::new("friction in the middle", traction / exact.traction(0.0) - 1.0, Demand::Finest(0.03)),
            Error::new("friction stress", distance.sqrt(), Demand::Shown),
        ]
    }
}
