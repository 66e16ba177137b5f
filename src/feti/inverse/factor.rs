//! `K^+`: a generalised inverse of each subdomain's singular stiffness matrix by plain sparse Cholesky.
//!
//! With `Q` the orthogonal projector onto the rigid modes restricted to a few well-spread fixing nodes, `K + rho Q` is
//! positive definite and its inverse is a generalised inverse of `K` (Brzobohaty, Kozubek, Markopoulos, Dostal 2011). Where
//! supports pin unknowns ([`Pins`]), `K` has no entries that join these with others, and `Q` is of the motions that are left.
//! No null pivots are sought. Symbolic analysis is done once and shared by subdomains of equal connectivity.

use std::rc::Rc;

use faer::Mat;
use thiserror::Error;

use super::kernel::RigidModes;
use super::pins::Pins;
use super::stock::{Batch, Stock};
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::sparse::cholesky::{Analysis, Factor, Lower, Precision, WIDTH, Workspace};
use crate::sparse::ordering::nested_dissection;
use crate::sparse::pattern::Pattern;

/// Number of fixing nodes: well-spread ones, see [`fixing_nodes`]. Three that are not on a line hold a body; the fourth is off
/// their plane.
const FIXING_NODES: usize = 4;
/// Error that a factor in single precision may make.
const PROBE: f64 = 1e-3;

/// The stiffness matrix lost its definiteness (up to rigid motions).
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "subdomain {subdomain}: the stiffness matrix is not positive definite (pivot {pivot} of {dofs}); \
     check for elements without volume, and for a hardening modulus of zero at the collapse load"
)]
pub struct NotDefinite {
    /// The subdomain.
    pub subdomain: usize,
    /// Column where the factorisation broke down, in elimination order.
    pub pivot: usize,
    /// Number of unknowns.
    pub dofs: usize,
}

/// What subdomains of equal connectivity and shape have in common.
pub struct Symbolic {
    /// Sparsity of `K + rho Q`.
    pub pattern: Pattern,
    /// Elimination order: the unknown at each place.
    pub order: Vec<u32>,
    /// Local fixing nodes.
    fixing: Vec<u32>,
    cholesky: Analysis,
}

impl Symbolic {
    /// Analyses a subdomain.
    pub fn new(subdomain: &Subdomain) -> Self {
        let fixing = fixing_nodes(&subdomain.shape);
        let pattern = Pattern::new(subdomain.nodes.len(), &subdomain.elements, &fixing);
        let order = nested_dissection(&pattern.adjacency, 3);
        let cholesky = Analysis::ordered(Lower::from(&pattern), &order);
        Self { pattern, order, fixing, cholesky }
    }

    /// Whether a subdomain may share this analysis.
    fn fits(&self, subdomain: &Subdomain, of: &Subdomain) -> bool {
        subdomain.elements == of.elements && fixing_nodes(&subdomain.shape) == self.fixing
    }

    /// Order and sparsity of the factor.
    pub fn analysis(&self) -> &Analysis {
        &self.cholesky
    }
}

/// Analyses all subdomains, sharing among those of equal connectivity.
pub fn analyse(subdomains: &[Subdomain]) -> Vec<Rc<Symbolic>> {
    let mut kinds: Vec<(usize, Rc<Symbolic>)> = Vec::new();
    subdomains
        .iter()
        .enumerate()
        .map(|(own, subdomain)| {
            if let Some((_, shared)) = kinds.iter().find(|(of, kind)| kind.fits(subdomain, &subdomains[*of])) {
                return Rc::clone(shared);
            }
            let new = Rc::new(Symbolic::new(subdomain));
            kinds.push((own, Rc::clone(&new)));
            new
        })
        .collect()
}

/// Numeric factors of all own subdomains.
pub struct Factors {
    symbolic: Vec<Rc<Symbolic>>,
    factors: Stock<Factor>,
    precision: Precision,
    workspace: Workspace,
    shifted: Vec<f64>,
    /// A number for each own subdomain; factors with the same number are the same.
    stamps: Vec<u64>,
    made: u64,
    /// What the factor of each own subdomain keeps at zero.
    pins: Vec<Pins>,
}

impl Factors {
    /// Space for the factors, each of which keeps its `pins` at zero, if there are any; nothing is factorised yet. With single `precision`, a factor
    /// that fails a probe is made again in double.
    pub fn new(symbolic: Vec<Rc<Symbolic>>, precision: Precision, pins: Option<Vec<Pins>>) -> Self {
        let workspace = Workspace::new(symbolic.iter().map(|s| &s.cholesky));
        let factors = Stock::new(symbolic.iter().map(|s| s.cholesky.factor(precision)));
        let stamps = vec![0; symbolic.len()];
        let pins = pins.unwrap_or_else(|| vec![Pins::none(); symbolic.len()]);
        Self { symbolic, factors, precision, workspace, shifted: Vec::new(), stamps, made: 0, pins }
    }

    /// Symbolic analysis of an own subdomain.
    pub fn symbolic(&self, own: usize) -> &Rc<Symbolic> {
        &self.symbolic[own]
    }

    /// What new factors are stored in at least.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// From now on factorises in this precision.
    pub fn set_precision(&mut self, precision: Precision) {
        self.precision = precision;
    }

    /// Factorises `K + rho Q` of an own subdomain, `stiffness` being the lower values of `K`; `common` says that it has twins, here
    /// or on other ranks. Its pins are kept at zero, and `Q` is of the rigid motions that they leave free.
    ///
    /// # Errors
    /// If the matrix is not positive definite, or not finite.
    pub fn factorise(
        &mut self,
        own: usize,
        subdomain: &Subdomain,
        stiffness: &[f64],
        common: bool,
    ) -> Result<(), NotDefinite> {
        let Symbolic { pattern, fixing, cholesky, .. } = &*self.symbolic[own];
        let n = pattern.dofs();
        self.shifted.clear();
        self.shifted.extend_from_slice(stiffness);
        let diagonal = pattern.diagonal(stiffness);
        let rho = diagonal.iter().sum::<f64>() / n as f64;
        let pins = &self.pins[own];
        if !pins.unknowns.is_empty() {
            pattern.uncouple(&pins.unknowns, &mut self.shifted);
        }
        add_fixing(pattern, fixing, (&subdomain.shape, pins), rho, &mut self.shifted);
        let refuse = |pivot| NotDefinite { subdomain: subdomain.id, pivot, dofs: n };
        if !rho.is_finite() {
            return Err(refuse(0));
        }
        self.made += 1;
        self.stamps[own] = self.made;
        let factor = self.factors.renew(own, common, || cholesky.factor(self.precision));
        if factor.precision() != self.precision {
            *factor = cholesky.factor(self.precision);
        }
        let outcome = self.workspace.factorise(cholesky, Lower::from(pattern), &self.shifted, factor);
        if factor.precision() == Precision::Double {
            return outcome.map_err(|breakdown| refuse(breakdown.place));
        }
        if outcome.is_err() || !passes_probe(pattern, &self.shifted, |x| self.workspace.solve(cholesky, factor, x)) {
            *factor = cholesky.factor(Precision::Double);
            let outcome = self.workspace.factorise(cholesky, Lower::from(pattern), &self.shifted, factor);
            return outcome.map_err(|breakdown| refuse(breakdown.place));
        }
        Ok(())
    }

    /// The least pivot of the factor of an own subdomain, relative to the diagonal entry of its `stiffness` there.
    pub fn least_pivot(&self, own: usize, stiffness: &[f64]) -> f64 {
        let Symbolic { pattern, cholesky, .. } = &*self.symbolic[own];
        cholesky.least_pivot(self.factors.of(own), |dof| stiffness[pattern.column_begin[dof] as usize])
    }

    /// Unknowns of an own subdomain that its factor keeps at zero, ascending.
    pub fn pinned(&self, own: usize) -> &[u32] {
        &self.pins[own].unknowns
    }

    /// Whether two own subdomains keep the same at zero.
    pub fn equally_pinned(&self, own: usize, other: usize) -> bool {
        self.pins[own] == self.pins[other]
    }

    /// From now on an own subdomain has the factor of a congruent one with equal stiffness and pins.
    pub fn share(&mut self, own: usize, twin: usize) {
        self.factors.share(own, twin, true);
        self.stamps[own] = self.stamps[twin];
    }

    /// A number of the factor of an own subdomain. Equal numbers mean equal factors, of one subdomain over time or of two.
    pub fn stamp(&self, own: usize) -> u64 {
        self.stamps[own]
    }

    /// `columns = K^+ columns` for several vectors of an own subdomain, one behind the other.
    pub fn solve_columns(&mut self, own: usize, columns: &mut [f64]) {
        let cholesky = &self.symbolic[own].cholesky;
        let n = self.symbolic[own].pattern.dofs();
        let mut panel = vec![[0.0; WIDTH]; n];
        for columns in columns.chunks_mut(WIDTH * n) {
            panel.fill([0.0; WIDTH]);
            for (lane, column) in columns.chunks_exact(n).enumerate() {
                panel.iter_mut().zip(column).for_each(|(panel, x)| panel[lane] = *x);
            }
            let count = columns.len() / n;
            self.workspace.solve_wide(cholesky, self.factors.of(own), panel.as_flattened_mut(), count);
            for (lane, column) in columns.chunks_exact_mut(n).enumerate() {
                column.iter_mut().zip(&panel).for_each(|(x, panel)| *x = panel[lane]);
            }
        }
    }

    /// `x = K^+ x`, subdomain by subdomain.
    pub fn solve(&mut self, x: &mut Torn) {
        for batch in self.factors.batches() {
            match batch {
                &Batch::Alone(own) => {
                    self.pins[own].unknowns.iter().for_each(|&dof| x[own][dof as usize] = 0.0);
                    self.workspace.solve(&self.symbolic[own].cholesky, self.factors.of(own), &mut x[own]);
                }
                Batch::Twins(twins) => {
                    let first = twins[0];
                    let mut panel = vec![[0.0; WIDTH]; x[first].len()];
                    for (lane, &own) in twins.iter().enumerate() {
                        panel.iter_mut().zip(&x[own]).for_each(|(panel, x)| panel[lane] = *x);
                    }
                    self.pins[first].unknowns.iter().for_each(|&dof| panel[dof as usize] = [0.0; WIDTH]);
                    let cholesky = &self.symbolic[first].cholesky;
                    self.workspace.solve_wide(cholesky, self.factors.of(first), panel.as_flattened_mut(), twins.len());
                    for (lane, &own) in twins.iter().enumerate() {
                        x[own].iter_mut().zip(&panel).for_each(|(x, panel)| *x = panel[lane]);
                    }
                }
            }
        }
    }
}

/// Whether a factor of `A` gives back a vector without a pattern: an error of this size is the rate at which Newton's
/// method converges with the factor.
fn passes_probe(pattern: &Pattern, values: &[f64], solve: impl FnOnce(&mut [f64])) -> bool {
    let probe: Vec<f64> = (0..pattern.dofs()).map(|k| 1.0 + ((k * k + k / 3) % 7) as f64 / 7.0).collect();
    let mut x = vec![0.0; probe.len()];
    pattern.multiply_add(values, &probe, &mut x);
    solve(&mut x);
    x.iter().zip(&probe).all(|(x, p)| (x - p).abs() <= PROBE * p)
}

/// Adds `rho Q` of the fixing nodes to the lower values of the stiffness: of the rigid motions that pins leave free.
fn add_fixing(pattern: &Pattern, fixing: &[u32], (points, pins): (&[[f64; 3]], &Pins), rho: f64, values: &mut [f64]) {
    let at = motions(fixing, points, pins);
    for (a, &row) in fixing.iter().enumerate() {
        for (b, &column) in fixing.iter().enumerate().filter(|&(_, &column)| column <= row) {
            let product = |i: usize, j: usize| at[a][i].iter().zip(&at[b][j]).map(|(p, q)| p * q).sum::<f64>();
            let block = std::array::from_fn(|i| std::array::from_fn(|j| rho * product(i, j)));
            pattern.add_block(values, row, column, &block);
        }
    }
}

/// The rigid motions that pins leave free at the fixing nodes, `[node][component][motion]`, orthonormal there.
fn motions(fixing: &[u32], points: &[[f64; 3]], pins: &Pins) -> Vec<[Vec<f64>; 3]> {
    let corners: Vec<[f64; 3]> = fixing.iter().map(|&n| points[n as usize]).collect();
    if pins.unknowns.is_empty() {
        let modes = RigidModes::new(&corners);
        return corners.iter().map(|&point| modes.at(point).map(Vec::from)).collect();
    }
    let modes = RigidModes::new(points);
    let at: Vec<_> = corners.iter().map(|&point| modes.at(point)).collect();
    let motion = |row: usize, of: usize| at[row / 3][row % 3].iter().zip(&pins.free[of]).map(|(m, a)| m * a).sum();
    let basis = Mat::<f64>::from_fn(3 * corners.len(), pins.free.len(), motion).qr().compute_thin_Q();
    let components = |node: usize, axis: usize| {
        // Rounding must not join pinned unknowns with others.
        let is_pinned = pins.unknowns.binary_search(&(3 * fixing[node] + axis as u32)).is_ok();
        (0..pins.free.len()).map(|k| if is_pinned { 0.0 } else { basis[(3 * node + axis, k)] }).collect()
    };
    (0..corners.len()).map(|node| std::array::from_fn(|axis| components(node, axis))).collect()
}

/// Well-spread nodes: each the farthest from those before it, the first the farthest from the centroid. Round-off does
/// not decide: congruent subdomains choose alike.
fn fixing_nodes(points: &[[f64; 3]]) -> Vec<u32> {
    let square = |p: [f64; 3], q: [f64; 3]| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>();
    let count = points.len() as f64;
    let centre: [f64; 3] = std::array::from_fn(|a| points.iter().map(|p| p[a]).sum::<f64>() / count);
    let mut distance: Vec<f64> = points.iter().map(|&p| square(p, centre)).collect();
    let mut chosen = Vec::new();
    while chosen.len() < FIXING_NODES.min(points.len()) {
        let mut best = 0;
        for (node, &d) in distance.iter().enumerate() {
            if d > distance[best] * (1.0 + 1e-9) {
                best = node;
            }
        }
        if chosen.is_empty() {
            distance.fill(f64::INFINITY);
        }
        chosen.push(best as u32);
        distance.iter_mut().zip(points).for_each(|(d, &p)| *d = d.min(square(p, points[best])));
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests;
