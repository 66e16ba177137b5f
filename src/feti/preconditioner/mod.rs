//! Preconditioners of the dual operator: `B_D S B_D'` with `S` the boundary block of the stiffness (lumped) or its Schur
//! complement (Dirichlet); Farhat, Mandel and Roux 1994, with the stiffness scaling of [`crate::feti::preconditioner::scaling`].

pub mod deluxe;
pub mod flexibility;
pub mod scaling;

use self::deluxe::Deluxe;
use self::scaling::Scaling;
use super::Torn;
use super::dual::gather::Gather;
use super::inverse::schur::Schur;

/// Approximate inverse of `F`; counts its applications.
pub struct Preconditioner<'a> {
    gather: &'a Gather<'a>,
    /// `S`; updated by the caller before the first application, and when tangents change.
    pub schur: Schur,
    /// Scaling of the rows; set by the caller before the first application, and when tangents or rows change.
    pub scaling: Scaling,
    /// Scaling of faces beside weak subdomains; updated by the caller when tangents change.
    pub deluxe: Deluxe<'a>,
    /// Place among the boundary unknowns of each own subdomain's coefficients, in the order of the rows.
    places: Vec<Vec<u32>>,
    displacements: Vec<Vec<f64>>,
    forces: Vec<Vec<f64>>,
    torn: Torn,
    /// What faces with a scaling of their own make of forces.
    parts: Torn,
    rows: Vec<f64>,
    applications: usize,
}

impl<'a> Preconditioner<'a> {
    /// With the boundary stiffness on the [`boundaries`] of the same `gather`.
    pub fn new(gather: &'a Gather<'a>, schur: Schur, deluxe: Deluxe<'a>) -> Self {
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
            deluxe,
            places,
            forces: displacements.clone(),
            displacements,
            parts: torn.clone(),
            torn,
            rows: vec![0.0; gather.rows()],
            applications: 0,
        }
    }

    /// `y = B_D S B_D' x`. One neighbour exchange, or two where faces have a scaling of their own.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        self.displace(x);
        self.schur.apply(&self.displacements, &mut self.forces);
        if self.deluxe.is_active() {
            self.deluxe.collect(&mut self.forces, &mut self.parts);
        }
        for (own, torn) in self.torn.iter_mut().enumerate() {
            let (boundary, forces) = (self.schur.boundary(own), &mut self.forces[own]);
            self.scaling.flexibility.apply(own, boundary, forces);
            // Only boundary unknowns are read.
            boundary.iter().zip(forces).for_each(|(&dof, x)| torn[dof as usize] = *x);
        }
        self.gather.apply(&self.torn, &mut self.rows);
        self.scaling.solve(&self.rows, y);
        if self.deluxe.is_active() {
            self.gather.apply(&self.parts, &mut self.rows);
            y.iter_mut().zip(&self.rows).for_each(|(y, part)| *y += part);
        }
    }

    /// Adds to a torn displacement what closes the rows' `defect = c - B u`: `B_D' defect` on the boundary and, for
    /// Dirichlet, the interior that follows it without force. Local.
    pub fn mend(&mut self, defect: &[f64], u: &mut Torn) {
        self.displace(defect);
        self.schur.extend(&self.displacements, u);
    }

    /// `B_D' x` on the boundaries.
    fn displace(&mut self, x: &[f64]) {
        self.scaling.solve(x, &mut self.rows);
        for (own, t) in self.displacements.iter_mut().enumerate() {
            t.fill(0.0);
            for (entry, &place) in self.gather.entries(own).iter().zip(&self.places[own]) {
                t[place as usize] += entry.value * self.rows[entry.row as usize];
            }
            self.scaling.flexibility.apply(own, self.schur.boundary(own), t);
        }
        self.deluxe.share(x, &mut self.displacements);
    }

    /// Applications so far.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

#[cfg(test)]
mod tests;
