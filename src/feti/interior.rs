//! The block `K_ii` of the unknowns that no constraint row touches, and its sparse Cholesky factor.

use std::rc::Rc;

use super::cholesky::{Analysis, Factor, Lower, Precision, Workspace};
use super::factor::{NotDefinite, Symbolic};
use crate::assembly::pattern::Pattern;

/// Which unknowns are interior, and the analysis of their block.
pub struct InteriorSymbolic {
    /// Local unknowns that rows touch, ascending.
    pub boundary: Vec<u32>,
    /// The others, ascending.
    pub interior: Vec<u32>,
    column_begin: Vec<u32>,
    rows: Vec<u32>,
    /// Where each entry stands among the values of the whole matrix.
    positions: Vec<u32>,
    cholesky: Analysis,
}

impl InteriorSymbolic {
    /// Of a subdomain whose rows touch the unknowns `boundary` (ascending).
    fn new(whole: &Symbolic, boundary: Vec<u32>) -> Self {
        let pattern = &whole.pattern;
        let mut place = vec![0_u32; pattern.dofs()];
        boundary.iter().for_each(|&dof| place[dof as usize] = u32::MAX);
        let interior: Vec<u32> = (0..pattern.dofs() as u32).filter(|&dof| place[dof as usize] == 0).collect();
        interior.iter().enumerate().for_each(|(k, &dof)| place[dof as usize] = k as u32);
        let (mut column_begin, mut rows, mut positions) = (vec![0], Vec::new(), Vec::new());
        for &column in &interior {
            for at in pattern.column_begin[column as usize]..pattern.column_begin[column as usize + 1] {
                let row = place[pattern.rows[at as usize] as usize];
                if row != u32::MAX {
                    rows.push(row);
                    positions.push(at);
                }
            }
            column_begin.push(rows.len() as u32);
        }
        // The whole matrix' nested dissection, without the boundary.
        let order: Vec<u32> = whole.order.iter().map(|&dof| place[dof as usize]).filter(|&k| k != u32::MAX).collect();
        let cholesky = Analysis::ordered(Lower { column_begin: &column_begin, rows: &rows }, &order);
        Self { boundary, interior, column_begin, rows, positions, cholesky }
    }
}

/// Analyses all subdomains, sharing among those with equal analysis of the whole and equal boundary.
pub fn analyse(whole: &[Rc<Symbolic>], boundaries: Vec<Vec<u32>>) -> Vec<Rc<InteriorSymbolic>> {
    let mut result: Vec<Rc<InteriorSymbolic>> = Vec::new();
    for (own, boundary) in boundaries.into_iter().enumerate() {
        let twin = (0..own).find(|&k| Rc::ptr_eq(&whole[k], &whole[own]) && result[k].boundary == boundary);
        result.push(match twin {
            Some(k) => Rc::clone(&result[k]),
            None => Rc::new(InteriorSymbolic::new(&whole[own], boundary)),
        });
    }
    result
}

/// Numeric factors of the interior blocks of all own subdomains.
pub struct InteriorFactors {
    symbolic: Vec<Rc<InteriorSymbolic>>,
    factors: Vec<Factor>,
    workspace: Workspace,
    block: Vec<f64>,
}

impl InteriorFactors {
    /// Space for the factors.
    pub fn new(symbolic: Vec<Rc<InteriorSymbolic>>, precision: Precision) -> Self {
        let workspace = Workspace::new(symbolic.iter().map(|s| &s.cholesky));
        let factors = symbolic.iter().map(|s| Factor::new(&s.cholesky, precision)).collect();
        Self { symbolic, factors, workspace, block: Vec::new() }
    }

    /// Which unknowns of an own subdomain are interior.
    pub fn symbolic(&self, own: usize) -> &InteriorSymbolic {
        &self.symbolic[own]
    }

    /// Factorises the interior block of the stiffness with these lower values.
    ///
    /// # Errors
    /// If it is not positive definite; `subdomain` is named in the message.
    pub fn factorise(&mut self, own: usize, subdomain: usize, stiffness: &[f64]) -> Result<(), NotDefinite> {
        let InteriorSymbolic { interior, column_begin, rows, positions, cholesky, .. } = &*self.symbolic[own];
        self.block.clear();
        self.block.extend(positions.iter().map(|&at| stiffness[at as usize]));
        let (lower, factor) = (Lower { column_begin, rows }, &mut self.factors[own]);
        let mut outcome = self.workspace.factorise(cholesky, lower, &self.block, factor);
        if outcome.is_err() && factor.precision() == Precision::Single {
            *factor = Factor::new(cholesky, Precision::Double);
            outcome = self.workspace.factorise(cholesky, lower, &self.block, factor);
        }
        outcome.map_err(|breakdown| NotDefinite { subdomain, pivot: breakdown.place, dofs: interior.len() })
    }

    /// Replaces the interior part of `u`, zero on entry, by the one that is in equilibrium with its boundary part:
    /// `u_i = -K_ii^-1 K_ib u_b`. `values` are the lower values of the stiffness that was factorised.
    pub fn extend(&mut self, own: usize, pattern: &Pattern, values: &[f64], u: &mut [f64]) {
        let InteriorSymbolic { interior, cholesky, .. } = &*self.symbolic[own];
        let mut forces = vec![0.0; u.len()];
        pattern.multiply_add(values, u, &mut forces);
        let mut inside: Vec<f64> = interior.iter().map(|&dof| -forces[dof as usize]).collect();
        self.workspace.solve(cholesky, &self.factors[own], &mut inside);
        interior.iter().zip(&inside).for_each(|(&dof, x)| u[dof as usize] = *x);
    }
}
