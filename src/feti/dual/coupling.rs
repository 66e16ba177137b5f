//! `B B'`: the squares of the rows' lengths, but for rows that are not orthogonal to each other, contact rows that share nodes.
//!
//! Where ranks hold all of such rows they have its Cholesky factors. Where they hold parts ([`crate::constraint::reach`]) it is inverted by
//! conjugate gradients with the rows' lengths: neighbours have little in common, so it is well conditioned.

use std::ops::Range;

use super::gather::Gather;
use super::gram::{Gram, Products};
use super::space::RowSpace;
use crate::constraint::Constraints;
use crate::vector::axpy;

/// `B B'` of the rows of this rank.
pub struct Coupling {
    /// Squared length of each row.
    squares: Vec<f64>,
    /// The contact rows of each block where it is not diagonal.
    grams: Vec<Gram>,
    /// The contact rows of parts of large components, ascending; any rank has them if `has_parts`.
    parts: Vec<usize>,
    has_parts: bool,
}

/// Share of the deepest overlap that is round-off.
const ROUNDING: f64 = 1e-12;

/// Residuals of conjugate gradients are reduced by this factor, and are rounding if they cannot be within so many iterations.
const REDUCTION: f64 = 1e-15;
const ITERATIONS: usize = 200;

impl Coupling {
    /// Of the rows of this rank.
    pub fn new(constraints: &Constraints) -> Self {
        let changes = |row: &usize| !constraints.rows[*row].law().always_holds();
        let contacts = |rows: &Range<usize>| -> Vec<usize> { rows.clone().filter(changes).collect() };
        let of = |part: bool| constraints.blocks.iter().zip(&constraints.is_part).filter(move |block| *block.1 == part);
        let several = of(false).map(|(rows, _)| contacts(rows)).filter(|rows| rows.len() > 1);
        let products = several.map(|rows| Products::new(constraints, rows, false, |_, _| 1.0));
        Self {
            squares: constraints.rows.iter().map(|row| row.length * row.length).collect(),
            grams: products.filter(Products::is_coupled).map(Gram::new).collect(),
            parts: of(true).flat_map(|(rows, _)| contacts(rows)).collect(),
            has_parts: constraints.has_parts,
        }
    }

    /// `rows = (B B')^-1 rows` with the kept rows of `B`; the others get zero where rows are coupled. Collective.
    pub fn solve(&mut self, (gather, space): (&Gather, &RowSpace), rows: &mut [f64], kept: impl Fn(usize) -> bool) {
        let x = rows.to_vec();
        rows.iter_mut().zip(&self.squares).for_each(|(row, square)| *row /= square);
        for gram in &mut self.grams {
            gram.factorise(&kept);
            gram.solve(&x, rows);
        }
        self.solve_parts((gather, space), &x, rows, kept);
    }

    /// From the slack `c - B u` of all rows, and the part `x` of it that is to be closed, to multipliers `x` such that `u + B'x`
    /// does so. Collective.
    ///
    /// Coupled rows that are violated are closed; where that violates others these are closed too.
    pub fn close(
        &mut self,
        (gather, space): (&Gather, &RowSpace),
        constraints: &Constraints,
        slack: &[f64],
        x: &mut [f64],
    ) {
        let depth = |row: usize, slack: f64| constraints.rows[row].law().violation(slack).abs();
        x.iter_mut().zip(&self.squares).for_each(|(x, square)| *x /= square);
        for gram in &mut self.grams {
            let rows = gram.rows().to_vec();
            let deepest = rows.iter().fold(0.0_f64, |deepest, &row| deepest.max(depth(row, slack[row])));
            let mut closed: Vec<bool> = rows.iter().map(|&row| depth(row, slack[row]) > 0.0).collect();
            rows.iter().for_each(|&row| x[row] = 0.0);
            while closed.contains(&true) {
                let is_closed = |row: usize| closed[rows.binary_search(&row).expect("of this block")];
                gram.factorise(is_closed);
                gram.solve(slack, x);
                let mut left: Vec<f64> = rows.iter().map(|&row| slack[row]).collect();
                gram.subtract_product(x, &mut left);
                if !join(&rows, &mut closed, |k| depth(rows[k], left[k]), deepest) {
                    break;
                }
            }
        }
        if !self.has_parts {
            return;
        }
        let depths = self.parts.iter().map(|&row| depth(row, slack[row]));
        let deepest = space.maximum(depths.clone().fold(0.0, f64::max));
        let mut closed: Vec<bool> = depths.map(|depth| depth > 0.0).collect();
        self.parts.iter().for_each(|&row| x[row] = 0.0);
        let mut grown = deepest > 0.0;
        while grown {
            let is_closed = |row: usize| closed[self.parts.binary_search(&row).expect("of these")];
            self.solve_parts((gather, space), slack, x, is_closed);
            let mut product = vec![0.0; x.len()];
            multiply(gather, x, &mut product);
            let left = |k: usize| slack[self.parts[k]] - product[self.parts[k]];
            let joins = join(&self.parts, &mut closed, |k| depth(self.parts[k], left(k)), deepest);
            grown = space.counts([u64::from(joins)]) != [0];
        }
    }

    /// `y = (B B')^-1 x` on the contact rows of parts that are kept, and zero on the others. Collective.
    fn solve_parts(
        &self,
        (gather, space): (&Gather, &RowSpace),
        x: &[f64],
        y: &mut [f64],
        kept: impl Fn(usize) -> bool,
    ) {
        if !self.has_parts {
            return;
        }
        let rows: Vec<usize> = self.parts.iter().copied().filter(|&row| kept(row)).collect();
        let only = |of: &[f64]| {
            let mut only = vec![0.0; of.len()];
            rows.iter().for_each(|&row| only[row] = of[row]);
            only
        };
        let scaled = |of: &[f64]| {
            let mut scaled = vec![0.0; of.len()];
            rows.iter().for_each(|&row| scaled[row] = of[row] / self.squares[row]);
            scaled
        };
        let (mut residual, mut found) = (only(x), vec![0.0; x.len()]);
        let mut direction = scaled(&residual);
        let mut square = space.dots(&[(&residual, &direction)])[0];
        let least = square * REDUCTION * REDUCTION;
        let mut product = vec![0.0; x.len()];
        for _ in 0..ITERATIONS {
            if square <= least {
                break;
            }
            multiply(gather, &direction, &mut product);
            product = only(&product);
            let step = square / space.dots(&[(&direction, &product)])[0];
            axpy(step, &direction, &mut found);
            axpy(-step, &product, &mut residual);
            let scaled = scaled(&residual);
            let next = space.dots(&[(&residual, &scaled)])[0];
            direction.iter_mut().zip(scaled).for_each(|(d, z)| *d = z + next / square * *d);
            square = next;
        }
        self.parts.iter().for_each(|&row| y[row] = found[row]);
    }
}

/// `y = B B' x`. One neighbour exchange.
fn multiply(gather: &Gather, x: &[f64], y: &mut [f64]) {
    let mut moved = gather.zeros();
    gather.add_transpose(1.0, x, &mut moved);
    gather.apply(&moved, y);
}

/// Lets rows that are too deep join those that are closed. Whether any did.
fn join(rows: &[usize], closed: &mut [bool], depth: impl Fn(usize) -> f64, deepest: f64) -> bool {
    let mut grown = false;
    for k in 0..rows.len() {
        let joins = !closed[k] && depth(k) > ROUNDING * deepest;
        closed[k] |= joins;
        grown |= joins;
    }
    grown
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Setup, long_contact, not_matching, on_ranks, same_on_any_ranks, two_bricks};

    #[test]
    fn orthogonal_rows_are_not_coupled() {
        on_ranks(&two_bricks(&[]), 2, |setup| {
            let coupling = Coupling::new(&setup.discrete.constraints);
            assert!(coupling.grams.is_empty() && coupling.parts.is_empty());
        });
    }

    #[test]
    fn closing_leaves_no_coupled_row_violated_and_is_the_same_on_any_ranks() {
        let close = |setup: &Setup, is_large: bool| {
            let mut coupling = Coupling::new(&setup.discrete.constraints);
            let around = (&setup.gather, &setup.space);
            // Many rows are violated, others nearly.
            let slack: Vec<f64> = setup.multipliers(3).iter().map(|&s| if s > 0.0 { 1e-3 * s } else { s }).collect();
            let mut x = vec![0.0; slack.len()];
            coupling.close(around, &setup.discrete.constraints, &slack, &mut x);
            let (mut torn, mut taken) = (setup.gather.zeros(), slack.clone());
            setup.gather.add_transpose(1.0, &x, &mut torn);
            setup.gather.apply(&torn, &mut taken);
            let of_blocks = coupling.grams.iter().flat_map(|gram| gram.rows().to_vec());
            let coupled: Vec<usize> = of_blocks.chain(coupling.parts.iter().copied()).collect();
            assert_eq!(coupling.has_parts, is_large);
            if setup.comm.size() == 1 {
                assert!(coupled.iter().any(|&row| slack[row] >= 0.0 && x[row] != 0.0), "some rows join");
                assert!(coupled.iter().any(|&row| slack[row] >= 0.0 && x[row] == 0.0), "some stay open");
            }
            assert!(coupled.iter().all(|&row| slack[row] - taken[row] > -1e-11));
            // Of all rows that are kept, the multipliers are those of their forces.
            let kept = |row: usize| !setup.rows()[row].law().always_holds() && slack[row] < 0.0;
            let mut wanted: Vec<f64> = setup.multipliers(4);
            (0..wanted.len()).filter(|&row| !kept(row)).for_each(|row| wanted[row] = 0.0);
            let (mut torn, mut found) = (setup.gather.zeros(), wanted.clone());
            setup.gather.add_transpose(1.0, &wanted, &mut torn);
            setup.gather.apply(&torn, &mut found);
            coupling.solve(around, &mut found, kept);
            assert!(coupled.iter().all(|&row| (found[row] - wanted[row]).abs() < 1e-11));
            setup.owned(&[x, found].concat())
        };
        same_on_any_ranks(&long_contact(), |setup| close(setup, true));
        same_on_any_ranks(&not_matching(&[]), |setup| close(setup, false));
    }
}
