//! A rigid ball on an elastic block.

use super::run::{Run, pressure_error};
use super::{Case, Demand, Error, material_line};
use crate::analytic::hertz::Hertz;
use crate::element::Kind;
use crate::material::VonMises;

const STEEL: VonMises = VonMises::elastic(210_000.0, 0.3);
const RADIUS: f64 = 100.0;
/// Makes a circle of contact of radius one.
const APPROACH: f64 = 0.01;

/// A quarter of a block, by symmetry; its size makes the force about a twentieth larger than on a half space, so all is
/// compared with the closed form for the force that was found.
pub struct Ball;

impl Case for Ball {
    fn title(&self) -> [&'static str; 2] {
        ["hertz", "a rigid ball on an elastic block"]
    }

    fn scene(&self) -> String {
        let (steel, centre) = (material_line("steel", &STEEL), RADIUS - APPROACH);
        format!(
            r#"
            {steel}
            support.x = {{ surface = "block.xmin", fix = ["x"] }}
            support.y = {{ surface = "block.ymin", fix = ["y"] }}
            support.ground = {{ surface = "block.zmin", fix = ["z"] }}
            contact.ball = {{ slave = "block.zmax", rigid = {{ sphere = {{ centre = [0.0, 0.0, {centre:?}], radius = {RADIUS:?} }} }} }}
            [body.block]
            material = "steel"
            element = "tet4"
            [body.block.grid]
            x = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.6, 2.2, 3.2, 5.0, 8.0, 13.0]
            y = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.6, 2.2, 3.2, 5.0, 8.0, 13.0]
            z = [-13.0, -8.0, -5.0, -3.2, -2.2, -1.6, -1.25, -1.0, -0.75, -0.5, -0.25, 0.0]"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        // Quadratic ones converge, but take thousands of applications of F and more than a minute.
        match element {
            Kind::Tet10 => Vec::new(),
            Kind::Tet4 => vec![1, 2],
            Kind::Hex8 => vec![1],
        }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let force = 4.0 * run.summary().state.contact_force.unwrap_or_default()[2].abs();
        let exact = Hertz::new(&STEEL, RADIUS, force);
        let touches = run.contacts();
        let square = |[x, y, _]: [f64; 3]| x * x + y * y;
        let load: f64 = touches.iter().map(|t| t.area * t.pressure).sum();
        let inertia: f64 = touches.iter().map(|t| t.area * t.pressure * square(t.place)).sum();
        let nearest = touches.iter().min_by(|a, b| square(a.place).total_cmp(&square(b.place)));
        let peak = nearest.map_or(f64::NAN, |touch| touch.pressure);
        let pressure = pressure_error(&touches, |x| exact.pressure(square(x).sqrt()));
        vec![
            // The mean square of the distance under Hertz' pressure is 2/5 a^2.
            Error::new("contact radius", (2.5 * inertia / load).sqrt() / exact.radius - 1.0, Demand::Finest(0.03)),
            Error::new("peak pressure", peak / exact.peak - 1.0, Demand::Finest(0.05)),
            Error::new("contact pressure", pressure, Demand::Shown),
            Error::new("approach", APPROACH / exact.approach - 1.0, Demand::Shown),
        ]
    }
}
