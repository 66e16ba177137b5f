//! The contact patch test: two blocks in series, pushed together across a gap. Exact where the meshes match.

use super::run::{Run, pressure_error};
use super::{Case, Demand, Error, PAPER, material_line};
use crate::analytic::blocks::{Pressed, TwoBlocks};
use crate::analytic::homogeneous::uniaxial;
use crate::element::Kind;

/// Two cubes of the paper's material.
pub struct Blocks {
    name: &'static str,
    about: &'static str,
    /// Between them.
    gap: f64,
    /// How far the top is pushed down.
    pushed: f64,
}

/// All of them.
pub const CASES: [Blocks; 2] = [
    Blocks { name: "patch-elastic", about: "two elastic blocks in contact", gap: 0.0, pushed: 3.0 },
    Blocks {
        name: "patch-plastic",
        about: "two blocks pushed together across a gap beyond yield",
        gap: 1.0,
        pushed: 10.0,
    },
];

const HEIGHT: f64 = 1000.0;

/// Relative to what is there; the solver's tolerances are below.
const EXACT: Demand = Demand::Below(1e-8);

impl Case for Blocks {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let (upper, down, paper) = (HEIGHT + self.gap, -self.pushed, material_line("paper", &PAPER));
        let block = |name: &str, z: f64| {
            format!(
                r#"
            [body.{name}]
            material = "paper"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, {z:?}], size = [{HEIGHT:?}, {HEIGHT:?}, {HEIGHT:?}], cells = [2, 2, 2] }}
            [support.{name}-back]
            surface = "{name}.xmin"
            fix = ["x"]
            [support.{name}-side]
            surface = "{name}.ymin"
            fix = ["y"]"#
            )
        };
        let blocks = block("lower", 0.0) + &block("upper", upper);
        format!(
            r#"
            {paper}
            decomposition.subdomains = 6
            contact.joint = {{ slave = "upper.zmin", master = "lower.zmax" }}
            {blocks}
            [support.bottom]
            surface = "lower.zmin"
            fix = ["z"]
            [support.top]
            surface = "upper.zmax"
            fix = ["z"]
            displacement = [0.0, 0.0, {down:?}]"#
        )
    }

    fn levels(&self, _: Kind) -> Vec<usize> {
        vec![1, 2]
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let Pressed { pressure, strain, .. } =
            TwoBlocks { material: PAPER, height: HEIGHT, gap: self.gap }.pressed(self.pushed);
        let lateral = uniaxial(&PAPER, -pressure)[1];
        let top = 2.0 * HEIGHT + self.gap;
        let moved = |body, [x, y, z]: [f64; 3]| {
            let down = if body == 0 { -strain * z } else { strain * (top - z) - self.pushed };
            [lateral * x, lateral * y, down]
        };
        vec![
            Error::new("displacement", run.worst_displacement(moved), EXACT),
            Error::new("von Mises stress", run.cells("von_mises", |_, _| pressure), EXACT),
            Error::new("contact pressure", pressure_error(&run.contacts(), |_| pressure), EXACT),
        ]
    }
}
