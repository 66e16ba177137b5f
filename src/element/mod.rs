//! Finite elements: their nodes and faces ([`kind`]), where they are integrated, and strains, forces and stiffness there
//! ([`point`]); finer points for what varies inside of one ([`sample`]). Elements take tensors and know no material.

pub mod hex8;
pub mod kind;
mod map;
pub mod point;
pub mod sample;
pub mod tet10;
pub mod tet4;

pub use kind::Kind;
pub use point::{Nodal, Point};

/// An element of smaller shape has no volume, or a negative one: it is lost in the rounding of coordinates.
pub const DEGENERATE: f64 = 1e-13;

/// `f(points, arguments)`, where `points` is the function that makes the integration points of a kind from its nodes.
macro_rules! by_kind {
    ($kind:expr, $function:ident($($argument:expr),*)) => {
        match $kind {
            $crate::element::Kind::Tet4 => $function($crate::element::tet4::points, $($argument),*),
            $crate::element::Kind::Tet10 => $function($crate::element::tet10::points, $($argument),*),
            $crate::element::Kind::Hex8 => $function($crate::element::hex8::points, $($argument),*),
        }
    };
}
pub(crate) use by_kind;

#[cfg(test)]
mod tests;
