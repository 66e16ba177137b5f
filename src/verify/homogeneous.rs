//! Homogeneous states of a cube beyond yield: exact on any mesh, up to round-off.

use super::run::Run;
use super::{Case, Demand, Error, PAPER, material_line};
use crate::analytic::homogeneous;
use crate::element::Kind;
use crate::tensor::{Voigt, von_mises};

/// A state of the unit cube of the paper's material, in one step.
pub struct Homogeneous {
    name: &'static str,
    about: &'static str,
    state: fn() -> State,
    /// Supports and loads beside those of three planes of symmetry.
    conditions: fn(&State) -> String,
}

/// A state; displacements are those of the strain with no rotation but about z, of the edge along x that stays.
struct State {
    strain: Voigt,
    stress: Voigt,
    kappa: f64,
}

fn beyond_yield(strain: Voigt, stress: Voigt) -> State {
    let excess = von_mises(&stress) - PAPER.yield_stress.unwrap_or(f64::INFINITY);
    State { strain, stress, kappa: excess / PAPER.hardening }
}

/// All of them.
pub const CASES: [Homogeneous; 4] = [
    Homogeneous {
        name: "uniaxial",
        about: "a cube pulled beyond yield",
        state: || beyond_yield(homogeneous::uniaxial(&PAPER, 500.0), [500.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        conditions: |state| SYMMETRY.to_owned() + &traction("xmax", [state.stress[0], 0.0, 0.0]),
    },
    Homogeneous {
        name: "biaxial",
        about: "a cube pulled along two axes beyond yield",
        state: || beyond_yield(homogeneous::equibiaxial(&PAPER, 500.0), [500.0, 500.0, 0.0, 0.0, 0.0, 0.0]),
        conditions: |state| {
            let pulled = traction("xmax", [state.stress[0], 0.0, 0.0]) + &traction("ymax", [0.0, state.stress[1], 0.0]);
            SYMMETRY.to_owned() + &pulled
        },
    },
    Homogeneous {
        name: "shear",
        about: "a cube sheared beyond yield",
        state: || beyond_yield(homogeneous::pure_shear(&PAPER, 300.0), [0.0, 0.0, 0.0, 300.0, 0.0, 0.0]),
        conditions: |state| {
            let [along, across] = [1.0, -1.0].map(|sign| [0.0, sign * state.stress[3], 0.0]);
            let moved = state.strain[3];
            let held = format!(
                r#"
                support.bottom = {{ surface = "cube.ymin", fix = ["x", "y", "z"] }}
                support.top = {{ surface = "cube.ymax", fix = ["x", "y", "z"], displacement = [{moved:?}, 0.0, 0.0] }}"#
            );
            held + &traction("xmin", across) + &traction("xmax", along)
        },
    },
    Homogeneous {
        name: "plane-strain",
        about: "a cube pressed beyond yield in plane strain, in one step",
        state: || {
            let state = homogeneous::plane_strain(&PAPER, -0.003);
            State { strain: state.strain, stress: state.stress, kappa: state.kappa }
        },
        conditions: |state| {
            let pressed = format!(
                r#"
                support.front = {{ surface = "cube.zmax", fix = ["z"] }}
                support.top = {{ surface = "cube.ymax", fix = ["y"], displacement = [0.0, {:?}, 0.0] }}"#,
                state.strain[1]
            );
            SYMMETRY.to_owned() + &pressed
        },
    },
];

const SYMMETRY: &str = r#"
    support.back = { surface = "cube.xmin", fix = ["x"] }
    support.side = { surface = "cube.ymin", fix = ["y"] }
    support.low = { surface = "cube.zmin", fix = ["z"] }"#;

fn traction(face: &str, value: [f64; 3]) -> String {
    format!("\n    load.{face} = {{ surface = \"cube.{face}\", traction = {value:?} }}")
}

/// Relative to what is there; the solver's tolerances are below.
const EXACT: Demand = Demand::Below(1e-8);

impl Case for Homogeneous {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let conditions = (self.conditions)(&(self.state)());
        let material = material_line("paper", &PAPER);
        format!(
            r#"
            {conditions}
            decomposition.subdomains = 3
            {material}
            [body.cube]
            material = "paper"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0], cells = [2, 2, 2] }}"#
        )
    }

    fn levels(&self, _: Kind) -> Vec<usize> {
        vec![1, 2]
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let State { strain, stress, kappa } = (self.state)();
        let moved = |_, x: [f64; 3]| [strain[0] * x[0] + strain[3] * x[1], strain[1] * x[1], strain[2] * x[2]];
        vec![
            Error::new("displacement", run.worst_displacement(moved), EXACT),
            Error::new("von Mises stress", run.cells("von_mises", |_, _| von_mises(&stress)), EXACT),
            Error::new("plastic strain", run.cells("equivalent_plastic_strain", |_, _| kappa), EXACT),
        ]
    }
}
