//! `F = B K^+ B'`, applied subdomain by subdomain through the factors, or cluster by cluster.

use super::gather::Gather;
use crate::feti::Torn;
use crate::feti::inverse::factor::Factors;
use crate::feti::inverse::hybrid::Hybrid;

/// The dual operator; counts its applications.
pub struct DualOperator<'a> {
    /// Factors of all own subdomains.
    pub factors: Factors,
    hybrid: Option<Hybrid>,
    gather: &'a Gather<'a>,
    torn: Torn,
    applications: usize,
}

impl<'a> DualOperator<'a> {
    /// On factors that will be computed before the first application, with clusters if there are any.
    pub fn new(factors: Factors, hybrid: Option<Hybrid>, gather: &'a Gather<'a>) -> Self {
        Self { factors, hybrid, gather, torn: gather.zeros(), applications: 0 }
    }

    /// Whether there are clusters.
    pub fn is_hybrid(&self) -> bool {
        self.hybrid.is_some()
    }

    /// Makes the clusters follow the factors.
    ///
    /// # Errors
    /// An own subdomain of a cluster whose members nothing holds together.
    pub fn update_clusters(&mut self) -> Result<(), usize> {
        self.hybrid.as_mut().map_or(Ok(()), |hybrid| hybrid.update(&mut self.factors))
    }

    /// `torn = K^+ torn`, of clusters if there are any. Local.
    pub fn invert(&mut self, torn: &mut Torn) {
        match &mut self.hybrid {
            Some(hybrid) => hybrid.solve(&mut self.factors, torn),
            None => self.factors.solve(torn),
        }
    }

    /// Closes the bonds of clusters in a displacement; see [`Hybrid::rejoin`]. Local.
    pub fn rejoin(&mut self, torn: &mut Torn) {
        self.hybrid.iter_mut().for_each(|hybrid| hybrid.rejoin(torn));
    }

    /// By `B`, the forces by which the members of clusters held each other in the last [`DualOperator::invert`] or
    /// [`DualOperator::rejoin`]: added to multipliers that balance clusters, they balance each subdomain. `None` without
    /// clusters. One neighbour exchange.
    pub fn bonds(&self) -> Option<Vec<f64>> {
        let hybrid = self.hybrid.as_ref()?;
        let mut torn = self.gather.zeros();
        hybrid.add_forces(&mut torn);
        let mut rows = vec![0.0; self.gather.rows()];
        self.gather.apply(&torn, &mut rows);
        Some(rows)
    }

    /// `y = F x`. One neighbour exchange.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        for (own, local) in self.torn.iter_mut().enumerate() {
            local.fill(0.0);
            self.gather.add_transpose_one(own, 1.0, x, local);
        }
        let mut torn = std::mem::take(&mut self.torn);
        self.invert(&mut torn);
        self.gather.apply(&torn, y);
        self.torn = torn;
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`: costs and counts as one application of F.
    pub fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64]) {
        self.applications += 1;
        self.gather.add_transpose(-1.0, x, torn);
        self.invert(torn);
        self.gather.apply(torn, y);
    }

    /// Applications of F so far.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

#[cfg(test)]
mod tests {
    use faer::{Mat, Side};

    use crate::fixture::{
        Setup, assert_close, block_diagonal, built_in, clustered, column, dense, on_ranks, same_on_any_ranks,
        two_bricks, two_bricks_by_metis,
    };

    /// `F` by its columns.
    fn columns(setup: &Setup) -> Mat<f64> {
        let mut operator = setup.operator();
        let n = setup.rows().len();
        let mut f = Mat::zeros(n, n);
        let (mut unit, mut image) = (vec![0.0; n], vec![0.0; n]);
        for k in 0..n {
            unit[k] = 1.0;
            operator.apply(&unit, &mut image);
            unit[k] = 0.0;
            (0..n).for_each(|i| f[(i, k)] = image[i]);
        }
        assert_eq!(operator.applications(), n);
        f
    }

    /// The Moore-Penrose inverses of all subdomains' stiffness matrices, from their eigenvectors.
    fn pseudo_inverse(setup: &Setup) -> Mat<f64> {
        let (factors, stiffnesses) = setup.factors();
        let blocks: Vec<Mat<f64>> = stiffnesses
            .iter()
            .enumerate()
            .map(|(own, values)| {
                let k = dense(&factors.symbolic(own).pattern, values);
                let eigen = k.self_adjoint_eigen(Side::Lower).expect("it exists");
                let n = k.nrows();
                let u = eigen.U().subcols(6, n - 6);
                let scaled = Mat::from_fn(n, n - 6, |i, j| u[(i, j)] / eigen.S()[j + 6]);
                scaled * u.transpose()
            })
            .collect();
        block_diagonal(&blocks)
    }

    #[test]
    fn equals_b_times_the_pseudo_inverse_times_b_transposed_between_projectors_and_is_definite_there() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(7)] {
            on_ranks(&scene, 1, |setup| {
                let f = columns(setup);
                assert_close(&f.transpose().to_owned(), &f, 1e-12);

                let b = setup.dense_rows();
                let gt = &b * setup.dense_modes();
                let basis = gt.qr().compute_thin_Q();
                let n = b.nrows();
                let p = Mat::<f64>::identity(n, n) - &basis * basis.transpose();
                let projected = &p * &f * &p;
                assert_close(&projected, &(&p * &b * pseudo_inverse(setup) * b.transpose() * &p), 1e-10);

                let values = projected.self_adjoint_eigenvalues(Side::Lower).expect("they exist");
                let (zero, positive) = values.split_at(6 * setup.subdomains().len());
                assert!(zero.iter().all(|v| v.abs() < 1e-13 * values[n - 1]));
                assert!(positive[0] > 1e-5 * values[n - 1], "{:e}", positive[0] / values[n - 1]);
            });
        }
    }

    #[test]
    fn responds_with_the_displacements_under_forces_and_multipliers() {
        on_ranks(&two_bricks(&[]), 1, |setup| {
            let mut operator = setup.operator();
            let forces = setup.displacements(5);
            let x = setup.multipliers(6);
            let [mut y, mut fx, mut bkf] = [(); 3].map(|()| vec![0.0; x.len()]);
            let mut torn = forces.clone();
            operator.respond(&x, &mut torn, &mut y);
            let mut bu = vec![0.0; x.len()];
            setup.gather.apply(&torn, &mut bu);
            assert_eq!(bu, y);
            operator.apply(&x, &mut fx);
            operator.respond(&vec![0.0; x.len()], &mut forces.clone(), &mut bkf);
            assert_close(&column(&y), &(column(&bkf) - column(&fx)), 1e-12);
            assert_eq!(operator.applications(), 3);
        });
    }

    #[test]
    fn images_are_the_same_bits_on_any_ranks() {
        for scene in [two_bricks(&[]), two_bricks_by_metis(7), built_in("patch", &[]), clustered()] {
            same_on_any_ranks(&scene, |setup| {
                let mut image = vec![0.0; setup.rows().len()];
                setup.operator().apply(&setup.multipliers(7), &mut image);
                setup.owned(&image)
            });
        }
    }
}
