//! Manufactured solutions on the unit cube: orders of all elements where the solution is smooth, and at a plastic front.

use super::run::{Exact, Run};
use super::{Case, Demand, Error, convergence, halved, material_line};
use crate::analytic::manufactured::Manufactured;
use crate::element::Kind;
use crate::material::VonMises;
use crate::tensor::Voigt;

/// A solution and what acts on it.
pub struct Smooth {
    name: &'static str,
    about: &'static str,
    solution: &'static Manufactured,
    force: fn([f64; 3]) -> [f64; 3],
    /// Whether a part of the cube yields and the rest does not.
    has_front: bool,
}

/// All of them.
pub const CASES: [Smooth; 3] = [
    Smooth {
        name: "manufactured-elastic",
        about: "a smooth elastic field",
        solution: &ELASTIC,
        force: |x| ELASTIC.force(x),
        has_front: false,
    },
    Smooth {
        name: "manufactured-plastic",
        about: "a smooth field that yields everywhere",
        solution: &PLASTIC,
        force: |x| PLASTIC.force(x),
        has_front: false,
    },
    Smooth {
        name: "manufactured-front",
        about: "a field that yields in a part of the cube",
        solution: &FRONT,
        force: |x| FRONT.force(x),
        has_front: true,
    },
];

const ELASTIC: Manufactured =
    Manufactured { material: VonMises::elastic(1.0, 0.3), stretch: [0.0; 3], wave: [1.0, -0.5, 0.7] };

/// Not nearly incompressible in plastic flow.
const HARDENING: VonMises = VonMises {
    young: 210_000.0,
    poisson: 0.1,
    yield_stress: Some(450.0),
    hardening: 100_000.0,
    kinematic_hardening: 0.0,
};

const PLASTIC: Manufactured =
    Manufactured { material: HARDENING, stretch: [0.02, -0.01, -0.01], wave: [2e-3, -1e-3, 1.5e-3] };

const FRONT: Manufactured = Manufactured { material: HARDENING, stretch: [0.0; 3], wave: [1.4e-3, -7e-4, 1e-3] };

impl Exact for Manufactured {
    fn displacement(&self, _: usize, x: [f64; 3]) -> [f64; 3] {
        Manufactured::displacement(self, x)
    }

    fn strain(&self, _: usize, x: [f64; 3]) -> Voigt {
        Manufactured::strain(self, x)
    }

    fn stress(&self, _: usize, x: [f64; 3]) -> Voigt {
        Manufactured::stress(self, x)
    }
}

impl Case for Smooth {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let material = material_line("smooth", &self.solution.material);
        let support = |axis: usize| {
            let (name, moved) = (["x", "y", "z"][axis], self.solution.stretch[axis]);
            let moved: [f64; 3] = std::array::from_fn(|i| if i == axis { moved } else { 0.0 });
            format!(
                r#"
                support.{name}min = {{ surface = "cube.{name}min", fix = ["{name}"] }}
                support.{name}max = {{ surface = "cube.{name}max", fix = ["{name}"], displacement = {moved:?} }}"#
            )
        };
        let supports: String = (0..3).map(support).collect();
        format!(
            r#"
            {material}
            {supports}
            load.field = {{ body = "cube", body_force = [0.0, 0.0, 0.0] }}
            [body.cube]
            material = "smooth"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0], cells = [1, 1, 1] }}"#
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        halved(element)
    }

    fn force(&self) -> Option<fn([f64; 3]) -> [f64; 3]> {
        Some(self.force)
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let mut errors = convergence(run, self.solution, self.has_front);
        if self.solution.material.yield_stress.is_some() {
            let kappa = run.cells("equivalent_plastic_strain", |_, x| self.solution.kappa(x));
            errors.push(Error::new("plastic strain", kappa, Demand::Shown));
        }
        errors
    }
}
