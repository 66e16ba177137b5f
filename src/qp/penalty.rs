//! The Hessian P A P + rho Q of the augmented Lagrangian, Q = I - P: one product with A and two projections.

use super::feasible::Face;
use super::mprgp::{Hessian, Point};
use super::quadratic::Quadratic;
use crate::vector::axpy;

/// The Hessian P A P + rho Q.
pub(super) struct Penalised<'a> {
    pub function: &'a mut dyn Quadratic,
    /// Of P A P.
    pub size: f64,
    pub penalty: f64,
    /// Work space, as long as x.
    pub inside: Vec<f64>,
}

impl Penalised<'_> {
    /// Removes from the defect its part in Ker G, which is rounding. The multiplier would collect it, rho times enlarged.
    pub fn clean(&mut self, point: &mut Point) {
        self.inside.copy_from_slice(&point.defect);
        self.function.project(&mut self.inside);
        axpy(-1.0, &self.inside, &mut point.defect);
        axpy(-self.penalty, &self.inside, &mut point.gradient);
    }
}

impl Hessian for Penalised<'_> {
    fn apply(&mut self, p: &[f64], hp: &mut [f64], defect: &mut [f64]) {
        self.inside.copy_from_slice(p);
        self.function.project(&mut self.inside);
        self.function.apply(&self.inside, hp);
        self.function.project(hp);
        for (i, d) in defect.iter_mut().enumerate() {
            *d = p[i] - self.inside[i];
            hp[i] += self.penalty * *d;
        }
    }

    fn enter(&mut self, face: &Face) {
        self.function.enter(face);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        self.function.precondition_on_face([self.size, self.penalty], r, z)
    }

    fn balance(&mut self, target: &[f64], x: &mut [f64]) {
        self.function.balance(target, x);
    }
}
