//! The dual problem's pieces in the words of the QP solvers.

use crate::feti::operator::DualOperator;
use crate::feti::projector::Projector;
use crate::feti::space::RowSpace;
use crate::monitor::timing::Timer;
use crate::qp::quadratic::{Operator, Projection, Space};

/// Inner products of multipliers.
pub struct Multipliers<'a>(pub &'a RowSpace<'a>, pub &'a Timer);

impl Space for Multipliers<'_> {
    fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        self.1.time("inner products", || self.0.dots(pairs))
    }

    fn minimum(&self, mine: f64) -> f64 {
        self.1.time("inner products", || -self.0.maximum(-mine))
    }
}

/// `F`.
pub struct Flexibility<'s, 'a>(pub &'s mut DualOperator<'a>, pub &'s Timer);

impl Operator for Flexibility<'_, '_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.1.time("dual operator", || self.0.apply(x, y));
    }
}

/// `P`.
pub struct Balanced<'s, 'a>(pub &'s mut Projector<'a>, pub &'s Timer);

impl Projection for Balanced<'_, '_> {
    fn project(&mut self, x: &mut [f64]) {
        self.1.time("coarse problem", || self.0.project(x));
    }
}
