//! A bar between two planes with friction, pulled at its end and let go again: [`crate::analytic::rubbing::Bar`].
//!
//! Hexahedra with all nodes on the planes are exact at nodes where whole elements slip. With nodes inside it is no bar: near the end
//! pressures change and the section warps. Tetrahedra and hexahedra then agree on an end that moves 0.4 % less, 0.7 % after it was let
//! go, and on 1.4 % less dissipation there.

use super::run::Run;
use super::{Case, Demand, Error};
use crate::analytic::rubbing;
use crate::element::Kind;

const YOUNG: f64 = 210_000.0;
const FRICTION: f64 = 0.3;
const PRESSURE: f64 = 100.0;
const LENGTH: f64 = 1000.0;
/// Edge of the cross section.
const EDGE: f64 = 20.0;
/// Elements along the bar at level 1, half of which slip; so many nodes are on the way back that it may be halved.
const ELEMENTS: usize = 20;

const BAR: rubbing::Bar = rubbing::Bar {
    stiffness: YOUNG * EDGE * EDGE,
    drag: 2.0 * FRICTION * PRESSURE * EDGE,
    pull: FRICTION * PRESSURE * EDGE * LENGTH,
};

/// A bar that is pulled, or let go after that.
pub struct Bar {
    name: &'static str,
    about: &'static str,
    released: bool,
}

/// Both.
pub const BARS: [Bar; 2] = [
    Bar { name: "friction-bar", about: "a bar pulled out from between two planes", released: false },
    Bar { name: "friction-bar-back", about: "the same bar, let go", released: true },
];

impl Case for Bar {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let steps = if self.released { "{}, { load.pull = 0.0 }" } else { "{}" };
        // The planes are closed until they press so much; nu = 0.
        let (gap, traction) = (-0.5 * PRESSURE * EDGE / YOUNG, BAR.pull / (EDGE * EDGE));
        let plane = |z: f64, normal: f64| {
            format!(
                "gap = {gap:?}, friction = {FRICTION:?}, rigid = {{ plane = {{ point = [0.0, 0.0, {z:?}], normal = [0.0, 0.0, {normal:?}] }} }}"
            )
        };
        let (low, high) = (plane(0.0, 1.0), plane(EDGE, -1.0));
        format!(
            r#"
            step = [{steps}]
            material.steel = {{ young = {YOUNG:?}, poisson = 0.0 }}
            decomposition.subdomains = 4
            [support]
            held = {{ surface = "bar.xmin", fix = ["x"] }}
            front = {{ surface = "bar.ymin", fix = ["y"] }}
            back = {{ surface = "bar.ymax", fix = ["y"] }}
            [load]
            pull = {{ surface = "bar.xmax", traction = [{traction:?}, 0.0, 0.0] }}
            [contact]
            low = {{ slave = "bar.zmin", {low} }}
            high = {{ slave = "bar.zmax", {high} }}
            [body.bar]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [{LENGTH:?}, {EDGE:?}, {EDGE:?}], cells = [{ELEMENTS}, 1, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        match element {
            Kind::Hex8 => vec![1],
            Kind::Tet4 => vec![1, 2, 3],
            Kind::Tet10 => vec![1, 2],
        }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let [end, work] = if run.element() == Kind::Hex8 {
            [Demand::Below(1e-9); 2]
        } else {
            [Demand::Finest(0.01), Demand::Finest(0.02)]
        };
        let moved = run.nodes(|_, [x, ..]| (x - LENGTH).abs() < 1e-6, |_, u| u[0] / BAR.end(self.released) - 1.0);
        let rubbed: f64 = run.summary().state.friction.values().map(|plane| plane.dissipation).sum();
        let slipping = ELEMENTS * run.level / if self.released { 4 } else { 2 };
        let exact = BAR.dissipated(self.released, Some(slipping));
        vec![Error::new("end", moved, end), Error::new("dissipation", rubbed / exact - 1.0, work)]
    }
}
