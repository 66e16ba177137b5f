//! `F = B K^+ B'`, applied subdomain by subdomain through the factors.

use super::Torn;
use super::factor::Factors;
use super::gather::Gather;

/// The dual operator; counts its applications.
pub struct DualOperator<'a> {
    /// Factors of all own subdomains.
    pub factors: Factors,
    gather: &'a Gather<'a>,
    torn: Torn,
    applications: usize,
}

impl<'a> DualOperator<'a> {
    /// On factors that will be computed before the first application.
    pub fn new(factors: Factors, gather: &'a Gather<'a>) -> Self {
        Self { factors, gather, torn: gather.zeros(), applications: 0 }
    }

    /// `y = F x`. One neighbour exchange.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        for (own, local) in self.torn.iter_mut().enumerate() {
            local.fill(0.0);
            self.gather.add_transpose_one(own, 1.0, x, local);
            self.factors.solve(own, local);
        }
        self.gather.apply(&self.torn, y);
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`: costs and counts as one application of F.
    pub fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64]) {
        self.applications += 1;
        for (own, local) in torn.iter_mut().enumerate() {
            self.gather.add_transpose_one(own, -1.0, x, local);
            self.factors.solve(own, local);
        }
        self.gather.apply(torn, y);
    }

    /// Applications of F so far.
    pub fn applications(&self) -> usize {
        self.applications
    }
}
