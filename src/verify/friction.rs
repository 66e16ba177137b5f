//! Blocks on a rigid plane with friction: homogeneous states that stick or slip, exact on any mesh, on both sides of the threshold.
//!
//! A block of height `h` that is pressed with `p` and whose top is moved by `U` sticks up to `U = mu p h / G`. Beyond it slips by the
//! rest. (`nu = 0`, so that pressing does not widen it.)

use super::run::Run;
use super::{Case, Demand, Error};
use crate::element::Kind;

/// Coefficient of friction.
const FRICTION: f64 = 0.3;
/// Pressure.
const PRESSURE: f64 = 100.0;
/// Shear modulus of a material with Young's modulus 210000 and no contraction.
const SHEAR: f64 = 105_000.0;
/// A rigid plane under what is drawn above `z = 0`, as a key of a scene.
pub(super) const FLOOR: &str = "rigid = { plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }";
/// Edge of the block.
const EDGE: f64 = 1000.0;

/// A cube whose top is moved.
pub struct Block {
    name: &'static str,
    about: &'static str,
    moved: f64,
}

/// Below and beyond the threshold, which is 0.2857.
pub const BLOCKS: [Block; 2] = [
    Block { name: "friction-stick", about: "a block that sticks to a plane", moved: 0.2 },
    Block { name: "friction-slip", about: "a block that slips on a plane", moved: 1.0 },
];

impl Block {
    /// Shear stress.
    fn shear(&self) -> f64 {
        (SHEAR * self.moved / EDGE).min(FRICTION * PRESSURE)
    }

    /// What it slips.
    fn slip(&self) -> f64 {
        self.moved - self.shear() * EDGE / SHEAR
    }
}

const EXACT: Demand = Demand::Below(1e-8);

impl Case for Block {
    fn title(&self) -> [&'static str; 2] {
        [self.name, self.about]
    }

    fn scene(&self) -> String {
        let (moved, shear) = (self.moved, self.shear());
        format!(
            r#"
            material.steel = {{ young = 210000.0, poisson = 0.0 }}
            decomposition.subdomains = 3
            [body.cube]
            material = "steel"
            element = "tet4"
            brick = {{ origin = [0.0, 0.0, 0.0], size = [{EDGE:?}, {EDGE:?}, {EDGE:?}], cells = [2, 2, 2] }}
            [support]
            top = {{ surface = "cube.zmax", fix = ["x"], displacement = [{moved:?}, 0.0, 0.0] }}
            side = {{ surface = "cube.ymin", fix = ["y"] }}
            [load]
            top = {{ surface = "cube.zmax", traction = [0.0, 0.0, {:?}] }}
            right = {{ surface = "cube.xmax", traction = [0.0, 0.0, {shear:?}] }}
            left = {{ surface = "cube.xmin", traction = [0.0, 0.0, {:?}] }}
            [contact.floor]
            slave = "cube.zmin"
            {FLOOR}
            friction = {FRICTION:?}"#,
            -PRESSURE, -shear
        )
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        if element == Kind::Tet10 { vec![1] } else { vec![1, 2] }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let (shear, slip) = (self.shear(), self.slip());
        let moved = |_, x: [f64; 3]| [slip + shear / SHEAR * x[2], 0.0, -PRESSURE / (2.0 * SHEAR) * x[2]];
        let von_mises = (PRESSURE * PRESSURE + 3.0 * shear * shear).sqrt();
        let dissipation = run.summary().state.friction["floor"].dissipation;
        let force = shear * EDGE * EDGE;
        vec![
            Error::new("displacement", run.worst_displacement(moved), EXACT),
            Error::new("von Mises stress", run.cells("von_mises", |_, _| von_mises), EXACT),
            Error::new("dissipation", (dissipation - force * slip) / (force * self.moved), EXACT),
        ]
    }
}
