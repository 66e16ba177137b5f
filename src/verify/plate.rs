//! A plate on a rigid plane with much friction: it leaves the plane at one end, slips, and sticks in the middle.
//!
//! The half of Code_Aster's SSNV128: a square of 40 mm in plane strain, in its plane of symmetry held along x; 50 MPa press on its top, and 150 MPa
//! on its side. Displacements of the corner A and of C, 5 mm beside it, are means of several programs (Feijoo, Barbosa, Zouain),
//! known to two to three digits.

use super::run::Run;
use super::{Case, Demand, Error};
use crate::element::Kind;

/// A plate that is pressed on its top and its side.
pub struct Plate;

/// Where, and how far it moves along x.
const KNOWN: [(&str, f64, f64); 2] = [("A", 0.0, 2.86e-2), ("C", 5.0, 2.28e-2)];

impl Case for Plate {
    fn title(&self) -> [&'static str; 2] {
        ["friction-plate", "a plate pressed along a plane with friction (SSNV128)"]
    }

    fn scene(&self) -> String {
        r#"
        material.steel = { young = 130000.0, poisson = 0.2 }
        decomposition.subdomains = 4
        contact.floor = { slave = "plate.zmin", friction = 1.0, rigid = { plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } } }
        [support]
        middle = { surface = "plate.xmax", fix = ["x"] }
        front = { surface = "plate.ymin", fix = ["y"] }
        back = { surface = "plate.ymax", fix = ["y"] }
        [load]
        top = { surface = "plate.zmax", pressure = 50.0 }
        side = { surface = "plate.xmin", pressure = 150.0 }
        [body.plate]
        material = "steel"
        element = "tet4"
        brick = { origin = [0.0, 0.0, 0.0], size = [40.0, 2.5, 40.0], cells = [16, 1, 16] }"#
            .to_owned()
    }

    fn levels(&self, element: Kind) -> Vec<usize> {
        if element == Kind::Tet10 { vec![1] } else { vec![1, 2] }
    }

    fn errors(&self, run: &Run) -> Vec<Error> {
        let error = |(name, at, known): (&'static str, f64, f64)| {
            let there = |_, [x, _, z]: [f64; 3]| (x - at).abs() < 1e-6 && z.abs() < 1e-6;
            Error::new(name, run.nodes(there, |_, u| u[0] / known - 1.0), Demand::Finest(0.02))
        };
        KNOWN.map(error).to_vec()
    }
}
