//! Hollow spheres under pressure: one, elastic, yielding, and unloaded again; and two with a gap between them.

use super::radial::{Radial, State};
use super::run::{Run, pressure_error};
use super::{Case, Demand, Error, PAPER, convergence, halved, material_line};
use crate::analytic::hollow_sphere::{HollowSphere, SphereState, Unloaded};
use crate::analytic::nested_spheres::NestedSpheres;
use crate::element::Kind;
use crate::material::von_mises::{PlasticState, VonMises};
use crate::material::{Law, Variables};

/// The sphere that takes the pressure.
const SPHERE: HollowSphere = HollowSphere { inner: 100.0, outer: 200.0, material: PAPER };

/// One sphere of the paper's material.
pub struct Hollow {
    name: &'static str,
    about: &'static str,
    pressure: f64,
    /// Whether the pressure is taken away again.
    unloaded: bool,
}

/// All of them.
pub const HOLLOW: [Hollow; 3] = [
    Hollow { name: "sphere-elastic", about: "a hollow sphere under pressure", pressure: 200.0, unloaded: false },
    Hollow { name: "sphere-plastic", about: "a hollow sphere that yields in a part", pressure: 500.0, unloaded: false },
    Hollow { name: "sphere-unloaded", about: "the yielding sphere, unloaded again", pressure: 500.0, unloaded: true },
];

impl Hollow {
    fn loaded(&self) -> SphereState {
        SPHERE.loaded(self.pressure, 0.0).expect("the pressure is below full plasticity")
    }

    fn is_elastic(&self) -> bool {
        self.loaded().front() == SPHERE.inner
    }
}

/// Supports in the planes of symmetry.
pub(super) fn symmetry(body: &str) -> String {
    let plane =
        |axis: &str| format!("\n    support.{body}-{axis} = {{ surface = \"{body}.{axis}0\", fix = [\"{axis}\"] }}");
    ["x", "y", "z"].map(plane).concat()
}

impl Case for Hollow {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let (material, supports, pressure) = (material_line("paper", &PAPER), symmetry("sphere"), self.pressure);
        let steps = if self.unloaded { "step = [{}, { amplitude = 0.0 }]" } else { "" };
        format!(
            r#"
            {steps}
            {material}
            {supports}
            load.bore = {{ surface = "sphere.inner", pressure = {pressure:?} }}
            [body.sphere]
            material = "paper"
            element = "tet4"
            sphere = {{ inner = 100.0, outer = 200.0, cells = [1, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        halved(element)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let loaded = self.loaded();
        let left = self.unloaded.then(|| loaded.unloaded().expect("nothing yields on the way back"));
        let state = |_, r| left.as_ref().map_or_else(|| under_pressure(&loaded, r), |left| without_pressure(left, r));
        let exact = Radial { about_axis: false, state };
        let mut errors = convergence(run, &exact, !self.is_elastic());
        if !self.is_elastic() {
            let kappa = run.cells("equivalent_plastic_strain", |_, x| loaded.kappa(distance(x)));
            errors.push(Error::new("plastic strain", kappa, Demand::Shown));
        }
        if !self.is_elastic() && !self.unloaded {
            errors.push(Error::new("plastic front", front(run, loaded.front()), of_front(run)));
        }
        errors
    }
}

fn under_pressure(state: &SphereState, r: f64) -> State {
    let around = state.hoop_stress(r);
    let stress = [state.radial_stress(r), around, around];
    State { displacement: state.displacement(r), strain: state.strains(r), stress }
}

fn without_pressure(state: &Unloaded, r: f64) -> State {
    let [radial, around] = state.stresses(r);
    State { displacement: state.displacement(r), strain: state.strains(r), stress: [radial, around, around] }
}

pub(super) fn distance(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// What the better elements owe.
fn within_a_percent(run: &Run) -> Demand {
    if run.element() == Kind::Tet4 { Demand::Shown } else { Demand::Finest(0.01) }
}

/// Linear elements yield as a whole: they know the front to half a cell.
fn of_front(run: &Run) -> Demand {
    if run.element() == Kind::Tet10 { Demand::Finest(0.01) } else { Demand::Shown }
}

/// Relative error of the radius of a sphere that holds as much yielding volume as was found in the first body.
fn front(run: &Run, exact: f64) -> f64 {
    let share = run.share(|body, strain| body == 0 && PAPER.respond(strain, &PlasticState::VIRGIN).plastic);
    let [a, b] = [SPHERE.inner, SPHERE.outer].map(|r| r.powi(3));
    (a + share * (b - a)).cbrt() / exact - 1.0
}

/// Two spheres, the inner one of the paper's material, the outer one elastic.
pub struct Nested;

const NESTED: NestedSpheres = NestedSpheres { inner: SPHERE, outer_radius: 300.0, outer_material: ELASTIC, gap: 0.05 };
const ELASTIC: VonMises = VonMises::elastic(PAPER.young, PAPER.poisson);
const PRESSURE: f64 = 600.0;

impl Case for Nested {
    fn title(&self) -> [&'static str; 2] {
        ["nested-spheres", "a yielding sphere that closes the gap to another one"]
    }

    fn scene(&self) -> String {
        let materials = material_line("elastic", &ELASTIC) + "\n" + &material_line("paper", &PAPER);
        let (supports, gap) = (symmetry("inner") + &symmetry("outer"), NESTED.gap);
        format!(
            r#"
            {materials}
            {supports}
            load.bore = {{ surface = "inner.inner", pressure = {PRESSURE:?} }}
            contact.joint = {{ slave = "inner.outer", master = "outer.inner", clearance = {gap:?} }}
            [body.inner]
            material = "paper"
            element = "tet4"
            sphere = {{ inner = 100.0, outer = 200.0, cells = [1, 1] }}
            [body.outer]
            material = "elastic"
            element = "tet4"
            sphere = {{ inner = 200.0, outer = 300.0, cells = [1, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        halved(element)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let exact = NESTED.loaded(PRESSURE).expect("no wall yields through");
        let of = |body| if body == 0 { &exact.inner } else { &exact.outer };
        let field = Radial { about_axis: false, state: |body, r| under_pressure(of(body), r) };
        let interface = SPHERE.outer;
        let at_interface = run.nodes(
            |body, x| body == 1 && (distance(x) / interface - 1.0).abs() < 1e-6,
            |x, u| (0..3).map(|i| u[i] * x[i]).sum::<f64>() / distance(x) / exact.outer.displacement(interface) - 1.0,
        );
        let closed = within_a_percent(run);
        let mut errors = convergence(run, &field, true);
        errors.extend([
            Error::new("interface moved", at_interface, closed),
            Error::new("contact pressure", pressure_error(&run.contacts(), |_| exact.contact_pressure), closed),
            Error::new("plastic front", front(run, exact.inner.front()), of_front(run)),
        ]);
        errors
    }
}
