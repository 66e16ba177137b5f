//! `P = I - G'(G G')^-1 G`, the orthogonal projector onto `Ker G`, and the rigid amplitudes that go with it.

use super::coarse::Coarse;

/// The natural coarse grid projector.
pub struct Projector<'a> {
    /// The coarse problem.
    pub coarse: Coarse<'a>,
}

impl Projector<'_> {
    /// `rows = P rows`; returns `(G G')^-1 G rows`. One all-gather.
    pub fn project(&self, rows: &mut [f64]) -> Vec<f64> {
        let mut a = self.coarse.apply(rows);
        self.coarse.solve(&mut a);
        self.coarse.add_transpose(-1.0, &a, rows);
        a
    }

    /// The smallest `rows` with `G rows = e`: `G'(G G')^-1 e`. Local.
    pub fn particular(&self, e: &[f64], rows: &mut [f64]) {
        let mut a = e.to_vec();
        self.coarse.solve(&mut a);
        rows.fill(0.0);
        self.coarse.add_transpose(1.0, &a, rows);
    }
}
