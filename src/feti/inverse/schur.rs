//! `S`: the forces that displacements of a subdomain's boundary cause there.
//!
//! With the unknowns that constraint rows touch called boundary (b) and the others interior (i),
//! `S = K_bb - K_bi K_ii^-1 K_ib` if the interior may follow (Dirichlet), `K_bb` if not (lumped). Works with the boundary
//! blocks and a sparse Cholesky factor of `K_ii`; `S` itself is never formed.

use std::rc::Rc;

use super::factor::{NotDefinite, Symbolic};
use super::stock::{Batch, Stock};
use crate::feti::Torn;
use crate::sparse::cholesky::{Factor, Numbers, Precision, WIDTH, Workspace};
use crate::sparse::submatrix::{Entries, Submatrix};
use crate::work;

/// Which unknowns are on the boundary, where their entries stand, and the analysis of the interior block.
struct Split {
    /// Local unknowns on the boundary, ascending.
    boundary: Vec<u32>,
    /// `K_bb`: lower triangle by columns, diagonal first.
    boundary_block: Entries,
    /// `K_bi` by rows; empty if the interior may not follow.
    coupling: Entries,
    /// The block `K_ii`.
    interior: Option<Submatrix>,
}

impl Split {
    /// Of a subdomain whose rows touch the unknowns `boundary` (ascending).
    fn new(whole: &Symbolic, boundary: Vec<u32>, follows: bool) -> Self {
        let pattern = &whole.pattern;
        let mut place = vec![u32::MAX; pattern.dofs()];
        boundary.iter().enumerate().for_each(|(k, &dof)| place[dof as usize] = k as u32);
        let is_boundary: Vec<bool> = place.iter().map(|&k| k != u32::MAX).collect();
        let interior = (0..pattern.dofs()).filter(|&dof| !is_boundary[dof]);
        interior.enumerate().for_each(|(k, dof)| place[dof] = k as u32);

        let mut boundary_block = vec![Vec::new(); boundary.len()];
        let mut coupling = vec![Vec::new(); if follows { boundary.len() } else { 0 }];
        for column in 0..pattern.dofs() {
            for at in pattern.column_begin[column]..pattern.column_begin[column + 1] {
                let row = pattern.rows[at as usize] as usize;
                let (r, c) = (place[row], place[column]);
                match (is_boundary[row], is_boundary[column]) {
                    (true, true) => boundary_block[c as usize].push((r, at)),
                    (true, false) if follows => coupling[r as usize].push((c, at)),
                    (false, true) if follows => coupling[c as usize].push((r, at)),
                    _ => {}
                }
            }
        }
        // The whole matrix' nested dissection, without the boundary.
        let inside = || whole.order.iter().copied().filter(|&dof| !is_boundary[dof as usize]).collect::<Vec<u32>>();
        let interior = follows.then(|| Submatrix::new(pattern, &inside()));
        let (boundary_block, coupling) = (Entries::new(boundary_block), Entries::new(coupling));
        Self { boundary, boundary_block, coupling, interior }
    }

    fn values(&self, precision: Option<Precision>) -> Values {
        let factor = |interior: &Submatrix| precision.map(|precision| interior.factor(precision));
        let interior = self.interior.as_ref().and_then(factor);
        let empty = || Numbers::new(0, Precision::Double);
        Values { boundary_block: empty(), coupling: empty(), interior, weak: false }
    }
}

/// The numbers of one subdomain.
struct Values {
    boundary_block: Numbers,
    coupling: Numbers,
    interior: Option<Factor>,
    /// Whether the interior gives way far more easily somewhere than its unknowns do one by one.
    weak: bool,
}

impl Values {
    /// Takes the blocks over, in the precision of the factor if there is one.
    fn take_blocks(&mut self, split: &Split, stiffness: &[f64]) {
        let precision = self.interior.as_ref().map_or(Precision::Double, Factor::precision);
        self.boundary_block.take(split.boundary_block.values(stiffness), precision);
        self.coupling.take(split.coupling.values(stiffness), precision);
    }
}

/// Least pivot, relative to the diagonal entry that it began as, from which an interior is weak. (Ordinary elements have 0.2
/// and more, Poisson's ratio 0.4999 leaves 1e-3, bodies that are rigid but for their flow 1e-6.)
const WEAK: f64 = 3e-4;

/// As many must be alike, wherever they are, to be worked on together: a solve for [`WIDTH`] takes a good two solves for
/// one (`benches/kernels.rs`).
const TOGETHER: usize = 3;

/// `S` of all own subdomains.
pub struct Schur {
    splits: Vec<Rc<Split>>,
    values: Stock<Values>,
    /// Of new interior factors, which may fail and be made in double precision; `None` without such factors.
    precision: Option<Precision>,
    /// Which own subdomains are worked on together with those that have the same values.
    together: Vec<bool>,
    workspace: Workspace,
    block: Vec<f64>,
}

impl Schur {
    /// For subdomains with these analyses and boundaries (ascending); equal ones share what follows from them. The
    /// interior follows the boundary if a `precision` for its factor is given. `alike` tells how many congruent
    /// subdomains have the same boundary, on all ranks. Nothing is factorised yet.
    pub fn new(
        whole: &[Rc<Symbolic>],
        boundaries: Vec<Vec<u32>>,
        alike: &[usize],
        precision: Option<Precision>,
    ) -> Self {
        let mut splits: Vec<Rc<Split>> = Vec::new();
        for (own, boundary) in boundaries.into_iter().enumerate() {
            let twin = (0..own).find(|&k| Rc::ptr_eq(&whole[k], &whole[own]) && splits[k].boundary == boundary);
            splits.push(match twin {
                Some(k) => Rc::clone(&splits[k]),
                None => Rc::new(Split::new(&whole[own], boundary, precision.is_some())),
            });
        }
        let workspace = Workspace::new(splits.iter().filter_map(|s| s.interior.as_ref()).map(|i| &i.cholesky));
        let values = Stock::new(splits.iter().map(|split| split.values(precision)));
        let together = alike.iter().map(|&count| count >= TOGETHER).collect();
        Self { splits, values, precision, together, workspace, block: Vec::new() }
    }

    /// Local unknowns on the boundary of an own subdomain, ascending.
    pub fn boundary(&self, own: usize) -> &[u32] {
        &self.splits[own].boundary
    }

    /// Takes over the stiffness with these lower values; `common` says that the subdomain has twins, here or on other
    /// ranks.
    ///
    /// # Errors
    /// If the interior block is not positive definite; `subdomain` is named in the message.
    pub fn update(&mut self, own: usize, subdomain: usize, stiffness: &[f64], common: bool) -> Result<(), NotDefinite> {
        let split = &*self.splits[own];
        let values = self.values.renew(own, common && self.together[own], || split.values(self.precision));
        let (Some(interior), Some(factor)) = (&split.interior, &mut values.interior) else {
            values.take_blocks(split, stiffness);
            return Ok(());
        };
        if let Some(precision) = self.precision.filter(|&precision| factor.precision() != precision) {
            *factor = interior.factor(precision);
        }
        self.block.clear();
        self.block.extend(interior.block.values(stiffness));
        let mut factorise =
            |factor: &mut Factor| self.workspace.factorise(&interior.cholesky, interior.lower(), &self.block, factor);
        let mut outcome = factorise(factor);
        let is_weak = |factor: &Factor| interior.least_pivot(factor, &self.block) < WEAK;
        values.weak = outcome.is_err() || is_weak(factor);
        if values.weak && factor.precision() == Precision::Single {
            *factor = interior.factor(Precision::Double);
            outcome = factorise(factor);
        }
        values.take_blocks(split, stiffness);
        outcome.map_err(|breakdown| NotDefinite { subdomain, pivot: breakdown.place, dofs: interior.unknowns.len() })
    }

    /// Whether the interior of an own subdomain gives way far more easily somewhere than its unknowns do one by one.
    pub fn is_weak(&self, own: usize) -> bool {
        self.values.of(own).weak
    }

    /// Whether two own subdomains have the same boundary, so that one may [`Schur::share`] the other's values.
    pub fn alike(&self, own: usize, other: usize) -> bool {
        Rc::ptr_eq(&self.splits[own], &self.splits[other])
    }

    /// From now on an own subdomain has the values of a congruent one with equal stiffness and boundary.
    pub fn share(&mut self, own: usize, twin: usize) {
        self.values.share(own, twin, self.together[own]);
    }

    /// `forces = S t`, both on the boundaries of all own subdomains.
    pub fn apply(&mut self, t: &[Vec<f64>], forces: &mut [Vec<f64>]) {
        let Self { splits, values, workspace, .. } = self;
        for batch in values.batches() {
            match batch {
                Batch::Alone(own) => Job::<1>::new(splits, values, &[*own]).apply(workspace, t, forces),
                Batch::Twins(twins) => Job::<WIDTH>::new(splits, values, twins).apply(workspace, t, forces),
            }
        }
    }

    /// Adds boundary displacements and those of the interiors, that follow them without force if they may, to a torn
    /// vector.
    pub fn extend(&mut self, t: &[Vec<f64>], u: &mut Torn) {
        let Self { splits, values, workspace, .. } = self;
        for batch in values.batches() {
            match batch {
                Batch::Alone(own) => Job::<1>::new(splits, values, &[*own]).extend(workspace, t, u),
                Batch::Twins(twins) => Job::<WIDTH>::new(splits, values, twins).extend(workspace, t, u),
            }
        }
    }
}

/// Work with the values of one subdomain for `W` that have them. Vectors are interleaved: `W` numbers an unknown.
struct Job<'a, const W: usize> {
    split: &'a Split,
    values: &'a Values,
    members: &'a [usize],
}

impl<'a, const W: usize> Job<'a, W> {
    fn new(splits: &'a [Rc<Split>], values: &'a Stock<Values>, members: &'a [usize]) -> Self {
        Self { split: &splits[members[0]], values: values.of(members[0]), members }
    }

    fn apply(&self, workspace: &mut Workspace, t: &[Vec<f64>], forces: &mut [Vec<f64>]) {
        let t = self.collect(t);
        let inside = self.respond(workspace, &t);
        let all = self.forces(&t, &inside);
        for (lane, &own) in self.members.iter().enumerate() {
            forces[own].clear();
            forces[own].extend(all.iter().map(|f| f[lane]));
        }
    }

    fn extend(&self, workspace: &mut Workspace, t: &[Vec<f64>], u: &mut Torn) {
        let t = self.collect(t);
        let inside = self.respond(workspace, &t);
        let unknowns = self.split.interior.as_ref().map_or(&[][..], |interior| &interior.unknowns);
        for (lane, &own) in self.members.iter().enumerate() {
            self.split.boundary.iter().zip(&t).for_each(|(&dof, t)| u[own][dof as usize] += t[lane]);
            unknowns.iter().zip(&inside).for_each(|(&dof, x)| u[own][dof as usize] += x[lane]);
        }
    }

    fn collect(&self, t: &[Vec<f64>]) -> Vec<[f64; W]> {
        let mut all = vec![[0.0; W]; self.split.boundary.len()];
        for (lane, &own) in self.members.iter().enumerate() {
            all.iter_mut().zip(&t[own]).for_each(|(all, t)| all[lane] = *t);
        }
        all
    }

    /// `-K_ii^-1 K_ib t`; empty if the interior may not follow.
    fn respond(&self, workspace: &mut Workspace, t: &[[f64; W]]) -> Vec<[f64; W]> {
        let (Some(interior), Some(factor)) = (&self.split.interior, &self.values.interior) else { return Vec::new() };
        let mut inside = vec![[0.0; W]; interior.unknowns.len()];
        self.split.coupling.subtract_transpose(&self.values.coupling, t, &mut inside);
        self.book(&self.values.coupling, 2);
        let (cholesky, x) = (&interior.cholesky, inside.as_flattened_mut());
        if W == WIDTH {
            workspace.solve_wide(cholesky, factor, x, self.members.len());
        } else {
            workspace.solve(cholesky, factor, x);
        }
        inside
    }

    /// `K_bb t + K_bi inside`.
    fn forces(&self, t: &[[f64; W]], inside: &[[f64; W]]) -> Vec<[f64; W]> {
        let Values { boundary_block, coupling, .. } = self.values;
        let mut forces = vec![[0.0; W]; t.len()];
        self.split.boundary_block.add_symmetric(boundary_block, t, &mut forces);
        self.book(boundary_block, 4);
        if !inside.is_empty() {
            self.split.coupling.add_product(coupling, inside, &mut forces);
            self.book(coupling, 2);
        }
        forces
    }

    /// Books a product with a block, of so many operations an entry and member.
    fn book(&self, block: &Numbers, flops: usize) {
        work::add(flops * block.len() * self.members.len(), block.bytes() + size_of::<u32>() * block.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feti::inverse::factor::analyse;
    use crate::fixture::{assert_close, built_in, column, elastic, on_ranks};

    #[test]
    fn who_leaves_its_twins_keeps_the_precision() {
        on_ranks(&built_in("patch", &[]), 1, |setup| {
            let symbolic = analyse(setup.subdomains());
            let values = elastic(&setup.subdomains()[0], setup.material(0), &symbolic[0].pattern);
            let forces = |shared: bool| {
                let mut schur = Schur::new(
                    &symbolic,
                    setup.gather.boundaries(),
                    &vec![TOGETHER; symbolic.len()],
                    Some(Precision::Double),
                );
                for own in 0..symbolic.len() {
                    schur.update(own, own, &values, false).expect("definite");
                }
                let twin = (1..symbolic.len()).find(|&k| schur.alike(0, k)).expect("two boxes are alike");
                if shared {
                    schur.share(twin, 0);
                    schur.update(twin, twin, &values, false).expect("definite");
                }
                let t: Vec<Vec<f64>> = (0..symbolic.len()).map(|own| vec![1.0; schur.boundary(own).len()]).collect();
                let mut forces = t.clone();
                schur.apply(&t, &mut forces);
                forces.swap_remove(twin)
            };
            assert_eq!(forces(true), forces(false));
        });
    }

    /// That the forces are those of the dense formula is shown with the preconditioner.
    #[test]
    fn twins_get_what_they_would_get_alone_and_the_same_bits_beside_any_others() {
        on_ranks(&built_in("patch", &[]), 1, |setup| {
            let symbolic = analyse(setup.subdomains());
            let values = elastic(&setup.subdomains()[0], setup.material(0), &symbolic[0].pattern);
            let count = symbolic.len();
            for (precision, tolerance) in
                [(None, 1e-14), (Some(Precision::Double), 1e-12), (Some(Precision::Single), 1e-4)]
            {
                let found = |shared: bool, common: bool| {
                    let mut schur = Schur::new(&symbolic, setup.gather.boundaries(), &vec![TOGETHER; count], precision);
                    for own in 0..count {
                        match (0..own).find(|&k| shared && schur.alike(own, k)) {
                            Some(twin) => schur.share(own, twin),
                            None => schur.update(own, own, &values, common).expect("definite"),
                        }
                    }
                    let displacement = |own: usize| (0..schur.boundary(own).len()).map(|k| (k as f64).sin()).collect();
                    let t: Vec<Vec<f64>> = (0..count).map(displacement).collect();
                    let (mut forces, mut u) = (t.clone(), setup.gather.zeros());
                    schur.apply(&t, &mut forces);
                    schur.extend(&t, &mut u);
                    [forces, u]
                };
                let [alone, together] = [found(false, false), found(true, true)];
                for (a, b) in alone.iter().flatten().zip(together.iter().flatten()) {
                    assert_close(&column(b), &column(a), tolerance);
                }
                assert!(found(false, true) == together);
            }
        });
    }
}
