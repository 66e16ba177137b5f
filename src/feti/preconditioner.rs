//! Preconditioners of the dual operator: `B_D S B_D'` with `S` the boundary block of the stiffness (lumped) or its Schur
//! complement (Dirichlet); Farhat, Mandel and Roux 1994, with the stiffness scaling of [`super::scaling`].

use super::Torn;
use super::gather::Gather;
use super::interior::InteriorFactors;
use super::scaling::Scaling;
use crate::assembly::pattern::Pattern;

/// Approximate inverse of `F`; counts its applications.
pub struct Preconditioner<'a> {
    gather: &'a Gather<'a>,
    /// Interior factors of the Dirichlet preconditioner; none for the lumped one.
    pub interior: Option<InteriorFactors>,
    /// Scaling of the rows; set by the caller before the first application, and when tangents or rows change.
    pub scaling: Scaling,
    /// Local unknowns that rows touch, for each own subdomain.
    boundary: Vec<Vec<u32>>,
    torn: Torn,
    rows: Vec<f64>,
    applications: usize,
}

/// Unknowns of each own subdomain that rows touch, ascending.
pub fn boundaries(gather: &Gather, own: usize) -> Vec<Vec<u32>> {
    (0..own)
        .map(|own| {
            let mut dofs: Vec<u32> = gather.entries(own).iter().map(|entry| entry.dof).collect();
            dofs.sort_unstable();
            dofs.dedup();
            dofs
        })
        .collect()
}

impl<'a> Preconditioner<'a> {
    /// Dirichlet with interior factors, lumped without.
    pub fn new(gather: &'a Gather<'a>, interior: Option<InteriorFactors>) -> Self {
        let torn = gather.zeros();
        let boundary = boundaries(gather, torn.len());
        Self {
            gather,
            interior,
            scaling: Scaling::default(),
            boundary,
            rows: vec![0.0; gather.rows()],
            torn,
            applications: 0,
        }
    }

    /// `y = B_D S B_D' x`, `stiffness(own)` being the sparsity and the lower values. One neighbour exchange.
    pub fn apply<'k>(&mut self, stiffness: impl Fn(usize) -> (&'k Pattern, &'k [f64]), x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        self.scaling.solve(x, &mut self.rows);
        for own in 0..self.torn.len() {
            let (pattern, values) = stiffness(own);
            let flexibility = &self.scaling.flexibility[own];
            let mut t = vec![0.0; pattern.dofs()];
            self.gather.add_transpose_one(own, 1.0, &self.rows, &mut t);
            t.iter_mut().zip(flexibility).for_each(|(t, f)| *t *= f);
            let mut forces = vec![0.0; t.len()];
            if let Some(factors) = &mut self.interior {
                factors.extend(own, pattern, values, &mut t);
            }
            pattern.multiply_add(values, &t, &mut forces);
            let out = &mut self.torn[own];
            out.fill(0.0);
            for &dof in &self.boundary[own] {
                out[dof as usize] = flexibility[dof as usize] * forces[dof as usize];
            }
        }
        self.gather.apply(&self.torn, &mut self.rows);
        self.scaling.solve(&self.rows, y);
    }

    /// Adds to a torn displacement what closes the rows' `defect = c - B u`: `B_D' defect` on the boundary and, with
    /// interior factors, the interior that follows it without force. Local.
    pub fn mend<'k>(&mut self, stiffness: impl Fn(usize) -> (&'k Pattern, &'k [f64]), defect: &[f64], u: &mut Torn) {
        self.scaling.solve(defect, &mut self.rows);
        for (own, u) in u.iter_mut().enumerate() {
            let (pattern, values) = stiffness(own);
            let mut t = vec![0.0; u.len()];
            self.gather.add_transpose_one(own, 1.0, &self.rows, &mut t);
            t.iter_mut().zip(&self.scaling.flexibility[own]).for_each(|(t, f)| *t *= f);
            if let Some(factors) = &mut self.interior {
                factors.extend(own, pattern, values, &mut t);
            }
            u.iter_mut().zip(&t).for_each(|(u, t)| *u += t);
        }
    }

    /// Applications so far.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

#[cfg(test)]
mod tests;
