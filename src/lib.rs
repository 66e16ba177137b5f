//! Contact of elasto-plastic bodies in 3D by Total-FETI domain decomposition on MPI.
//!
//! The bodies of a [`scene`] are torn into subdomains. Rows of `B` glue these together again, hold the supports and keep contact
//! surfaces apart. Semismooth Newton linearises the plastic flow; each of its steps is a quadratic program for the multipliers
//! `lambda`, with six unknowns a subdomain in a coarse problem (Cermak and Sysala, "Total-FETI method for solving contact
//! elasto-plastic problems").
//!
//! Three calls lead from a text to results, on every rank of a [`comm::Comm`]:
//!
//! 1. [`scene::Scene::from_text`] reads and checks a scene;
//! 2. [`model::discretise`] makes meshes, subdomains, contact conditions and loads of it;
//! 3. [`study::solve`] follows the history of loads, and returns a summary and fields.
//!
//! [`results`] writes both to files; [`cli`] is the program `fetiplast`, which does all of it. [`qp`] has the solvers of quadratic
//! programs, which know of nothing else. The other modules are closed:
//! `docs/developing.md` leads through them.
//!
//! # Example
//!
//! Two bricks, the upper one pressed on the lower one; the largest contact pressure is that of the load.
//!
//! ```
//! use fetiplast::comm::solo::Solo;
//! use fetiplast::monitor::timing::Timer;
//! use fetiplast::scene::Scene;
//! use fetiplast::study::{Begin, solve};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     [material.steel]
//!     young = 210000.0
//!     poisson = 0.0
//!     yield_stress = 450.0
//!     hardening = 10000.0
//!     [body.lower]
//!     material = "steel"
//!     element = "hex8"
//!     brick = { origin = [0.0, 0.0, 0.0], size = [2.0, 2.0, 1.0], cells = [4, 4, 2] }
//!     [body.upper]
//!     material = "steel"
//!     element = "hex8"
//!     brick = { origin = [0.0, 0.0, 1.0], size = [2.0, 2.0, 1.0], cells = [4, 4, 2] }
//!     [support]
//!     ground = { surface = "lower.zmin", fix = ["x", "y", "z"] }
//!     guide = { surface = "upper.zmax", fix = ["x", "y"] }
//!     [load.press]
//!     surface = "upper.zmax"
//!     pressure = 100.0
//!     [contact.joint]
//!     slave = "upper.zmin"
//!     master = "lower.zmax"
//! "#;
//! let scene = Scene::from_text(text, "two bricks", 1, &[])?;
//! let discrete = fetiplast::model::discretise(&scene, &Solo)?;
//! let solved = solve(&scene, &discrete, &Solo, Begin::Rest, &Timer::start(), &mut ())?;
//! let pressure = solved.piece.last("contact_pressure").expect("there is a contact");
//! let largest = pressure.iter().copied().fold(0.0, f64::max);
//! println!("converged: {:?}, largest pressure: {largest:.3}", solved.summary.converged);
//! # assert_eq!(solved.summary.converged, Some(true));
//! # assert!((largest / 100.0 - 1.0).abs() < 1e-6, "{largest}");
//! # Ok(())
//! # }
//! ```

pub mod analytic;
pub mod cli;
pub mod comm;
pub mod heap;
pub mod material;
pub mod mesh;
pub mod model;
pub mod monitor;
pub mod qp;
pub mod record;
pub mod results;
pub mod scene;
pub mod study;

mod assembly;
mod constraint;
mod contact;
mod decomposition;
mod element;
mod estimate;
mod feti;
mod newton;

mod restart;
mod simd;
mod sizing;
mod span;
mod sparse;
mod tensor;
mod vector;
mod verify;
mod work;

#[cfg(test)]
mod extension;
#[cfg(test)]
mod fixture;
#[cfg(test)]
mod random;

/// What `benches/kernels.rs` measures; no part of the interface.
#[doc(hidden)]
pub mod kernels {
    pub use crate::assembly::{Region, stiffness};
    pub use crate::decomposition::Subdomain;
    pub use crate::feti::coarse::Coarse;
    pub use crate::feti::coarse::face::CoarseFace;
    pub use crate::feti::dual::Interconnection;
    pub use crate::feti::inverse::factor::{Factors, analyse};
    pub use crate::feti::inverse::schur::Schur;
    pub use crate::sparse::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
}
