//! The dual problem in the words of the QP solvers: inner products, and `F`, `P`, `M` as one quadratic function.

use crate::feti::operator::DualOperator;
use crate::feti::preconditioner::Preconditioner;
use crate::feti::projector::Projector;
use crate::feti::space::RowSpace;
use crate::monitor::timing::Timer;
use crate::qp::quadratic::{Operator, Projection, Quadratic, Space};

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

/// `F`, `P` and the preconditioner at one tangent.
pub struct Dual<'s, 'a> {
    /// `F`.
    pub operator: &'s mut DualOperator<'a>,
    /// `P`.
    pub projector: &'s Projector<'a>,
    /// `M`.
    pub preconditioner: Option<&'s mut Preconditioner<'a>>,
    /// Lower values of the own subdomains' tangents.
    pub tangents: &'s [Vec<f64>],
    /// Where the time goes.
    pub timer: &'s Timer,
}

impl Operator for Dual<'_, '_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.timer.time("dual operator", || self.operator.apply(x, y));
    }
}

impl Projection for Dual<'_, '_> {
    fn project(&mut self, x: &mut [f64]) {
        self.timer.time("coarse problem", || self.projector.project(x));
    }
}

impl Quadratic for Dual<'_, '_> {
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        let Some(preconditioner) = &mut self.preconditioner else { return false };
        let factors = &self.operator.factors;
        let stiffness = |own: usize| (&factors.symbolic(own).pattern, &self.tangents[own][..]);
        self.timer.time("preconditioner", || preconditioner.apply(stiffness, r, z));
        true
    }
}
