//! A cylinder pressed on a block with friction and pushed along it, in plane strain: [`crate::analytic::mindlin`].
//!
//! The cylinder is rigid, and pressed on without friction; then it has some, and is pushed. Friction does not change pressures where
//! bodies keep their volume. Poisson's ratio is 0.45, for linear tetrahedra: what is left of that coupling (Dundurs' constant is 0.09)
//! moves the contact by a hundredth of its width, and lies below a percent elsewhere, by runs with 0.48 and 0.499. Forces are
//! those that are found, as in the case of Hertz' ball: how far bodies come nearer in plane strain depends on all of the block. It is
//! pushed by its base, so that the contact stays where it is.

use super::run::Run;
use super::{Case, Demand, Error, material_line};
use crate::analytic::mindlin::Line;
use crate::element::Kind;
use crate::material::VonMises;

const BLOCK: VonMises = VonMises::elastic(150_000.0, 0.45);
pub(super) const RADIUS: f64 = 50.0;
pub(super) const FRICTION: f64 = 0.3;
/// Makes half a width of contact of about 0.8, and friction of about half of what would make all of it slip.
const APPROACH: f64 = 0.0215;
const PUSHED: f64 = 0.0065;
/// Width of cells where it touches, a twentieth of the half width.
const CELL: f64 = 0.04;
/// Thickness of the slice of the block.
const SLICE: f64 = 0.08;

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
        ["friction-cylinder", "a cylinder on a block that sticks in the middle (Cattaneo and Mindlin)"]
    }

    fn scene(&self) -> String {
        let (right, down) = (planes(22, CELL, 1.4), planes(10, CELL, 1.4));
        let (x, z) = ([mirrored(&right), right].concat(), [mirrored(&down), vec![0.0]].concat());
        let (steel, centre) = (material_line("steel", &BLOCK), RADIUS - APPROACH);
        format!(
            r#"
            step = [{{ support.base = 0.0, friction.roll = 0.0 }}, {{}}]
            {steel}
            decomposition.subdomains = 8
            contact.roll = {{ slave = "block.zmax", friction = {FRICTION:?}, rigid = {{ cylinder = {{ point = [0.0, 0.0, {centre:?}], axis = [0.0, 1.0, 0.0], radius = {RADIUS:?} }} }} }}
            [support]
            base = {{ surface = "block.zmin", fix = ["x", "z"], displacement = [{PUSHED:?}, 0.0, 0.0] }}
            front = {{ surface = "block.ymin", fix = ["y"] }}
            back = {{ surface = "block.ymax", fix = ["y"] }}
            [body.block]
            material = "steel"
            element = "tet4"
            grid = {{ x = {x:?}, y = [0.0, {SLICE:?}], z = {z:?} }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        // Level 2 takes 20 s, quadratic ones a minute.
        if element == Kind::Tet10 { Vec::new() } else { vec![1] }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let [x, _, z] = run.summary().state.contact_force.unwrap_or_default();
        let modulus = BLOCK.young / (1.0 - BLOCK.poisson * BLOCK.poisson);
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
        let in_the_middle = touches.iter().filter(|t| t.place[0].abs() < 0.1 * CELL);
        let traction = in_the_middle.map(|t| 0.5 * t.friction[0].abs()).sum::<f64>();
        let distance = sum(&|x, _, q| (q - exact.traction(x)).powi(2)) / sum(&|x, _, _| exact.traction(x).powi(2));
        vec![
            Error::new("contact width", half / exact.half - 1.0, Demand::Finest(0.03)),
            Error::new("sticking width", Line::sticking_of(half, square) / exact.sticking - 1.0, Demand::Finest(0.03)),
            Error::new("friction in the middle", traction / exact.traction(0.0) - 1.0, Demand::Finest(0.03)),
            Error::new("friction stress", distance.sqrt(), Demand::Shown),
        ]
    }
}
