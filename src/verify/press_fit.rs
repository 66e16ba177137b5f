//! A ring with friction in another that is too small for it, pressed on along the axis: [`crate::analytic::press_fit`].
//!
//! Sizes are those of a user's example (CalculiX's issue 98), where diameters are 40.005 in 40.000, the bore 20 and the outside 60; Young's
//! modulus and the length follow from the 5.74 MPa and the 1371 N that are said there. Lame's rings know no ends and no friction:
//! with Poisson's ratio axial stresses change the pressure by a percent.

use super::run::Run;
use super::{Case, Demand, Error};
use crate::analytic::press_fit::PressFit;
use crate::element::Kind;

const FIT: PressFit = PressFit { young: 196_000.0, radii: [10.0, 20.0, 30.0], interference: 0.0025, length: 19.0 };
const FRICTION: f64 = 0.1;

/// A shaft that is pushed through a hub.
pub struct Pressed;

impl Case for Pressed {
    fn title(&self) -> [&'static str; 2] {
        ["friction-press-fit", "a shaft pushed through its hub, by mu times Lame's pressure"]
    }

    fn scene(&self) -> String {
        let PressFit { young, radii: [bore, joint, outside], interference, length } = FIT;
        let plane = |[body, surface, axis]: [&str; 3]| {
            format!("\n            {body}-{axis} = {{ surface = \"{body}.{surface}\", fix = [\"{axis}\"] }}")
        };
        let planes =
            [["shaft", "x0", "x"], ["shaft", "y0", "y"], ["hub", "x0", "x"], ["hub", "y0", "y"]].map(plane).concat();
        let ring = |name: &str, inner: f64, outer: f64| {
            format!(
                r#"
            [body.{name}]
            material = "steel"
            element = "tet4"
            cylinder = {{ inner = {inner:?}, outer = {outer:?}, height = {length:?}, cells = [4, 2, 4] }}"#
            )
        };
        let rings = ring("shaft", bore, joint) + &ring("hub", joint, outside);
        // First it is fitted, and then pushed by twenty times the interference.
        format!(
            r#"
            step = [{{ support.push = 0.0 }}, {{}}]
            material.steel = {{ young = {young:?}, poisson = 0.3 }}
            decomposition.subdomains = 8
            contact.joint = {{ slave = "hub.inner", master = "shaft.outer", clearance = {:?}, friction = {FRICTION:?} }}
            {rings}
            [support]{planes}
            seat = {{ surface = "hub.bottom", fix = ["z"] }}
            push = {{ surface = "shaft.top", fix = ["z"], displacement = [0.0, 0.0, {:?}] }}"#,
            -interference,
            -20.0 * interference
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        if element == Kind::Tet10 { vec![1] } else { vec![1, 2] }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        // A quarter.
        let pushed = 4.0 * run.summary().state.reactions["push"][2].abs();
        let pressed: f64 = 4.0 * run.contacts().iter().map(|touch| touch.area * touch.pressure).sum::<f64>();
        vec![
            Error::new("axial force", pushed / (FRICTION * FIT.force()) - 1.0, Demand::Finest(0.02)),
            Error::new("pressure", pressed / FIT.force() - 1.0, Demand::Finest(0.02)),
            Error::new("friction", pushed / (FRICTION * pressed) - 1.0, Demand::Finest(1e-3)),
        ]
    }
}
