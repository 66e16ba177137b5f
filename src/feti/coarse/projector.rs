//! `P = I - G'(G G')^-1 G` of all rows, the orthogonal projector onto `Ker G`, and the rigid amplitudes that go with it.

use super::factor::CoarseFactor;
use super::{Coarse, Floating};

/// `P`, with the factor of `G G'`.
#[derive(Clone, Copy)]
pub struct Projector<'s, 'a> {
    coarse: &'s Coarse<'a>,
    factor: &'s CoarseFactor,
}

impl<'a> Coarse<'a> {
    /// `P`. Factorises `G G'` of all rows when it is asked for it first. Collective.
    ///
    /// # Errors
    /// If that is singular: on every rank.
    pub fn projector(&self) -> Result<Projector<'_, 'a>, Floating> {
        let factor = match self.whole.get() {
            Some(factor) => factor,
            None => {
                let factor = self.factor_of(&self.blocks(|_| 1.0.into()), || self.unit_blocks(|_| 1.0.into()))?;
                self.whole.get_or_init(|| factor)
            }
        };
        Ok(Projector { coarse: self, factor })
    }
}

impl Projector<'_, '_> {
    /// `rows = P rows`; returns `(G G')^-1 G rows`. One all-gather.
    pub fn project(&self, rows: &mut [f64]) -> Vec<f64> {
        let mut a = self.coarse.apply(rows);
        self.factor.solve(self.coarse.comm(), &mut a);
        self.coarse.add_transpose(-1.0, &a, rows);
        a
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
                    let p = coarse.projector().expect("all rows hold them");
                    let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                    let [mut px, mut py] = [x.clone(), y.clone()];
                    let a = p.project(&mut px);
                    p.project(&mut py);
                    assert!(norm(&coarse.apply(&px)) < 1e-12 * norm(&coarse.apply(&x)));

                    let mut twice = px.clone();
                    p.project(&mut twice);
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
}
