//! Limit loads of perfectly plastic bodies, approached in increments.
//!
//! Spheres and cylinders are loaded by pressure: beyond the limit there is no equilibrium, and the history must end there
//! with what converged before. A footing is pressed by a displacement: its force comes to rest. Elements that lock carry more, or know no limit
//! at all; that linear tetrahedra do is part of what is shown.

use super::cylinders::{CYLINDER, STEEL, plane_strain};
use super::run::Run;
use super::spheres::symmetry;
use super::{Case, Demand, End, Error, material_line};
use crate::analytic::hollow_sphere::HollowSphere;
use crate::element::Kind;
use crate::material::VonMises;

const SPHERE: HollowSphere = HollowSphere { inner: 100.0, outer: 200.0, material: STEEL };

/// A wall under pressure up to its limit and beyond.
pub struct Wall {
    name: &'static str,
    about: &'static str,
    body: &'static str,
    /// Its supports.
    planes: fn() -> String,
    limit: fn() -> f64,
}

/// All of them.
pub const WALLS: [Wall; 2] = [
    Wall {
        name: "limit-sphere",
        about: "the limit pressure of a hollow sphere, 2 sigma_y ln(b/a)",
        body: "sphere = { inner = 100.0, outer = 200.0, cells = [1, 1] }",
        planes: || symmetry("wall"),
        limit: || SPHERE.pressure_of_front(SPHERE.outer),
    },
    Wall {
        name: "limit-cylinder",
        about: "the limit pressure of a thick cylinder in plane strain, 2/sqrt(3) sigma_y ln(b/a)",
        body: "cylinder = { inner = 100.0, outer = 200.0, height = 50.0, cells = [2, 1, 1] }",
        planes: || plane_strain("wall"),
        limit: || CYLINDER.limit_pressure(),
    },
];

/// The history: to this share of the limit in one step, then in increments to the end.
const BEGIN: f64 = 0.9;
const STEP: f64 = 0.01;
const END: f64 = 1.3;

/// What the better elements owe; what tetrahedra miss.
const CLOSE: f64 = 0.02;

fn close(element: Kind) -> Demand {
    if element == Kind::Tet4 { Demand::Missed(CLOSE) } else { Demand::Finest(CLOSE) }
}

impl Case for Wall {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let (material, body, limit) = (material_line("steel", &STEEL), self.body, (self.limit)());
        let planes = (self.planes)();
        let increments = ((END - BEGIN) / STEP).round();
        format!(
            r#"
            step = [{{ amplitude = {BEGIN:?}, increments = 3 }}, {{ amplitude = {END:?}, increments = {increments}, halvings = 0 }}]
            {material}
            {planes}
            load.bore = {{ surface = "wall.inner", pressure = {limit:?} }}
            [body.wall]
            material = "steel"
            element = "tet4"
            {body}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        match element {
            Kind::Tet10 => vec![2],
            Kind::Tet4 => vec![4],
            Kind::Hex8 => vec![2, 4],
        }
    }

    fn end(&self, element: Kind) -> End {
        if element == Kind::Tet4 { End::Either } else { End::Early }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let time = run.summary().steps.last().map_or(0.0, |row| row.time);
        let reached = if time <= 1.0 { BEGIN * time } else { BEGIN + (time - 1.0) * (END - BEGIN) };
        vec![Error::new("limit load", reached - 1.0, close(run.element()))]
    }
}

/// A smooth rigid strip on a perfectly plastic half space in plane strain (Prandtl; de Souza Neto, Peric and Owen, 7.5.3).
/// The strip is at rest, and what is below it comes up against it.
pub struct Footing;

/// Of the ground, in kPa.
const GROUND: VonMises =
    VonMises { young: 1e7, poisson: 0.48, yield_stress: Some(848.7), hardening: 0.0, kinematic_hardening: 0.0 };

/// Half the strip, and how thick a slice of it is.
const HALF: f64 = 50.0;
const SLICE: f64 = 10.0;

impl Case for Footing {
    fn title(&self) -> [&'static str; 2] {
        ["limit-footing", "the limit load of a strip footing, (2 + pi) sigma_y/sqrt(3)"]
    }

    fn scene(&self) -> String {
        let ground = material_line("ground", &GROUND);
        let plane = |surface: &str, axis: &str| {
            format!("\n    support.{surface} = {{ surface = \"ground.{surface}\", fix = [\"{axis}\"] }}")
        };
        let planes = [("xmin", "x"), ("xmax", "x"), ("ymin", "y"), ("ymax", "y")].map(|(s, a)| plane(s, a)).concat();
        // Small cells at the end of the strip, where the stress jumps.
        format!(
            r#"
            step = [{{ increments = 15 }}]
            {ground}
            {planes}
            support.zmin = {{ surface = "ground.zmin", fix = ["z"], displacement = [0.0, 0.0, 0.3] }}
            [contact.strip]
            slave = "ground.zmax"
            rigid = {{ heightfield = {{ origin = [0.0, 0.0], spacing = [{HALF:?}, {SLICE:?}], heights = [[0.0, 0.0], [0.0, 0.0]], above = true }} }}
            [body.ground]
            material = "ground"
            element = "tet4"
            [body.ground.grid]
            x = [0.0, 12.0, 24.0, 34.0, 42.0, 47.0, 49.0, 50.0, 51.0, 53.0, 58.0, 66.0, 78.0, 95.0, 118.0, 150.0, 190.0, 250.0]
            y = [0.0, {SLICE:?}]
            z = [-150.0, -115.0, -88.0, -68.0, -53.0, -41.0, -31.0, -23.0, -16.0, -10.0, -6.0, -3.0, -1.0, 0.0]"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        // Quadratic ones take minutes.
        if element == Kind::Tet10 { Vec::new() } else { vec![1] }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let limit = (2.0 + std::f64::consts::PI) * GROUND.yield_stress.unwrap_or_default() / 3f64.sqrt();
        let force = run.summary().state.contact_force.unwrap_or_default()[2].abs();
        vec![Error::new("limit load", force / (HALF * SLICE * limit) - 1.0, close(run.element()))]
    }
}
