//! `F = B K^+ B'`, applied subdomain by subdomain through the factors, or cluster by cluster.

use super::gather::Gather;
use super::hybrid::Hybrid;
use super::space::RowSpace;
use crate::assembly::Region;
use crate::constraint::Constraints;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::feti::inverse::Inverse;
use crate::feti::inverse::basis::Bases;
use crate::feti::inverse::factor::NotDefinite;
use crate::feti::inverse::schur::Schur;
use crate::feti::inverse::tangents::Linearisation;
use crate::monitor::timing::Timer;
use crate::sparse::cholesky::Precision;

/// What an update changed, of all subdomains on every rank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changes {
    /// Whether the tangent is a new one.
    pub fresh: Vec<bool>,
    /// Whether the interior is weak ([`Schur::is_weak`]); never without a preconditioner.
    pub weak: Vec<bool>,
    /// Subdomains with a new tangent, over all ranks.
    pub refreshed: u64,
    /// Whether any rank has a weak one.
    pub is_any_weak: bool,
}

/// The dual operator; counts its applications.
pub struct DualOperator<'a> {
    /// `K^+` of each subdomain, to be applied by itself too.
    pub inverse: Inverse,
    hybrid: Option<Hybrid<'a>>,
    pub(super) gather: &'a Gather<'a>,
    pub(super) torn: Torn,
    applications: usize,
}

impl<'a> DualOperator<'a> {
    /// On a generalised inverse, which gets its numbers by [`DualOperator::update`], of clusters if there are any.
    pub fn new(inverse: Inverse, hybrid: Option<Hybrid<'a>>, gather: &'a Gather<'a>) -> Self {
        Self { inverse, hybrid, gather, torn: gather.zeros(), applications: 0 }
    }

    /// Takes over the tangents at an iterate, see [`Inverse::update`]. Collective.
    ///
    /// # Errors
    /// If one is singular.
    pub fn update(
        &mut self,
        at: &Linearisation,
        left: f64,
        mut interiors: Option<&mut Schur>,
        space: &RowSpace,
        timer: &Timer,
    ) -> Result<Changes, NotDefinite> {
        let fresh = agree(self.inverse.update(at, left, interiors.as_deref_mut(), timer), space)?;
        let is_weak = |own| interiors.as_ref().is_some_and(|schur| schur.is_weak(own));
        let weak: Vec<bool> = (0..fresh.len()).map(is_weak).collect();
        let count = |of: &[bool]| of.iter().filter(|is| **is).count() as u64;
        let [refreshed, weak_everywhere] = space.counts([count(&fresh), count(&weak)]);
        Ok(Changes { fresh, weak, refreshed, is_any_weak: weak_everywhere > 0 })
    }

    /// As [`Inverse::remake`]. Collective.
    ///
    /// # Errors
    /// If a tangent is singular.
    pub fn remake(
        &mut self,
        regions: &[Region],
        made_of: (Precision, Vec<Bases>),
        interiors: Option<&mut Schur>,
        space: &RowSpace,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        agree(self.inverse.remake(regions, made_of, interiors, timer), space)
    }

    /// As [`Inverse::strengthen`]. Collective.
    ///
    /// # Errors
    /// If a block is singular.
    pub fn strengthen(
        &mut self,
        subdomains: &[Subdomain],
        beside: &[usize],
        interiors: &mut Schur,
        space: &RowSpace,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        agree(self.inverse.strengthen(subdomains, beside, interiors, timer), space)
    }

    /// Adds to multipliers, which balance each cluster, what balances each of its members: the forces by which these held each
    /// other in the last [`DualOperator::solve`]. Local.
    pub fn add_bonds<const N: usize>(&self, multipliers: [&mut Vec<f64>; N]) {
        let Some(hybrid) = &self.hybrid else { return };
        for lambda in multipliers {
            lambda.iter_mut().zip(hybrid.forces()).for_each(|(l, c)| *l += c);
        }
    }

    /// Moves the members of clusters to where a displacement keeps them together. Collective.
    pub fn rejoin(&mut self, u: &mut Torn) {
        self.hybrid.iter_mut().for_each(|hybrid| hybrid.rejoin(u));
    }

    /// `z = M r` by a preconditioner of subdomains, see [`Hybrid::precondition`]. Collective.
    pub fn precondition(&self, r: &[f64], z: &mut [f64], apply: impl FnOnce(&[f64], &mut [f64])) {
        match &self.hybrid {
            Some(hybrid) => hybrid.precondition(r, z, apply),
            None => apply(r, z),
        }
    }

    /// Whether there are clusters of several subdomains.
    pub fn is_hybrid(&self) -> bool {
        self.hybrid.is_some()
    }

    /// `torn = K^+ torn`, of clusters if there are any. Collective.
    pub fn solve(&mut self, torn: &mut Torn) {
        solve(&mut self.inverse, &mut self.hybrid, torn);
    }

    /// Adds to multipliers what no quadratic program sees: what holds the members of clusters together, and what
    /// pinned supports carry, after the displacement `du` under `forces`. The last of the multipliers are in balance.
    pub fn add_hidden(&self, constraints: &Constraints, at: (&Torn, &Torn), [lambda, balanced]: [&mut Vec<f64>; 2]) {
        self.add_bonds([&mut *lambda, &mut *balanced]);
        self.add_reactions(constraints, at, [lambda, balanced]);
    }

    /// `y = F x`. One neighbour exchange.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        for (own, local) in self.torn.iter_mut().enumerate() {
            local.fill(0.0);
            self.gather.add_transpose_one(own, 1.0, x, local);
        }
        solve(&mut self.inverse, &mut self.hybrid, &mut self.torn);
        self.gather.apply(&self.torn, y);
    }

    /// `torn = K^+ (torn - B' x)` and `y = B torn`: costs and counts as one application of F.
    pub fn respond(&mut self, x: &[f64], torn: &mut Torn, y: &mut [f64]) {
        self.applications += 1;
        self.gather.add_transpose(-1.0, x, torn);
        self.solve(torn);
        self.gather.apply(torn, y);
    }

    /// Applications of F so far.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

fn solve(inverse: &mut Inverse, hybrid: &mut Option<Hybrid>, torn: &mut Torn) {
    match hybrid {
        Some(hybrid) => hybrid.solve(inverse, torn),
        None => inverse.solve(torn),
    }
}

/// One outcome for all ranks: the lowest failing subdomain speaks; ranks that see no failure repeat its number.
fn agree<T>(outcome: Result<T, NotDefinite>, space: &RowSpace) -> Result<T, NotDefinite> {
    let Some(subdomain) = space.lowest(outcome.as_ref().err().map(|failure| failure.subdomain)) else {
        return outcome;
    };
    let unknown = NotDefinite { subdomain, pivot: 0, dofs: 0 };
    Err(outcome.err().filter(|failure| failure.subdomain == subdomain).unwrap_or(unknown))
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
