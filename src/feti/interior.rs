//! The block `K_ii` of the unknowns that no constraint row touches, and its sparse Cholesky factor.

use std::rc::Rc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::prelude::MatMut;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Par, Side, Spec};

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
    cholesky: SymbolicCholesky<u32>,
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
        let n = interior.len();
        let forward: Vec<u32> = whole.order.iter().map(|&dof| place[dof as usize]).filter(|&k| k != u32::MAX).collect();
        let mut inverse = vec![0; n];
        forward.iter().enumerate().for_each(|(new, &old)| inverse[old as usize] = new as u32);
        let cholesky = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &column_begin, None, &rows),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .expect("an interior factor is smaller than the whole one");
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
    values: Vec<Vec<f64>>,
    scratch: MemBuffer,
    block: Vec<f64>,
}

impl InteriorFactors {
    /// Space for the factors.
    pub fn new(symbolic: Vec<Rc<InteriorSymbolic>>) -> Self {
        let request = |s: &Rc<InteriorSymbolic>| {
            StackReq::or(
                s.cholesky.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()),
                s.cholesky.solve_in_place_scratch::<f64>(1, Par::Seq),
            )
        };
        let scratch = MemBuffer::new(StackReq::any_of(&symbolic.iter().map(request).collect::<Vec<_>>()));
        let values = symbolic.iter().map(|s| vec![0.0; s.cholesky.len_val()]).collect();
        Self { symbolic, values, scratch, block: Vec::new() }
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
        let n = interior.len();
        self.block.clear();
        self.block.extend(positions.iter().map(|&at| stiffness[at as usize]));
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, column_begin, None, rows);
        cholesky
            .factorize_numeric_llt(
                &mut self.values[own],
                SparseColMatRef::new(pattern, &self.block[..]),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Spec::default(),
            )
            .map(|_| ())
            .map_err(|_| NotDefinite { subdomain, pivot: 0, dofs: n })
    }

    /// Replaces the interior part of `u`, zero on entry, by the one that is in equilibrium with its boundary part:
    /// `u_i = -K_ii^-1 K_ib u_b`. `values` are the lower values of the stiffness that was factorised.
    pub fn extend(&mut self, own: usize, pattern: &Pattern, values: &[f64], u: &mut [f64]) {
        let InteriorSymbolic { interior, cholesky, .. } = &*self.symbolic[own];
        let mut forces = vec![0.0; u.len()];
        pattern.multiply_add(values, u, &mut forces);
        let mut inside: Vec<f64> = interior.iter().map(|&dof| -forces[dof as usize]).collect();
        let n = inside.len();
        LltRef::new(cholesky, &self.values[own]).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut inside, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        interior.iter().zip(&inside).for_each(|(&dof, x)| u[dof as usize] = *x);
    }
}
