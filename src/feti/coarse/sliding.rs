//! Pairs of rows of which one combination is kept: surfaces that slide one way and are held across it.
//!
//! Where contact slips, friction along the slip is known and only the multiplier across it is free. Both friction rows are kept
//! then, and vectors on them are projected onto the direction across: `Pi x = a a'x` with a unit vector `a`.

use std::collections::HashMap;

/// Two rows, and the direction that is kept of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// The rows.
    pub rows: [usize; 2],
    /// `a`, a unit vector.
    pub direction: [f64; 2],
    /// Whether a multiplier there gives way much further than its neighbours do.
    pub is_soft: bool,
}

/// All such pairs of a rank.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sliding {
    pairs: Vec<Across>,
    of_row: HashMap<usize, usize>,
}

/// What a row weighs in `G W G'`: by itself, and with another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    /// `W` on the diagonal.
    pub own: f64,
    /// Another row, and `W` beside the diagonal.
    pub other: Option<(usize, f64)>,
}

impl From<f64> for Weight {
    fn from(own: f64) -> Self {
        Self { own, other: None }
    }
}

impl Sliding {
    /// Of these pairs, which have no row in common.
    pub fn new(pairs: Vec<Across>) -> Self {
        let rows = |(number, pair): (usize, &Across)| pair.rows.map(|row| (row, number));
        let of_row = pairs.iter().enumerate().flat_map(rows).collect();
        Self { pairs, of_row }
    }

    /// `Pi` of a row that is kept.
    pub(super) fn weight(&self, row: usize) -> Weight {
        let Some(&pair) = self.of_row.get(&row) else { return 1.0.into() };
        let Across { rows, direction: [a, b], .. } = self.pairs[pair];
        match row == rows[0] {
            true => Weight { own: a * a, other: Some((rows[1], a * b)) },
            false => Weight { own: b * b, other: Some((rows[0], a * b)) },
        }
    }

    /// `rows = Pi rows`.
    pub fn mask(&self, rows: &mut [f64]) {
        for Across { rows: [i, j], direction: [a, b], .. } in &self.pairs {
            let across = a * rows[*i] + b * rows[*j];
            (rows[*i], rows[*j]) = (a * across, b * across);
        }
    }

    /// The pair that a row is in.
    pub(super) fn of(&self, row: usize) -> Option<&Across> {
        self.of_row.get(&row).map(|pair| &self.pairs[*pair])
    }

    /// Of kept rows those that are not soft.
    pub(super) fn firm(&self, kept: &[bool]) -> Vec<bool> {
        let mut firm = kept.to_vec();
        let soft = self.pairs.iter().filter(|pair| pair.is_soft);
        soft.flat_map(|pair| pair.rows).for_each(|row| firm[row] = false);
        firm
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }
}
