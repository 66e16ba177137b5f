//! The states that the kept factors were made from. A restart makes the factors again from these states, to the same bits. States
//! take little memory beside factors.

use std::sync::Arc;

use crate::assembly::flow::Flow;

/// The state that a factor was made from.
#[derive(Clone, Debug, PartialEq)]
pub enum Basis {
    /// No element yields.
    Elastic,
    /// The subdomain had this displacement, one step from what is committed now, and these directions of flow.
    At(Arc<Vec<f64>>, Flow),
}

/// The states of a subdomain's factors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bases {
    /// Of the whole tangent; `None` if there is no factor to go on with.
    pub factor: Option<Basis>,
    /// Of its interior block, for the preconditioner.
    pub interior: Option<Basis>,
    /// By how much the tangent has changed since the interior block was taken, relative to its diagonal.
    pub drift: f64,
}

impl Bases {
    /// Whether the factor is that of the elastic stiffness.
    pub fn is_elastic(&self) -> bool {
        self.factor == Some(Basis::Elastic)
    }

    /// Another state is committed: factors of plastic tangents, which depend on the former history, cannot be made again and
    /// are dropped.
    pub fn commit(&mut self) {
        let is_plastic = |basis: &Option<Basis>| matches!(basis, Some(Basis::At(..)));
        if is_plastic(&self.factor) || is_plastic(&self.interior) {
            self.factor = None;
        }
    }
}
