//! `P = I - G'(G G')^-1 G`, the orthogonal projector onto `Ker G`, and the rigid amplitudes that go with it.

use super::Coarse;
use super::face::without;

impl Coarse<'_> {
    /// `rows = P rows`; returns `(G G')^-1 G rows`. One all-gather.
    pub fn project(&self, rows: &mut [f64]) -> Vec<f64> {
        let mut a = self.apply(rows);
        self.solve(&mut a);
        self.add_transpose(-1.0, &a, rows);
        a
    }

    /// As [`Coarse::project`]; returns the squared norm of `P rows`, and the sums over all subdomains of `width` numbers
    /// for each own one, given and returned behind those of the square of `rows`. One all-gather.
    pub fn project_with_sums(&self, rows: &mut [f64], partial: &[f64], width: usize) -> (f64, Vec<f64>) {
        let (mut a, mut sums) = self.apply_with_sums(rows, partial, width);
        let e = a.clone();
        self.solve(&mut a);
        self.add_transpose(-1.0, &a, rows);
        (without(sums.remove(0), &e, &a), sums)
    }

    /// The smallest `rows` with `G rows = e`: `G'(G G')^-1 e`. Local.
    pub fn particular(&self, e: &[f64], rows: &mut [f64]) {
        let mut a = e.to_vec();
        self.solve(&mut a);
        rows.fill(0.0);
        self.add_transpose(1.0, &a, rows);
    }
}

#[cfg(test)]
mod tests {
    use crate::fixture::{clustered, on_ranks, two_bricks, two_bricks_by_metis};
    use crate::scene::Scene;

    fn scenes() -> [Scene; 3] {
        [two_bricks(&[]), clustered(), two_bricks_by_metis(7)]
    }

    fn norm(v: &[f64]) -> f64 {
        v.iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    #[test]
    fn projects_orthogonally_onto_the_kernel_of_g() {
        for scene in scenes() {
            for ranks in [1, 3] {
                on_ranks(&scene, ranks, |setup| {
                    let coarse = setup.coarse().expect("the bodies are held");
                    let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                    let [mut px, mut py] = [x.clone(), y.clone()];
                    let a = coarse.project(&mut px);
                    coarse.project(&mut py);
                    assert!(norm(&coarse.apply(&px)) < 1e-12 * norm(&coarse.apply(&x)));

                    let mut twice = px.clone();
                    coarse.project(&mut twice);
                    let error: Vec<f64> = twice.iter().zip(&px).map(|(a, b)| a - b).collect();
                    assert!(norm(&error) < 1e-12 * norm(&px));

                    let products = setup.space.dots(&[(&px, &y), (&x, &py), (&px, &py)]);
                    let size = setup.space.dots(&[(&x, &x)])[0];
                    assert!(products.iter().all(|p| (p - products[0]).abs() < 1e-12 * size));

                    // What is taken away is G' of the returned amplitudes.
                    coarse.add_transpose(1.0, &a, &mut px);
                    let error: Vec<f64> = px.iter().zip(&x).map(|(a, b)| a - b).collect();
                    assert!(norm(&error) < 1e-12 * norm(&x));
                });
            }
        }
    }

    #[test]
    fn the_particular_multiplier_balances_and_is_the_smallest() {
        for scene in scenes() {
            on_ranks(&scene, 2, |setup| {
                let coarse = setup.coarse().expect("the bodies are held");
                let e: Vec<f64> = coarse.apply(&setup.multipliers(3));
                let mut rows = setup.multipliers(4);
                coarse.particular(&e, &mut rows);
                let error: Vec<f64> = coarse.apply(&rows).iter().zip(&e).map(|(a, b)| a - b).collect();
                assert!(norm(&error) < 1e-12 * norm(&e));
                let size = norm(&rows);
                coarse.project(&mut rows);
                assert!(norm(&rows) < 1e-12 * size);
            });
        }
    }
}
