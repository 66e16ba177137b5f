//! Bodies that slide as a whole, or just do not: friction is what equilibrium says, however pressures are spread.
//!
//! Beyond the angle of friction a block on an incline is refused before anything is solved, which no case can express; a test of the
//! program has that.

use super::friction::FLOOR;
use super::run::Run;
use super::{Case, Demand, Error};
use crate::analytic::rubbing::up_a_slope;
use crate::element::Kind;

const FRICTION: f64 = 0.3;

fn levels(element: Kind) -> Vec<usize> {
    if element == Kind::Tet10 { vec![1] } else { vec![1, 2] }
}

/// A plate whose top is moved: friction is `mu N`.
pub struct Dragged;

impl Case for Dragged {
    fn title(&self) -> [&'static str; 2] {
        ["friction-dragged", "a plate dragged over a plane, T = mu N"]
    }

    fn scene(&self) -> String {
        format!(
            r#"
            material.steel = {{ young = 210000.0, poisson = 0.0 }}
            decomposition.subdomains = 4
            support.top = {{ surface = "plate.zmax", fix = ["x", "y"], displacement = [1.0, 0.0, 0.0] }}
            load.top = {{ surface = "plate.zmax", traction = [0.0, 0.0, -50.0] }}
            contact.floor = {{ slave = "plate.zmin", friction = {FRICTION:?}, {FLOOR} }}
            [body.plate]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [1000.0, 1000.0, 200.0], cells = [5, 5, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        levels(element)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let [x, _, z] = run.summary().state.contact_force.unwrap_or_default();
        // Nodes that shear makes slip a little across, too, have less along.
        vec![Error::new("friction", -x / (FRICTION * z) - 1.0, Demand::Below(1e-6))]
    }
}

/// A heavy block on a plane that leans a little less than the angle of friction, 16.699 degrees. Nothing else holds it.
pub struct Incline;

/// In degrees.
const ANGLE: f64 = 16.6;

/// Weight of a unit of volume, and edges.
const WEIGHT: f64 = 1e-3;
const SIZE: [f64; 3] = [400.0, 400.0, 100.0];

impl Case for Incline {
    fn title(&self) -> [&'static str; 2] {
        ["friction-incline", "a block on an incline just below the angle of friction"]
    }

    fn scene(&self) -> String {
        let (sine, cosine) = ANGLE.to_radians().sin_cos();
        let (along, across) = (WEIGHT * sine, -WEIGHT * cosine);
        format!(
            r#"
            material.steel = {{ young = 210000.0, poisson = 0.3 }}
            decomposition.subdomains = 4
            load.weight = {{ body = "block", body_force = [{along:?}, 0.0, {across:?}] }}
            contact.floor = {{ slave = "block.zmin", friction = {FRICTION:?}, {FLOOR} }}
            [body.block]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = {SIZE:?}, cells = [4, 4, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        levels(element)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let (sine, cosine) = ANGLE.to_radians().sin_cos();
        let weight = WEIGHT * SIZE.iter().product::<f64>();
        let [x, y, z] = run.summary().state.contact_force.unwrap_or_default().map(|force| force / weight);
        // It creeps until friction is nowhere above its limit, by elastic displacements.
        let crept = run.nodes(|_, _| true, |_, u| u[0]) * 210_000.0 / (WEIGHT * SIZE[0] * SIZE[0]);
        vec![
            Error::new("friction", (x + sine).hypot(y), Demand::Below(1e-8)),
            Error::new("normal force", z - cosine, Demand::Below(1e-8)),
            Error::new("displacement E/(weight L)", crept, Demand::Shown),
        ]
    }
}

/// A wedge that is driven up a slope (after NAFEMS' CGS-4). It is drawn without its wedge, by a clearance of zero. Its top is
/// pushed, as friction at nodes that supports hold would act on the supports.
pub struct Wedge;

/// Tangent of the slope.
const SLOPE: f64 = 0.1;

impl Case for Wedge {
    fn title(&self) -> [&'static str; 2] {
        ["friction-wedge", "a wedge driven up a slope, F/G = (tan a + mu)/(1 - mu tan a)"]
    }

    fn scene(&self) -> String {
        format!(
            r#"
            material.steel = {{ young = 206000.0, poisson = 0.3 }}
            decomposition.subdomains = 4
            support.top = {{ surface = "wedge.zmax", fix = ["x", "y"], displacement = [1.0, 0.0, 0.0] }}
            load.top = {{ surface = "wedge.zmax", traction = [0.0, 0.0, -10.0] }}
            contact.slope = {{ slave = "wedge.zmin", clearance = 0.0, friction = {FRICTION:?}, rigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = [{:?}, 0.0, 1.0] }} }} }}
            [body.wedge]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [400.0, 200.0, 200.0], cells = [4, 2, 2] }}"#,
            -SLOPE
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        levels(element)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let force = run.summary().state.reactions["top"][0] / (10.0 * 400.0 * 200.0);
        vec![Error::new("force", force / up_a_slope(SLOPE, FRICTION) - 1.0, Demand::Below(5e-4))]
    }
}
