//! A thick cylinder in plane strain under pressure: elastic, and perfectly plastic in increments.

use super::radial::{Radial, State};
use super::run::Run;
use super::{Case, Demand, Error, convergence, halved, material_line};
use crate::analytic::cylinder::{Cylinder, CylinderState};
use crate::element::Kind;
use crate::material::VonMises;

/// Of de Souza Neto, Peric and Owen, 7.5, in GPa.
pub(super) const STEEL: VonMises =
    VonMises { young: 210.0, poisson: 0.3, yield_stress: Some(0.24), hardening: 0.0, kinematic_hardening: 0.0 };

pub(super) const CYLINDER: Cylinder = Cylinder { inner: 100.0, outer: 200.0, material: STEEL };

/// The cylinder under a pressure.
pub struct Pressed {
    name: &'static str,
    about: &'static str,
    pressure: f64,
    increments: usize,
}

/// All of them.
pub const CASES: [Pressed; 2] = [
    Pressed { name: "cylinder-elastic", about: "a thick cylinder under pressure", pressure: 0.1, increments: 1 },
    Pressed {
        name: "cylinder-plastic",
        about: "a thick cylinder, perfectly plastic in a part, in increments",
        pressure: 0.18,
        increments: 20,
    },
];

/// Supports in the planes of symmetry and across the axis.
pub(super) fn plane_strain(body: &str) -> String {
    let plane = |(surface, axis): (&str, &str)| {
        format!("\n    support.{surface} = {{ surface = \"{body}.{surface}\", fix = [\"{axis}\"] }}")
    };
    [("x0", "x"), ("y0", "y"), ("bottom", "z"), ("top", "z")].map(plane).concat()
}

impl Pressed {
    fn state(&self) -> CylinderState {
        CYLINDER.loaded(self.pressure).expect("the pressure is below the limit")
    }
}

/// Hill's solution is Tresca's, which differs a little from von Mises' along the axis.
const BIAS: f64 = 0.01;

impl Case for Pressed {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let (material, planes) = (material_line("steel", &STEEL), plane_strain("wall"));
        let (pressure, increments) = (self.pressure, self.increments);
        format!(
            r#"
            step = [{{ increments = {increments} }}]
            {material}
            {planes}
            load.bore = {{ surface = "wall.inner", pressure = {pressure:?} }}
            [body.wall]
            material = "steel"
            element = "tet4"
            cylinder = {{ inner = 100.0, outer = 200.0, height = 50.0, cells = [2, 1, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        match (element, self.increments) {
            (_, 1) => halved(element),
            (Kind::Tet10, _) => vec![2, 4],
            _ => vec![4, 8],
        }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let state = self.state();
        let outer = CYLINDER.outer;
        let radius = |x: [f64; 3]| x[0].hypot(x[1]);
        let at_outer = run.nodes(
            |_, x| (radius(x) / outer - 1.0).abs() < 1e-6,
            |x, u| (x[0] * u[0] + x[1] * u[1]) / radius(x) / state.outer_displacement() - 1.0,
        );
        if self.increments > 1 {
            let demand = if run.element() == Kind::Tet4 { Demand::Shown } else { Demand::Finest(BIAS) };
            return vec![Error::new("outer radius", at_outer, demand)];
        }
        let at = |_, r: f64| {
            let (strain, stress) =
                (state.strains(r), [state.radial_stress(r), state.hoop_stress(r), state.axial_stress(r)]);
            State { displacement: r * strain[1], strain, stress }
        };
        let exact = Radial { about_axis: true, state: at };
        let mut errors = convergence(run, &exact, false);
        errors.push(Error::new("outer radius", at_outer, Demand::Shown));
        errors
    }
}
