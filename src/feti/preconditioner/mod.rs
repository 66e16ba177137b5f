//! Preconditioners of the dual operator: `B_D S B_D'` with `S` the boundary block of the stiffness (lumped) or its Schur
//! complement (Dirichlet); Farhat, Mandel and Roux 1994, with the stiffness scaling of [`crate::feti::preconditioner::scaling`].

pub mod deluxe;
pub mod flexibility;
pub mod patches;
pub mod scaling;

use self::deluxe::Deluxe;
use self::flexibility::Flexibility;
use self::patches::Patches;
use self::scaling::Scaling;
use super::Torn;
use super::dual::Interconnection;
use super::dual::gather::Gather;
use super::dual::operator::{Changes, DualOperator};
use super::dual::space::RowSpace;
use super::inverse::factor::NotDefinite;
use super::inverse::schur::Schur;
use crate::constraint::{Constraints, Entry};
use crate::decomposition::Subdomain;
use crate::monitor::timing::Timer;
use crate::work;

/// Approximate inverse of `F`.
pub struct Preconditioner<'a> {
    gather: &'a Gather<'a>,
    /// `S`.
    schur: Schur,
    /// Scaling of the rows.
    scaling: Scaling,
    /// Who holds parts of large components of conditions, if there are any.
    patches: Option<Patches<'a>>,
    /// Scaling of faces beside weak subdomains.
    deluxe: Deluxe<'a>,
    /// Place among the boundary unknowns of each own subdomain's coefficients, in the order of the rows.
    places: Vec<Vec<u32>>,
    displacements: Vec<Vec<f64>>,
    forces: Vec<Vec<f64>>,
    torn: Torn,
    /// What faces with a scaling of their own make of forces.
    parts: Torn,
    rows: Vec<f64>,
}

impl<'a> Preconditioner<'a> {
    /// With the boundary stiffness on the [`Gather::boundaries`] of the same `gather`. It gets its numbers by
    /// [`Preconditioner::interiors`] and [`Preconditioner::update`].
    pub fn new(connection: &'a Interconnection<'a>, constraints: &Constraints, schur: Schur) -> Self {
        let (gather, deluxe) = (&connection.gather, Deluxe::new(connection, constraints, &schur));
        let torn = gather.zeros();
        let place = |own: usize, dof| schur.boundary(own).binary_search(&dof).expect("rows touch boundary unknowns");
        let places = (0..torn.len())
            .map(|own| gather.entries(own).iter().map(|entry| place(own, entry.dof) as u32).collect())
            .collect();
        let displacements: Vec<_> = (0..torn.len()).map(|own| vec![0.0; schur.boundary(own).len()]).collect();
        Self {
            gather,
            schur,
            scaling: Scaling::default(),
            patches: Patches::new(connection.tree.comm(), connection.tree.shares(), constraints),
            deluxe,
            places,
            forces: displacements.clone(),
            displacements,
            parts: torn.clone(),
            torn,
            rows: vec![0.0; gather.rows()],
        }
    }

    /// `S`, of which [`DualOperator::update`] makes the interior factors along with those of the tangents.
    pub fn interiors(&mut self) -> &mut Schur {
        &mut self.schur
    }

    /// Follows the tangents of the operator after these changes: scales all rows by their stiffness, and faces beside weak
    /// subdomains by that of both sides; these subdomains are strengthened ([`DualOperator::strengthen`]). Collective.
    ///
    /// # Errors
    /// If a block is singular.
    pub fn update(
        &mut self,
        operator: &mut DualOperator,
        changes: &Changes,
        subdomains: &[Subdomain],
        constraints: &Constraints,
        space: &RowSpace,
        timer: &Timer,
    ) -> Result<(), NotDefinite> {
        let stiffness = (0..subdomains.len()).map(|own| operator.inverse.stiffness(own));
        let stiffness = stiffness.map(|(symbolic, values)| (&symbolic.pattern, values));
        self.scaling = timer.time("scaling", || {
            let before = std::mem::take(&mut self.scaling);
            let patches = self.patches.as_ref().map(|patches| (patches, before));
            Scaling::new(constraints, self.gather, patches, stiffness)
        });
        if !changes.is_any_weak && !self.deluxe.is_active() {
            return Ok(());
        }
        timer.time("faces", || self.deluxe.meet(changes));
        let beside: Vec<usize> = (0..subdomains.len()).filter(|&own| self.deluxe.is_beside(own)).collect();
        operator.strengthen(subdomains, &beside, &mut self.schur, space, timer)?;
        let stiffness = |own: usize| operator.inverse.stiffness(own);
        timer.time("faces", || self.deluxe.update(&self.schur, stiffness));
        Ok(())
    }

    /// Flexibility of the nodes, at the tangents of the last update.
    pub fn flexibility(&self) -> &Flexibility {
        self.scaling.flexibility()
    }

    /// From now on scales the kept rows only: all equalities and some inequalities. Local.
    pub fn restrict(&mut self, constraints: &Constraints, kept: impl Fn(usize) -> bool) {
        self.scaling.restrict(constraints, kept);
    }

    /// `y = B_D S B_D' x`. One neighbour exchange, or two where faces have a scaling of their own.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.displace(x);
        self.schur.apply(&self.displacements, &mut self.forces);
        if self.deluxe.is_active() {
            self.deluxe.collect(&mut self.forces, &mut self.parts);
        }
        for (own, torn) in self.torn.iter_mut().enumerate() {
            let (boundary, forces) = (self.schur.boundary(own), &mut self.forces[own]);
            self.scaling.flexibility().apply(own, boundary, forces);
            // Only boundary unknowns are read.
            boundary.iter().zip(forces).for_each(|(&dof, x)| torn[dof as usize] = *x);
        }
        match &self.patches {
            Some(patches) => {
                patches.sum(self.gather, self.scaling.patches(), &self.torn, &mut self.rows);
                patches.copy(&self.rows, y);
            }
            None => self.gather.apply(&self.torn, &mut self.rows),
        }
        self.scaling.solve(&self.rows, y);
        if self.deluxe.is_active() {
            self.gather.apply(&self.parts, &mut self.rows);
            y.iter_mut().zip(&self.rows).for_each(|(y, part)| *y += part);
        }
    }

    /// Closes what a displacement leaves open of the `slack`, in the kept rows and in violated ones, at the least energy that the
    /// preconditioner knows. One neighbour exchange.
    pub fn close(&mut self, constraints: &Constraints, slack: &[f64], kept: &[bool], u: &mut Torn, timer: &Timer) {
        let mut defect = vec![0.0; slack.len()];
        self.gather.apply(u, &mut defect);
        defect.iter_mut().zip(slack).for_each(|(d, s)| *d = s - *d);
        constraints.violation(&mut defect);
        timer.time("scaling", || self.restrict(constraints, |row| kept[row] || defect[row] != 0.0));
        timer.time("preconditioner", || self.mend(&defect, u));
    }

    /// Adds to a torn displacement what closes the rows' `defect = c - B u`, of large components nearly: `B_D' defect` on the boundary and,
    /// for Dirichlet, the interior that follows it without force. Local.
    pub fn mend(&mut self, defect: &[f64], u: &mut Torn) {
        self.displace(defect);
        self.schur.extend(&self.displacements, u);
    }

    /// `B_D' x` on the boundaries.
    fn displace(&mut self, x: &[f64]) {
        self.scaling.solve(x, &mut self.rows);
        for (own, t) in self.displacements.iter_mut().enumerate() {
            t.fill(0.0);
            self.scaling.solve_near(own, x, &mut self.rows);
            work::each(self.places[own].len(), 2, size_of::<Entry>());
            for (entry, &place) in self.gather.entries(own).iter().zip(&self.places[own]) {
                t[place as usize] += entry.value * self.rows[entry.row as usize];
            }
            self.scaling.flexibility().apply(own, self.schur.boundary(own), t);
        }
        self.deluxe.share(x, &mut self.displacements);
    }
}

#[cfg(test)]
mod tests;
