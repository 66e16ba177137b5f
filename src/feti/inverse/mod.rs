//! The generalised inverse `K^+` of the torn stiffness, its kernel `R`, and which factors are made when.
//!
//! [`Inverse`] is the whole: set up in [`Inverse::new`], given its numbers by [`Inverse::update`], applied by [`Inverse::solve`].
//! [`kernel`] has the rigid modes, [`factor`] the factors of whole subdomains, [`schur`] those of their interiors with the Schur
//! complement, [`stock`] the scratch that their solves share. [`tangents`] decides which factors are kept, shared or made
//! again, from the states that they were made from ([`basis`]). [`refine`] recovers the digits that they lack. [`pins`] finds unknowns
//! that factors keep at zero.
//!
//! All here is local to a rank.

pub mod basis;
pub mod factor;
pub mod kernel;
pub mod pins;
pub mod refine;
pub mod schur;
pub mod stock;
pub mod tangents;

use std::rc::Rc;

use self::basis::Bases;
use self::factor::{Factors, NotDefinite, Symbolic};
use self::pins::Pins;
use self::schur::Schur;
use self::tangents::{Factorising, Linearisation, Tangents};
use super::Torn;
use crate::assembly::Region;
use crate::decomposition::Subdomain;
use crate::monitor::timing::Timer;
use crate::sparse::cholesky::Precision;

/// `K^+` of one rank's subdomains.
pub struct Inverse {
    factors: Factors,
    tangents: Tangents,
    /// Whether the factor of any subdomain, on any rank, keeps unknowns at zero.
    pins: bool,
}

impl Inverse {
    /// Of subdomains with these analyses. Factors are in single `precision` where a probe lets
    /// them. `twins` numbers subdomains that have congruent ones. Of the pins of each subdomain see [`Pins::of_supports`]; `None`
    /// on all ranks if there are to be none. Nothing is factorised before [`Inverse::update`].
    pub fn new(
        symbolic: Vec<Rc<Symbolic>>,
        precision: Precision,
        twins: Vec<Option<usize>>,
        pins: Option<Vec<Pins>>,
    ) -> Self {
        let has_pins = pins.is_some();
        Self { factors: Factors::new(symbolic, precision, pins), tangents: Tangents::new(twins), pins: has_pins }
    }

    /// Assembles the tangents `K_k` at an iterate and factorises those whose entries changed by more than `left`, relative to
    /// their diagonal; with them the `interiors` of the preconditioner, if there is one. Returns for each own subdomain whether its
    /// tangent is a new one.
    ///
    /// # Errors
    /// The first tangent that is singular. Those behind it keep their factors.
    pub fn update(
        &mut self,
        at: &Linearisation,
        left: f64,
        interiors: Option<&mut Schur>,
        timer: &Timer,
    ) -> Result<Vec<bool>, NotDefinite> {
        self.tangents.update(at, left, &mut Factorising { factors: &mut self.factors, schur: interiors, timer })
    }

    /// Makes factors again from their former states, to the same bits, in at least this precision.
    ///
    /// # Errors
    /// The first tangent that is singular. Those behind it have no factors.
    pub fn remake(
        &mut self,
        regions: &[Region],
        (precision, bases): (Precision, Vec<Bases>),
        interiors: Option<&mut Schur>,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        self.factors.set_precision(precision);
        let mut on = Factorising { factors: &mut self.factors, schur: interiors, timer };
        self.tangents.remake(regions, bases, &mut on)
    }

    /// Gives the preconditioner the `interiors` of own subdomains `beside` weak ones ([`Schur::is_weak`]) as they are now.
    ///
    /// # Errors
    /// The first block that is singular.
    pub fn strengthen(
        &mut self,
        subdomains: &[Subdomain],
        beside: &[usize],
        interiors: &mut Schur,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        let mut on = Factorising { factors: &mut self.factors, schur: Some(interiors), timer };
        beside.iter().try_for_each(|&own| self.tangents.follow(own, subdomains[own].id, &mut on))
    }

    /// Another solve follows, from what is committed now.
    pub fn begin(&mut self) {
        self.tangents.bases.iter_mut().for_each(Bases::commit);
    }

    /// The next update makes all factors anew.
    pub fn forget(&mut self) {
        self.tangents.bases.iter_mut().for_each(|bases| bases.factor = None);
    }

    /// From now on factorises in double precision, and the next update makes all factors anew; false if that was so before.
    pub fn sharpen(&mut self) -> bool {
        let before = self.factors.precision();
        self.factors.set_precision(Precision::Double);
        self.forget();
        before == Precision::Single
    }

    /// `x = K^+ x`.
    pub fn solve(&mut self, x: &mut Torn) {
        self.factors.solve(x);
    }

    /// Refines `x = K^+ r`, see [`refine::refine`].
    pub fn refine(&mut self, norm: &dyn Fn(&Torn) -> f64, at: (&Torn, &mut Torn), share: f64) -> (f64, usize) {
        refine::refine(&mut self.factors, &self.tangents.values, norm, at, share)
    }

    /// Whether unknowns of any subdomain, on any rank, are kept at zero.
    pub fn pins(&self) -> bool {
        self.pins
    }

    /// Unknowns of an own subdomain that its factor keeps at zero, ascending.
    pub fn pinned(&self, own: usize) -> &[u32] {
        self.factors.pinned(own)
    }

    /// Analysis and lower values of an own subdomain's tangent as it was factorised last.
    pub fn stiffness(&self, own: usize) -> (&Symbolic, &[f64]) {
        (self.factors.symbolic(own), &self.tangents.values[own])
    }

    /// What new factors are stored in at least.
    pub fn precision(&self) -> Precision {
        self.factors.precision()
    }

    /// The states that the factors of each own subdomain were made from.
    pub fn bases(&self) -> &[Bases] {
        &self.tangents.bases
    }
}
