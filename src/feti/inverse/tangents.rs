//! The tangents of own subdomains: which of their factors are kept, shared or made again.

use std::rc::Rc;
use std::sync::Arc;

use super::basis::{Bases, Basis};
use super::factor::{Factors, NotDefinite};
use super::schur::Schur;
use crate::assembly::flow::Flow;
use crate::assembly::{Region, stiffness};
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::monitor::timing::Timer;

/// Change of a tangent's entries, relative to its diagonal, that the preconditioner does not follow. (On the benchmark at
/// level 2, 0.1 saves a quarter of its factorisations and costs no iteration; 0.3 saves three fifths, and costs a tenth
/// more iterations.)
const DRIFT: f64 = 0.1;

/// Least pivot of a tangent's factor, relative to the diagonal entry that it began as, from which the preconditioner follows every
/// change. (That of slender elastic subdomains is as small, which costs them nothing: they do not change.)
const SOFT: f64 = 1e-3;

/// What is factorised at a tangent.
pub(super) struct Factorising<'s> {
    /// Factors of whole tangents.
    pub factors: &'s mut Factors,
    /// Factors of their interior blocks, for the preconditioner.
    pub schur: Option<&'s mut Schur>,
    /// Where the time goes.
    pub timer: &'s Timer,
}

/// What the tangents `K_k` at a Newton iterate `u_k` depend on.
#[derive(Clone, Copy)]
pub struct Linearisation<'s> {
    /// Own subdomains, each with its material and history.
    pub regions: &'s [Region<'s>],
    /// Torn displacement.
    pub u: &'s Torn,
    /// Number of elements of each own subdomain that yield.
    pub yielding: &'s [usize],
    /// Directions of flow in each own subdomain ([`crate::assembly::flow`]).
    pub flows: &'s [Flow],
}

/// The tangents of own subdomains as they were factorised last.
pub(super) struct Tangents {
    /// Congruent subdomains have the same number.
    twins: Vec<Option<usize>>,
    /// Lower values of each own subdomain's tangent.
    pub values: Vec<Rc<Vec<f64>>>,
    /// The states that the factors of each own subdomain were made from.
    pub bases: Vec<Bases>,
    /// Scratch: a tangent that may be worth factorising.
    assembled: Vec<f64>,
}

impl Tangents {
    /// Of own subdomains without factors; `twins` numbers those that have congruent ones.
    pub fn new(twins: Vec<Option<usize>>) -> Self {
        let (values, bases) = (vec![Rc::default(); twins.len()], vec![Bases::default(); twins.len()]);
        Self { twins, values, bases, assembled: Vec::new() }
    }

    /// Makes factors again, to the same bits. Local.
    ///
    /// # Errors
    /// The first tangent that is singular; those behind it have no factors then.
    pub fn remake(&mut self, regions: &[Region], bases: Vec<Bases>, on: &mut Factorising) -> Result<(), NotDefinite> {
        let mut outcome = Ok(());
        for (own, bases) in bases.into_iter().enumerate() {
            if outcome.is_ok() && bases.factor.is_some() {
                outcome = self.remake_one(regions, own, &bases, on);
            }
            self.bases[own] = bases;
        }
        outcome
    }

    fn remake_one(
        &mut self,
        regions: &[Region],
        own: usize,
        bases: &Bases,
        on: &mut Factorising,
    ) -> Result<(), NotDefinite> {
        let subdomain = regions[own].subdomain;
        let twin = self.twins[own].is_some();
        if bases.is_elastic()
            && let Some(outcome) = self.adopt(own, subdomain.id, on)
        {
            outcome?;
        } else if let Some(basis) = &bases.factor {
            let common = twin && bases.is_elastic();
            let values = Rc::new(tangent(&regions[own], own, basis, on.factors));
            self.values[own] = Rc::clone(&values);
            on.timer.time("factorisation", || on.factors.factorise(own, subdomain, &values, common))?;
        }
        let Some(basis) = &bases.interior else { return Ok(()) };
        if on.schur.is_none() || self.bases[own].interior.as_ref() == Some(basis) {
            return Ok(());
        }
        let values = if bases.factor.as_ref() == Some(basis) {
            Rc::clone(&self.values[own])
        } else {
            Rc::new(tangent(&regions[own], own, basis, on.factors))
        };
        let common = twin && *basis == Basis::Elastic;
        self.take_interior(own, subdomain.id, &values, basis.clone(), common, on)
    }

    /// Assembles the tangents at an iterate and factorises those that changed by more than `left`, relative to their diagonal.
    /// Returns for each own subdomain whether it has a new factor; shared ones count.
    ///
    /// # Errors
    /// The first tangent that is singular; those behind it are not looked at.
    pub fn update(
        &mut self,
        &Linearisation { regions, u, yielding, flows }: &Linearisation,
        left: f64,
        on: &mut Factorising,
    ) -> Result<Vec<bool>, NotDefinite> {
        let mut fresh = vec![false; regions.len()];
        for (own, region) in regions.iter().enumerate() {
            let elastic = yielding[own] == 0;
            // An elastic tangent that was elastic before is the same matrix.
            if elastic && self.bases[own].is_elastic() {
                continue;
            }
            // Elastic twins share one factor.
            if elastic && let Some(outcome) = self.adopt(own, region.subdomain.id, on) {
                outcome?;
                fresh[own] = true;
                continue;
            }
            let change = self.assemble(own, region, (&u[own], &flows[own]), on);
            // Where twins are elastic on other ranks only, it gets what it would get from one of them here.
            let common = elastic && self.twins[own].is_some();
            if change <= left && !common {
                continue;
            }
            fresh[own] = true;
            let at = || Basis::At(Arc::new(u[own].clone()), Flow::clone(&flows[own]));
            let basis = if elastic { Basis::Elastic } else { at() };
            self.bases[own].drift += change;
            self.factorise(own, region.subdomain, basis, common, on)?;
        }
        Ok(fresh)
    }

    /// Assembles the tangent of an own subdomain into the scratch. Returns by how much it differs from the one that was
    /// factorised last, relative to its diagonal; infinity if there is none.
    fn assemble(&mut self, own: usize, region: &Region, at: (&[f64], &Flow), on: &mut Factorising) -> f64 {
        let pattern = &on.factors.symbolic(own).pattern;
        self.assembled.resize(pattern.rows.len(), 0.0);
        let (assembled, at) = (&mut self.assembled, (at.0, &at.1[..]));
        on.timer.time("assembly", || stiffness::assemble(region, at, pattern, assembled));
        let known = self.bases[own].factor.is_some();
        if known { pattern.difference(&self.values[own], assembled) } else { f64::INFINITY }
    }

    /// Factorises the tangent in the scratch, and the interior block of the preconditioner where that has drifted too far.
    fn factorise(
        &mut self,
        own: usize,
        subdomain: &Subdomain,
        basis: Basis,
        common: bool,
        on: &mut Factorising,
    ) -> Result<(), NotDefinite> {
        self.bases[own].factor = Some(basis.clone());
        let values = Rc::new(self.assembled.clone());
        self.values[own] = Rc::clone(&values);
        let outcome = on.timer.time("factorisation", || on.factors.factorise(own, subdomain, &values, common));
        outcome?;
        // Where a body has become soft but for its volume, the entries of the volume hide it; the pivots do not.
        let drift = self.bases[own].drift;
        let is_stale = || drift.is_nan() || drift > DRIFT || on.factors.least_pivot(own, &values) < SOFT;
        if common || is_stale() {
            return self.take_interior(own, subdomain.id, &values, basis, common, on);
        }
        Ok(())
    }

    /// Gives the preconditioner the interior block of an own subdomain's tangent as it was factorised last, however little that
    /// has changed. Local.
    ///
    /// # Errors
    /// If it is singular.
    pub fn follow(&mut self, own: usize, id: usize, on: &mut Factorising) -> Result<(), NotDefinite> {
        let Bases { factor, interior, .. } = &self.bases[own];
        let Some(basis) = factor.clone().filter(|_| interior != factor) else { return Ok(()) };
        let common = self.twins[own].is_some() && basis == Basis::Elastic;
        let values = Rc::clone(&self.values[own]);
        self.take_interior(own, id, &values, basis, common, on)
    }

    /// Gives an elastic subdomain what an elastic twin with equal pins has already; `None` if there is none.
    fn adopt(&mut self, own: usize, id: usize, on: &mut Factorising) -> Option<Result<(), NotDefinite>> {
        let class = self.twins[own]?;
        let is_alike = |k: &usize| {
            self.twins[*k] == Some(class) && on.factors.equally_pinned(own, *k) && self.bases[*k].is_elastic()
        };
        let mut twins = (0..self.twins.len()).filter(is_alike);
        let twin = twins.clone().next()?;
        let alike = on.schur.as_ref().and_then(|schur| twins.find(|&k| schur.alike(own, k)));
        on.factors.share(own, twin);
        self.values[own] = Rc::clone(&self.values[twin]);
        self.bases[own].factor = Some(Basis::Elastic);
        if let (Some(alike), Some(schur)) = (alike, &mut on.schur) {
            (self.bases[own].interior, self.bases[own].drift) = (Some(Basis::Elastic), 0.0);
            schur.share(own, alike);
            return Some(Ok(()));
        }
        let values = Rc::clone(&self.values[own]);
        Some(self.take_interior(own, id, &values, Basis::Elastic, true, on))
    }

    /// Gives the preconditioner the interior block of these lower values, if there is one.
    fn take_interior(
        &mut self,
        own: usize,
        id: usize,
        values: &[f64],
        basis: Basis,
        common: bool,
        on: &mut Factorising,
    ) -> Result<(), NotDefinite> {
        let Some(schur) = &mut on.schur else { return Ok(()) };
        (self.bases[own].interior, self.bases[own].drift) = (Some(basis), 0.0);
        on.timer.time("factorisation of the interior", || schur.update(own, id, values, common))
    }
}

/// Lower values of the tangent at the state that a factor is made from.
fn tangent(region: &Region, own: usize, basis: &Basis, factors: &Factors) -> Vec<f64> {
    let pattern = &factors.symbolic(own).pattern;
    let mut values = vec![0.0; pattern.rows.len()];
    match basis {
        Basis::Elastic => {
            let rest = vec![0.0; region.subdomain.dofs()];
            stiffness::assemble(&Region { history: &[], ..*region }, (&rest, &[]), pattern, &mut values)
        }
        Basis::At(u, flow) => stiffness::assemble(region, (u, flow), pattern, &mut values),
    };
    values
}
