//! `B B'`: the squares of the rows' lengths, but for rows that are not orthogonal to each other, contact rows that share nodes.

use super::gram::Gram;
use crate::constraint::Constraints;

/// `B B'` of the rows of this rank.
pub struct Coupling {
    /// Squared length of each row.
    squares: Vec<f64>,
    /// The contact rows of each block where it is not diagonal.
    grams: Vec<Gram>,
}

/// Share of the deepest overlap that is round-off.
const ROUNDING: f64 = 1e-12;

impl Coupling {
    /// Of the rows of this rank.
    pub fn new(constraints: &Constraints) -> Self {
        let contacts = |rows: &std::ops::Range<usize>| -> Vec<usize> {
            rows.clone().filter(|&row| !constraints.rows[row].law().always_holds()).collect()
        };
        let several = constraints.blocks.iter().map(contacts).filter(|rows| rows.len() > 1);
        Self {
            squares: constraints.rows.iter().map(|row| row.length * row.length).collect(),
            grams: several.map(|rows| Gram::new(constraints, rows, false)).filter(Gram::is_coupled).collect(),
        }
    }

    /// `rows = (B B')^-1 rows` with the kept rows of `B`; the others get zero where rows are coupled. Local.
    pub fn solve(&mut self, rows: &mut [f64], kept: impl Fn(usize) -> bool) {
        let x = rows.to_vec();
        rows.iter_mut().zip(&self.squares).for_each(|(row, square)| *row /= square);
        for gram in &mut self.grams {
            gram.factorise(|_, _| 1.0, &kept);
            gram.solve(&x, rows);
        }
    }

    /// From the slack `c - B u` of all rows, and the part `x` of it that is to be closed, to multipliers `x` such that `u + B'x`
    /// does so. Local.
    ///
    /// Coupled rows that are violated are closed; where that violates others these are closed too.
    pub fn close(&mut self, constraints: &Constraints, slack: &[f64], x: &mut [f64]) {
        let depth = |row: usize, slack: f64| constraints.rows[row].law().violation(slack).abs();
        x.iter_mut().zip(&self.squares).for_each(|(x, square)| *x /= square);
        for gram in &mut self.grams {
            let rows = gram.rows().to_vec();
            let deepest = rows.iter().fold(0.0_f64, |deepest, &row| deepest.max(depth(row, slack[row])));
            let mut closed: Vec<bool> = rows.iter().map(|&row| depth(row, slack[row]) > 0.0).collect();
            rows.iter().for_each(|&row| x[row] = 0.0);
            while closed.contains(&true) {
                let is_closed = |row: usize| closed[rows.binary_search(&row).expect("of this block")];
                gram.factorise(|_, _| 1.0, is_closed);
                gram.solve(slack, x);
                let mut left: Vec<f64> = rows.iter().map(|&row| slack[row]).collect();
                gram.subtract_product(x, &mut left);
                let mut grown = false;
                for ((closed, left), &row) in closed.iter_mut().zip(left).zip(&rows) {
                    let joins = !*closed && depth(row, left) > ROUNDING * deepest;
                    *closed |= joins;
                    grown |= joins;
                }
                if !grown {
                    break;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Setup, not_matching, on_ranks, same_on_any_ranks, two_bricks};

    #[test]
    fn orthogonal_rows_are_not_coupled() {
        on_ranks(&two_bricks(&[]), 2, |setup| assert!(Coupling::new(&setup.discrete.constraints).grams.is_empty()));
    }

    #[test]
    fn closing_leaves_no_coupled_row_violated_and_is_the_same_on_any_ranks() {
        let close = |setup: &Setup| {
            let mut coupling = Coupling::new(&setup.discrete.constraints);
            // Many rows are violated, others nearly.
            let slack: Vec<f64> = setup.multipliers(3).iter().map(|&s| if s > 0.0 { 1e-3 * s } else { s }).collect();
            let mut x = vec![0.0; slack.len()];
            coupling.close(&setup.discrete.constraints, &slack, &mut x);
            let (mut torn, mut taken) = (setup.gather.zeros(), slack.clone());
            setup.gather.add_transpose(1.0, &x, &mut torn);
            setup.gather.apply(&torn, &mut taken);
            let coupled: Vec<usize> = coupling.grams.iter().flat_map(|gram| gram.rows().to_vec()).collect();
            if setup.comm.size() == 1 {
                assert!(coupled.iter().any(|&row| slack[row] >= 0.0 && x[row] != 0.0), "some rows join");
                assert!(coupled.iter().any(|&row| slack[row] >= 0.0 && x[row] == 0.0), "some stay open");
            }
            assert!(coupled.iter().all(|&row| slack[row] - taken[row] > -1e-11));
            setup.owned(&x)
        };
        same_on_any_ranks(&not_matching(&[]), close);
    }
}
